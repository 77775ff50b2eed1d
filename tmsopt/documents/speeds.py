"""The speeds at which the motion of a design changes, and its roots over a parameter."""

import math
from collections.abc import Iterator, Mapping, Sequence

from tmsopt import plots
from tmsopt.documents.blocks import Badge, Block, Cell, Chapter, Figure, Level, Sentence, TableBlock, count_things
from tmsopt.documents.design_rows import format_frequency, format_multiplicity
from tmsopt.documents.maker import Maker, remove_titles
from tmsopt.dynamics.crossings import Crossing, Stretch
from tmsopt.dynamics.growth import Growth
from tmsopt.dynamics.speeds import Speeds, speed_of
from tmsopt.models import in_words_of
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, common_unit, unit_of

_DIGITS = 15


def summarise_speeds(found: Speeds) -> Iterator[Badge]:
    """Where the design is stable."""
    yield Badge(found.parameter)
    yield Badge(f"stable {_format_ranges(found.stable, unit_of(found.problem.posed, found.parameter))}")
    yield Badge(count_things(len(found.found), "critical value"))


def write_speeds(found: Speeds, level: Level) -> Iterator[Chapter]:
    """The stable and the heavily damped bands, and every speed with what happens there."""
    unit, real = unit_of(found.problem.posed, found.parameter), found.problem.model.carrier is None
    end = f" < {unit.number(found.upper, 6)}" if math.isfinite(found.upper) else ""
    within = f" {unit.text}" if unit.text else ""
    asked = f"{unit.number(found.lower, 6)} < {found.parameter}{end}{within}"
    answer: list[Block] = [Sentence(f"{asked}, by exact root isolation, with the parameters in double precision")]
    answer += [Sentence(found.problem.model.omits, "model")] if found.problem.model.omits else []
    yield Chapter("range", tuple(answer), "Answer")
    yield Chapter("speeds", (_tabulate_crossings(found, unit, real),), "Critical speeds", "wide")
    bands = [Sentence(text) for text in _list_identities(found)]
    bands.append(Sentence(_describe_bands(found, found.stable), "stable", "good" if found.stable else "bad"))
    if found.always and (found.zeros or "weave" in found.always):
        bands.append(Sentence(_describe_bands(found, found.marginal), _describe_marginal(found), "doubt"))
    if real:
        bands.append(Sentence(_describe_bands(found, found.heavily_damped), "heavily damped"))
    yield Chapter("bands", tuple(bands))
    if level == "page":
        caption = f"Roots over {found.parameter}"
        yield Chapter("picture", (Figure(lambda: plots.draw_speeds(remove_titles(found)), caption),))


def _tabulate_crossings(found: Speeds, unit: Unit, real: bool) -> Block:
    if not found.found:
        root, axis = ("root", "imaginary") if real else ("eigenfrequency", "real")
        others = f"besides what holds for every {found.parameter}, " if found.always else ""
        return Sentence(f"{others}no {root} meets another or the {axis} axis")
    held = {n: x for n, x in found.parameters.items() if n != found.parameter}
    per = common_unit(found.problem.posed, "abscissa", held)
    roots = f"root {per.text}".rstrip() if real else "eigenfrequency"
    rows: list[Sequence[Cell | str]] = [("", f"{found.parameter} {unit.text}".rstrip(), roots, "")]
    for c in found.found:
        place = _format_root(c, per) if real else format_frequency(-c.root.im, c.root.re, 12, c.root.multiplicity)
        rows.append((in_words_of(found.problem.model, c.kind), Cell(c.at, unit, _DIGITS), place, _describe_change(c)))
    return TableBlock(rows, "Speeds at which the motion changes", needs=(3, 3, 1, 2))


def summarise_growth(found: Growth) -> Iterator[Badge]:
    """Where the design is stable."""
    yield Badge(f"over {found.over.name}")
    yield Badge(f"stable {_format_ranges(found.stable, unit_of(found.problem.posed, found.over.name))}")
    yield Badge(found.structure)


def write_growth(found: Growth, _level: Level) -> Iterator[Chapter]:
    """Over what, where the design stands, and the stable and the heavily damped bands."""
    unit, real = unit_of(found.problem.posed, found.over.name), found.problem.model.carrier is None
    critical = f", critical value {unit.show(found.critical, 8)}" if math.isfinite(found.critical) else ""
    over = f"over {found.over.name} from {unit.number(found.values[0], 6)} to {unit.show(found.values[-1], 6)}"
    at = f"{found.over.name} = {unit.show(found.design, 8)}, structure {found.structure}{critical}"
    lines = [Sentence(f"{'roots' if real else 'eigenfrequencies'} {over}"), Sentence(at, "the design")]
    for name, bands in [("stable", found.stable), ("heavily damped", found.heavily_damped)][: 2 if real else 1]:
        listed = ", ".join(f"{unit.number(low, 8)} to {unit.show(high, 8)}" for low, high in bands)
        lines.append(Sentence(listed or "nowhere", name))
    yield Chapter("answer", tuple(lines))


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


def _describe_change(c: Crossing) -> str:
    if c.changes:
        return "stability changes"
    return "rightmost" if c.rightmost else ""


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


MAKERS: Mapping[str, Maker] = {
    "Speeds": Maker(summarise_speeds, write_speeds, "draw_speeds"),
    "Growth": Maker(summarise_growth, write_growth, "draw_growth"),
}
