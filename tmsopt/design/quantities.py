"""Quantities of the roots, for any model: what an expression may say about stability."""

import math
from collections.abc import Mapping
from typing import Any

from tmsopt.models import Quantity, Values
from tmsopt.roots import Structure, structure

STRUCTURE_TOLERANCE = 1e-11
"""Relative change of a coefficient within which roots count as multiple: a polished optimum is within 1e-14."""


def _structure(values: Mapping[str, Any]) -> Structure:
    assert isinstance(values, Values)
    a = [float(c) for c in values.coefficients]
    if a[0] == 0 or not all(map(math.isfinite, a)):
        return Structure("undecided", (), math.inf)  # a singular mass matrix: a root is at infinity
    return structure(a, STRUCTURE_TOLERANCE)


def _abscissa(values: Mapping[str, Any]) -> float:
    return float(values["structure"].abscissa)


def _damping_ratio(values: Mapping[str, Any]) -> float:
    roots = values["structure"].roots
    ratios = (-r.re / math.hypot(r.re, r.im) if r.re or r.im else 0.0 for r in roots)
    return min(ratios, default=math.nan)


ROOT_QUANTITIES = (
    Quantity("abscissa", "1", "largest real part of the roots", r"\alpha", _abscissa),
    Quantity("damping_ratio", "1", "least −Re s/|s| over the roots", r"\zeta", _damping_ratio),
)
"""Quantities of the roots, each the worst over the cases that a problem lists."""

STRUCTURE = Quantity("structure", "", "structure of the roots, multiple roots recognised", "", _structure)

RADIUS = "radius"
"""Distance to the nearest loss of stability, in the problem's weights; found by a search of its own."""

ROOT_NAMES = (*(q.name for q in ROOT_QUANTITIES), RADIUS)
