"""Pareto: fronts of two or three objectives.

In: a problem with `pareto`. Out: a `Front` of designs none of which beats another. Open `pareto` first.
"""

from tmsopt.fronts.front import Front
from tmsopt.fronts.pareto import pareto

__all__ = ["Front", "pareto"]
