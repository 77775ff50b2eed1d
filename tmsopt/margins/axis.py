"""Whether a design stands on the boundary of stability already, as far as the rounding of its parameters tells."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import flint
import numpy as np

from tmsopt.design.problem import Problem
from tmsopt.models.exact import written
from tmsopt.models.told import beyond_axis
from tmsopt.records import Array
from tmsopt.roots import Root, Structure, lienard_chipart, rebuilt, structure

_ROUNDING = 64 * float(np.finfo(float).eps)  # of the terms of a coefficient: what a solver and numeric roots leave
_FAR = 1e-3  # of the largest root: an abscissa of no edge
_ON_LINE = 1e-6  # of the largest root: beyond it none is on the axis but for rounding


def edges_at(problem: Problem, parameters: Mapping[str, float]) -> tuple[str, ...]:
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
    problem: Problem, parameters: Mapping[str, float], structure: Structure, optimal: bool
) -> tuple[tuple[str, ...], bool]:  # fmt: skip
    """The boundaries of stability that a design stands on, and whether that is certain.

    Certain are roots that a located pattern ties to the axis, and those of coefficients that are fractions.
    """
    beyond = beyond_axis(problem.model, problem.located if optimal else (), structure.roots)
    largest = max((math.hypot(r.re, r.im) for r in structure.roots), default=0.0)
    if beyond or (abs(structure.abscissa) > _FAR * largest and largest):
        return (), False
    edges = edges_at(problem, parameters)
    if beyond == 0:
        return edges or ("weave",), True
    return edges, bool(edges) and is_exactly_on_edge(problem, parameters)


def is_exactly_on_edge(problem: Problem, parameters: Mapping[str, float]) -> bool:
    """Whether roots are on the imaginary axis and none right of it, in fractions; False where these do not tell.

    p(s) = e(s²) + s o(s²) has the roots s² = x of gcd(e, o) on the axis, mirrored in it, or in four quadrants.
    """
    of = problem.parameter_set
    a = written(of, parameters).coefficients(problem.model, of)
    if a is None or a[0] == 0:
        return False
    zeros = next(k for k, c in enumerate(a[::-1]) if c != 0)
    ascending = a[::-1][zeros:]
    shared = flint.fmpq_poly(ascending[::2]).gcd(flint.fmpq_poly(ascending[1::2]))
    squares: Any = (shared * shared.denom()).numer().complex_roots()
    if zeros + shared.degree() < 1 or any(square[0].imag != 0 or square[0].real > 0 for square in squares):
        return False
    double = flint.fmpq_poly([c for x in shared.coeffs() for c in (x, flint.fmpq(0))])
    rest = (flint.fmpq_poly(ascending) / double).coeffs()[::-1]
    return len(rest) == 1 or all(q > 0 for q in lienard_chipart([c / rest[0] for c in rest]))


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
