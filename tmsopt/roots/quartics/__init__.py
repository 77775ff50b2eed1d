"""Millions of quartics at once, by NumPy or numba.

In: arrays of coefficients. Out: factors, abscissae, damping ratios and classes of stability, jointly right beside
exceptional points. Open `quartic` first.
"""

from tmsopt.roots.quartics.degenerate import hard_factors
from tmsopt.roots.quartics.factors import cube_root, largest_root

__all__ = ["cube_root", "hard_factors", "largest_root"]
