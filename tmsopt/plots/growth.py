"""Growth rates and frequencies over the speed, or another parameter, with their modes named; the events as a ruler."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.typing import LineStyleType

from tmsopt.dynamics.growth import SPEEDS, Growth, growth
from tmsopt.dynamics.modes import Mode
from tmsopt.dynamics.speeds import Speeds
from tmsopt.plots.labels import OF_H, AxisScale, Name, events_of, finish_axes, place_all, scale_over
from tmsopt.plots.style import (
    CAPSIZE,
    COMPLEX,
    CRITICAL,
    LINE,
    MARK,
    REAL,
    draw_bands,
    legend_below,
    new_figure,
    note,
    on_axes,
)
from tmsopt.problem.solution import Solution
from tmsopt.records import Array

_DASHED: LineStyleType = (0, (6, 2))
_STYLES: Mapping[str, tuple[str, LineStyleType]] = {
    "weave": (CRITICAL, "-"),
    "capsize": (MARK, _DASHED),
    "castering": (REAL, (0, (4, 2, 1, 2))),
    "capsize + castering": (COMPLEX, "-"),
    "second pair": (COMPLEX, _DASHED),
}
"""Colours and lines of modes: of a bicycle by name, of others in their order at the design."""

EVENTS: Mapping[str, tuple[str, LineStyleType]] = {
    "weave": (CRITICAL, "--"),
    "capsize": (MARK, "-."),
    "infinity": (CAPSIZE, (0, (1, 1))),
}
"""Colour and line of events at which a design loses stability."""

_LABELS = {
    "real": (r"growth rate $\mathrm{Re}\,s$", "growth rate in 1/s"),
    "imag": (r"frequency $\mathrm{Im}\,s$", "frequency in Hz"),
}
"""Without and with a unit of time."""

_NOTHING = 1e-12  # of the range: less is 0 but for rounding

_ROOM = 0.08  # of all that is shown of H, above and below it

_LEVELS = 3  # heights at which names of events stand in turn
_MARGIN = 1.15  # times the last event

_Curve = tuple[Mode, Array]
"""A mode, and its growth rates or frequencies as they stand on the axis."""


def draw_growth(data: Growth | Solution, ax: Axes | None = None) -> Axes:
    """Growth rates of every mode over the speed, or another parameter.

    The Axes show Re s, in 1/s for a problem in SI, over the parameter in the unit of the problem's file: each mode with
    its name, bands of stability and heavy damping, lines at the values where a mode loses stability and at the
    design's own, all with their numbers in the legend, and circles where roots meet. For a complex H they show Im ω of
    every eigenfrequency, to the ends of all curves.

    Example:
        >>> axes = tmsopt.plots.draw_growth(tmsopt.growth("problems/benchmark.toml"))
        >>> [label for label in axes.get_legend_handles_labels()[1] if "at" in label]
        ['weave at 2.841 m/s', 'design at 4 m/s']

    More: docs/explanation/weave_and_capsize.md
    """
    return _draw(data, ax, "real")


def draw_frequencies(data: Growth | Solution, ax: Axes | None = None) -> Axes:
    """Frequencies of every oscillating mode, marked in the same way.

    The Axes show Im s, for a problem in SI as Hz, over the parameter in the unit of the problem's file; of a complex H
    Re ω of every eigenfrequency, of either sign.

    Example:
        >>> axes = tmsopt.plots.draw_frequencies(tmsopt.growth("problems/benchmark.toml"))
        >>> [text.get_text() for text in axes.texts], axes.get_ylabel()  # the one mode that swings
        (['weave'], 'frequency in Hz')

    More: docs/explanation/weave_and_capsize.md
    """
    return _draw(data, ax, "imag")


def growth_figure(data: Growth | Solution, title: str = "", metres_per_second: float | None = None) -> Figure:
    """Growth rates above frequencies; an upper axis shows the speed for Fr = 1 being `metres_per_second`.

    Example:
        >>> figure = tmsopt.plots.growth_figure(tmsopt.growth("problems/benchmark.toml"))
        >>> [axes.get_ylabel() for axes in figure.axes]
        ['growth rate in 1/s', 'frequency in Hz']

    More: docs/explanation/weave_and_capsize.md
    """
    figure = new_figure(6.4, 6.8)
    upper, lower = figure.subplots(2, 1, sharex=True)
    data = growth(data) if isinstance(data, Solution) else data
    named = [(ax, draw_curves(ax, data, part)) for ax, part in ((upper, "real"), (lower, "imag"))]
    upper.set_xlabel("")
    if (unit := metres_per_second) is not None and data.over.name == "Fr":
        speed = upper.secondary_xaxis("top", functions=(lambda x: x * unit, lambda x: x / unit))
        speed.set_xlabel("speed $v$ in m/s")
    figure.suptitle(title or data.problem.title, fontsize=11)
    legend_below(figure, upper.get_legend_handles_labels()[0])
    place_all(named)
    return figure


def draw_speeds(data: Speeds, ax: Axes | None = None) -> Axes:
    """Every place where a root crosses the imaginary axis or roots meet.

    The Axes show a ruler of the parameter, in the unit of the file, to a little beyond the last event: each event with
    its name and value, heavier where stability changes, bands of stability and heavy damping, and the design.

    Example:
        >>> axes = tmsopt.plots.draw_speeds(tmsopt.speeds("problems/benchmark.toml"))
        >>> [text.get_text() for text in axes.texts]
        ['EP2 0.009546', 'weave 2.841']

    More: docs/explanation/weave_and_capsize.md
    """
    problem = data.problem
    ax = on_axes(ax, 6.4, 2.4, problem.title)
    scale, words = scale_over(problem.posed, problem.posed.parameter_set[data.parameter]), events_of(problem.model)
    at = data.parameters.get(data.parameter, data.lower)
    last = _MARGIN * max(c.at for c in data.found) if data.found else data.lower + 2 * abs(at) + 1
    high = data.upper if math.isfinite(data.upper) else max(last, _MARGIN * at)
    draw_bands(ax, *(scale.to_axis(np.minimum(bands, high)) for bands in (data.stable, data.heavily_damped)))
    for k, event in enumerate(data.found):
        x, height = float(scale.to_axis(event.at)), 0.95 - 0.62 * (k % _LEVELS) / _LEVELS
        colour, _ = EVENTS.get(event.kind, (REAL, ""))
        ax.plot([x, x], [0, height], color=colour, linewidth=2.0 if event.changes else 0.9)
        side = 3 if event.at < (data.lower + high) / 2 else -3
        note(ax, f"{words.get(event.kind, event.kind)} {x:.4g}", (x, height), (side, 0), verticalalignment="top")
    if data.parameter in data.parameters:
        label = f"design at {scale.unit.show(at, 4)}"
        ax.plot(scale.to_axis(at), 0.06, "^", color=LINE, label=label, clip_on=False)
    ax.set(xlim=scale.to_axis([data.lower, high]), ylim=(0, 1.05), yticks=[], xlabel=scale.label)
    ax.spines[["left", "right", "top"]].set_visible(False)
    return finish_axes(ax)


def _draw(data: Growth | Solution, ax: Axes | None, part: str) -> Axes:
    data = growth(data) if isinstance(data, Solution) else data
    ax = on_axes(ax, 6.4, 4.4, data.problem.title)
    return finish_axes(ax, draw_curves(ax, data, part))


def draw_curves(ax: Axes, data: Growth, part: str) -> list[Name]:
    """Everything but the legend; the names of the modes, to place."""
    scale, of_H = scale_over(data.problem.posed, data.over), _of_H(data)
    draw_bands(ax, scale.to_axis(data.stable), scale.to_axis(data.heavily_damped))
    names = list(dict.fromkeys(mode.name for mode in sorted(data.modes, key=lambda m: _rank_mode(m, data.design))))
    shown = [m for m in data.modes if part == "real" or of_H or m.roots.imag.any()]
    curves = [(m, _heights(data, m.values, m.roots, part)) for m in shown]
    for mode, y in curves:
        place = names.index(mode.name)
        colour, style = _STYLES.get(mode.name, [*_STYLES.values()][place % len(_STYLES)])
        level = 2 + 0.01 * place  # whole lines below dashed ones
        ax.plot(scale.to_axis(mode.values), y, color=colour, linestyle=style, zorder=level)
    _marks(ax, data, scale, part)
    first = min(0.0, data.values[0]) if data.over.name in SPEEDS else data.values[0]
    ax.set(
        ylabel=OF_H[part] if of_H else _LABELS[part][data.rate is not None],
        xlabel=scale.label,
        xlim=scale.to_axis([first, data.values[-1]]),
    )
    if of_H:
        ax.margins(y=_ROOM)
    else:
        ax.set_ylim(_focus(data, curves, part))
    found = _names(ax, scale, curves)
    if of_H:
        kind = "EP{}" if "EP" in data.structure else "{}-fold"
        for root, (own, z) in zip(data.multiple, _multiple(data), strict=True):
            height = _heights(data, own, z, part).item()
            found.append(Name(kind.format(root.multiplicity), scale.to_axis(own).item(), height))
    return found


def _heights(data: Growth, at: Any, roots: Any, part: str) -> Array:
    """Growth rates or frequencies as they stand on the axis, of roots at values of the parameter; of H ω = i s."""
    heights = np.asarray(getattr(np.asarray(roots), part), dtype=float)
    if data.rate is not None:
        heights = heights * np.interp(at, data.values, data.rate) / (1 if part == "real" else 2 * np.pi)
    return -heights if _of_H(data) and part == "imag" else heights


def _of_H(data: Growth) -> bool:
    return data.problem.model.carrier is not None


def _marks(ax: Axes, data: Growth, scale: AxisScale, part: str) -> None:
    """Lines where a mode loses stability and at the design, and circles where roots meet."""
    unit = f" {scale.unit.text}" if scale.unit.text else ""
    words = events_of(data.problem.model)
    for kind, (colour, style) in EVENTS.items():
        at = scale.to_axis([c.at for c in data.events if c.kind == kind])
        label = f"{words[kind]} at {', '.join(dict.fromkeys(f'{x:.4g}' for x in at))}{unit}"
        for x in at:
            ax.axvline(x, color=colour, linestyle=style, label=label)
    structure = f" ({data.structure})" if "EP" in data.structure else ""
    own = data.design if abs(data.design) > _NOTHING * np.ptp(data.values) else 0.0
    label = f"design at {scale.to_axis(own):.4g}{unit}{structure}"
    ax.axvline(float(scale.to_axis(data.design)), color=LINE, linestyle=":", label=label)
    met = [(c.at, complex(c.root.re, c.root.im)) for c in data.events if "EP" in c.kind] + _multiple(data)
    if met:
        places, roots = zip(*met, strict=True)
        label = "eigenfrequencies meet" if _of_H(data) else "roots meet"
        x, y = scale.to_axis(places), _heights(data, places, roots, part)
        ax.plot(x, y, "o", color=LINE, markerfacecolor="white", zorder=4, label=label)
    if part == "real":
        ax.axhline(0, color="grey", linewidth=0.6, zorder=1)


def _focus(data: Growth, curves: Sequence[_Curve], part: str) -> tuple[float, float]:
    """Limits that show the roots around the design and the events, even where others run away."""
    shown = [y for _, y in curves]
    if part == "real":
        centres = [data.design, *(c.at for c in data.events if c.kind in ("weave", "capsize"))]
        room = 0.25 * abs(data.design) + 0.05 * (data.values[-1] - data.values[0])
        low, high = min(centres) - room, max(centres) + room
        shown = [y[(m.values >= low) & (m.values <= high)] for m, y in curves]
    bottom, top = np.percentile(np.concatenate([*shown, [0.0]]), (1, 99)) * (part == "real", 1)
    room = 0.2 * (top - bottom) or 0.1
    return bottom - room * (part == "real"), top + room


def _names(ax: Axes, scale: AxisScale, curves: Sequence[_Curve]) -> list[Name]:
    """Each mode's name in the middle of the longest of its curves that is in sight."""
    low, high = np.reshape([ax.get_xlim(), ax.get_ylim()], (2, 2, 1)).swapaxes(0, 1)
    longest: dict[str, tuple[float, Name]] = {}
    for mode, heights in curves:
        points = np.array([scale.to_axis(mode.values), heights])
        x, y = points[:, ((points > low) & (points < high)).all(axis=0)]
        if x.size and np.ptp(x) >= longest.get(mode.name, (0.0, None))[0]:
            middle = np.abs(x - (x[0] + x[-1]) / 2).argmin()
            longest[mode.name] = np.ptp(x), Name(mode.name, float(x[middle]), float(y[middle]))
    return [name for _, name in longest.values()]


def _multiple(data: Growth) -> list[tuple[float, complex]]:
    """Where the design stands, and its multiple roots, of conjugates the upper ones."""
    return [(data.design, complex(r.re, r.im)) for r in data.multiple if r.im >= 0 or _of_H(data)]


def _rank_mode(mode: Mode, design: float) -> tuple[float, float]:
    """By which modes are put in order: how near they come to the design, and from the right there."""
    near = np.abs(mode.values - design)
    return round(float(near.min()) / (1e-3 + abs(design)), 3), -float(mode.roots[near.argmin()].real)
