"""Grids of designs over two or three parameters, and surveys of a grid.

A layer is an array with one number for each design of a grid, such as its abscissa. A survey computes layers, a few
rows of the grid at a time.
"""

import math
import operator
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tmsopt.errors import Fault, InputError, input_error, list_faults, short, suggest, table_faults
from tmsopt.problem.advice.names import example_of
from tmsopt.problem.evaluate import ArrayFunction, array_function, describe_eigenvalues, find_eigenvalues, parse_all
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS, ROOT_NAMES
from tmsopt.records import Array
from tmsopt.roots import CLASSES, classify, find_motion

LAYERS: Mapping[str, DTypeLike] = {
    "kind": np.int8,
    "abscissa": np.float64,
    "damping_ratio": np.float64,
    "real_roots": np.int8,
    "satisfied": np.bool_,
    "margin": np.float64,
    "petermann": np.float64,
    "phase_rigidity": np.float64,
}
"""Layers that a chart can have → their types; `Chart` explains them."""

MEMORY_LAYERS = tuple(LAYERS)[:-2]
"""Default layers of a chart in memory."""

DEFAULT_LAYERS = MEMORY_LAYERS[:-1]
"""Default layers of a chart that is written to a folder."""

_ROOT_LAYERS = {"kind", "abscissa", "damping_ratio", "real_roots"}  # layers that need the coefficients
_EIGENVECTOR_LAYERS = {"petermann", "phase_rigidity"}  # layers that need the matrices

DEFAULT_POINTS: Mapping[int, tuple[int, ...]] = {2: (400, 300), 3: (120, 100, 80)}
"""Number of axes → default numbers of points along them."""

MAX_DESIGNS = 10**9
"""Largest number of designs of a grid."""

MAX_AXIS_POINTS = 10**6
"""Largest number of points along one axis."""

MAX_TILES = 10**6
"""Largest number of tiles of a chart."""


@dataclass(frozen=True)
class Grid:
    """Values along two or three axes. The first index of an array belongs to the last axis, as in an image.

    Attributes:
        axes: names of the parameters.
        values: values along each axis.
    """

    axes: tuple[str, ...]
    values: tuple[Array, ...] = field(repr=False)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the arrays."""
        return tuple(len(v) for v in reversed(self.values))

    @property
    def size(self) -> int:
        """Number of designs."""
        return math.prod(self.shape)

    def columns(self, rows: range) -> dict[str, Array]:
        """Parameters of a few rows, of shape (1, n) for the first axis, and of shape (len(rows), 1) for the others."""
        indices = np.unravel_index(np.arange(rows.start, rows.stop), self.shape[:-1])
        slow_axes = zip(self.axes[:0:-1], self.values[:0:-1], indices, strict=True)
        return {self.axes[0]: self.values[0][None, :]} | {n: values[index][:, None] for n, values, index in slow_axes}

    def describe(self) -> dict[str, dict[str, Any]]:
        """Axis → its ends and its number of points."""
        axes = zip(self.axes, self.values, strict=True)
        return {n: {"min": float(v[0]), "max": float(v[-1]), "points": len(v)} for n, v in axes}

    def design(self, index: int) -> dict[str, float]:
        """Parameters of the design at an index of the flat arrays."""
        indices = np.unravel_index(index, self.shape)[::-1]
        return {n: float(v[k]) for n, v, k in zip(self.axes, self.values, indices, strict=True)}

    def tiles(self, points: int) -> list[range]:
        """All rows, in tiles of about this many points.

        Raises:
            InputError: for too many tiles.
        """
        rows_per_tile, rows = max(1, points // self.shape[-1]), range(self.size // self.shape[-1])
        if (count := len(rows[::rows_per_tile])) > MAX_TILES:
            raise input_error(
                f"found {points}, which makes {count} tiles; accepted: {MAX_TILES} tiles or fewer", "tile"
            )
        return [rows[k : k + rows_per_tile] for k in rows[::rows_per_tile]]


@dataclass(frozen=True)
class Tally:
    """Counts over some of the designs.

    Attributes:
        designs: number of designs.
        classes: number of designs in each class; empty without the layer ``kind``.
        satisfied: number of designs that satisfy every inequality; None without that layer.
        least: least abscissa of the designs that satisfy every inequality; nan if there is no such design.
        place: index of the design with this abscissa in the flat arrays; the first index if there are several such
            designs, -1 if there is none.
        fallbacks: number of designs whose roots were computed as eigenvalues of a companion matrix.
    """

    designs: int = 0
    classes: tuple[int, ...] = ()
    satisfied: int | None = None
    least: float = math.nan
    place: int = -1
    fallbacks: int = 0

    @property
    def shares(self) -> dict[str, float]:
        """Share of the designs in each class; empty without the layer ``kind``."""
        return {n: count / self.designs for n, count in zip(CLASSES, self.classes, strict=False)}


@dataclass(frozen=True)
class Survey:
    """The layers to compute for every design of a grid.

    Attributes:
        dtypes: layer → its type, for names among `LAYERS` and for quantities.
        quantities: name of an additional layer → its expression.
        formulas: functions that need no roots, including the coefficients.
        root_formulas: functions that need the roots.
    """

    problem: Posed
    grid: Grid
    dtypes: Mapping[str, np.dtype[Any]]
    quantities: Mapping[str, str]
    formulas: ArrayFunction = field(repr=False)
    root_formulas: ArrayFunction = field(repr=False)

    def compute(self, rows: range) -> tuple[dict[str, NDArray[Any]], Tally]:
        """The layers of a few rows, of shape (len(rows), n), and their counts."""
        shape, layers, fallbacks = (len(rows), self.grid.shape[-1]), self.dtypes.keys(), 0
        columns, model = {**self.problem.fixed, **self.grid.columns(rows)}, self.problem.model
        with np.errstate(all="ignore"):  # overflow counts as undefined
            values = self.formulas(columns)
            coefficients = [np.broadcast_to(values[n], shape) for n in model.coefficient_names() if n in values]
            needs_roots, root_quantities = self.root_formulas.names or _ROOT_LAYERS & layers, dict[str, Any]()
            if _EIGENVECTOR_LAYERS & layers or (needs_roots and model.polynomial is None):
                eigenvalues = find_eigenvalues(model, self.problem.parameter_set, columns)
                values["petermann"] = np.fmax.reduce(eigenvalues.petermann, axis=-1)
                values["phase_rigidity"] = np.fmin.reduce(eigenvalues.phase_rigidity, axis=-1)
                if model.polynomial is None:
                    root_quantities = describe_eigenvalues(eigenvalues.eigenvalues, model.is_complex)
            if {"kind", "real_roots"} & layers and model.polynomial is not None:
                values |= vars(classify(coefficients))
            if model.polynomial is not None and (self.root_formulas.names or {"abscissa", "damping_ratio"} & layers):
                root_quantities = vars(find_motion(coefficients))
                fallbacks = root_quantities["fallbacks"]
            if root_quantities:
                values |= root_quantities | self.root_formulas(columns | root_quantities)
            if {"satisfied", "margin"} & layers:
                margins = [-c.sign * values[_LIMIT + n] for n, c in limits_of(self.problem).items()]
                values["margin"] = reduce(np.minimum, margins, np.inf)
                values["satisfied"] = values["margin"] >= 0
            values |= {n: values[_QUANTITY + n] for n in self.quantities}
            full_arrays = {n: np.broadcast_to(values[n], shape) for n in layers}
            arrays = {n: np.ascontiguousarray(full_arrays[n], dtype) for n, dtype in self.dtypes.items()}
        return arrays, count_tile(arrays, rows.start * shape[1], fallbacks)


_QUANTITY, _LIMIT = "quantity ", "limit "
"""Prefixes that keep output names apart from parameters."""


def limits_of(problem: Posed) -> dict[str, Any]:
    """The inequality constraints."""
    return {n: c for n, c in problem.conditions.items() if not c.equality}


def plan_survey(
    problem: ProblemSource,
    axes: Sequence[str] | None = None,
    points: Sequence[int] | None = None,
    layers: Sequence[str] = DEFAULT_LAYERS,
    quantities: Mapping[str, str] | None = None,
    single_precision: bool = False,
) -> Survey:
    """Validate the arguments of `chart` and plan its survey.

    Args:
        single_precision: store numbers in single precision; see `chart` for the other arguments.

    Raises:
        InputError: unless two or three parameters are free and the axes name them; for bad numbers of points, unknown
            layers or bad expressions.
    """
    problem = pose(problem)
    names = axes_of(problem, axes)
    point_counts = _parse_point_counts(DEFAULT_POINTS[len(names)] if points is None else points, len(names))
    user_layers = {} if quantities is None else quantities
    faults = layer_faults(layers, list(LAYERS)) + table_faults(
        "quantities", user_layers, "{'wheel_load': 'load_front/2'}"
    )
    if not faults:
        reserved = {*LAYERS, *names, "about"}
        message = f"accepted: letters, digits and _, other than {' '.join(sorted(reserved))}"
        bad_names = [n for n in user_layers if n in reserved or not (n.isidentifier() and n.isascii())]
        faults = [Fault(f"found the name {n!r}; {message}", ("quantities",)) for n in bad_names]
        if not (layers or user_layers):
            faults.append(Fault(f"found none; accepted: some of {' '.join(LAYERS)}", ("layers",)))
    if faults:
        raise InputError(faults)
    expressions = {_QUANTITY + n: e for n, e in parse_all(problem, user_layers).items()}
    message = f"found {RADIUS}, which needs a search for every design; accepted: quantities with a formula"
    if faults := [Fault(message, ("quantities", n)) for n in user_layers if RADIUS in expressions[_QUANTITY + n].names]:
        raise InputError(faults)
    if {"satisfied", "margin"} & set(layers):
        expressions |= {_LIMIT + n: c for n, c in limits_of(problem).items()}
    root_expressions = {n: e for n, e in expressions.items() if set(ROOT_NAMES) & set(e.names)}
    if root_expressions or _ROOT_LAYERS & set(layers):
        expressions |= parse_all(problem, {n: n for n in problem.model.coefficient_names()})
    types = {n: np.dtype(LAYERS.get(n, np.float64)) for n in (*layers, *user_layers)}
    return Survey(
        problem,
        Grid(names, tuple(np.linspace(*problem.free[n], m) for n, m in zip(names, point_counts, strict=True))),
        {n: np.dtype(np.float32) if single_precision and d == np.float64 else d for n, d in types.items()},
        dict(user_layers),
        formulas=array_function(problem, {n: e for n, e in expressions.items() if n not in root_expressions}),
        root_formulas=array_function(problem, root_expressions),
    )


def layer_faults(names: Any, accepted: Collection[str]) -> list[Fault]:
    """Faults in a list of layers."""
    return list_faults("layers", names, "['kind', 'abscissa']") or [
        Fault(f"found {short(n)}; {suggest(n, accepted)}", ("layers",)) for n in names if n not in accepted
    ]


def axes_of(problem: Posed, axes: Sequence[str] | None = None) -> tuple[str, ...]:
    """The two or three free parameters of a problem, in the order of the axes.

    Raises:
        InputError: unless two or three parameters are free and the axes name them.
    """
    free_names = list(problem.free)
    if len(free_names) not in (2, 3):
        names_text = ", ".join(free_names) or "none"
        message = f"a grid needs two or three free parameters, and {len(free_names)} are free ({names_text})"
        fixed_names = [n for n in ("Fr", "v", *problem.fixed) if n in problem.fixed]
        advice = f"; write e.g. {example_of(problem.parameter_set[fixed_names[0]])[1]}" if fixed_names else ""
        raise input_error(message + ("; fix the others" if len(free_names) > 3 else advice), "parameters")
    if axes is not None and (list_faults("axes", axes, "") or sorted(map(str, axes)) != sorted(free_names)):
        raise input_error(f"found {axes!r}; accepted: {' and '.join(free_names)}", "axes")
    return tuple(axes or free_names)


def _parse_point_counts(points: Any, count: int) -> tuple[int, ...]:
    try:
        counts = tuple(map(operator.index, points))
    except (TypeError, ValueError):
        counts = ()
    if len(counts) != count or min(counts) < 2 or max(counts) > MAX_AXIS_POINTS or math.prod(counts) > MAX_DESIGNS:
        number = ("two", "three")[count - 2]
        accepted = (
            f"{number} whole numbers, each from 2 to {MAX_AXIS_POINTS}, with a product of {MAX_DESIGNS:.0e} or less"
        )
        raise input_error(f"found {points!r}; accepted: {accepted}", "points")
    return counts


def count_tile(layers: Mapping[str, NDArray[Any]], first_index: int, fallbacks: int = 0) -> Tally:
    """Count over a tile; its first design has the index `first_index` in the flat arrays of the chart."""
    kind, satisfied, abscissa = (layers.get(n) for n in ("kind", "satisfied", "abscissa"))
    least_abscissa, least_index = math.nan, -1
    if abscissa is not None:
        is_allowed = np.isfinite(abscissa) & (True if satisfied is None else satisfied)
        allowed = np.where(is_allowed, abscissa, np.inf)
        best_index = int(allowed.argmin())
        if allowed.flat[best_index] < np.inf:
            least_abscissa, least_index = float(allowed.flat[best_index]), first_index + best_index
    return Tally(
        next(iter(layers.values())).size,
        () if kind is None else tuple(np.bincount(kind.ravel(), minlength=len(CLASSES)).tolist()),
        None if satisfied is None else int(np.count_nonzero(satisfied)),
        least_abscissa,
        least_index,
        fallbacks,
    )


def add_tallies(tallies: Iterable[Tally]) -> Tally:
    """Add the counts of several tiles, in any order."""
    tally_list = [*tallies]
    best_tally = min((t for t in tally_list if t.place >= 0), key=lambda t: (t.least, t.place), default=Tally())
    satisfied_counts = [t.satisfied for t in tally_list if t.satisfied is not None]
    return Tally(
        sum(t.designs for t in tally_list),
        tuple(map(sum, zip(*(t.classes for t in tally_list), strict=True))),
        sum(satisfied_counts) if satisfied_counts else None,
        best_tally.least,
        best_tally.place,
        sum(t.fallbacks for t in tally_list),
    )
