"""The motion of a design: its cause, peaks, settling times, shapes of modes."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tmsopt import plots
from tmsopt.documents.blocks import Chapter, Figure, Level, Parts, Sentence, TableBlock, judge
from tmsopt.documents.design_rows import format_root
from tmsopt.documents.tables import tabulate_records
from tmsopt.dynamics.speeds import speed_of
from tmsopt.problem import unit_of
from tmsopt.problem.verdict.stability import MARGINAL, UNSTABLE, power_of_t

if TYPE_CHECKING:
    from tmsopt.dynamics import ModeShape, Simulation

_WORDS = {"phi": "lean phi", "delta": "steer delta", "T_phi": "lean torque", "T_delta": "steer torque"}
_COUNTS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}
_STEEP = 20.0  # degrees beyond which the equations, which are linear, say little
_ROWS, _SHAPES = 8, 4  # of each table, coordinates of a shape, if not full
_NOTHING = 1e-12  # of a root: a real part so small is rounding, and on the axis beside the largest


def write_simulation(motion: "Simulation", level: Level) -> Parts:
    """What sets a design moving, peak, overshoot and settling time of each angle and torque, and the modes."""
    units = motion.units
    over = f"over {motion['t'][-1]:.4g} {units.get('t', '')}".rstrip()
    peaks = (f"peak {m.name} = {m.peak:.4g} {units.get(m.name, '')}".rstrip() for m in motion.measures[:2])
    yield over, *peaks, motion.structure, judge(motion.stable, "stable")
    time, name = _format_with_unit(motion, "t", motion["t"][-1]), speed_of(motion.problem.posed.parameter_set)
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
    said = [f"{_name_coordinate(name)} = {_format_with_unit(motion, name, x)}" for name, x in asked.start.items()]
    for name, push in (("steer", asked.push), ("lean", asked.lean_push)):
        said += [f"an impulse of {name} torque of {push:.6g} {torque} {time}"] if push else []
    said = [f"from {' and '.join(said) or 'rest'}"]
    if asked.noise:
        root = "√s" if time == "s" else "(w/g)^(1/4)"
        said.append(f"in white noise of steer torque of {asked.noise:.6g} {torque} {root} (seed {asked.seed})")
    return ", ".join(said) + (", as nothing else was asked" if asked.default else "")


def _list_peaks(motion: "Simulation") -> Iterator[Sequence[str]]:
    noisy = bool(motion.disturbance.noise)
    yield ("", "peak", "at", *(("in the long run",) if noisy else ("overshoot", "settled within 2 % at")))
    for m in motion.measures:
        first = (
            _name_coordinate(m.name),
            _format_with_unit(motion, m.name, m.peak),
            _format_with_unit(motion, "t", m.at),
        )
        if noisy:
            deviation = _format_with_unit(motion, m.name, motion.deviations.get(m.name, math.nan))
            yield *first, "none" if deviation == "none" else f"± {deviation}"
        else:
            yield *first, f"{100 * m.overshoot:.3g} %", _format_with_unit(motion, "t", m.settling)


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
            yield root, ratio, _format_degrees(mode.phases["delta"])
        else:
            said = [f"{n} {x:.3g} at {_format_degrees(mode.phases[n])}" for n, x in mode.amplitudes.items() if x]
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
        end = {n: column[-1] for n, column in motion.columns.items()}
        side = "right" if end["y_rear"] >= 0 else "left"
        ahead, aside = (_format_with_unit(motion, n, abs(end[n])) for n in ("x", "y_rear"))
        where = f"{ahead} on, {aside} to the {side}"
        turned = "right" if end["psi"] >= 0 else "left"
        yield f"at the end: {where}, heading {_format_with_unit(motion, 'psi', abs(end['psi']))} to the {turned}"
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


def _name_coordinate(name: str) -> str:
    return _WORDS.get(name, name)


def _format_with_unit(motion: "Simulation", name: str, value: float) -> str:
    """A number with its unit, angles in degrees."""
    unit = motion.units.get(name, "")
    if not math.isfinite(value):
        return "none"
    if unit.startswith("rad"):
        value, unit = math.degrees(value), unit.replace("rad", "deg")
    return f"{value + 0.0:.5g} {unit}".rstrip()


def _format_degrees(value: float) -> str:
    return f"{value + 0.0:.4g} deg" if math.isfinite(value) else "none"
