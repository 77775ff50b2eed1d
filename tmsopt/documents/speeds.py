"""The speeds at which the motion of a design changes, and its roots over a parameter."""

import math
from collections.abc import Iterator, Sequence

from tmsopt import plots
from tmsopt.documents.blocks import (
    Block,
    Cell,
    Chapter,
    Figure,
    Level,
    Parts,
    Row,
    Sentence,
    TableBlock,
    count_things,
)
from tmsopt.documents.design_rows import format_frequency, format_multiplicity
from tmsopt.dynamics.crossings import Crossing, Stretch
from tmsopt.dynamics.growth import Growth
from tmsopt.dynamics.speeds import Speeds, speed_of
from tmsopt.models import in_words_of
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, common_unit, unit_of

_DIGITS = 15


def write_speeds(found: Speeds, level: Level) -> Parts:
    """The stable and the heavily damped bands, and every speed with what happens there."""
    unit, real = unit_of(found.problem.posed, found.parameter), found.problem.model.carrier is None
    stable = f"stable {_format_ranges(found.stable, unit)}"
    yield found.parameter, stable, count_things(found.found, "critical value")
    end = f" < {unit.number(found.upper, 6)}" if math.isfinite(found.upper) else ""
    within = f" {unit.text}" if unit.text else ""
    asked = f"{unit.number(found.lower, 6)} < {found.parameter}{end}{within}"
    yield Chapter("range", "Answer")
    yield f"{asked}, by exact root isolation for the numbers as stored"
    yield Sentence(found.problem.model.omits, "model")
    yield Chapter("speeds", "Critical speeds", "wide")
    yield _tabulate_crossings(found, unit, real)
    yield Chapter("bands")
    yield from _list_identities(found)
    yield Sentence(_describe_bands(found, found.stable), "stable", "good" if found.stable else "bad")
    if found.always and (found.zeros or "weave" in found.always):
        yield Sentence(_describe_bands(found, found.marginal), _describe_marginal(found), "doubt")
    if real:
        yield Sentence(_describe_bands(found, found.heavily_damped), "heavily damped")
    if level == "page":
        yield Chapter("picture")
        yield Figure(plots.draw_speeds, found, f"Roots over {found.parameter}")


def _tabulate_crossings(found: Speeds, unit: Unit, real: bool) -> Block | str:
    if not found.found:
        root, axis = ("root", "imaginary") if real else ("eigenfrequency", "real")
        others = f"besides what holds for every {found.parameter}, " if found.always else ""
        return f"{others}no {root} meets another or the {axis} axis"
    held = {n: x for n, x in found.parameters.items() if n != found.parameter}
    per = common_unit(found.problem.posed, "abscissa", held)
    roots = f"root {per.text}".rstrip() if real else "eigenfrequency"
    rows: list[Row] = [("", f"{found.parameter} {unit.text}".rstrip(), roots, "")]
    for c in found.found:
        place = _format_root(c, per) if real else format_frequency(-c.root.im, c.root.re, 12, c.root.multiplicity)
        change = "stability changes" if c.changes else "rightmost" if c.rightmost else ""
        rows.append((in_words_of(found.problem.model, c.kind), Cell(c.at, unit, _DIGITS), place, change))
    return TableBlock(rows, "Speeds at which the motion changes", needs=(3, 3, 1, 2))


def write_growth(found: Growth, _level: Level) -> Parts:
    """Over what, where the design stands, and the stable and the heavily damped bands."""
    unit, real = unit_of(found.problem.posed, found.over.name), found.problem.model.carrier is None
    yield f"over {found.over.name}", f"stable {_format_ranges(found.stable, unit)}", found.structure
    critical = f", critical value {unit.show(found.critical, 8)}" if math.isfinite(found.critical) else ""
    over = f"over {found.over.name} from {unit.number(found.values[0], 6)} to {unit.show(found.values[-1], 6)}"
    at = f"{found.over.name} = {unit.show(found.design, 8)}, structure {found.structure}{critical}"
    yield f"{'roots' if real else 'eigenfrequencies'} {over}"
    yield Sentence(at, "the design")
    for name, bands in [("stable", found.stable), ("heavily damped", found.heavily_damped)][: 2 if real else 1]:
        listed = ", ".join(f"{unit.number(low, 8)} to {unit.show(high, 8)}" for low, high in bands)
        yield Sentence(listed or "nowhere", name)


def _list_identities(found: Speeds) -> Iterator[str]:
    """What holds whatever the parameter; the places in the table are those where more happens."""
    name = found.parameter
    if found.zeros:
        times = f", {found.zeros}-fold" if found.zeros > 1 else ""
        yield f"s = 0 is a root for every {name}{times}"
    if "weave" in found.always:
        yield f"roots are mirrored in the imaginary axis for every {name}: no design is better than marginally stable"
    if "EP2" in found.always:
        yield f"a root is multiple for every {name}"
    if "infinity" in found.always:
        yield f"a root is at infinity for every {name}"


def _describe_marginal(found: Speeds) -> str:
    """What the bands mean in which roots stay on the imaginary axis."""
    if found.zeros > 1:
        kind = "marginally stable" if "weave" in found.always else "stable"
        return f"{kind} but for the {found.zeros}-fold root 0"
    return "marginally stable (no root right of the imaginary axis, those on it simple)"


def _format_root(c: Crossing, unit: Unit) -> str:
    if c.kind == "infinity":
        return "infinite"
    times = format_multiplicity(c.root.multiplicity)
    if not c.root.im:
        return f"{unit.number(c.root.re, 12)}{times}"
    real = f"{unit.number(c.root.re, 12)} " if c.root.re else ""
    return f"{real}± {unit.number(c.root.im, 12)}i{times}"


def _describe_bands(found: Speeds, bands: Sequence[Stretch]) -> str:
    return _format_bands(bands, (found.lower, found.upper), unit_of(found.problem.posed, found.parameter))


def _format_ranges(bands: Sequence[Stretch], unit: Unit) -> str:
    listed = ", ".join(f"{unit.number(low)} to {unit.number(high)}" for low, high in bands)
    return f"{listed} {unit.text}".strip() if listed else "nowhere"


def _format_bands(bands: Sequence[Stretch], within: Stretch, unit: Unit, digits: int = 8) -> str:
    """Bands as a reader writes them."""
    parts = []
    for low, high in bands:
        begin = "" if low == within[0] else f"from {unit.number(low, digits)}"
        end = "" if high == within[1] else f"to {unit.number(high, digits)}"
        alone = begin.removeprefix("from") == end.removeprefix("to")  # one speed, as far as its digits tell
        parts.append(begin.replace("from", "at") if begin and alone else f"{begin} {end}".strip() or "everywhere")
    text = ", ".join(parts) or "nowhere"
    return text if text in ("nowhere", "everywhere") else f"{text} {unit.text}".rstrip()


def describe_range(stable: Sequence[Stretch], solution: Solution) -> str:
    """The bands of its speed in which a design is stable, and its own speed."""
    of = solution.problem.posed.parameter_set
    name = speed_of(of)
    assert name is not None
    unit, ends = unit_of(solution.problem.posed, name), of[name].range
    bands = _format_bands(stable, (ends.lower, ends.upper), unit, 5)
    return f"stable in {name}: {bands}; this design at {unit.show(solution.parameters[name])}"
