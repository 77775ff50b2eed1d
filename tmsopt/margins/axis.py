"""Whether a design stands on the boundary of stability already, as far as the rounding of its parameters tells."""

from collections.abc import Mapping, Sequence

import numpy as np

from tmsopt.design.problem import Problem
from tmsopt.records import Array
from tmsopt.roots import Root, Structure, rebuilt, structure

_ROUNDING = 64 * float(np.finfo(float).eps)  # of the terms of a coefficient: what a solver and numeric roots leave
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
    return () if on_axis is None else (*on_axis, *(["infinity"] if lead else []))


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
