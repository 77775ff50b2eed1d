"""Millions of quartics at once.

In: arrays of coefficients. Out: factors, abscissae, damping ratios and stability classes, accurate near exceptional
points too. Open `quartic` first.
"""
