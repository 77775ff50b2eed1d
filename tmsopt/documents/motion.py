"""Documents on motion: critical speeds, roots over a parameter, and the motion after a push."""

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
    write_verdict,
)
from tmsopt.documents.design_rows import format_frequency, format_multiplicity, format_root
from tmsopt.documents.tables import tabulate_records
from tmsopt.dynamics.crossings import Crossing, Stretch
from tmsopt.dynamics.eigenvalue_crossings import choose_grid_size
from tmsopt.dynamics.growth import Growth
from tmsopt.dynamics.speeds import Speeds, speed_of
from tmsopt.models import in_words_of
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, common_unit, unit_of
from tmsopt.problem.verdict.stability import MARGINAL, UNSTABLE, power_of_t

if TYPE_CHECKING:
    from tmsopt.dynamics import ModeShape, Simulation

_SPEED_DIGITS = 15
"""Significant digits of a critical speed; all of them are correct."""
_COLUMN_WORDS = {"phi": "lean phi", "delta": "steer delta", "T_phi": "lean torque", "T_delta": "steer torque"}
_COUNT_WORDS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}
_MAX_LINEAR_ANGLE = 20.0
"""For larger angles (in degrees), the linear equations are not accurate."""
_DEGREES = Unit("deg")
_MAX_ROWS = 8
"""Maximum number of rows of a table in a brief report."""
_MAX_COORDINATES = 4
"""Maximum number of coordinates of a mode shape in a brief report."""
_ZERO_SHARE = 1e-12
"""A real part that is smaller than this share of the largest root is a rounding error."""


def write_simulation(motion: "Simulation", level: Level) -> Parts:
    """Write the cause of the motion, then a table of peaks and settling times, then a table of modes."""
    units = motion.units
    duration = f"over {motion['t'][-1]:.4g} {units.get('t', '')}".rstrip()
    peaks = (f"peak {m.name} = {m.peak:.4g} {units.get(m.name, '')}".rstrip() for m in motion.measures[:2])
    yield duration, *peaks, motion.structure, write_verdict(motion.stable, "stable")
    time, name = _choose_unit(motion, "t").show(motion["t"][-1]), speed_of(motion.problem.posed.parameter_set)
    speed = f" at {name} = {unit_of(motion.problem.posed, name).show(motion.parameters[name])}" if name else ""
    yield f"motion over {time}{speed} {_describe_cause(motion)}"
    yield Sentence(motion.problem.model.omits, "model")
    if level == "page":
        yield Chapter("picture")
        yield Figure(plots.draw_motion, motion, "The motion")
    yield Chapter("peaks", width="wide")
    yield TableBlock([*_list_peaks(motion)], "Peaks and settling times", max_rows=_MAX_ROWS)
    yield Chapter("modes", width="wide")
    yield TableBlock([*_list_modes(motion, level != "brief")], "Modes", max_rows=_MAX_ROWS)
    yield Chapter("notes")
    yield from _write_notes(motion)
    if level == "page":
        yield from tabulate_records(motion)


def _describe_cause(motion: "Simulation") -> str:
    """Describe the initial values, impulses and noise that cause the motion."""
    disturbance, time_unit = motion.disturbance, motion.units.get("t", "")
    torque_unit = "N m" if time_unit == "s" else "m_B g w"
    causes = [
        f"{_COLUMN_WORDS.get(name, name)} = {_choose_unit(motion, name).show(x)}"
        for name, x in disturbance.start.items()
    ]
    for name, push in (("steer", disturbance.push), ("lean", disturbance.lean_push)):
        causes += [f"an impulse of {name} torque of {push:.6g} {torque_unit} {time_unit}"] if push else []
    causes = [f"from {' and '.join(causes) or 'rest'}"]
    if disturbance.noise:
        sqrt_time_unit = "√s" if time_unit == "s" else "(w/g)^(1/4)"
        noise = f"{disturbance.noise:.6g} {torque_unit} {sqrt_time_unit}"
        causes.append(f"in white noise of steer torque of {noise} (seed {disturbance.seed})")
    return ", ".join(causes) + (" (the default disturbance)" if disturbance.default else "")


def _list_peaks(motion: "Simulation") -> Iterator[Sequence[str]]:
    has_noise, time_unit = bool(motion.disturbance.noise), _choose_unit(motion, "t")
    yield ("", "peak", "at", *(("after a long time",) if has_noise else ("overshoot", "settled within 2 % at")))
    for m in motion.measures:
        unit = _choose_unit(motion, m.name)
        peak = (_COLUMN_WORDS.get(m.name, m.name), unit.show(m.peak), time_unit.show(m.at))
        if has_noise:
            deviation = unit.show(motion.deviations.get(m.name, math.nan))
            yield *peak, "none" if deviation == "none" else f"± {deviation}"
        else:
            yield *peak, f"{100 * m.overshoot:.3g} %", time_unit.show(m.settling)


def _list_modes(motion: "Simulation", full: bool) -> Iterator[Sequence[str]]:
    is_bicycle = "phi" in motion.columns
    unit = {"s": "1/s", "√(w/g)": "√(g/w)"}.get(motion.units.get("t", ""), "")
    heads = ("steer per lean", "steer ahead of lean") if is_bicycle else ("amplitudes and phases",)
    yield f"{'eigenfrequency' if motion.problem.model.is_complex else 'root'} {unit}".rstrip(), *heads
    for mode in motion.modes:
        size = abs(mode.im) if mode.eigenfrequency is None else _largest_size(motion)
        root = format_root(mode, 6, mode.multiplicity, _ZERO_SHARE * size)
        if is_bicycle:
            ratio = f"{mode.steer_per_lean:.4g}" if math.isfinite(mode.steer_per_lean) else "no lean"
            yield root, ratio, _DEGREES.show(mode.phases["delta"], 4)
        else:
            texts = [f"{n} {x:.3g} at {_DEGREES.show(mode.phases[n], 4)}" for n, x in mode.amplitudes.items() if x]
            if not full and len(texts) > _MAX_COORDINATES:
                texts = [*texts[:_MAX_COORDINATES], f"… {len(texts) - _MAX_COORDINATES} more"]
            yield root, ", ".join(texts)


def _write_notes(motion: "Simulation") -> Iterator[str]:
    has_noise = bool(motion.disturbance.noise)
    merged_modes = {(m.re, m.im): m for m in motion.modes if m.multiplicity > 1}
    yield from map(_describe_merging, merged_modes.values())
    if merged_modes:
        noun = "eigenfrequencies" if motion.problem.model.is_complex else "roots"
        yield f"the {noun} belong to the ideal design, the motion belongs to the design with rounded parameters"
    if not motion.stable and (description := _describe_motion_on_axis(motion)):
        yield f"{description}; peaks are within the time shown"
    elif not motion.stable:
        yield "not stable: the motion does not settle, and peaks are within the time shown"
    elif not has_noise and any(math.isnan(m.settling) for m in motion.measures):
        yield "stable, but the motion decays too slowly for a settling time; peaks are within the time shown"
    elif not has_noise:
        yield "stable; peaks, overshoots and settling times are those of the whole motion, not only of the time shown"
    if "x" in motion.columns:
        end = {n: motion.columns[n][-1] for n in ("x", "y_rear", "psi")}
        distance, offset, heading = (_choose_unit(motion, n).show(abs(x)) for n, x in end.items())
        side, turn = ("right" if end[n] >= 0 else "left" for n in ("y_rear", "psi"))
        yield f"at the end: {distance} forward, {offset} to the {side}, turned {heading} to the {turn}"
        angles = [abs(m.peak) for m in motion.measures if motion.units.get(m.name) == "rad"]
        if max(angles) > math.radians(_MAX_LINEAR_ANGLE):
            yield f"beyond {_MAX_LINEAR_ANGLE:.0f} deg, trust the timing of the linear equations, not the amplitude"


def _largest_size(motion: "Simulation") -> float:
    """Return the modulus of the largest root."""
    return max(math.hypot(m.re, m.im) for m in motion.modes)


def _describe_motion_on_axis(motion: "Simulation") -> str:
    """Describe the motion if the rightmost roots lie on the axis, up to rounding errors; empty if they do not."""
    threshold = _ZERO_SHARE * _largest_size(motion)
    axis_modes = [m for m in motion.modes if abs(m.re) <= threshold]
    if any(m.re > threshold for m in motion.modes) or not axis_modes:
        return ""
    of_H = motion.problem.model.is_complex
    if power := power_of_t(max(m.partial[0] for m in axis_modes)):
        return f"{UNSTABLE}: modes merge on the {'real' if of_H else 'imaginary'} axis, so the motion grows as {power}"
    root = "an eigenfrequency is real" if of_H else "a root is on the imaginary axis"
    return f"{MARGINAL}: {root}, and its motion neither grows nor dies out"


def _describe_merging(mode: "ModeShape") -> str:
    k, of_H = mode.multiplicity, mode.eigenfrequency is not None
    name = f"{'C' if mode.im and not of_H else ''}EP{k}"
    number = _COUNT_WORDS.get(k, str(k))
    roots, wave = ("eigenfrequencies", "e^(-i omega t)") if of_H else ("roots", "e^(st)")
    if mode.geometric == k:
        return f"{number} {roots} coincide and keep {number} mode shapes: no Jordan chain, no power of t"
    if mode.geometric > 1:
        lengths = ", ".join(map(str, mode.partial))
        return f"{number} {roots} coincide with {mode.geometric} mode shapes and Jordan chains of {lengths}"
    power = "t" if k == 2 else f"t^{k - 1}"
    return (
        f"{name}: {number} modes merge in one shape, a Jordan chain of {k}: the motion has terms up to {power} {wave}"
    )


def _choose_unit(motion: "Simulation", name: str) -> Unit:
    """Return the unit in which a column is shown: degrees for angles and their rates."""
    text = motion.units.get(name, "")
    return Unit(text.replace("rad", "deg"), math.radians(1)) if text.startswith("rad") else Unit(text)


def write_speeds(speeds: Speeds, level: Level) -> Parts:
    """Write the stable and the heavily damped bands, and every critical speed with its event."""
    unit, has_roots = unit_of(speeds.problem.posed, speeds.parameter), not speeds.problem.model.is_complex
    stable = f"stable {_format_ranges(speeds.stable, unit)}"
    yield speeds.parameter, stable, count_things(speeds.found, "critical value")
    range_text = f"{speeds.parameter} > {unit.show(speeds.lower, 6)}"
    if math.isfinite(speeds.upper):
        range_text = f"{unit.number(speeds.lower, 6)} < {speeds.parameter} < {unit.show(speeds.upper, 6)}"
    yield Chapter("range", "Answer")
    if speeds.is_exact:
        yield f"{range_text}, by exact root isolation, with the parameters in double precision"
    else:
        count = choose_grid_size(speeds.problem.model.degree)
        yield f"{range_text}, by eigenvalues at {count} values and Newton steps; nothing is proved between these values"
    yield Sentence(speeds.problem.model.omits, "model")
    yield Chapter("speeds", "Critical speeds", "wide")
    yield _tabulate_crossings(speeds, unit, has_roots)
    yield Chapter("bands")
    yield from _list_identities(speeds)
    yield Sentence(_describe_bands(speeds, speeds.stable), "stable", "good" if speeds.stable else "bad")
    if speeds.always and (speeds.zeros or "weave" in speeds.always):
        yield Sentence(_describe_bands(speeds, speeds.marginal), _describe_marginal(speeds), "doubt")
    if has_roots:
        yield Sentence(_describe_bands(speeds, speeds.heavily_damped), "heavily damped")
    if level == "page":
        yield Chapter("picture")
        yield Figure(plots.draw_speeds, speeds, f"Roots over {speeds.parameter}")


def _tabulate_crossings(speeds: Speeds, unit: Unit, has_roots: bool) -> Block | str:
    if not speeds.found:
        root, axis = ("root", "imaginary") if has_roots else ("eigenfrequency", "real")
        exception = f", apart from the facts below, which hold for every {speeds.parameter}" if speeds.always else ""
        return f"no {root} meets another {root} or the {axis} axis{exception}"
    other_parameters = {n: x for n, x in speeds.parameters.items() if n != speeds.parameter}
    rate_unit = common_unit(speeds.problem.posed, "abscissa", other_parameters)
    heading = f"root {rate_unit.text}".rstrip() if has_roots else "eigenfrequency"
    rows: list[Row] = [("", f"{speeds.parameter} {unit.text}".rstrip(), heading, "")]
    for c in speeds.found:
        root = format_frequency(-c.root.im, c.root.re, 12, c.root.multiplicity)
        root = _format_root(c, rate_unit) if has_roots else root
        change = "stability changes" if c.changes else "rightmost" if c.rightmost else ""
        rows.append((in_words_of(speeds.problem.model, c.kind), Cell(c.at, unit, _SPEED_DIGITS), root, change))
    return TableBlock(rows, "Speeds at which the motion changes", priorities=(3, 3, 1, 2))


def write_growth(growth: Growth, _level: Level) -> Parts:
    """Write the parameter and its range, its value at the design, and the stable and the heavily damped bands."""
    unit, has_roots = unit_of(growth.problem.posed, growth.over.name), not growth.problem.model.is_complex
    yield f"over {growth.over.name}", f"stable {_format_ranges(growth.stable, unit)}", growth.structure
    critical = f", critical value {unit.show(growth.critical, 8)}" if math.isfinite(growth.critical) else ""
    range_text = f"over {growth.over.name} from {unit.number(growth.values[0], 6)} to {unit.show(growth.values[-1], 6)}"
    design = f"{growth.over.name} = {unit.show(growth.design, 8)}, structure {growth.structure}{critical}"
    yield f"{'roots' if has_roots else 'eigenfrequencies'} {range_text}"
    yield Sentence(design, "the design")
    for name, bands in [("stable", growth.stable), ("heavily damped", growth.heavily_damped)][: 2 if has_roots else 1]:
        bands_text = ", ".join(f"{unit.number(low, 8)} to {unit.show(high, 8)}" for low, high in bands)
        yield Sentence(bands_text or "nowhere", name)


def _list_identities(speeds: Speeds) -> Iterator[str]:
    """Describe facts that hold for every value of the parameter; the table lists only other events."""
    name = speeds.parameter
    if speeds.zeros:
        times = f", {speeds.zeros}-fold" if speeds.zeros > 1 else ""
        yield f"s = 0 is a root for every {name}{times}"
    if "weave" in speeds.always:
        yield f"roots are mirrored in the imaginary axis for every {name}: no design is better than marginally stable"
    if "EP2" in speeds.always:
        yield f"a root is multiple for every {name}"
    if "infinity" in speeds.always:
        yield f"a root is at infinity for every {name}"


def _describe_marginal(speeds: Speeds) -> str:
    """Describe the bands in which roots stay on the imaginary axis."""
    if speeds.zeros > 1:
        kind = "marginally stable" if "weave" in speeds.always else "stable"
        return f"{kind} except for the {speeds.zeros}-fold root 0"
    return "marginally stable (no root is right of the imaginary axis, and the roots on it are simple)"


def _format_root(c: Crossing, unit: Unit) -> str:
    if c.kind == "infinity":
        return "infinite"
    multiplicity = format_multiplicity(c.root.multiplicity)
    if not c.root.im:
        return f"{unit.number(c.root.re, 12)}{multiplicity}"
    real_part = f"{unit.number(c.root.re, 12)} " if c.root.re else ""
    return f"{real_part}± {unit.number(c.root.im, 12)}i{multiplicity}"


def _describe_bands(speeds: Speeds, bands: Sequence[Stretch]) -> str:
    return _format_bands(bands, (speeds.lower, speeds.upper), unit_of(speeds.problem.posed, speeds.parameter))


def _format_ranges(bands: Sequence[Stretch], unit: Unit) -> str:
    text = ", ".join(f"{unit.number(low)} to {unit.number(high)}" for low, high in bands)
    return f"{text} {unit.text}".strip() if text else "nowhere"


def _format_bands(bands: Sequence[Stretch], limits: Stretch, unit: Unit, digits: int = 8) -> str:
    """Write bands in words, such as "from 4 to 6"."""
    parts = []
    for low, high in bands:
        start = "" if low == limits[0] else f"from {unit.number(low, digits)}"
        end = "" if high == limits[1] else f"to {unit.number(high, digits)}"
        is_single = start.removeprefix("from") == end.removeprefix("to")  # to these digits, the band is a single speed
        parts.append(start.replace("from", "at") if start and is_single else f"{start} {end}".strip() or "everywhere")
    text = ", ".join(parts) or "nowhere"
    return text if text in ("nowhere", "everywhere") else f"{text} {unit.text}".rstrip()


def describe_range(stable: Sequence[Stretch], solution: Solution) -> str:
    """Write the bands of the speed in which a design is stable, and the speed of the design."""
    parameter_set = solution.problem.posed.parameter_set
    name = speed_of(parameter_set)
    assert name is not None
    unit, limits = unit_of(solution.problem.posed, name), parameter_set[name].range
    bands = _format_bands(stable, (limits.lower, limits.upper), unit, 5)
    return f"stable range of {name}: {bands}; this design has {name} = {unit.show(solution.parameters[name])}"
