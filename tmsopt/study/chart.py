"""Stability charts: what kind of motion each design of a two-parameter grid has."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.design.errors import Fault, InputError
from tmsopt.design.problem import Problem, checked
from tmsopt.design.quantities import NO_RADIUS
from tmsopt.models import Values
from tmsopt.roots import is_stable, real_roots, roots
from tmsopt.study.domain import Domain, domain
from tmsopt.study.grid import coefficients

Array = NDArray[np.float64]

CLASSES = ("undefined", "capsize", "weave", "stable", "heavily damped")
"""Names of the class codes 0 … 4, from worst to best; undefined is a singular mass matrix."""

LARGEST = 20_000_000
"""Designs of a chart, which is held in memory at some 40 bytes each."""

_BLOCK = 20_000


@dataclass(frozen=True)
class Chart:
    """Classes and roots over a grid of two parameters.

    Attributes:
        axes: names of the two parameters; arrays have shape (len(second), len(first)), as an image has.
        grid: the values along each axis.
        kind: class codes, decided by coefficients: unstable with a real root ≥ 0 (capsize), unstable without one
            (weave), stable, stable with all roots real (heavily damped).
        abscissa, damping_ratio: from roots that are jointly right next to an exceptional point; nan if undefined.
        real_roots: number of different real roots, from coefficients.
        satisfied: where every inequality constraint of the problem holds.
        margin: least difference of the sides of an inequality, negative where one is violated, nan where one does not
            exist.
        domain: the exact boundaries, if asked for.
    """

    problem: Problem
    axes: tuple[str, str]
    grid: tuple[Array, Array]
    kind: NDArray[np.int8]
    abscissa: Array
    damping_ratio: Array
    real_roots: NDArray[np.int8]
    satisfied: NDArray[np.bool_]
    margin: Array
    domain: Domain | None

    @property
    def shares(self) -> dict[str, float]:
        """Share of the grid in each class."""
        return {name: float(np.mean(self.kind == code)) for code, name in enumerate(CLASSES)}

    @property
    def left_aside(self) -> tuple[str, ...]:
        """Names of the equality constraints: they hold on curves, which `trace` follows, and nowhere on a grid."""
        return tuple(n for n, c in self.problem.conditions.items() if c.comparison == "==")

    def to_json(self) -> dict[str, Any]:
        """Summary, boundaries and corners; the arrays themselves go to a file."""
        allowed = np.where(self.satisfied, self.abscissa, np.nan)
        best = int(np.nanargmin(allowed)) if np.any(np.isfinite(allowed)) else None
        row, column = divmod(best, len(self.grid[0])) if best is not None else (0, 0)
        return {
            "schema": 1,
            "title": self.problem.title,
            "model": self.problem.model.name,
            "axes": {n: {"min": float(g[0]), "max": float(g[-1]), "points": len(g)} for n, g in self._named()},
            "classes": self.shares,
            "satisfied": float(np.mean(self.satisfied)),
            "least_abscissa": None
            if best is None
            else {
                "value": float(self.abscissa.flat[best]),
                self.axes[0]: float(self.grid[0][column]),
                self.axes[1]: float(self.grid[1][row]),
            },
            "boundaries": None if self.domain is None else self.domain.to_json(),
        }

    def _named(self) -> list[tuple[str, Array]]:
        return list(zip(self.axes, self.grid, strict=True))


def chart(
    problem: Problem,
    axes: tuple[str, str] | None = None,
    *,
    points: tuple[int, int] = (400, 300),
    boundaries: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> Chart:
    """Classify every design of a grid over the two free parameters; the others must be fixed.

    Equality constraints are left aside.

    Args:
        axes: horizontal and vertical parameter; by default in the order of the problem.
        points: along each axis; the ends of the box are grid points.
        boundaries: also trace the exact boundary curves.
        progress: called with the number of designs done and in all.

    Raises:
        InputError: unless exactly two parameters are free and the axes name them, or for other numbers of points.
    """
    names = plane_of(checked(problem), axes)
    _check(points)
    first, second = (np.linspace(*problem.free[n], m) for n, m in zip(names, points, strict=True))
    across, up = (part.ravel() for part in np.meshgrid(first, second))
    count = across.size
    kind, real = np.zeros(count, dtype=np.int8), np.zeros(count, dtype=np.int8)
    alpha, ratio = np.full(count, np.nan), np.full(count, np.nan)
    margin = np.full(count, np.inf)
    for start in range(0, count, _BLOCK):
        block = slice(start, min(start + _BLOCK, count))
        columns = {names[0]: across[block], names[1]: up[block]}
        with np.errstate(all="ignore"):  # a box of any size: what overflows is undefined
            kind[block], real[block], alpha[block], ratio[block] = classify(coefficients(problem, columns))
            margin[block] = _margin(problem, columns, alpha[block], ratio[block])
        if progress:
            progress(block.stop, count)
    shape = (len(second), len(first))
    return Chart(
        problem=problem,
        axes=names,
        grid=(first, second),
        kind=kind.reshape(shape),
        abscissa=alpha.reshape(shape),
        damping_ratio=ratio.reshape(shape),
        real_roots=real.reshape(shape),
        satisfied=(margin >= 0).reshape(shape),
        margin=margin.reshape(shape),
        domain=domain(problem) if boundaries else None,
    )


def _check(points: Any) -> None:
    try:
        across, up = (int(p) for p in points)
    except (TypeError, ValueError):
        across = up = 0
    if min(across, up) < 2 or across * up > LARGEST:
        message = f"found {points!r}; accepted: two whole numbers, each 2 or more, their product {LARGEST:.0e} or less"
        raise InputError([Fault(message, ("points",))])


def plane_of(problem: Problem, axes: tuple[str, str] | None = None) -> tuple[str, str]:
    """The two free parameters of a problem, in the order asked for.

    Raises:
        InputError: unless there are exactly two, and the axes name them.
    """
    free = list(problem.free)
    if len(free) != 2:
        message = f"a plane has two free parameters, and {len(free)} are free ({', '.join(free) or 'none'})"
        advice = "; fix the others" if len(free) > 2 else "; write e.g. Fr = { min = 0.1, max = 5 }"
        raise InputError([Fault(message + advice, ("parameters",))])
    if axes is not None and (isinstance(axes, str) or sorted(axes) != sorted(free)):
        raise InputError([Fault(f"found {axes!r}; accepted: {' and '.join(free)}", ("axes",))])
    return axes or (free[0], free[1])


def classify(a: Array) -> tuple[NDArray[np.int8], NDArray[np.int8], Array, Array]:
    """Class code, number of real roots, abscissa and damping ratio for coefficients of shape (designs, n + 1)."""
    count, n = len(a), a.shape[1] - 1
    kind, real = np.zeros(count, dtype=np.int8), np.zeros(count, dtype=np.int8)
    alpha, ratio = np.full(count, np.nan), np.full(count, np.nan)
    regular = np.flatnonzero(np.all(np.isfinite(a), axis=1) & (a[:, 0] != 0))
    if not regular.size:
        return kind, real, alpha, ratio
    c = a[regular]
    negative, positive = real_roots(c)
    zero = c[:, -1] == 0
    stable = is_stable(c)
    unstable = np.where((positive > 0) | zero, CLASSES.index("capsize"), CLASSES.index("weave"))
    damped = np.where(negative == n, CLASSES.index("heavily damped"), CLASSES.index("stable"))
    kind[regular] = np.where(stable, damped, unstable)
    real[regular] = negative + positive + zero
    z = roots(c)
    alpha[regular] = z.real.max(axis=1)
    ratio[regular] = np.min(-z.real / (np.abs(z) + 1e-300), axis=1)
    return kind, real, alpha, ratio


def _margin(problem: Problem, columns: Mapping[str, Array], alpha: Array, ratio: Array) -> Array:
    """Least difference by which the inequalities hold; nan where one does not exist, such as the speed of a root."""
    values = Values(problem.model, problem.parameter_set, problem.ordered(columns), extra=(NO_RADIUS,))
    values.define("abscissa", alpha)
    values.define("damping_ratio", ratio)
    least = np.full(len(alpha), np.inf)
    for condition in problem.conditions.values():
        if condition.comparison != "==":
            sign = -1.0 if condition.comparison == "<=" else 1.0
            least = np.minimum(least, sign * np.asarray(condition(values), dtype=float))
    return least


def save_arrays(found: Chart, path: Path) -> None:
    """Write a chart as a NumPy archive: the axes by name, `kind`, `abscissa`, `damping_ratio`, `real_roots`,
    `satisfied`, `about`.

    Raises:
        OSError: when the file cannot be written.
    """
    about = {
        "title": found.problem.title,
        "model": found.problem.model.name,
        "dimensions": [found.axes[1], found.axes[0]],
        "classes": list(CLASSES),
        "fixed": dict(found.problem.fixed),
    }
    arrays: dict[str, Any] = dict(zip(found.axes, found.grid, strict=True))
    arrays |= {n: getattr(found, n) for n in ("kind", "abscissa", "damping_ratio", "real_roots", "satisfied")}
    with path.open("wb") as stream:
        np.savez_compressed(stream, about=np.array(json.dumps(about)), **arrays)
