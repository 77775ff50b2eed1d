"""Whether a design stands on the boundary of stability already, as far as the rounding of its parameters tells."""

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

_ROUNDING = 64 * float(np.finfo(float).eps)  # of the terms of a coefficient: what a solver and numeric roots leave
_FAR = 1e-3  # of the largest root: an abscissa of no edge
_ON_LINE = 1e-6  # of the largest root: beyond it none is on the axis but for rounding


def edges_at(problem: Posed, parameters: Numbers) -> tuple[str, ...]:
    """The boundaries of stability that a design stands on as far as rounding tells, of weave, capsize and infinity.

    Empty where a root is right of the imaginary axis. Judged by coefficients: with roots moved onto the axis, or the
    leading coefficient 0, they change by no more than the rounding of the parameters may change them.
    """
    values = problem.values(parameters)
    c, off = np.array([float(x) for x in values.coefficients]), np.array(values.roundings())
    known = np.abs(c) > off
    if not np.all(np.isfinite(c)) or not known[:-1].any():
        return ()
    lead = int(np.argmax(known))
    found: Structure = structure(c[lead:], off=off[lead:]) if lead else values["structure"]
    on_axis = _on_axis(found.roots, off[lead:] / abs(c[lead]))
    if on_axis and problem.model.carrier is not None:  # a root 0 of the double is a real eigenfrequency like others
        on_axis = ("weave",)
    return () if on_axis is None else (*on_axis, *(["infinity"] if lead else []))


def stands_on(
    problem: Posed,
    parameters: Numbers,
    structure: Structure,
    optimal: bool,
    abscissa: float,
    meetings: Sequence[MultipleRoot],
) -> tuple[tuple[str, ...], bool]:
    """The boundaries of stability that a design stands on, and whether that and its growth are certain.

    Certain are simple roots that a located pattern ties to the axis, and what fractions show.

    Args:
        abscissa, meetings: of the design, in doubles.
    """
    beyond = beyond_axis(problem.model, problem.located if optimal else (), structure.roots)
    largest = max((r.size for r in structure.roots), default=0.0)
    if beyond or (abs(structure.abscissa) > _FAR * largest and largest):
        return (), False
    edges = edges_at(problem, parameters) or (("weave",) if beyond == 0 else ())
    longest = longest_chain_on_line(meetings, abscissa, largest)
    tied = beyond == 0 and longest is None
    return edges, tied or (bool(edges) and longest_on_axis(problem, parameters) == (longest or 1))


def longest_on_axis(problem: Posed, parameters: Numbers) -> int | None:
    """Length of the longest Jordan chain of roots on the imaginary axis, in fractions.

    None where no root is there or one is right of it, and where fractions do not tell.
    p(s) = e(s²) + s o(s²) has the roots s² = x of gcd(e, o) on the axis, mirrored in it, or in four quadrants.
    """
    model, of = problem.model, problem.parameter_set
    design = as_typed(problem, parameters)
    a = design.coefficients(model, of)
    if a is None or a[0] == 0:
        return None
    zeros = next(k for k, c in enumerate(a[::-1]) if c != 0)
    ascending = a[::-1][zeros:]
    shared = flint.fmpq_poly(ascending[::2]).gcd(flint.fmpq_poly(ascending[1::2]))
    squares: Any = (shared * shared.denom()).numer().complex_roots()
    if zeros + shared.degree() < 1 or any(square[0].imag != 0 or square[0].real > 0 for square in squares):
        return None
    double = flint.fmpq_poly([c for x in shared.coeffs() for c in (x, flint.fmpq(0))])
    rest = (flint.fmpq_poly(ascending) / double).coeffs()[::-1]
    if not all(q > 0 for q in lienard_chipart([c / rest[0] for c in rest])):
        return None
    on_axis = double * flint.fmpq_poly([0] * zeros + [1])
    multiple = [(f, int(m)) for f, m in flint.fmpq_poly(a[::-1]).factor()[1] if m > 1 and (on_axis % f).is_zero()]
    matrices = design.matrices(model, of) if multiple else None
    if model.pencil is not None and multiple and matrices is None:
        return None
    return max((exact_longest(matrices, f, m) if matrices else m for f, m in multiple), default=1)


def is_exactly_multiple(problem: Posed, parameters: Numbers, roots: Sequence[Root]) -> bool:
    """Whether the multiplicities of the roots of a polynomial are those of the numbers as typed, in fractions."""
    a = as_typed(problem, parameters).coefficients(problem.model, problem.parameter_set)
    if a is None or a[0] == 0:
        return False
    return sorted(r.multiplicity for r in roots) == sorted(m for _, m in isolated_roots(a))


def as_typed(problem: Posed, parameters: Numbers) -> ExactDesign:
    """A design in exact numbers: what was typed for the fixed ones, decimals for the others."""
    typed = {n: text for n, text in problem.typed(parameters).items() if n in problem.fixed}
    return as_exact_design(problem.parameter_set, parameters, None, typed)


def _on_axis(roots: Sequence[Root], off: Array) -> tuple[str, ...] | None:
    """What roots on the imaginary axis make of monic coefficients that may be off; None where one is right of it."""
    z = np.array([complex(r.re, r.im) for r in roots for _ in range(r.multiplicity)])
    near = np.abs(z.real) <= _ON_LINE * np.abs(z).max(initial=0.0)
    moved = np.where(near, 1j * z.imag, z)
    change = np.abs(rebuilt(moved) - rebuilt(z))
    if len(z) != len(off) - 1 or np.any(change > off + _ROUNDING * rebuilt(-np.abs(z).astype(complex))):
        near[:] = False
    if np.any(z.real[~near] >= 0):
        return None
    kinds = {"weave": near & (z.imag != 0), "capsize": near & (z.imag == 0)}
    return tuple(kind for kind, which in kinds.items() if which.any())
