"""Root quantities of any model, such as the abscissa, for objectives and constraints."""

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import flint
import numpy as np

from tmsopt.models import Model, ParameterSet, Quantity, Values
from tmsopt.records import AnyNumbers, Array
from tmsopt.roots import Root, Structure, exact_roots, structure

STRUCTURE_TOLERANCE = 1e-11
"""Roots count as multiple within this relative change of a coefficient; polished optima are within 1e-14."""

SIMPLE = ("real", "pair", "undecided")
"""Structures whose roots are the numeric ones."""

_SCATTER, _ROUNDING = 1e-11, 4 * np.finfo(float).eps  # relative error of numeric roots that asks for exact ones

_DIGITS = 120  # so that products of five doubles are exact

_KEPT = 64  # structures in the cache, since several quantities use the same design

_LARGEST_ROOT = 1e50
"""Products of a few larger roots overflow."""


def _may_have_huge_roots(a: Array) -> Any:
    """Whether the leading coefficient is 0, or so small that a root may be too large for doubles."""
    ends = np.abs(a[..., 0]) * _LARGEST_ROOT <= np.abs(a).max(axis=-1)
    if ends.any():
        with np.errstate(all="ignore"):
            sizes = np.abs(a[..., 1:] / a[..., :1]) ** (1 / np.arange(1, a.shape[-1]))
        ends &= ~(sizes.max(axis=-1) < _LARGEST_ROOT)  # also true for nan, if all are 0
    return ends


def _structure(values: AnyNumbers) -> Structure:
    assert isinstance(values, Values)
    a = [float(c) for c in values.coefficients]
    undecided = Structure("undecided", (), math.inf)
    if not all(map(math.isfinite, a)) or _may_have_huge_roots(np.array(a)):
        return undecided  # a singular mass matrix: a root at infinity
    off = values.roundings()
    if abs(a[0]) <= off[0] < math.inf:
        return undecided  # a0 may be 0 within rounding
    found = _cached_structure(tuple(a), tuple(map(float, off)))
    simple = found.name in SIMPLE and all(root.multiplicity == 1 for root in found.roots)
    if simple and _scatter(np.array(a), found) > _SCATTER:
        found = replace(found, roots=roots_at(*values.given) or found.roots)
    return found


def _scatter(a: Array, found: Structure) -> float:
    """Rounding error of simple numeric roots, relative to the largest root."""
    z = np.array([complex(root.re, root.im) for root in found.roots])
    terms, slope = np.polyval(np.abs(a), np.abs(z)), np.abs(np.polyval(np.polyder(a), z))
    return float((_ROUNDING * terms / (slope + np.finfo(float).tiny)).max() / (np.abs(z).max() or 1.0))


@lru_cache(maxsize=_KEPT)
def _cached_structure(a: tuple[float, ...], off: tuple[float, ...]) -> Structure:
    return structure(a, STRUCTURE_TOLERANCE, off)


def roots_at(model: Model, of: ParameterSet, parameters: AnyNumbers) -> tuple[Root, ...]:
    """Exact roots of the parameters as stored, rightmost first; none if a coefficient is undefined.

    Coefficients have 120 digits, and roots are isolated in ball arithmetic.
    """
    with flint.ctx.workdps(_DIGITS):
        exact = {name: flint.arb(value) for name, value in parameters.items()}
        coefficients = model.coefficients(exact, of)
    if not all(c.is_finite() for c in coefficients):
        return ()
    leading = next((k for k, c in enumerate(coefficients) if c.mid() != 0), None)
    if leading is None or leading == len(coefficients) - 1:
        return ()
    return exact_roots(coefficients[leading:])


def _damping_ratio(values: AnyNumbers) -> float:
    if isinstance(values, Values) and values.model.carrier is not None:
        return math.nan  # a complex system has no fixed zero of frequency
    roots = values["structure"].roots
    ratios = (-r.re / r.size if r.re or r.im else 0.0 for r in roots)
    return min(ratios, default=math.nan)


ANGULAR_FREQUENCY = "angular_frequency"
"""Angular frequency of the fastest oscillation; 0 if all roots are real."""

ROOT_QUANTITIES = (
    Quantity("abscissa", "1", "largest real part of the roots", r"\alpha", lambda v: float(v["structure"].abscissa)),
    Quantity("damping_ratio", "1", "least −Re s/|s| over the roots", r"\zeta", _damping_ratio),
    Quantity(
        ANGULAR_FREQUENCY,
        "1",
        "greatest |Im s| over the roots",
        r"\omega",
        lambda v: max((abs(r.im) for r in v["structure"].roots), default=math.nan),
    ),
)
"""Root quantities, each the worst over the cases of a problem."""

STRUCTURE = Quantity("structure", "", "structure of the roots, multiple roots recognised", "", _structure)

RADIUS = "radius"
"""Distance to the nearest loss of stability in the problem's weights, from a separate search."""

_RADIUS = "robustness radius, the least change of the parameters, in their weights, after which it is unstable"

NO_RADIUS = Quantity(RADIUS, "1", _RADIUS, "r", lambda values: math.nan)
"""The radius before it was searched for."""

ROOT_NAMES = (*(q.name for q in ROOT_QUANTITIES), RADIUS)


def root_names(model: Model) -> tuple[str, ...]:
    """Names of the root quantities that a model has."""
    return tuple(name for name in ROOT_NAMES if name not in model.absent)


def expand_names(text: str, of: ParameterSet) -> str:
    """Replace short names in an expression: decay_rate by -(abscissa*sqrt(g/w)). Other types pass unchanged."""
    short = {q.name: q.stands_for for q in of.quantities if q.stands_for}
    if not short or not isinstance(text, str):
        return text
    return re.sub(rf"\b({'|'.join(short)})\b", lambda found: short[found[0]], text)


def regularise(coefficients: Array) -> Array:
    """Replace a leading coefficient of about 0 by a small one, which gives a distant root; undefined rows become sⁿ."""
    exist = np.all(np.isfinite(coefficients), axis=-1, keepdims=True)
    a = np.where(exist, coefficients, np.eye(coefficients.shape[-1])[0])
    size = np.abs(a).max(axis=-1, initial=0.0) + 1e-300
    return np.concatenate([np.where(_may_have_huge_roots(a), 1e-12 * size, a[..., 0])[..., None], a[..., 1:]], axis=-1)


def lifted_quantities(
    model: Model, of: ParameterSet, parameters: AnyNumbers, expressions: Iterable[Callable[[Values], Any]]
) -> tuple[Quantity, ...]:
    """The quantities in expressions that are defined by an equation; proofs treat these as unknowns."""
    found: dict[str, Quantity] = {}

    def note(quantity: Quantity, values: Values) -> None:
        if quantity.equation is not None:
            found[quantity.name] = quantity

    values = Values(model, of, parameters, lift=note).with_known(dict.fromkeys(ROOT_NAMES, math.nan))
    for expression in expressions:
        expression(values)
    return tuple(found.values())
