"""The speeds at which the motion of a design changes, as text."""

import math
from collections.abc import Iterator, Sequence

from tmsopt.dynamics.crossings import Crossing, Stretch
from tmsopt.dynamics.growth import Growth
from tmsopt.dynamics.speeds import Speeds, speed_of
from tmsopt.models import in_words_of
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, unit_of, unit_of_all
from tmsopt.report.solution.rows import frequency_of
from tmsopt.report.text import columns, model_lines

_DIGITS = 15


def speeds_table(found: Speeds) -> str:
    """Every speed with what happens there, then the stable and the heavily damped bands.

    Example:
        >>> print(tmsopt.report.speeds_table(tmsopt.speeds("problems/benchmark.toml")).splitlines()[-2])
        stable: from 2.8410083 m/s

    More: docs/explanation/weave_and_capsize.md
    """
    unit = unit_of(found.problem.posed, found.parameter)
    end = f" < {unit.number(found.upper, 6)}" if math.isfinite(found.upper) else ""
    within = f" {unit.text}" if unit.text else ""
    lines = [
        found.problem.title or "untitled problem",
        f"{unit.number(found.lower, 6)} < {found.parameter}{end}{within}, "
        "by exact root isolation for the numbers as stored",
        *model_lines(found.problem.model),
        "",
    ]
    real = found.problem.model.carrier is None
    held = {n: x for n, x in found.parameters.items() if n != found.parameter}
    per = unit_of_all(found.problem.posed, "abscissa", held)
    roots = "eigenfrequency" if not real else f"root {per.text}".rstrip()
    rows: list[Sequence[str]] = [("", f"{found.parameter} {unit.text}".rstrip(), roots, "")]
    for c in found.found:
        place = _root(c, per) if real else frequency_of(-c.root.im, c.root.re, 12, c.root.multiplicity)
        rows.append((in_words_of(found.problem.model, c.kind), unit.number(c.at, _DIGITS), place, _meaning(c)))
    lines += [*columns(rows), ""] if found.found else [_nothing(found), ""]
    lines += list(_always(found))
    lines.append(f"stable: {_bands(found, found.stable)}")
    if found.always and (found.zeros or "weave" in found.always):
        lines.append(f"{_marginally(found)}: {_bands(found, found.marginal)}")
    if real:
        lines.append(f"heavily damped: {_bands(found, found.heavily_damped)}")
    return "\n".join(line.rstrip() for line in lines)


def growth_table(found: Growth) -> str:
    """Over what, where the design stands, and the stable and the heavily damped bands.

    Example:
        >>> print(tmsopt.report.growth_table(tmsopt.growth("problems/benchmark.toml")))
        roots over v ...
        the design: v = 4 m/s, structure pair, critical value 2.8410083 m/s
        stable: 2.8410083 to 5 m/s
        heavily damped: nowhere

    More: docs/explanation/weave_and_capsize.md
    """
    unit = unit_of(found.problem.posed, found.over.name)
    critical = f", critical value {unit.show(found.critical, 8)}" if math.isfinite(found.critical) else ""
    roots = "roots" if found.problem.model.carrier is None else "eigenfrequencies"
    lines = [
        f"{roots} over {found.over.name} from {unit.number(found.values[0], 6)} to {unit.show(found.values[-1], 6)}",
        f"the design: {found.over.name} = {unit.show(found.design, 8)}, structure {found.structure}{critical}",
    ]
    kinds = [("stable", found.stable), ("heavily damped", found.heavily_damped)]
    for name, bands in kinds if found.problem.model.carrier is None else kinds[:1]:
        words = ", ".join(f"{unit.number(low, 8)} to {unit.show(high, 8)}" for low, high in bands)
        lines.append(f"{name}: {words or 'nowhere'}")
    return "\n".join(lines)


def _nothing(found: Speeds) -> str:
    real = found.problem.model.carrier is None
    root, axis = ("root", "imaginary") if real else ("eigenfrequency", "real")
    beside = f"beside what holds for every {found.parameter}, " if found.always else ""
    return f"{beside}no {root} meets another or the {axis} axis"


def _always(found: Speeds) -> Iterator[str]:
    """What holds whatever the parameter; the places above are those where more happens."""
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


def _marginally(found: Speeds) -> str:
    """What the bands mean in which roots stay on the imaginary axis."""
    if found.zeros > 1:
        kind = "marginally stable" if "weave" in found.always else "stable"
        return f"{kind} but for the {found.zeros}-fold root 0"
    return "marginally stable (no root right of the imaginary axis, those on it simple)"


def _root(c: Crossing, unit: Unit) -> str:
    if c.kind == "infinity":
        return "infinite"
    times = f" ({c.root.multiplicity}-fold)" if c.root.multiplicity > 1 else ""
    if not c.root.im:
        return f"{unit.number(c.root.re, 12)}{times}"
    real = f"{unit.number(c.root.re, 12)} " if c.root.re else ""
    return f"{real}± {unit.number(c.root.im, 12)}i{times}"


def _meaning(c: Crossing) -> str:
    if c.changes:
        return "stability changes"
    return "rightmost" if c.rightmost else ""


def _bands(found: Speeds, bands: Sequence[Stretch]) -> str:
    return _written(bands, (found.lower, found.upper), unit_of(found.problem.posed, found.parameter))


def _written(bands: Sequence[Stretch], within: Stretch, unit: Unit, digits: int = 8) -> str:
    """Bands as a reader writes them."""
    words = []
    for low, high in bands:
        begin = "" if low == within[0] else f"from {unit.number(low, digits)}"
        end = "" if high == within[1] else f"to {unit.number(high, digits)}"
        alone = begin.removeprefix("from") == end.removeprefix("to")  # one speed, as far as its digits tell
        words.append(begin.replace("from", "at") if begin and alone else f"{begin} {end}".strip() or "everywhere")
    text = ", ".join(words) or "nowhere"
    return text if text in ("nowhere", "everywhere") else f"{text} {unit.text}".rstrip()


def range_line(stable: Sequence[Stretch], solution: Solution) -> str:
    """In one line: the bands of its speed in which a design is stable, and its own speed."""
    of = solution.problem.posed.parameter_set
    name = speed_of(of)
    assert name is not None
    unit, ends = unit_of(solution.problem.posed, name), of[name].range
    bands = _written(stable, (ends.lower, ends.upper), unit, 5)
    return f"stable in {name}: {bands}; this design at {unit.show(solution.parameters[name])}"
