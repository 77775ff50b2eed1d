"""Decides whether a design is on a stability boundary, up to the rounding of its parameters."""

from collections.abc import Sequence
from typing import Any

import flint
import numpy as np

from tmsopt.models.exact import ExactDesign, as_exact_design
from tmsopt.models.user_spectrum import distance_beyond_axis
from tmsopt.problem.problem import Posed
from tmsopt.problem.real_form import has_real_form, real_form
from tmsopt.problem.verdict.stability import MultipleRoot, longest_chain_on_line
from tmsopt.records import Array, Numbers
from tmsopt.roots import Root, Structure, exact_longest, lienard_chipart, rebuilt, structure
from tmsopt.roots.exact import isolated_roots

# Error of a solver and of numeric roots, relative to the terms of a coefficient.
_ROUNDING = 64 * float(np.finfo(float).eps)
_MAX_ABSCISSA = 1e-3  # relative to the largest root: a design with a larger |abscissa| is on no edge
_MAX_REAL_PART = 1e-6  # relative to the largest root: a larger real part is no rounding error


def edges_at(problem: Posed, parameters: Numbers) -> tuple[str, ...]:
    """The stability boundaries that a design is on up to rounding: weave, capsize, infinity.

    The result is empty if a root is right of the imaginary axis. The test moves the roots to the axis, or the leading
    coefficient to 0. It compares this change of the coefficients with that caused by rounding of the parameters.
    """
    if not has_real_form(problem.model):
        return ()
    values = real_form(problem).problem.values(parameters)
    c, errors = np.array([float(x) for x in values.coefficients]), np.array(values.roundings())
    is_nonzero = np.abs(c) > errors
    if not np.all(np.isfinite(c)) or not is_nonzero[:-1].any():
        return ()
    first_index = int(np.argmax(is_nonzero))
    nearby_structure: Structure = (
        structure(c[first_index:], off=errors[first_index:]) if first_index else values["structure"]
    )
    axis_edges = _classify_axis_roots(nearby_structure.roots, errors[first_index:] / abs(c[first_index]))
    if axis_edges and problem.model.is_complex:  # a root 0 is a real eigenfrequency like any other
        axis_edges = ("weave",)
    return () if axis_edges is None else (*axis_edges, *(["infinity"] if first_index else []))


def find_edges(
    problem: Posed,
    parameters: Numbers,
    structure: Structure,
    is_optimal: bool,
    abscissa: float,
    meetings: Sequence[MultipleRoot],
) -> tuple[tuple[str, ...], bool]:
    """The stability boundaries that a design is on, and whether these and the growth of motions there are certain.

    They are certain if a located pattern places simple roots on the axis, or if exact fractions decide.

    Args:
        is_optimal: whether the status is optimal, so that the design has the patterns that the problem locates.
        abscissa: the abscissa of the design, in doubles.
        meetings: the multiple roots of the design, in doubles.
    """
    right_of_axis = distance_beyond_axis(problem.model, problem.located if is_optimal else (), structure.roots)
    largest = max((r.size for r in structure.roots), default=0.0)
    if right_of_axis or (abs(structure.abscissa) > _MAX_ABSCISSA * largest and largest):
        return (), False
    edges = edges_at(problem, parameters) or (("weave",) if right_of_axis == 0 else ())
    longest_chain = longest_chain_on_line(meetings, abscissa, largest)
    is_located = right_of_axis == 0 and longest_chain is None
    return edges, is_located or (bool(edges) and find_longest_chain(problem, parameters) == (longest_chain or 1))


def find_longest_chain(problem: Posed, parameters: Numbers) -> int | None:
    """Length of the longest Jordan chain of a root on the imaginary axis, in exact fractions.

    The result is None if no root is on the axis, if a root is right of the axis, or if fractions do not decide. For
    p(s) = e(s²) + s o(s²), a root x of gcd(e, o) gives two roots s = ±√x of p, on the axis if x is real and ≤ 0.
    """
    if not has_real_form(problem.model):
        return None
    model, parameter_set = real_form(problem).problem.model, problem.parameter_set
    design = convert_as_typed(problem, parameters)
    a = design.coefficients(model, parameter_set)
    if a is None or a[0] == 0:
        return None
    zero_count = next(k for k, c in enumerate(a[::-1]) if c != 0)
    ascending = a[::-1][zero_count:]
    divisor = flint.fmpq_poly(ascending[::2]).gcd(flint.fmpq_poly(ascending[1::2]))
    squared_roots: Any = (divisor * divisor.denom()).numer().complex_roots()
    if zero_count + divisor.degree() < 1 or any(square[0].imag != 0 or square[0].real > 0 for square in squared_roots):
        return None
    even_divisor = flint.fmpq_poly([c for x in divisor.coeffs() for c in (x, flint.fmpq(0))])
    cofactor = (flint.fmpq_poly(ascending) / even_divisor).coeffs()[::-1]
    if not all(q > 0 for q in lienard_chipart([c / cofactor[0] for c in cofactor])):
        return None
    axis_divisor = even_divisor * flint.fmpq_poly([0] * zero_count + [1])
    multiple_factors = [
        (f, int(m)) for f, m in flint.fmpq_poly(a[::-1]).factor()[1] if m > 1 and (axis_divisor % f).is_zero()
    ]
    matrices = design.matrices(model, parameter_set) if multiple_factors else None
    if model.pencil is not None and multiple_factors and matrices is None:
        return None
    return max((exact_longest(matrices, f, m) if matrices else m for f, m in multiple_factors), default=1)


def is_exactly_multiple(problem: Posed, parameters: Numbers, roots: Sequence[Root]) -> bool:
    """Whether the polynomial in fractions, from the numbers as typed, has roots of these multiplicities."""
    if not has_real_form(problem.model):
        return False
    form = real_form(problem)
    a = convert_as_typed(problem, parameters).coefficients(form.problem.model, problem.parameter_set)
    if a is None or a[0] == 0:
        return False
    return sorted(r.multiplicity for r in form.real_roots(roots)) == sorted(m for _, m in isolated_roots(a))


def convert_as_typed(problem: Posed, parameters: Numbers) -> ExactDesign:
    """Convert a design to exact numbers: fixed parameters as typed, the others as decimals."""
    typed = {n: text for n, text in problem.typed(parameters).items() if n in problem.fixed}
    return as_exact_design(problem.parameter_set, parameters, None, typed)


def _classify_axis_roots(roots: Sequence[Root], errors: Array) -> tuple[str, ...] | None:
    """Boundaries of the roots on the axis, up to errors of the coefficients; None if a root is right of the axis."""
    z = np.array([complex(r.re, r.im) for r in roots for _ in range(r.multiplicity)])
    is_on_axis = np.abs(z.real) <= _MAX_REAL_PART * np.abs(z).max(initial=0.0)
    moved_roots = np.where(is_on_axis, 1j * z.imag, z)
    change = np.abs(rebuilt(moved_roots) - rebuilt(z))
    if len(z) != len(errors) - 1 or np.any(change > errors + _ROUNDING * rebuilt(-np.abs(z).astype(complex))):
        is_on_axis[:] = False
    if np.any(z.real[~is_on_axis] >= 0):
        return None
    kinds = {"weave": is_on_axis & (z.imag != 0), "capsize": is_on_axis & (z.imag == 0)}
    return tuple(kind for kind, mask in kinds.items() if mask.any())
