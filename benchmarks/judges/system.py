"""A linear system and a question as text, which judges and rivals evaluate without the package."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from benchmarks.judges.eigenvalues import companion, root_values
from benchmarks.judges.text import evaluated, excess, sides
from tmsopt import Problem
from tmsopt.models import Model, from_coefficients, from_matrices
from tmsopt.records import Array

FLOOR = 1e-3
"""Of |value| in relative differences: an abscissa near 0 has no scale of its own."""

Entries = list[list[str]]


@dataclass(frozen=True)
class System:
    """A system and a question, as text.

    Attributes:
        index: in the suite.
        kind: how it was made.
        matrices: ``M``, ``D`` and ``K``; or ``A``; or ``coefficients``, in one row.
        goal: ``minimize``, ``maximize`` or ``locate`` and what.
        known: a design that has the pattern to locate.
    """

    index: int
    kind: str
    matrices: Mapping[str, Entries]
    fixed: Mapping[str, float]
    free: Mapping[str, tuple[float, float]]
    goal: Mapping[str, str]
    constraints: Mapping[str, str] = field(default_factory=dict)
    known: Mapping[str, float] = field(default_factory=dict)

    @property
    def degree(self) -> int:
        """Of the characteristic polynomial."""
        size = len(next(iter(self.matrices.values()))[0])
        return 2 * size if "M" in self.matrices else size if "A" in self.matrices else size - 1

    @property
    def sign(self) -> float:
        """−1 where the objective is maximised."""
        return -1.0 if "maximize" in self.goal else 1.0

    @property
    def objective(self) -> str:
        """What is optimised."""
        return self.goal.get("minimize") or self.goal["maximize"]

    @cached_property
    def model(self) -> Model:
        """As a user would make it."""
        symbols = {n: ca.SX.sym(n) for n in (*self.fixed, *self.free)}
        made: dict[str, Any] = {
            n: [[eval(text, {}, symbols) for text in row] for row in rows] for n, rows in self.matrices.items()
        }
        if "coefficients" in made:
            return from_coefficients(made["coefficients"][0], name="random")
        return from_matrices(name="random", **made)

    @property
    def problem(self) -> Problem:
        """As `solve` takes it."""
        return Problem(
            model=self.model,
            fixed=self.fixed,
            free=self.free,
            constraints=self.constraints,
            title=f"random system {self.index}: {self.kind}",
            minimize=self.goal.get("minimize"),
            maximize=self.goal.get("maximize"),
            locate=self.goal.get("locate"),
        )

    def evaluated(self, values: Mapping[str, Any]) -> dict[str, list[list[Any]]]:
        """The matrices for numbers of any kind, arrays included."""
        every = {**self.fixed, **values}
        return {n: [[eval(text, {}, every) for text in row] for row in rows] for n, rows in self.matrices.items()}

    def state(self, values: Mapping[str, Any]) -> Array:
        """The state matrix, shape (designs, n, n), for arrays of shape (designs,)."""
        found = self.evaluated(values)
        count = len(next(iter(values.values())))
        stacked = {n: _stacked(rows, count) for n, rows in found.items()}
        if "A" in stacked:
            return stacked["A"]
        if "coefficients" in stacked:
            return companion(stacked["coefficients"][:, 0])
        size = stacked["M"].shape[-1]
        lower = -np.linalg.solve(stacked["M"], np.concatenate([stacked["K"], stacked["D"]], axis=-1))
        upper = np.broadcast_to(np.eye(size, 2 * size, size), lower.shape)
        return np.concatenate([upper, lower], axis=1)

    def worth(self, values: Mapping[str, Any]) -> Any:
        """The objective, of designs with their root quantities."""
        return evaluated(self.objective, {**self.fixed, **values})

    def violation(self, values: Mapping[str, Any]) -> Array:
        """Largest over the constraints, relative to their sides, of designs with their root quantities."""
        worst = np.zeros(np.shape(next(iter(values.values()))))
        every = {**self.fixed, **values}
        for left, comparison, right in map(sides, self.constraints.values()):
            worst = np.maximum(worst, excess(evaluated(left, every), comparison, evaluated(right, every)))
        return worst

    def judged(self, designs: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
        """Abscissa and damping ratio by eigenvalues, and the violation, of many designs."""
        with np.errstate(all="ignore"):
            abscissa, ratio = root_values(np.asarray(np.linalg.eigvals(self.state(designs)), dtype=complex))
        found = {"abscissa": abscissa, "damping_ratio": ratio}
        return found, self.violation({**designs, **found})

    def excess(self, value: float, best: float) -> float:
        """Of a value over the best one, in units of that or of `FLOOR`."""
        return self.sign * (value - best) / max(FLOOR, abs(best))


def _stacked(rows: list[list[Any]], count: int) -> Array:
    return np.stack(
        [np.stack([np.broadcast_to(np.asarray(x, float), count) for x in row], axis=-1) for row in rows], axis=1
    )
