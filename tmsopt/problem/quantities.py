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
from tmsopt.records import AnyNumbers, Array, Complex
from tmsopt.roots import Root, Structure, exact_roots, spectrum, structure
from tmsopt.roots.chains import eigenvalues_of
from tmsopt.roots.polynomial import rightmost_first

STRUCTURE_TOLERANCE = 1e-11
"""Roots count as multiple if a relative change of the coefficients by this amount makes them multiple.

At optima 1e-14 is enough.
"""

SIMPLE_STRUCTURES = ("real", "pair", "undecided")
"""Names of structures without multiple roots, whose roots are computed numerically."""

_MAX_ERROR = 1e-11  # roots with a larger relative error are computed exactly
_ROUNDING = 4 * np.finfo(float).eps  # relative rounding error of a term of a polynomial

_DIGITS = 120  # decimal digits in which products of five doubles are exact

_MAX_EXACT_EIGENVALUES = 30  # more eigenvalues with 120 digits would take seconds
_ZERO_EIGENVALUE = 1e-25  # relative to the entries; at 120 digits, parts of eigenvalues this small are 0

_CACHE_SIZE = 64  # number of structures in the cache; several quantities of a design use the same structure

_LARGEST_ROOT = 1e50
"""Greatest size of a root; products of a few larger roots overflow."""


def _may_have_huge_roots(a: Array) -> Any:
    """Whether the leading coefficient is 0, or so small that a root may be too large for doubles."""
    is_huge = np.abs(a[..., 0]) * _LARGEST_ROOT <= np.abs(a).max(axis=-1)
    if is_huge.any():
        with np.errstate(all="ignore"):
            sizes = np.abs(a[..., 1:] / a[..., :1]) ** (1 / np.arange(1, a.shape[-1]))
        is_huge &= ~(sizes.max(axis=-1) < _LARGEST_ROOT)  # also true if all coefficients are 0: sizes are nan
    return is_huge


def _structure(values: AnyNumbers) -> Structure:
    assert isinstance(values, Values)
    if values.model.polynomial is None:
        return _spectrum_at(*values.given)
    a = [float(c) for c in values.coefficients]
    undecided = Structure("undecided", (), math.inf)
    if not all(map(math.isfinite, a)) or _may_have_huge_roots(np.array(a)):
        return undecided  # a singular mass matrix: a root at infinity
    roundings = values.roundings()
    if abs(a[0]) <= roundings[0] < math.inf:
        return undecided  # a0 may be 0 within rounding
    root_structure = _cached_structure(tuple(a), tuple(map(float, roundings)))
    is_simple = root_structure.name in SIMPLE_STRUCTURES and all(
        root.multiplicity == 1 for root in root_structure.roots
    )
    if is_simple and _root_error(np.array(a), root_structure) > _MAX_ERROR:
        root_structure = replace(root_structure, roots=roots_at(*values.given) or root_structure.roots)
    return root_structure


def _spectrum_at(model: Model, parameter_set: ParameterSet, parameters: AnyNumbers) -> Structure:
    """The structure of the eigenvalues of a design's matrices; without roots if the leading matrix is singular."""
    try:
        return spectrum(matrices_at(model, parameter_set, parameters), STRUCTURE_TOLERANCE, model.is_complex)
    except np.linalg.LinAlgError:
        return Structure("undecided", (), math.inf)


def matrices_at(model: Model, parameter_set: ParameterSet, parameters: AnyNumbers) -> Complex:
    """The matrices of a design in doubles, in descending powers, shape (d + 1, n, n)."""
    assert model.pencil is not None
    return np.array(model.pencil(parameter_set.native({n: float(x) for n, x in parameters.items()})), dtype=complex)


def _root_error(a: Array, root_structure: Structure) -> float:
    """Rounding error of simple numeric roots, relative to the largest root."""
    z = np.array([complex(root.re, root.im) for root in root_structure.roots])
    terms, slope = np.polyval(np.abs(a), np.abs(z)), np.abs(np.polyval(np.polyder(a), z))
    return float((_ROUNDING * terms / (slope + np.finfo(float).tiny)).max() / (np.abs(z).max() or 1.0))


@lru_cache(maxsize=_CACHE_SIZE)
def _cached_structure(a: tuple[float, ...], roundings: tuple[float, ...]) -> Structure:
    return structure(a, STRUCTURE_TOLERANCE, roundings)


def roots_at(model: Model, parameter_set: ParameterSet, parameters: AnyNumbers) -> tuple[Root, ...]:
    """Exact roots for parameters in double precision, rightmost first; none if a coefficient is undefined.

    The parameters count as exact, coefficients have 120 digits, and roots are isolated in interval arithmetic. Without
    a polynomial the roots are eigenvalues computed with 120 digits, or in doubles if they are many.
    """
    if model.polynomial is None:
        is_small = model.degree <= _MAX_EXACT_EIGENVALUES
        find_eigenvalues = _find_eigenvalues_exactly if is_small else _find_eigenvalues
        try:
            return rightmost_first(find_eigenvalues(model, parameter_set, parameters))
        except (np.linalg.LinAlgError, ZeroDivisionError, ValueError):
            return ()
    with flint.ctx.workdps(_DIGITS):
        exact_parameters = {name: flint.arb(value) for name, value in parameters.items()}
        coefficients = model.coefficients(exact_parameters, parameter_set)
    if not all(c.is_finite() for c in coefficients):
        return ()
    leading_index = next((k for k, c in enumerate(coefficients) if c.mid() != 0), None)
    if leading_index is None or leading_index == len(coefficients) - 1:
        return ()
    return exact_roots(coefficients[leading_index:])


def _find_eigenvalues(model: Model, parameter_set: ParameterSet, parameters: AnyNumbers) -> list[Root]:
    eigenvalues = eigenvalues_of(matrices_at(model, parameter_set, parameters))
    return [Root(float(z.real), float(z.imag)) for z in eigenvalues]


def _find_eigenvalues_exactly(model: Model, parameter_set: ParameterSet, parameters: AnyNumbers) -> list[Root]:
    with flint.ctx.workdps(_DIGITS):
        eigenvalues, size = approximate_eigenvalues(
            model, parameter_set, {n: flint.arb(x) for n, x in parameters.items()}
        )
        parts = ((float(z.real), float(z.imag)) for z in eigenvalues)
        pairs = ([x if abs(x) > _ZERO_EIGENVALUE * size else 0.0 for x in pair] for pair in parts)
        return [Root(re, im) for re, im in pairs]


def approximate_eigenvalues(
    model: Model, parameter_set: ParameterSet, parameters: AnyNumbers
) -> tuple[list[Any], float]:
    """The eigenvalues of a design of balls at the working precision, and the size of the matrix.

    Raises:
        ZeroDivisionError: if the leading matrix may be singular.
        ValueError: if the eigenvalues do not converge.
    """
    assert model.pencil is not None
    matrices = model.pencil(parameter_set.native(parameters))
    leading, *others = (flint.acb_mat([[flint.acb(x) for x in row] for row in P]) for P in matrices)
    n, size = len(matrices[0]), len(others) * len(matrices[0])
    last_rows = [leading.solve(P).tolist() for P in others[::-1]]
    rows = [[flint.acb(j == i + n) for j in range(size)] for i in range(size - n)]
    rows += [[-x for P in last_rows for x in P[i]] for i in range(n)]
    return flint.acb_mat(rows).eig(algorithm="approx"), max(float(abs(z)) for row in rows for z in row)


def _damping_ratio(values: AnyNumbers) -> float:
    if isinstance(values, Values) and values.model.is_complex:
        return math.nan  # the frequencies of a complex system have no fixed zero
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
"""Root quantities. In a problem with cases, each has its worst value over the cases."""

STRUCTURE = Quantity("structure", "", "structure of the roots, multiple roots recognised", "", _structure)

RADIUS = "radius"
"""Distance to the nearest loss of stability, measured in the problem's weights; a separate search finds it."""

_RADIUS_MEANING = "robustness radius, the least change of the parameters, in their weights, after which it is unstable"

NO_RADIUS = Quantity(RADIUS, "1", _RADIUS_MEANING, "r", lambda values: math.nan)
"""The robustness radius, which is nan until a search has found it."""

ROOT_NAMES = (*(q.name for q in ROOT_QUANTITIES), RADIUS)


def root_names(model: Model) -> tuple[str, ...]:
    """Names of the root quantities that a model has."""
    return tuple(name for name in ROOT_NAMES if name not in model.absent)


def expand_names(text: str, parameter_set: ParameterSet) -> str:
    """Replace short names, such as decay_rate by -(abscissa*sqrt(g/w)). A `text` of another type stays unchanged."""
    expansions = {q.name: q.stands_for for q in parameter_set.quantities if q.stands_for}
    if not expansions or not isinstance(text, str):
        return text
    return re.sub(rf"\b({'|'.join(expansions)})\b", lambda match: expansions[match[0]], text)


def regularise(coefficients: Array) -> Array:
    """Replace a leading coefficient near 0 by a small number, for a large root; rows with nan or inf become sⁿ."""
    is_finite = np.all(np.isfinite(coefficients), axis=-1, keepdims=True)
    a = np.where(is_finite, coefficients, np.eye(coefficients.shape[-1])[0])
    size = np.abs(a).max(axis=-1, initial=0.0) + 1e-300
    return np.concatenate([np.where(_may_have_huge_roots(a), 1e-12 * size, a[..., 0])[..., None], a[..., 1:]], axis=-1)


def lifted_quantities(
    model: Model, parameter_set: ParameterSet, parameters: AnyNumbers, expressions: Iterable[Callable[[Values], Any]]
) -> tuple[Quantity, ...]:
    """The quantities in expressions that have an equation; proofs treat them as unknowns."""
    quantities: dict[str, Quantity] = {}

    def collect(quantity: Quantity, values: Values) -> None:
        if quantity.equation is not None:
            quantities[quantity.name] = quantity

    values = Values(model, parameter_set, parameters, lift=collect).with_known(dict.fromkeys(ROOT_NAMES, math.nan))
    for expression in expressions:
        expression(values)
    return tuple(quantities.values())
