"""Millions of quartics at once.

In: arrays of coefficients. Out: factors, abscissae, damping ratios and stability classes, which are accurate even near
exceptional points. Open `quartic` first.
"""
