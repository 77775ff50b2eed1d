"""What happens to a design over its speeds, as a ruler."""

import math

import numpy as np
from matplotlib.axes import Axes

from tmsopt.dynamics.speeds import Speeds
from tmsopt.plots.growth import EVENTS
from tmsopt.plots.labels import events_of, finish_axes, scale_over
from tmsopt.plots.style import LINE, REAL, draw_bands, note, on_axes

_LEVELS = 3  # heights at which names stand in turn
_MARGIN = 1.15  # times the last event


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
