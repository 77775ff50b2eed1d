"""Decides whether a design is on a stability boundary, up to the rounding of its parameters."""

from collections.abc import Sequence
from typing import Any

import flint
import numpy as np

from tmsopt.models.exact import ExactDesign, as_exact_design
from tmsopt.models.user_spectrum import beyond_axis
from tmsopt.problem.problem import Posed
from tmsopt.problem.verdict.stability import MultipleRoot, longest_chain_on_line
from tmsopt.records import Array, Numbers
from tmsopt.roots import Root, Structure, exact_longest, lienard_chipart, rebuilt, structure
from tmsopt.roots.exact import isolated_roots

_ROUNDING = 64 * float(
    np.finfo(float).eps
)  # error of a solver and of numeric roots, relative to the terms of a coefficient
_FAR = 1e-3  # a design with a larger |abscissa|, relative to the largest root, is on no edge
_ON_LINE = 1e-6  # a real part that is larger, relative to the largest root, is no rounding error


def edges_at(problem: Posed, parameters: Numbers) -> tuple[str, ...]:
    """The stability boundaries that a design is on up to rounding: weave, capsize, infinity.

    The result is empty if a root is right of the imaginary axis. The test moves roots onto the axis, or the leading
    coefficient to 0, and compares the change of the coefficients with the rounding of the parameters.
    """
    values = problem.values(parameters)
    c, errors = np.array([float(x) for x in values.coefficients]), np.array(values.roundings())
    is_nonzero = np.abs(c) > errors
    if not np.all(np.isfinite(c)) or not is_nonzero[:-1].any():
        return ()
    lead = int(np.argmax(is_nonzero))
    nearby: Structure = structure(c[lead:], off=errors[lead:]) if lead else values["structure"]
    on_axis = _classify_axis_roots(nearby.roots, errors[lead:] / abs(c[lead]))
    if on_axis and problem.model.carrier is not None:  # a root 0 is a real eigenfrequency like any other
        on_axis = ("weave",)
    return () if on_axis is None else (*on_axis, *(["infinity"] if lead else []))


def find_edges(
    problem: Posed,
    parameters: Numbers,
    structure: Structure,
    optimal: bool,
    abscissa: float,
    meetings: Sequence[MultipleRoot],
) -> tuple[tuple[str, ...], bool]:
    """The stability boundaries that a design is on, and whether they and the growth on them are certain.

    They are certain if a located pattern places simple roots on the axis, or if exact fractions decide.

    Args:
        optimal: whether the status is optimal, so that the design has the patterns that the problem locates.
        abscissa, meetings: the abscissa and the multiple roots of the design, in doubles.
    """
    right_of_axis = beyond_axis(problem.model, problem.located if optimal else (), structure.roots)
    largest = max((r.size for r in structure.roots), default=0.0)
    if right_of_axis or (abs(structure.abscissa) > _FAR * largest and largest):
        return (), False
    edges = edges_at(problem, parameters) or (("weave",) if right_of_axis == 0 else ())
    longest = longest_chain_on_line(meetings, abscissa, largest)
    is_tied = right_of_axis == 0 and longest is None
    return edges, is_tied or (bool(edges) and find_longest_chain(problem, parameters) == (longest or 1))


def find_longest_chain(problem: Posed, parameters: Numbers) -> int | None:
    """Length of the longest Jordan chain of a root on the imaginary axis, in exact fractions.

    The result is None if no root is on the axis, if one is right of it, or if fractions do not decide. For p(s) =
    e(s²) + s o(s²), a root x of gcd(e, o) gives a pair of roots s = ±√x of p: on the axis if x is real and ≤ 0.
    """
    model, parameter_set = problem.model, problem.parameter_set
    design = convert_as_typed(problem, parameters)
    a = design.coefficients(model, parameter_set)
    if a is None or a[0] == 0:
        return None
    zeros = next(k for k, c in enumerate(a[::-1]) if c != 0)
    ascending = a[::-1][zeros:]
    divisor = flint.fmpq_poly(ascending[::2]).gcd(flint.fmpq_poly(ascending[1::2]))
    squares: Any = (divisor * divisor.denom()).numer().complex_roots()
    if zeros + divisor.degree() < 1 or any(square[0].imag != 0 or square[0].real > 0 for square in squares):
        return None
    double = flint.fmpq_poly([c for x in divisor.coeffs() for c in (x, flint.fmpq(0))])
    cofactor = (flint.fmpq_poly(ascending) / double).coeffs()[::-1]
    if not all(q > 0 for q in lienard_chipart([c / cofactor[0] for c in cofactor])):
        return None
    on_axis = double * flint.fmpq_poly([0] * zeros + [1])
    multiple = [(f, int(m)) for f, m in flint.fmpq_poly(a[::-1]).factor()[1] if m > 1 and (on_axis % f).is_zero()]
    matrices = design.matrices(model, parameter_set) if multiple else None
    if model.pencil is not None and multiple and matrices is None:
        return None
    return max((exact_longest(matrices, f, m) if matrices else m for f, m in multiple), default=1)


def is_exactly_multiple(problem: Posed, parameters: Numbers, roots: Sequence[Root]) -> bool:
    """Whether the polynomial in fractions, from the numbers as typed, has roots of these multiplicities."""
    a = convert_as_typed(problem, parameters).coefficients(problem.model, problem.parameter_set)
    if a is None or a[0] == 0:
        return False
    return sorted(r.multiplicity for r in roots) == sorted(m for _, m in isolated_roots(a))


def convert_as_typed(problem: Posed, parameters: Numbers) -> ExactDesign:
    """A design in exact numbers: fixed parameters as typed, the others as decimals."""
    typed = {n: text for n, text in problem.typed(parameters).items() if n in problem.fixed}
    return as_exact_design(problem.parameter_set, parameters, None, typed)


def _classify_axis_roots(roots: Sequence[Root], errors: Array) -> tuple[str, ...] | None:
    """Boundaries of the roots on the axis, up to errors of the coefficients; None if a root is right of the axis."""
    z = np.array([complex(r.re, r.im) for r in roots for _ in range(r.multiplicity)])
    is_on_axis = np.abs(z.real) <= _ON_LINE * np.abs(z).max(initial=0.0)
    on_line = np.where(is_on_axis, 1j * z.imag, z)
    change = np.abs(rebuilt(on_line) - rebuilt(z))
    if len(z) != len(errors) - 1 or np.any(change > errors + _ROUNDING * rebuilt(-np.abs(z).astype(complex))):
        is_on_axis[:] = False
    if np.any(z.real[~is_on_axis] >= 0):
        return None
    kinds = {"weave": is_on_axis & (z.imag != 0), "capsize": is_on_axis & (z.imag == 0)}
    return tuple(kind for kind, mask in kinds.items() if mask.any())
