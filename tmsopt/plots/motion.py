"""Draw the motion of a design over time, and the paths of its wheels."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.dynamics import Simulation
from tmsopt.plots.labels import finish_axes
from tmsopt.plots.style import COMPLEX, CRITICAL, HEAVY, LINE, MARK, REAL, ensure_axes, new_figure

_COLOURS = (CRITICAL, MARK, REAL, HEAVY, COMPLEX, LINE)
_LABELS = {"phi": r"lean $\varphi$", "delta": r"steer $\delta$", "T_phi": r"lean torque", "T_delta": r"steer torque"}


def draw_motion(motion: Simulation, ax: Axes | None = None) -> Axes:
    """Draw lean and steer in degrees over time, or the coordinates of a system that the user defined.

    The time after which all curves have settled is grey.

    Example:
        >>> axes = tmsopt.plots.draw_motion(tmsopt.simulate("problems/ep4.toml", lean=5))
        >>> axes.get_legend_handles_labels()[1]
        ['lean $\\\\varphi$', 'steer $\\\\delta$', 'settled within 2 %']

    More: docs/how_to/motion.md
    """
    ax = ensure_axes(ax, 6.4, 3.2, motion.problem.title)
    _draw_angles(motion, ax)
    return finish_axes(ax)


def motion_figure(motion: Simulation) -> Figure:
    """Draw the motion in a new figure, and below it the torques of a controller and the paths of both contacts.

    The paths are seen from above. Torques and paths are left out if the simulation does not have them.

    Example:
        >>> figure = tmsopt.plots.motion_figure(tmsopt.simulate("problems/whipple_benchmark.toml", lean=5))
        >>> [axes.get_ylabel() for axes in figure.axes]
        ['angle in deg', 'to the right in m']

    More: docs/how_to/motion.md
    """
    draw_functions = [
        _draw_angles,
        *[_draw_torques] * ("T_delta" in motion.columns),
        *[_draw_path] * ("x" in motion.columns),
    ]
    figure = new_figure(6.4, 1.0 + 2.4 * len(draw_functions))
    axes = figure.subplots(len(draw_functions), 1, squeeze=False)[:, 0]
    axes[0].set_title(motion.problem.title, fontsize=11)
    for draw, ax in zip(draw_functions, axes, strict=True):
        draw(motion, ax)
        finish_axes(ax)
    return figure


def _draw_angles(motion: Simulation, ax: Axes) -> None:
    names = [m.name for m in motion.measures if not m.name.startswith("T_")]
    scale, label = (180 / np.pi, "angle in deg") if "phi" in motion.columns else (1.0, "coordinate")
    _draw_lines(motion, ax, names, scale, label)
    settling_time = np.max([m.settling for m in motion.measures])  # nan if one settling time is nan
    if settling_time < motion["t"][-1]:
        ax.axvspan(settling_time, motion["t"][-1], color="0.93", zorder=0, label="settled within 2 %")


def _draw_torques(motion: Simulation, ax: Axes) -> None:
    names = [n for n in ("T_phi", "T_delta") if n in motion.columns]
    _draw_lines(motion, ax, names, 1.0, f"torque in {motion.units['T_delta']}")


def _draw_path(motion: Simulation, ax: Axes) -> None:
    for end, colour in (("rear", CRITICAL), ("front", MARK)):
        ax.plot(motion["x"], motion[f"y_{end}"], color=colour, label=f"{end} contact")
    ax.invert_yaxis()  # seen from above; the bicycle moves to the right of the picture
    unit = motion.units["x"]
    ax.set(xlabel=f"distance of the rear contact in {unit}", ylabel=f"to the right in {unit}")


def _draw_lines(motion: Simulation, ax: Axes, names: Sequence[str], scale: float, label: str) -> None:
    for k, name in enumerate(names):
        style, y = "-" if k < 6 else "--", scale * np.asarray(motion[name])
        ax.plot(motion["t"], y, style, color=_COLOURS[k % 6], label=_LABELS.get(name, name))
    ax.axhline(0, color="0.6", linewidth=0.6, zorder=0)
    unit = motion.units.get("t")
    ax.set(xlim=(0, motion["t"][-1]), xlabel=f"time in {unit}" if unit else "time", ylabel=label)
