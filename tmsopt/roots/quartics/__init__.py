"""Millions of quartics at once.

In: arrays of coefficients. Out: factors, abscissae, damping ratios and classes of stability, jointly right beside
exceptional points. Open `quartic` first.
"""
