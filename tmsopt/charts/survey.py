"""Grids over two or three parameters, and what is known of their designs, computed a few rows at a time."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tmsopt.charts.expressions import ArrayFunction, array_function, parsed
from tmsopt.charts.motion import Classified, classified, engine_of
from tmsopt.design.advice.names import example_of
from tmsopt.design.files import Given, problem_of
from tmsopt.design.problem import Problem
from tmsopt.design.quantities import RADIUS, ROOT_NAMES
from tmsopt.errors import Fault, InputError, list_faults, suggest, table_faults
from tmsopt.records import Array

LAYERS: Mapping[str, DTypeLike] = {
    "kind": np.int8, "abscissa": np.float64, "damping_ratio": np.float64, "real_roots": np.int8, "satisfied": np.bool_,
    "margin": np.float64,
}  # fmt: skip
"""What can be computed of every design; see `Chart`."""

USUAL = ("kind", "abscissa", "damping_ratio", "real_roots", "satisfied")
"""Layers of a chart unless others are asked for."""

USUAL_POINTS: Mapping[int, tuple[int, ...]] = {2: (400, 300), 3: (120, 100, 80)}
"""Points along two or three axes unless others are asked for."""

MOST = 10**9
"""Designs of a grid."""

_WORTH_COMPILING = 5_000_000
"""Designs for which numba is taken unless an engine is named: compiling takes as long as some millions in NumPy."""

LONGEST = 10**6
"""Points along one axis."""


@dataclass(frozen=True)
class Grid:
    """Values along two or three axes; arrays have the last axis first, and the first one runs fastest, as in an image.

    Attributes:
        axes: names of the parameters.
        values: along each axis.
    """

    axes: tuple[str, ...]
    values: tuple[Array, ...] = field(repr=False)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the arrays."""
        return tuple(len(v) for v in reversed(self.values))

    @property
    def size(self) -> int:
        """Number of designs."""
        return math.prod(self.shape)

    @property
    def rows(self) -> int:
        """Number of lines along the first axis."""
        return math.prod(self.shape[:-1])

    def across(self) -> dict[str, Array]:
        """The first axis, shape (1, n)."""
        return {self.axes[0]: self.values[0][None, :]}

    def up(self, rows: range) -> dict[str, Array]:
        """Values of the other axes in a few rows, shape (len(rows), 1)."""
        places = np.unravel_index(np.arange(rows.start, rows.stop), self.shape[:-1])
        others = list(zip(self.axes, self.values, strict=True))[:0:-1]
        return {n: values[at][:, None] for (n, values), at in zip(others, places, strict=True)}

    def at(self, place: int) -> dict[str, float]:
        """Parameters of a design by its place in the flat arrays."""
        indices = np.unravel_index(place, self.shape)[::-1]
        return {n: float(v[k]) for n, v, k in zip(self.axes, self.values, indices, strict=True)}

    def tiles(self, points: int) -> list[range]:
        """All rows, in parts of about so many points."""
        each = max(1, points // self.shape[-1])
        return [range(k, min(k + each, self.rows)) for k in range(0, self.rows, each)]


@dataclass(frozen=True)
class Survey:
    """What is to be computed of every design of a grid.

    Attributes:
        layers: names among `LAYERS`.
        quantities: name → expression, further layers.
        engine: ``numpy`` or ``numba``; the numbers do not depend on it.
        single: whether numbers are kept in single precision.
        before, after: what is computed before the roots, coefficients among it, and what takes them.
    """

    problem: Problem
    grid: Grid
    layers: tuple[str, ...]
    quantities: Mapping[str, str]
    engine: str
    single: bool
    before: ArrayFunction = field(repr=False)
    after: ArrayFunction = field(repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Of all layers."""
        return (*self.layers, *self.quantities)

    def dtype(self, name: str) -> np.dtype[Any]:
        """Of a layer's numbers."""
        wanted = np.dtype(LAYERS.get(name, np.float64))
        return np.dtype(np.float32) if self.single and wanted == np.float64 else wanted

    def room(self, rows: int) -> Array:
        """Memory for the coefficients of so many rows, to be used again: new pages cost as much as the classes."""
        return np.empty((self.problem.model.degree + 1, rows, self.grid.shape[-1]))

    def tile(self, rows: range, room: Array | None = None) -> tuple[dict[str, NDArray[Any]], int]:
        """The layers of a few rows, shape (len(rows), n), and how many roots took the slow way.

        Args:
            room: memory of this thread's own for as many rows or more.
        """
        shape, up = (len(rows), self.grid.shape[-1]), self.grid.up(rows)
        with np.errstate(all="ignore"):  # a box of any size: what overflows is undefined
            a = (self.room(len(rows)) if room is None else room)[:, : len(rows)]
            places = dict(zip(self.problem.model.coefficient_names(), a, strict=True))
            values = self.before(up, places)
            for name, whole in places.items():
                if values[name] is not whole:
                    whole[...] = values[name]
            found = classified(list(a), self._needs, self.engine)
            if self.problem.model.carrier is not None and found.damping_ratio is not None:
                found = replace(found, damping_ratio=np.full_like(found.damping_ratio, np.nan))
            known = {n: v for n in ("abscissa", "damping_ratio") if (v := getattr(found, n)) is not None}
            values |= self.after(up | known) if self.after.names else {}
            layers = {n: self._layer(n, found, values, shape) for n in self.names}
        return layers, found.fallbacks

    @property
    def _needs(self) -> frozenset[str]:
        """Layers that come from the coefficients."""
        return frozenset(self.layers) | {n for n in self.after.inputs if n in LAYERS} | (
            {"abscissa", "damping_ratio"} if self.after.others else set()
        )  # fmt: skip

    def _layer(self, name: str, found: Classified, values: Mapping[str, Any], shape: tuple[int, ...]) -> NDArray[Any]:
        if name in self.quantities:
            layer = values[_QUANTITY + name]
        elif name in ("satisfied", "margin"):
            margin = self._margin(values)
            layer = margin >= 0 if name == "satisfied" else margin
        else:
            layer = getattr(found, name)
        return np.ascontiguousarray(np.broadcast_to(layer, shape), dtype=self.dtype(name))

    def _margin(self, values: Mapping[str, Any]) -> Any:
        """Least difference by which the inequalities hold; nan where one does not exist."""
        least: Any = np.inf
        for name, condition in self.problem.conditions.items():
            if not condition.equality:
                least = np.minimum(least, -condition.sign * values[_CONDITION + name])
        return least


_QUANTITY, _CONDITION = "quantity ", "condition "
"""Before the names of outputs, which users choose."""


def survey(
    problem: Given, axes: Sequence[str] | None = None, points: Sequence[int] | None = None,
    layers: Sequence[str] = USUAL, quantities: Mapping[str, str] | None = None, engine: str = "auto",
    single: bool = False,
) -> Survey:  # fmt: skip
    """What is to be computed over a grid of the free parameters, checked.

    Args:
        axes: the free parameters, the one that runs fastest first; by default in the order of the problem.
        points: along each axis, by default those of `USUAL_POINTS`; the ends of the box are grid points.
        layers: names among `LAYERS`.
        quantities: name → expression, further layers.
        engine: ``numpy``, ``numba``, or ``auto``: numba where it is installed and the grid is worth compiling for.
        single: keep numbers in single precision.

    Raises:
        InputError: unless two or three parameters are free and the axes name them; for other numbers of points,
            unknown layers, bad expressions, unknown engines.
    """
    problem = problem_of(problem)
    names = axes_of(problem, axes)
    sizes = _sizes(USUAL_POINTS[len(names)] if points is None else points, len(names))
    if faults := [*list_faults("layers", layers, "['kind', 'abscissa']"),
                  *table_faults("quantities", quantities or {}, "{'wheel_load': 'load_front/2'}")]:  # fmt: skip
        raise InputError(faults)
    faults = [Fault(f"found {n!r}; {suggest(n, LAYERS)}", ("layers",)) for n in layers if n not in tuple(LAYERS)]
    extra = dict(quantities or {})
    reserved = {*LAYERS, *names, "about"}
    faults += [
        Fault(f"found the name {n!r}; accepted: letters, digits and _, other than {' '.join(sorted(reserved))}",
              ("quantities",))
        for n in extra if n in reserved or not (n.isidentifier() and n.isascii())
    ]  # fmt: skip
    if not (layers or extra):
        faults.append(Fault(f"found none; accepted: some of {' '.join(LAYERS)}", ("layers",)))
    if faults:
        raise InputError(faults)
    grid = Grid(names, tuple(np.linspace(*problem.free[n], m) for n, m in zip(names, sizes, strict=True)))
    if engine == "auto" and grid.size < _WORTH_COMPILING:
        engine = "numpy"
    return _over(problem, grid, tuple(dict.fromkeys(layers)), extra, engine_of(engine), single)


def _over(
    problem: Problem, grid: Grid, layers: tuple[str, ...], extra: Mapping[str, str], engine: str, single: bool
) -> Survey:
    wanted = {_QUANTITY + n: e for n, e in parsed(problem, extra).items()}
    if searched := [n for n in extra if RADIUS in wanted[_QUANTITY + n].names]:
        message = f"uses {RADIUS}, which takes a search for every design; a chart has what is computed at once"
        raise InputError([Fault(message, ("quantities", n)) for n in searched])
    if {"satisfied", "margin"} & set(layers):
        wanted |= {_CONDITION + n: c for n, c in problem.conditions.items() if not c.equality}
    of_roots = {n: e for n, e in wanted.items() if set(ROOT_NAMES) & set(e.names)}
    others = {n: e for n, e in wanted.items() if n not in of_roots}
    others |= parsed(problem, {n: n for n in problem.model.coefficient_names()})
    settled = {**problem.fixed, **grid.across()}
    return Survey(
        problem=problem, grid=grid, layers=layers, quantities=extra, engine=engine, single=single,
        before=array_function(problem, others).settled(settled),
        after=array_function(problem, of_roots).settled(settled),
    )  # fmt: skip


def axes_of(problem: Problem, axes: Sequence[str] | None = None) -> tuple[str, ...]:
    """The two or three free parameters of a problem, in the order asked for.

    Raises:
        InputError: unless there are two or three, and the axes name them.
    """
    free = list(problem.free)
    if len(free) not in (2, 3):
        message = f"a grid has two or three free parameters, and {len(free)} are free ({', '.join(free) or 'none'})"
        of = problem.parameter_set
        fixed = [*(n for n in ("Fr", "v") if n in problem.fixed), *problem.fixed]
        freed = f"; write e.g. {example_of(of[fixed[0]])[1]}" if fixed else ""
        advice = "; fix the others" if len(free) > 3 else freed
        raise InputError([Fault(message + advice, ("parameters",))])
    if axes is not None and (list_faults("axes", axes, "") or sorted(map(str, axes)) != sorted(free)):
        raise InputError([Fault(f"found {axes!r}; accepted: {' and '.join(free)}", ("axes",))])
    return tuple(axes or free)


def _sizes(points: Any, count: int) -> tuple[int, ...]:
    try:
        sizes = tuple(int(p) for p in points)
    except (TypeError, ValueError):
        sizes = ()
    if len(sizes) != count or min(sizes) < 2 or max(sizes) > LONGEST or math.prod(sizes) > MOST:
        message = (
            f"found {points!r}; accepted: {('two', 'three')[count - 2]} whole numbers, each from 2 to {LONGEST}, "
            f"their product {MOST:.0e} or less"
        )
        raise InputError([Fault(message, ("points",))])
    return sizes
