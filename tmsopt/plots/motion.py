"""The motion of a design over time, and the path of its wheels."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.dynamics import Simulation
from tmsopt.plots.labels import finish_axes
from tmsopt.plots.style import COMPLEX, CRITICAL, HEAVY, LINE, MARK, REAL, new_figure, on_axes

_COLOURS = (CRITICAL, MARK, REAL, HEAVY, COMPLEX, LINE)
_LATEX = {"phi": r"lean $\varphi$", "delta": r"steer $\delta$", "T_phi": r"lean torque", "T_delta": r"steer torque"}


def draw_motion(motion: Simulation, ax: Axes | None = None) -> Axes:
    """Lean and steer in degrees over time, of a stated system its coordinates; grey where all of them have settled.

    Example:
        >>> axes = tmsopt.plots.draw_motion(tmsopt.simulate("problems/ep4.toml", lean=5))
        >>> axes.get_legend_handles_labels()[1]
        ['lean $\\\\varphi$', 'steer $\\\\delta$', 'settled within 2 %']

    More: docs/how_to/motion.md
    """
    ax = on_axes(ax, 6.4, 3.2, motion.problem.title)
    _angles(motion, ax)
    return finish_axes(ax)


def motion_figure(motion: Simulation) -> Figure:
    """The same as a figure, with the torques of a controller and, from above, the path of both contacts below it.

    Example:
        >>> figure = tmsopt.plots.motion_figure(tmsopt.simulate("problems/whipple_benchmark.toml", lean=5))
        >>> [axes.get_ylabel() for axes in figure.axes]
        ['angle in deg', 'to the right in m']

    More: docs/how_to/motion.md
    """
    parts = [_angles, *[_torques] * ("T_delta" in motion.columns), *[_path] * ("x" in motion.columns)]
    figure = new_figure(6.4, 1.0 + 2.4 * len(parts))
    axes = figure.subplots(len(parts), 1, squeeze=False)[:, 0]
    axes[0].set_title(motion.problem.title, fontsize=11)
    for draw, ax in zip(parts, axes, strict=True):
        draw(motion, ax)
        finish_axes(ax)
    return figure


def _angles(motion: Simulation, ax: Axes) -> None:
    names = [m.name for m in motion.measures if not m.name.startswith("T_")]
    scale, label = (180 / np.pi, "angle in deg") if "phi" in motion.columns else (1.0, "coordinate")
    _lines(motion, ax, names, scale, label)
    settled = np.max([m.settling for m in motion.measures])  # nan if one is
    if settled < motion["t"][-1]:
        ax.axvspan(settled, motion["t"][-1], color="0.93", zorder=0, label="settled within 2 %")


def _torques(motion: Simulation, ax: Axes) -> None:
    names = [n for n in ("T_phi", "T_delta") if n in motion.columns]
    _lines(motion, ax, names, 1.0, f"torque in {motion.units['T_delta']}")


def _path(motion: Simulation, ax: Axes) -> None:
    for end, colour in (("rear", CRITICAL), ("front", MARK)):
        ax.plot(motion["x"], motion[f"y_{end}"], color=colour, label=f"{end} contact")
    ax.invert_yaxis()  # seen from above, ahead is to the right
    unit = motion.units["x"]
    ax.set(xlabel=f"way of the rear contact in {unit}", ylabel=f"to the right in {unit}")


def _lines(motion: Simulation, ax: Axes, names: Sequence[str], scale: float, label: str) -> None:
    for k, name in enumerate(names):
        style, y = "-" if k < 6 else "--", scale * np.asarray(motion[name])
        ax.plot(motion["t"], y, style, color=_COLOURS[k % 6], label=_LATEX.get(name, name))
    ax.axhline(0, color="0.6", linewidth=0.6, zorder=0)
    unit = motion.units.get("t")
    ax.set(xlim=(0, motion["t"][-1]), xlabel=f"time in {unit}" if unit else "time", ylabel=label)
