"""How a design moves: the speeds at which that changes, its roots over a parameter, its motion after a push."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

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
    judge,
)
from tmsopt.documents.design_rows import format_frequency, format_multiplicity, format_root
from tmsopt.documents.tables import tabulate_records
from tmsopt.dynamics.crossings import Crossing, Stretch
from tmsopt.dynamics.growth import Growth
from tmsopt.dynamics.speeds import Speeds, speed_of
from tmsopt.models import in_words_of
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, common_unit, unit_of
from tmsopt.problem.verdict.stability import MARGINAL, UNSTABLE, power_of_t

if TYPE_CHECKING:
    from tmsopt.dynamics import ModeShape, Simulation

_ALL = 15  # digits of a critical speed, which is known to all of them
_WORDS = {"phi": "lean phi", "delta": "steer delta", "T_phi": "lean torque", "T_delta": "steer torque"}
_COUNTS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}
_STEEP = 20.0  # degrees beyond which the equations, which are linear, say little
_DEGREES = Unit("deg")
_ROWS, _SHAPES = 8, 4  # of each table, coordinates of a shape, if not full
_NOTHING = 1e-12  # of a root: a real part so small is rounding, and on the axis beside the largest


def write_simulation(motion: "Simulation", level: Level) -> Parts:
    """What sets a design moving, peak, overshoot and settling time of each angle and torque, and the modes."""
    units = motion.units
    over = f"over {motion['t'][-1]:.4g} {units.get('t', '')}".rstrip()
    peaks = (f"peak {m.name} = {m.peak:.4g} {units.get(m.name, '')}".rstrip() for m in motion.measures[:2])
    yield over, *peaks, motion.structure, judge(motion.stable, "stable")
    time, name = _unit_in(motion, "t").show(motion["t"][-1]), speed_of(motion.problem.posed.parameter_set)
    at = f" at {name} = {unit_of(motion.problem.posed, name).show(motion.parameters[name])}" if name else ""
    yield f"motion over {time}{at} {_describe_cause(motion)}"
    yield Sentence(motion.problem.model.omits, "model")
    if level == "page":
        yield Chapter("picture")
        yield Figure(plots.draw_motion, motion, "The motion")
    yield Chapter("peaks", width="wide")
    yield TableBlock([*_list_peaks(motion)], "Peaks and settling times", most=_ROWS)
    yield Chapter("modes", width="wide")
    yield TableBlock([*_list_modes(motion, level != "brief")], "Modes", most=_ROWS)
    yield Chapter("notes")
    yield from _write_notes(motion)
    if level == "page":
        yield from tabulate_records(motion)


def _describe_cause(motion: "Simulation") -> str:
    """In words."""
    asked, time = motion.disturbance, motion.units.get("t", "")
    torque = "N m" if time == "s" else "m_B g w"
    said = [f"{_WORDS.get(name, name)} = {_unit_in(motion, name).show(x)}" for name, x in asked.start.items()]
    for name, push in (("steer", asked.push), ("lean", asked.lean_push)):
        said += [f"an impulse of {name} torque of {push:.6g} {torque} {time}"] if push else []
    said = [f"from {' and '.join(said) or 'rest'}"]
    if asked.noise:
        root = "√s" if time == "s" else "(w/g)^(1/4)"
        said.append(f"in white noise of steer torque of {asked.noise:.6g} {torque} {root} (seed {asked.seed})")
    return ", ".join(said) + (", as nothing else was asked" if asked.default else "")


def _list_peaks(motion: "Simulation") -> Iterator[Sequence[str]]:
    noisy, time = bool(motion.disturbance.noise), _unit_in(motion, "t")
    yield ("", "peak", "at", *(("in the long run",) if noisy else ("overshoot", "settled within 2 % at")))
    for m in motion.measures:
        unit = _unit_in(motion, m.name)
        first = (_WORDS.get(m.name, m.name), unit.show(m.peak), time.show(m.at))
        if noisy:
            deviation = unit.show(motion.deviations.get(m.name, math.nan))
            yield *first, "none" if deviation == "none" else f"± {deviation}"
        else:
            yield *first, f"{100 * m.overshoot:.3g} %", time.show(m.settling)


def _list_modes(motion: "Simulation", full: bool) -> Iterator[Sequence[str]]:
    bicycle = "phi" in motion.columns
    unit = {"s": "1/s", "√(w/g)": "√(g/w)"}.get(motion.units.get("t", ""), "")
    heads = ("steer per lean", "steer ahead of lean") if bicycle else ("amplitudes and phases",)
    yield f"{'eigenfrequency' if motion.problem.model.double else 'root'} {unit}".rstrip(), *heads
    for mode in motion.modes:
        size = abs(mode.im) if mode.eigenfrequency is None else _largest_size(motion)
        root = format_root(mode, 6, mode.multiplicity, _NOTHING * size)
        if bicycle:
            ratio = f"{mode.steer_per_lean:.4g}" if math.isfinite(mode.steer_per_lean) else "no lean"
            yield root, ratio, _DEGREES.show(mode.phases["delta"], 4)
        else:
            said = [f"{n} {x:.3g} at {_DEGREES.show(mode.phases[n], 4)}" for n, x in mode.amplitudes.items() if x]
            left = len(said) - _SHAPES
            yield root, ", ".join(said if full or left <= 0 else [*said[:_SHAPES], f"… {left} more"])


def _write_notes(motion: "Simulation") -> Iterator[str]:
    noisy = bool(motion.disturbance.noise)
    merged = {(m.re, m.im): m for m in motion.modes if m.multiplicity > 1}
    yield from map(_describe_merging, merged.values())
    if merged:
        what = "eigenfrequencies" if motion.problem.model.double else "roots"
        moved = "which rounding moves by no more than itself"
        yield f"{what}: of the ideal design; motion: of the design as stored, {moved}"
    if not motion.stable and (words := _describe_axis(motion)):
        yield f"{words}; peaks are those of the time shown"
    elif not motion.stable:
        yield "not stable: it does not settle, and peaks are those of the time shown"
    elif not noisy and any(math.isnan(m.settling) for m in motion.measures):
        yield "stable, but it dies out too slowly for a settling time: peaks are those of the time shown"
    elif not noisy:
        yield "stable; peaks, overshoots and settling times are those of the whole motion, however long is shown"
    if "x" in motion.columns:
        end = {n: motion.columns[n][-1] for n in ("x", "y_rear", "psi")}
        ahead, aside, turned = (_unit_in(motion, n).show(abs(x)) for n, x in end.items())
        side, turn = ("right" if end[n] >= 0 else "left" for n in ("y_rear", "psi"))
        yield f"at the end: {ahead} on, {aside} to the {side}, heading {turned} to the {turn}"
        angles = [abs(m.peak) for m in motion.measures if motion.units.get(m.name) == "rad"]
        if max(angles) > math.radians(_STEEP):
            yield f"beyond {_STEEP:.0f} deg the equations, which are linear, tell what a smaller push does, enlarged"


def _largest_size(motion: "Simulation") -> float:
    """A size beside which a root is none: of the roots of the polynomial, those of a complex H with its carrier."""
    carrier = motion.problem.model.carrier or 0.0
    return max(math.hypot(m.re, m.im - carrier) for m in motion.modes)


def _describe_axis(motion: "Simulation") -> str:
    """The verdict, and what the rightmost modes do, where they lie on the axis but for rounding; else empty."""
    least = _NOTHING * _largest_size(motion)
    first = [m for m in motion.modes if abs(m.re) <= least]
    if any(m.re > least for m in motion.modes) or not first:
        return ""
    of_H = motion.problem.model.double is not None
    if power := power_of_t(max(m.partial[0] for m in first)):
        return f"{UNSTABLE}: on the {'real' if of_H else 'imaginary'} axis, where modes merge, it grows as {power}"
    root = "an eigenfrequency is real" if of_H else "a root is on the imaginary axis"
    return f"{MARGINAL}: {root}, and its motion neither grows nor dies out"


def _describe_merging(mode: "ModeShape") -> str:
    k, of_H = mode.multiplicity, mode.eigenfrequency is not None
    name = f"{'C' if mode.im and not of_H else ''}EP{k}"
    many = _COUNTS.get(k, str(k))
    roots, wave = ("eigenfrequencies", "e^(-i omega t)") if of_H else ("roots", "e^(st)")
    if mode.geometric == k:
        return f"{many} {roots} meet and keep {many} shapes: no chain, no power of t"
    if mode.geometric > 1:
        return f"{many} {roots} meet in {mode.geometric} shapes, Jordan chains of {', '.join(map(str, mode.partial))}"
    top = "t" if k == 2 else f"t^{k - 1}"
    return f"{name}: {many} modes merge in one shape, a Jordan chain of {k}: the motion has terms up to {top} {wave}"


def _unit_in(motion: "Simulation", name: str) -> Unit:
    """The unit to show a column in: degrees for angles and their rates."""
    text = motion.units.get(name, "")
    return Unit(text.replace("rad", "deg"), math.radians(1)) if text.startswith("rad") else Unit(text)


def write_speeds(found: Speeds, level: Level) -> Parts:
    """The stable and the heavily damped bands, and every speed with what happens there."""
    unit, real = unit_of(found.problem.posed, found.parameter), found.problem.model.carrier is None
    stable = f"stable {_format_ranges(found.stable, unit)}"
    yield found.parameter, stable, count_things(found.found, "critical value")
    end = f" < {unit.number(found.upper, 6)}" if math.isfinite(found.upper) else ""
    within = f" {unit.text}" if unit.text else ""
    asked = f"{unit.number(found.lower, 6)} < {found.parameter}{end}{within}"
    yield Chapter("range", "Answer")
    yield f"{asked}, by exact root isolation, with the parameters in double precision"
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
        rows.append((in_words_of(found.problem.model, c.kind), Cell(c.at, unit, _ALL), place, change))
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
