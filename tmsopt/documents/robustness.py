"""Documents on the distances from a design to the boundaries of stability."""

import math
from collections.abc import Iterator, Sequence

from tmsopt.boundaries.nearest import Nearest, Robustness
from tmsopt.documents.blocks import Cell, Chapter, Level, Parts, Sentence, TableBlock, write_verdict
from tmsopt.models import Model, in_words_of, words_of
from tmsopt.problem.unit_system import unit_of

_MAIN_SHARE = 0.5
"""The headline names a parameter whose change is at least this share of the largest change."""
_MAX_COLUMNS = 12
"""With more parameters, the table has a row instead of a column for each parameter."""
_ZERO_SHARE = 1e-3
"""A change that is less than this share of the largest change is shown as 0."""
_MAX_NAMES = 3
"""Maximum number of parameters that the headline names."""
_EDGE_OF_H = {"weave": "a real eigenfrequency"}
_EDGE = {"weave": "a pair of roots on the imaginary axis", "capsize": "a root 0", "infinity": "a root at infinity"}
"""Kind of boundary → what a design on this boundary has; for a complex H, `_EDGE_OF_H`."""


def write_robustness(robustness: Robustness, _level: Level) -> Parts:
    """Write one sentence, then the nearest point of every boundary."""
    radius = _format_value("radius" if robustness.stable else "to stability", robustness.limit.distance)
    yield (
        write_verdict(robustness.stable, "stable"),
        radius,
        f"to {robustness.limit.kind}" if robustness.limit.found else "",
    )
    yield Sentence(describe_robustness(robustness), "robustness", "answer")
    yield Chapter("boundaries")
    yield from tabulate_boundaries(robustness)


def describe_robustness(robustness: Robustness, on_edge: bool = False) -> str:
    """Describe the smallest change that makes a design unstable (or stable), its cause, and its main parameters.

    Args:
        on_edge: whether the ideal design is on the edge of stability; its rounded numbers may lie next to the edge.
    """
    is_complex = robustness.problem.model.is_complex
    threshold = f"none: the {robustness.problem.model.noun} is on the edge of stability"
    if robustness.edges:
        edge = _EDGE_OF_H if is_complex else _EDGE
        edge_names = " and ".join(edge[kind] for kind in robustness.edges)
        if robustness.zeros:
            zeros = ", ".join(f"{n} = 0" for n in robustness.zeros)
            return f"{threshold}, because {zeros} ({edge_names})"
        return f"{threshold}, with {edge_names}"
    if on_edge:
        return f"{threshold}, up to rounding errors"
    unstable = "with gain" if is_complex else "not stable"
    limit, new_state = robustness.limit, "unstable" if robustness.stable else "stable"
    if not limit.found:
        return f"{'' if robustness.stable else f'{unstable}; '}the search found no change that makes it {new_state}"
    if not robustness.stable:
        return f"{unstable}; {_describe_size(robustness)}{_name_largest(limit)} makes it stable"
    cause = words_of(robustness.problem.model).get(limit.kind, "a root at infinity, a0 = 0")
    return f"{_describe_size(robustness)}{_name_largest(limit)} makes it unstable ({cause})"


def tabulate_boundaries(robustness: Robustness) -> Iterator[TableBlock]:
    """Tabulate the nearest point of every boundary: its distance and the changes, then the values of the parameters."""
    names, model = list(robustness.weights), robustness.problem.model
    boundaries = (robustness.weave, robustness.capsize, robustness.infinity, robustness.heavy_damping)
    units = {name: unit_of(robustness.problem.posed, name) for name in names}
    heading = "relative changes" if robustness.relative else "changes divided by weights"
    changes: list[Sequence[str]] = [(heading, "distance", *names)]
    weights = (units[name].show(robustness.weights[name], 6) for name in names)
    values: list[Sequence[str]] = [("values", *names), ("changes are divided by", *weights)]
    for nearest in boundaries if not model.is_complex else boundaries[:1]:
        distance = "0" if nearest.found else "none found"
        cells = ["" for _ in names]
        if nearest.found and nearest.distance > 0:
            distance = _format_percent(nearest.distance) if robustness.relative else f"{nearest.distance:.4g}"
            cells = _format_changes(nearest, robustness.relative)
            point = (units[name].show(nearest.parameters[name], 8) for name in names)
            values.append((f"nearest point with {_name_boundary(nearest, model)}", *point))
        changes.append((_name_row(nearest, robustness), distance, *cells))
    for rows, caption in (
        (changes, "Smallest changes to the boundaries"),
        (values, "Nearest points of the boundaries"),
    ):
        yield TableBlock(list(zip(*rows, strict=True)) if len(names) > _MAX_COLUMNS else rows, caption)


def write_nearest(nearest: Nearest, _level: Level) -> Parts:
    """Write the distance to one boundary, then its nearest point and the change of each parameter over its weight."""
    yield nearest.kind, _format_value("distance", nearest.distance) if nearest.found else "none found"
    if not nearest.found:
        yield f"no point of the boundary of {nearest.kind} was found"
        return
    doubt = "" if nearest.refined else ", to the nearest crossing found"
    yield Sentence(
        f"{nearest.distance:.6g} (changes are divided by weights){doubt}", f"distance to {nearest.kind}", "answer"
    )
    yield Chapter("boundary")
    rows = [(n, Cell(nearest.parameters[n], digits=8), f"{change:+.4g}") for n, change in nearest.direction.items()]
    yield TableBlock((("parameter", "value", "change divided by weight"), *rows), "Nearest point of the boundary")


def _name_boundary(nearest: Nearest, model: Model) -> str:
    return "a root at infinity" if nearest.kind == "infinity" else in_words_of(model, nearest.kind)


def _name_row(nearest: Nearest, robustness: Robustness) -> str:
    if nearest.kind == "heavy damping":
        return f"change {'out of' if robustness.heavily_damped else 'into'} {nearest.kind}"
    return f"change to reach {_name_boundary(nearest, robustness.problem.model)}"


def _format_changes(nearest: Nearest, relative: bool) -> list[str]:
    """List the change of each parameter; a negligible change is 0."""
    largest = max(map(abs, nearest.direction.values()))
    changes = (x if abs(x) >= _ZERO_SHARE * largest else 0.0 for x in nearest.direction.values())
    return ["0" if x == 0 else _format_percent(x, "+") if relative else f"{x:+.3g}" for x in changes]


def _name_largest(limit: Nearest) -> str:
    """Name the parameters that change most."""
    changes = sorted(limit.direction.items(), key=lambda item: -abs(item[1]))
    largest = abs(changes[0][1])
    names = [n for n, x in changes if largest > 0 and abs(x) >= _MAIN_SHARE * largest]
    return f", mostly in {' and '.join(names[:_MAX_NAMES])}," if names and len(changes) > 1 else ""


def _describe_size(robustness: Robustness) -> str:
    if robustness.relative:
        return f"a change of {_format_percent(robustness.limit.distance)}"
    return (
        f"a change of {robustness.limit.distance:.2g} times {'your' if robustness.problem.weights else 'the'} weights"
    )


def _format_percent(x: float, sign: str = "") -> str:
    """Write a percentage with at least two significant digits."""
    digits = 1 if x == 0 else max(1 - math.floor(math.log10(abs(100 * x))), 0)
    return f"{100 * x:{sign}.{digits}f} %"


def _format_value(name: str, value: float) -> str:
    return f"{name} = {value:.5g}" if math.isfinite(value) else f"no {name}"
