"""How far the boundaries of a design are."""

import math
from collections.abc import Sequence

from tmsopt.boundaries.nearest import Nearest, Robustness
from tmsopt.documents.blocks import Cell, Chapter, Level, Parts, Sentence, TableBlock, judge
from tmsopt.models import in_words_of, words_of
from tmsopt.problem.unit_system import unit_of

_MAIN = 0.5
"""Share of the largest change above which a parameter is named in the headline."""
_WIDE = 12
"""Parameters up to which each has a column; of more, each has a row."""
_LITTLE = 1e-3
"""Share of the largest change below which one is 0."""
_NAMED = 3
"""Parameters named in the headline at most."""
_OF_H = {"weave": "a real eigenfrequency"}
_ON_EDGE = {"weave": "a pair of roots on the imaginary axis", "capsize": "a root 0", "infinity": "a root at infinity"}


def write_robustness(found: Robustness, _level: Level) -> Parts:
    """The sentence, then the nearest point of every boundary."""
    radius = _format_value("radius" if found.stable else "to stability", found.limit.distance)
    yield judge(found.stable, "stable"), radius, f"to {found.limit.kind}" if found.limit.found else ""
    yield Sentence(describe_robustness(found), "robustness", "answer")
    yield Chapter("boundaries")
    yield tabulate_boundaries(found)


def describe_robustness(found: Robustness, on_edge: bool = False) -> str:
    """How large a change ends stability, or brings it, how, and by which parameters mostly.

    Args:
        on_edge: whether the solution is on the edge of stability by more than its numbers as stored tell.
    """
    if found.edges:
        edge = _ON_EDGE if found.problem.model.carrier is None else _OF_H
        on = " and ".join(edge[kind] for kind in found.edges)
        if found.zeros:
            return f"at its edge already: {', '.join(f'{n} = 0' for n in found.zeros)} ({on})"
        return f"none, on the edge of stability already, with {on}"
    if on_edge:
        return "none, on the edge of stability already, up to rounding errors"
    limit, other = found.limit, "unstable" if found.stable else "stable"
    if not limit.found:
        return f"{'' if found.stable else 'not stable; '}no change in reach of the search makes it {other}"
    if not found.stable:
        return f"not stable; {_describe_size(found)} makes it stable{_name_largest(limit)}"
    how = words_of(found.problem.model).get(limit.kind, "a root passes through infinity, a0 = 0")
    return f"{_describe_size(found)} makes it unstable ({how}){_name_largest(limit)}"


def tabulate_boundaries(found: Robustness) -> TableBlock:
    """The nearest point of every boundary: its distance and the change of each parameter."""
    names, model = list(found.weights), found.problem.model
    kinds: tuple[Nearest, ...] = (found.weave, found.capsize, found.infinity, found.heavy_damping)
    units = {name: unit_of(found.problem.posed, name) for name in names}
    rows: list[Sequence[str]] = [("relative changes" if found.relative else "changes over weights", "distance", *names)]
    places: list[Sequence[str]] = []
    for n in kinds if model.carrier is None else kinds[:1]:
        distance = "" if n.found else "none found"
        moves = ["" for _ in names]
        if n.found and n.distance > 0:
            distance = _format_percent(n.distance) if found.relative else f"{n.distance:.4g}"
            moves = _format_moves(n, found.relative)
            places.append(
                (
                    f"values at {in_words_of(model, n.kind)}",
                    "",
                    *(units[name].show(n.parameters[name], 8) for name in names),
                )
            )
        rows.append((_name_row(n, found), distance, *moves))
    rows += [("weight", "", *(units[name].show(found.weights[name], 6) for name in names)), *places]
    transposed = len(names) > _WIDE
    return TableBlock(list(zip(*rows, strict=True)) if transposed else rows, "Nearest points of the boundaries")


def write_nearest(found: Nearest, _level: Level) -> Parts:
    """How far one boundary is, then its nearest point and the change of each parameter in weights."""
    yield found.kind, _format_value("distance", found.distance) if found.found else "none found"
    if not found.found:
        yield f"no point of the boundary of {found.kind} was found"
        return
    crossing = "" if found.refined else ", the nearest crossing seen"
    yield Sentence(f"{found.distance:.6g} in weights{crossing}", f"to {found.kind}", "answer")
    yield Chapter("boundary")
    rows = [(n, Cell(found.parameters[n], digits=8), f"{change:+.4g}") for n, change in found.direction.items()]
    yield TableBlock((("", "there", "change in weights"), *rows), "Nearest point of the boundary")


def _name_row(n: Nearest, found: Robustness) -> str:
    to = "at the edge of" if n.distance == 0 else "change to"
    if n.kind != "heavy damping":
        return f"{to} {in_words_of(found.problem.model, n.kind)}"
    return f"{to} {n.kind}" if n.distance == 0 else f"change {'out of' if found.heavily_damped else 'into'} {n.kind}"


def _format_moves(n: Nearest, relative: bool) -> list[str]:
    """The change of each parameter; 0 for one that is too little to matter."""
    largest = max(map(abs, n.direction.values()))
    shown = (x if abs(x) >= _LITTLE * largest else 0.0 for x in n.direction.values())
    return ["0" if x == 0 else _format_percent(x, "+") if relative else f"{x:+.3g}" for x in shown]


def _name_largest(limit: Nearest) -> str:
    """The parameters that change most."""
    changes = sorted(limit.direction.items(), key=lambda item: -abs(item[1]))
    largest = abs(changes[0][1])
    named = [n for n, x in changes if largest > 0 and abs(x) >= _MAIN * largest]
    return f"; largest changes: {', '.join(named[:_NAMED])}" if named and len(changes) > 1 else ""


def _describe_size(found: Robustness) -> str:
    if found.relative:
        return f"a change of {_format_percent(found.limit.distance)}"
    return f"a change of {found.limit.distance:.2g} times {'your' if found.problem.weights else 'the'} weights"


def _format_percent(x: float, sign: str = "") -> str:
    """Two significant digits at least."""
    digits = 1 if x == 0 else max(1 - math.floor(math.log10(abs(100 * x))), 0)
    return f"{100 * x:{sign}.{digits}f} %"


def _format_value(name: str, value: float) -> str:
    return f"{name} = {value:.5g}" if math.isfinite(value) else f"no {name}"
