"""Draw growth rates and frequencies of modes over the speed or another parameter, and events along it as a ruler."""

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
from tmsopt.errors import input_error
from tmsopt.plots.labels import (
    COMPLEX_H_LABELS,
    PETERMANN_LABEL,
    AxisScale,
    Name,
    events_of,
    finish_axes,
    place_all,
    scale_over,
)
from tmsopt.plots.style import (
    CAPSIZE,
    COMPLEX,
    CRITICAL,
    LINE,
    MARK,
    REAL,
    draw_bands,
    ensure_axes,
    legend_below,
    new_figure,
    write_note,
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
"""Name of a mode → colour and line style; modes with other names take the styles in order."""

EVENTS: Mapping[str, tuple[str, LineStyleType]] = {
    "weave": (CRITICAL, "--"),
    "capsize": (MARK, "-."),
    "infinity": (CAPSIZE, (0, (1, 1))),
}
"""Event at which a design loses stability → colour and line style."""

_LABELS = {
    "real": (r"growth rate $\mathrm{Re}\,s$", "growth rate in 1/s"),
    "imag": (r"frequency $\mathrm{Im}\,s$", "frequency in Hz"),
    "petermann": (PETERMANN_LABEL, PETERMANN_LABEL),
}
"""Labels of the vertical axis without and with a unit of time."""

_PETERMANN = "petermann"  # the part that draws Petermann factors
_MAX_PETERMANN = 1e6  # greatest Petermann factor that is shown; only points very near an exceptional point have more

_ROUNDING = 1e-12  # a value below this fraction of the range is shown as 0

_VERTICAL_MARGIN = 0.08  # fraction of the range of values that is free above and below the curves of a complex H

_LEVEL_COUNT = 3  # the names of events stand at so many heights in turn
_END_FACTOR = 1.15  # the ruler ends at this multiple of the last event

_Curve = tuple[Mode, Array]
"""A mode, and its growth rates or frequencies in the units of the axis."""


def draw_growth(data: Growth | Solution, ax: Axes | None = None) -> Axes:
    """Draw the growth rates of all modes over the speed or another parameter.

    The Axes show Re s, in 1/s for a problem in SI, over the parameter in the unit of the problem's file. Each mode has
    its name. Bands show stability and heavy damping. Lines show the values where a mode loses stability, and the value
    of the design; the legend has these values. Circles show where roots meet. For a complex H the Axes show Im ω of
    every eigenfrequency, and no part of a curve is cut off.

    Example:
        >>> axes = tmsopt.plots.draw_growth(tmsopt.growth("problems/benchmark.toml"))
        >>> [label for label in axes.get_legend_handles_labels()[1] if "at" in label]
        ['weave at 2.841 m/s', 'design at 4 m/s']

    More: docs/explanation/weave_and_capsize.md
    """
    return _draw(data, ax, "real")


def draw_frequencies(data: Growth | Solution, ax: Axes | None = None) -> Axes:
    """Draw the frequencies of all oscillating modes, with the same marks as `draw_growth`.

    The Axes show Im s, in Hz for a problem in SI, over the parameter in the unit of the problem's file. For a complex H
    they show Re ω of every eigenfrequency, positive or negative.

    Example:
        >>> axes = tmsopt.plots.draw_frequencies(tmsopt.growth("problems/benchmark.toml"))
        >>> [text.get_text() for text in axes.texts], axes.get_ylabel()  # the one mode that swings
        (['weave'], 'frequency in Hz')

    More: docs/explanation/weave_and_capsize.md
    """
    return _draw(data, ax, "imag")


def draw_petermann(data: Growth | Solution, ax: Axes | None = None) -> Axes:
    """Draw the Petermann factors of all modes on a logarithmic scale, over the same axis as `draw_growth`.

    Raises:
        InputError: for a `Growth` without Petermann factors.

    Example:
        >>> dimer = tmsopt.models.from_hamiltonian([["1j*g", "k"], ["k", "-1j*g"]])
        >>> curves = tmsopt.growth(tmsopt.Problem(dimer, fixed={"g": 1, "k": 2}), over="k", petermann=True)
        >>> tmsopt.plots.draw_petermann(curves).get_ylabel()
        'Petermann factor'

    More: docs/explanation/exceptional_points.md
    """
    return _draw(data, ax, _PETERMANN)


def growth_figure(data: Growth | Solution, title: str = "", metres_per_second: float | None = None) -> Figure:
    """Draw growth rates and, below them, frequencies and the Petermann factors if `data` has them, in a new figure.

    Args:
        metres_per_second: the speed at Fr = 1; if given, an additional axis shows the speed.

    Example:
        >>> figure = tmsopt.plots.growth_figure(tmsopt.growth("problems/benchmark.toml"))
        >>> [axes.get_ylabel() for axes in figure.axes]
        ['growth rate in 1/s', 'frequency in Hz']

    More: docs/explanation/weave_and_capsize.md
    """
    data = growth(data) if isinstance(data, Solution) else data
    parts = ("real", "imag") if data.petermann is None else ("real", "imag", _PETERMANN)
    figure = new_figure(6.4, 3.4 * len(parts))
    upper, *lower = figure.subplots(len(parts), 1, sharex=True)
    axes_names = [(ax, draw_curves(ax, data, part)) for ax, part in zip((upper, *lower), parts, strict=True)]
    for ax in (upper, *lower[:-1]):
        ax.set_xlabel("")
    if (speed_unit := metres_per_second) is not None and data.over.name == "Fr":
        speed_axis = upper.secondary_xaxis("top", functions=(lambda x: x * speed_unit, lambda x: x / speed_unit))
        speed_axis.set_xlabel("speed $v$ in m/s")
    figure.suptitle(title or data.problem.title, fontsize=11)
    legend_below(figure, upper.get_legend_handles_labels()[0])
    place_all(axes_names)
    return figure


def draw_speeds(data: Speeds, ax: Axes | None = None) -> Axes:
    """Draw the events along a parameter: a root crosses the imaginary axis, or roots meet.

    The Axes show a ruler of the parameter, in the unit of the file, which ends a little after the last event. Each
    event has its name and value, and a thick line if stability changes there. Bands show stability and heavy damping,
    and a mark shows the design.

    Example:
        >>> axes = tmsopt.plots.draw_speeds(tmsopt.speeds("problems/benchmark.toml"))
        >>> [text.get_text() for text in axes.texts]
        ['EP2 0.009546', 'weave 2.841']

    More: docs/explanation/weave_and_capsize.md
    """
    problem = data.problem
    ax = ensure_axes(ax, 6.4, 2.4, problem.title)
    scale, words = scale_over(problem.posed, problem.posed.parameter_set[data.parameter]), events_of(problem.model)
    design_value = data.parameters.get(data.parameter, data.lower)
    last_value = _END_FACTOR * max(c.at for c in data.found) if data.found else data.lower + 2 * abs(design_value) + 1
    high = data.upper if math.isfinite(data.upper) else max(last_value, _END_FACTOR * design_value)
    draw_bands(ax, *(scale.to_axis(np.minimum(bands, high)) for bands in (data.stable, data.heavily_damped)))
    for k, event in enumerate(data.found):
        x, height = float(scale.to_axis(event.at)), 0.95 - 0.62 * (k % _LEVEL_COUNT) / _LEVEL_COUNT
        colour, _ = EVENTS.get(event.kind, (REAL, ""))
        ax.plot([x, x], [0, height], color=colour, linewidth=2.0 if event.changes else 0.9)
        offset = 3 if event.at < (data.lower + high) / 2 else -3
        write_note(
            ax, f"{words.get(event.kind, event.kind)} {x:.4g}", (x, height), (offset, 0), verticalalignment="top"
        )
    if data.parameter in data.parameters:
        label = f"design at {scale.unit.show(design_value, 4)}"
        ax.plot(scale.to_axis(design_value), 0.06, "^", color=LINE, label=label, clip_on=False)
    ax.set(xlim=scale.to_axis([data.lower, high]), ylim=(0, 1.05), yticks=[], xlabel=scale.label)
    ax.spines[["left", "right", "top"]].set_visible(False)
    return finish_axes(ax)


def _draw(data: Growth | Solution, ax: Axes | None, part: str) -> Axes:
    data = growth(data, petermann=part == _PETERMANN) if isinstance(data, Solution) else data
    if part == _PETERMANN and data.petermann is None:
        raise input_error("found no Petermann factors; accepted: tmsopt.growth(…, petermann=True)", "data")
    ax = ensure_axes(ax, 6.4, 4.4, data.problem.title)
    return finish_axes(ax, draw_curves(ax, data, part))


def draw_curves(ax: Axes, data: Growth, part: str) -> list[Name]:
    """Draw everything except the legend; return the names of the modes, which are written later."""
    scale, is_complex = scale_over(data.problem.posed, data.over), _is_complex_H(data)
    draw_bands(ax, scale.to_axis(data.stable), scale.to_axis(data.heavily_damped))
    names = list(dict.fromkeys(mode.name for mode in sorted(data.modes, key=lambda m: _rank_mode(m, data.design))))
    modes = [m for m in data.modes if part != "imag" or is_complex or m.roots.imag.any()]
    curves = [(m, _compute_heights(data, m.values, m.roots, part)) for m in modes]
    for mode, y in curves:
        index = names.index(mode.name)
        colour, style = _STYLES.get(mode.name, [*_STYLES.values()][index % len(_STYLES)])
        level = 2 + 0.01 * index  # solid lines are drawn below dashed lines
        ax.plot(scale.to_axis(mode.values), y, color=colour, linestyle=style, zorder=level)
    _draw_marks(ax, data, scale, part)
    start = min(0.0, data.values[0]) if data.over.name in SPEEDS else data.values[0]
    ax.set(
        ylabel=COMPLEX_H_LABELS[part] if is_complex else _LABELS[part][data.rate is not None],
        xlabel=scale.label,
        xlim=scale.to_axis([start, data.values[-1]]),
    )
    if part == _PETERMANN:
        ax.set_yscale("log")
        ax.set_ylim(top=min(ax.get_ylim()[1], _MAX_PETERMANN))
    elif is_complex:
        ax.margins(y=_VERTICAL_MARGIN)
    else:
        ax.set_ylim(_find_limits(data, curves, part))
    mode_names = _name_modes(ax, scale, curves)
    if is_complex and part != _PETERMANN:
        kind = "EP{}" if "EP" in data.structure else "{}-fold"
        for root, (value, multiple_root) in zip(data.multiple, _list_multiple_roots(data), strict=True):
            height = _compute_heights(data, value, multiple_root, part).item()
            mode_names.append(Name(kind.format(root.multiplicity), scale.to_axis(value).item(), height))
    return mode_names


def _compute_heights(data: Growth, values: Any, roots: Any, part: str) -> Array:
    """Heights of roots in the Axes at parameter values: growth rates, frequencies (Re ω of a complex H) or factors."""
    if part == _PETERMANN:
        assert data.petermann is not None
        rows = np.searchsorted(data.values, values)
        nearest = np.abs(data.roots[rows] - roots[:, None]).argmin(axis=1)
        return np.asarray(data.petermann[rows, nearest])
    heights = np.asarray(getattr(np.asarray(roots), part), dtype=float)
    if data.rate is not None:
        heights = heights * np.interp(values, data.values, data.rate) / (1 if part == "real" else 2 * np.pi)
    return -heights if _is_complex_H(data) and part == "imag" else heights


def _is_complex_H(data: Growth) -> bool:
    return data.problem.model.is_complex


def _draw_marks(ax: Axes, data: Growth, scale: AxisScale, part: str) -> None:
    """Draw lines where a mode loses stability and at the design, and circles where roots meet."""
    unit = f" {scale.unit.text}" if scale.unit.text else ""
    words = events_of(data.problem.model)
    for kind, (colour, style) in EVENTS.items():
        event_values = scale.to_axis([c.at for c in data.events if c.kind == kind])
        label = f"{words[kind]} at {', '.join(dict.fromkeys(f'{x:.4g}' for x in event_values))}{unit}"
        for x in event_values:
            ax.axvline(x, color=colour, linestyle=style, label=label)
    structure = f" ({data.structure})" if "EP" in data.structure else ""
    design_value = data.design if abs(data.design) > _ROUNDING * np.ptp(data.values) else 0.0
    label = f"design at {scale.to_axis(design_value):.4g}{unit}{structure}"
    ax.axvline(float(scale.to_axis(data.design)), color=LINE, linestyle=":", label=label)
    multiple_roots = [(c.at, complex(c.root.re, c.root.im)) for c in data.events if "EP" in c.kind]
    multiple_roots += _list_multiple_roots(data)
    if multiple_roots and part != _PETERMANN:  # where roots meet, the Petermann factor is infinite
        values, roots = zip(*multiple_roots, strict=True)
        label = "eigenfrequencies meet" if _is_complex_H(data) else "roots meet"
        x, y = scale.to_axis(values), _compute_heights(data, values, roots, part)
        ax.plot(x, y, "o", color=LINE, markerfacecolor="white", zorder=4, label=label)
    if part == "real":
        ax.axhline(0, color="grey", linewidth=0.6, zorder=1)


def _find_limits(data: Growth, curves: Sequence[_Curve], part: str) -> tuple[float, float]:
    """Limits of the vertical axis that show the roots near the design and the events, even if other roots are large."""
    heights = [y for _, y in curves]
    if part == "real":
        centres = [data.design, *(c.at for c in data.events if c.kind in ("weave", "capsize"))]
        distance = 0.25 * abs(data.design) + 0.05 * (data.values[-1] - data.values[0])
        low, high = min(centres) - distance, max(centres) + distance
        heights = [y[(m.values >= low) & (m.values <= high)] for m, y in curves]
    bottom, top = np.percentile(np.concatenate([*heights, [0.0]]), (1, 99)) * (part == "real", 1)
    margin = 0.2 * (top - bottom) or 0.1
    return bottom - margin * (part == "real"), top + margin


def _name_modes(ax: Axes, scale: AxisScale, curves: Sequence[_Curve]) -> list[Name]:
    """The name of each mode, in the middle of the longest of its visible curves."""
    low, high = np.reshape([ax.get_xlim(), ax.get_ylim()], (2, 2, 1)).swapaxes(0, 1)
    longest: dict[str, tuple[float, Name]] = {}
    for mode, heights in curves:
        points = np.array([scale.to_axis(mode.values), heights])
        x, y = points[:, ((points > low) & (points < high)).all(axis=0)]
        if x.size and np.ptp(x) >= longest.get(mode.name, (0.0, None))[0]:
            middle = np.abs(x - (x[0] + x[-1]) / 2).argmin()
            longest[mode.name] = np.ptp(x), Name(mode.name, float(x[middle]), float(y[middle]))
    return [name for _, name in longest.values()]


def _list_multiple_roots(data: Growth) -> list[tuple[float, complex]]:
    """The multiple roots of the design as (value of the parameter, root), without lower conjugates."""
    return [(data.design, complex(r.re, r.im)) for r in data.multiple if r.im >= 0 or _is_complex_H(data)]


def _rank_mode(mode: Mode, design: float) -> tuple[float, float]:
    """Sort key of a mode: first its distance from the design, then its position from right to left there."""
    distances = np.abs(mode.values - design)
    return round(float(distances.min()) / (1e-3 + abs(design)), 3), -float(mode.roots[distances.argmin()].real)
