"""The form of a problem in which the roots are those of a real polynomial.

It is the problem itself, unless the system is complex. The form of a complex system x′ = A x is a real system of twice
the size. A carrier, a real constant c, is subtracted from all Im s, so that no root meets the conjugate of another one:
the real system has the roots s − i c and their conjugates, and an EPn of A is a CEPn of the real system.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from tmsopt.algebra.formula import constant, symbol
from tmsopt.algebra.intervals import Interval
from tmsopt.algebra.sequence import golden_steps
from tmsopt.errors import input_error
from tmsopt.models.model import Model
from tmsopt.models.stated.pairs import list_parts
from tmsopt.models.stated.real_form import real_model
from tmsopt.problem.cases import points_of
from tmsopt.problem.evaluate import evaluate_matrices
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.records import Table
from tmsopt.roots import Root
from tmsopt.roots.patterns.complex_patterns import complex_name, real_form_name

_ROUNDING = 1e-14  # a few rounding errors, relative to the carrier

_NEGLIGIBLE = 2.0**-300  # a smaller spread comes from rounding, and its carrier would underflow
_MIN_SPREAD = 1e-6  # least spread, relative to the largest frequency
_MIN_SHARE = 1 / 64  # and relative to H; the eigenvalues of a defective H have no spread, but a large rounding error
_SAMPLE_SIZE = 256  # designs of a sample of the ranges
_SPREAD_FACTOR = 1.25  # the spread in a sample is multiplied by this factor
_MAX_CORNER_PARAMETERS = 8  # with more parameters, a sample does not contain the corners of the ranges

_MAX_SIZE = 6
"""Largest number of roots of a complex system that has a real form."""


@dataclass(frozen=True, eq=False)
class RealForm:
    """A problem whose model has a real polynomial, and the carrier of its roots; None if the problem is the user's."""

    problem: Posed
    carrier: float | None = None

    def user_roots(self, roots: Iterable[Any]) -> tuple[Any, ...]:
        """The user's roots for roots of the polynomial: numbers or balls with ``re``, ``im`` and multiplicity."""
        if self.carrier is None:
            return tuple(roots)
        return tuple(replace(r, im=r.im + self.carrier) for r in roots if r.im < 0)

    def real_roots(self, roots: Iterable[Any]) -> tuple[Any, ...]:
        """The roots of the polynomial for the user's roots; the inverse of `user_roots`."""
        if self.carrier is None:
            return tuple(roots)
        lower = [replace(r, im=r.im - self.carrier) for r in roots]
        return tuple(w for r in lower for w in (replace(r, im=-r.im), r))

    def user_name(self, name: str) -> str:
        """The user's name of a pattern or structure of the polynomial."""
        return name if self.carrier is None else complex_name(name)

    def real_name(self, name: str) -> str:
        """The name of a pattern or structure of the polynomial for the user's name."""
        return name if self.carrier is None else real_form_name(name)

    def to_real(self, solution: Solution) -> Solution:
        """A solution of the user's problem as a solution of the real form."""
        if self.carrier is None:
            return solution
        structure, roots = self.real_name(solution.structure), self.real_roots(solution.roots)
        return replace(solution, problem=self.problem.problem, structure=structure, roots=roots)

    def to_user(self, solution: Solution, problem: Posed) -> Solution:
        """A solution of the real form as a solution of the user's problem."""
        if self.carrier is None:
            return solution
        violations = {n if n in problem.conditions else self.user_name(n): x for n, x in solution.violations.items()}
        hidden = self.problem.model.coefficient_names()
        return replace(
            solution,
            problem=problem.problem,
            structure=self.user_name(solution.structure),
            roots=tuple(self._drop_rounding(r) for r in self.user_roots(solution.roots)),
            meetings=self.user_roots(solution.meetings),
            violations=Table(violations),
            quantities=Table({n: x for n, x in solution.quantities.items() if n not in hidden}),
            freedom=degrees_of_freedom(problem),
        )

    def _drop_rounding(self, root: Root) -> Root:
        """A root without the rounding error that the carrier leaves of a part that is 0."""
        zero = _ROUNDING * abs(self.carrier or 0.0)
        return replace(root, re=root.re if abs(root.re) > zero else 0.0, im=root.im if abs(root.im) > zero else 0.0)


@lru_cache(maxsize=64)
def has_real_form(model: Model) -> bool:
    """Whether a model has a real polynomial, or is a small complex system x′ = A x."""
    if model.polynomial is not None or model.pencil is None or model.degree > _MAX_SIZE:
        return model.polynomial is not None
    leading, *others = model.pencil({n: symbol(n) for n in model.sets[0].names})
    entries = [constant(x).fraction for x in list_parts([leading])]
    return len(others) == 1 and entries == list_parts([np.eye(len(leading), dtype=int).tolist()])


@lru_cache(maxsize=32)
def real_form(problem: Posed) -> RealForm:
    """The form of a problem in which the roots are those of a real polynomial.

    Raises:
        InputError: for large matrices, and for complex M, D, K or coefficients.
    """
    model = problem.model
    if not has_real_form(model):
        accepted = "real A up to 12 × 12, real M, D, K up to 6 × 6, complex H and A up to 6 × 6"
        tasks = "minimise the abscissa, locate and prove a pattern, list all points"
        can = f"{tasks}, draw `tmsopt chart` and `tmsopt sheets`"
        message = f"needs the characteristic polynomial; accepted here: {accepted}; with others: {can}"
        raise input_error(message, "model")
    if model.polynomial is not None:
        return RealForm(problem)
    ranges = {n: (x, x) for n, x in problem.fixed.items()} | {**problem.free}  # over all cases
    for name, scenario in problem.scenarios.items():
        points = [*points_of(scenario), problem.fixed[name]]
        ranges[name] = min(points), max(points)
    tolerances = {n: problem.tolerances.get(n, 0.0) for n in ranges}
    carrier = _choose_carrier(model, {n: (lo - tolerances[n], hi + tolerances[n]) for n, (lo, hi) in ranges.items()})
    locate = problem.locate and real_form_name("".join(problem.locate.split()))
    return RealForm(problem.derive(model=real_model(model, carrier), locate=locate), carrier)


def _choose_carrier(model: Model, box: Mapping[str, Interval]) -> float:
    """The carrier for a complex system with parameters in a box, from the eigenfrequencies ω of designs in the box.

    It moves the middle of all Re ω to at least twice their spread, which is at least the largest |Im ω|.
    """
    ends, size = np.array([*box.values()]).reshape(-1, 2), len(box)
    u = np.arange(_SAMPLE_SIZE)[:, None] * golden_steps(size) % 1.0
    if size <= _MAX_CORNER_PARAMETERS:
        u = np.concatenate([u, np.array(list(product((0.0, 1.0), repeat=size)))])
    columns = dict(zip(box, (ends[:, 0] + np.ptp(ends, axis=1) * u).T, strict=True))
    H = 1j * -evaluate_matrices(model, model.sets[0], columns)[..., 1, :, :].reshape(-1, model.degree, model.degree)
    H = H[np.isfinite(H).all(axis=(1, 2))]
    omega = np.linalg.eigvals(H) if len(H) else np.zeros((1, 1))
    low, high = float(omega.real.min()), float(omega.real.max())
    spread = _SPREAD_FACTOR * max((high - low) / 2, float(np.abs(omega.imag).max()))
    distances = np.linalg.norm(H - omega.mean(axis=-1)[:, None, None] * np.eye(model.degree), axis=(-2, -1))
    spread = max(spread, _MIN_SHARE * float(distances.max(initial=0.0)), _MIN_SPREAD * max(abs(low), abs(high)))
    return 2 * (spread if spread > _NEGLIGIBLE else 1.0) - (low + high) / 2
