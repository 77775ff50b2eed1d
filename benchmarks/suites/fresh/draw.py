"""Random decimals, names and files: what every family writes with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.suites.fresh.problem import Problem, System

SEED = 20260137
"""Of all problems."""

Table = Sequence[Sequence[str]]


class Draw:
    """A source of random decimals, one for each problem."""

    def __init__(self, family: str, number: int) -> None:
        """Reproducible by family and number."""
        self.name = f"{family}/{number:02d}"
        self.rng = np.random.default_rng([SEED, *family.encode(), number])

    def number(self, low: float, high: float, digits: int = 3) -> str:
        """A decimal between two."""
        return f"{self.rng.uniform(low, high):.{digits}g}"

    def chance(self, share: float) -> bool:
        """True in that share of the cases."""
        return bool(self.rng.random() < share)

    def some(self, names: Sequence[str], least: int, most: int) -> list[str]:
        """So many of the names, in their order."""
        chosen = set(self.rng.choice(len(names), int(self.rng.integers(least, most + 1)), replace=False))
        return [name for i, name in enumerate(names) if i in chosen]

    def one(self, of: Sequence[Any]) -> Any:
        """One of several."""
        return of[int(self.rng.integers(len(of)))]

    def matrix(self, n: int, size: float = 1.0) -> npt.NDArray[np.float64]:
        """A random matrix, rounded to three decimals."""
        return self.rng.normal(0, size, (n, n)).round(3)


@dataclass
class Parts:
    """What a problem is put together from; `made` writes its file.

    Attributes:
        head: the lines of the model.
        free: parameter → its limits as decimals.
        gains: which parameters stand under ``[feedback]``.
        band: parameter → values, or (least, greatest, points).
    """

    head: str
    system: System
    free: Mapping[str, tuple[str, str]]
    fixed: Mapping[str, str]
    sense: str = "minimize"
    objective: str = "abscissa"
    limits: Mapping[str, str] = field(default_factory=dict)
    gains: Sequence[str] = ()
    band: tuple[str, Sequence[str], bool] | None = None


def made(name: str, parts: Parts, **known: Any) -> Problem:
    """The problem with its file."""
    lines = dict(parts.fixed)
    lines |= {n: f"{{ min = {low}, max = {high} }}" for n, (low, high) in parts.free.items()}
    text = [parts.head, "[parameters]", *(f"{n} = {v}" for n, v in lines.items() if n not in parts.gains)]
    if parts.gains:
        text += ["[feedback]", *(f"{n} = {lines[n]}" for n in parts.gains if n in lines)]
    cases: tuple[Mapping[str, str], ...] = ({},)
    if parts.band:
        speed, values, listed = parts.band
        low, high = values[0], values[-1]
        text += ["[scenarios]"]
        text += [
            f"{speed} = [{', '.join(values)}]" if listed else f"{speed} = {{ min = {low}, max = {high}, points = 5 }}"
        ]
        dense = [f"{x:.12g}" for x in np.linspace(float(low), float(high), 17)]
        cases = tuple({speed: v} for v in (values if listed else dense))
    text += ["[objective]", f'{parts.sense} = "{parts.objective}"']
    if parts.limits:
        text += ["[constraints]", *(f'{n} = "{t}"' for n, t in parts.limits.items())]
    free = {n: (float(low), float(high)) for n, (low, high) in parts.free.items()}
    return Problem(
        name,
        "\n".join(text) + "\n",
        parts.system,
        free,
        dict(parts.fixed),
        parts.sense,
        parts.objective,
        dict(parts.limits),
        cases,
        **known,
    )


def rows(matrix: Table) -> str:
    """A matrix of texts as TOML has it."""
    return "[" + ", ".join("[" + ", ".join(f'"{t}"' for t in row) + "]" for row in matrix) + "]"


def entries(*matrices: Table) -> tuple[tuple[tuple[str, ...], ...], ...]:
    """Matrices of texts, frozen."""
    return tuple(tuple(tuple(row) for row in matrix) for matrix in matrices)


def stated(kind: str, *matrices: Table) -> tuple[str, System]:
    """Head of the file and system, of matrices or coefficients."""
    names = {"MDK": ("M", "D", "K")}.get(kind, (kind,))
    body = [f"{n} = {rows(m)}" for n, m in zip(names, matrices, strict=True)]
    if kind == "coefficients":
        body = [f"coefficients = {rows(matrices[0])[1:-1]}"]
    return "\n".join(["[model]", *body]), System(kind, entries(*matrices))


def texts(matrix: npt.NDArray[np.float64]) -> list[list[str]]:
    """Numbers as texts."""
    return [[f"{x:.6g}" for x in row] for row in matrix]
