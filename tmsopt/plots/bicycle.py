"""A two-mass-skate bicycle to scale with its parameters, drawn into Axes that the caller made."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, Polygon
from numpy.typing import ArrayLike

from tmsopt.paper.sketch import Sketch, sketch
from tmsopt.plots.style import CRITICAL, HEAVY, LINE, MARK, REAL, arrow, on_axes
from tmsopt.problem.solution import Solution
from tmsopt.records import Array

REAR_FRAME, FRONT_FRAME = CRITICAL, MARK
"""Colours of the rear frame with mass B, and of the front assembly with mass H."""

_THIN: dict[str, Any] = {"linewidth": 0.8, "color": "0.25"}
_BOX: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}


def draw_bicycle(data: Sketch | Solution, ax: Axes | None = None) -> Axes:
    """A two-mass-skate bicycle to scale.

    The Axes show its side in wheelbases, z down, with dimension lines, speed, gravity, lean φ and steer δ.

    Example:
        >>> axes = tmsopt.plots.draw_bicycle(tmsopt.solve("problems/benchmark.toml"))
        >>> {"steer axis", "$m_B$", "$m_H$", "$w$", "$x_B$", "$z_B$"} <= {text.get_text() for text in axes.texts}
        True

    More: docs/tutorials/first_bicycle.md
    """
    data = data if isinstance(data, Sketch) else sketch(data.dimensionless)
    ax = on_axes(ax, 6.4, 4.1)
    ahead = max(1.0, float(data.B[0]), float(data.H[0]))
    reach = max(
        0.62, 0.24 - float(data.B[1]), 0.3 - float(data.H[1])
    )  # the top of the steer axis, clear of both masses
    _line(ax, (-0.12, 0), (ahead + 0.42, 0), color="0.4", linewidth=1.2, zorder=1)
    x = np.arange(-0.09, ahead + 0.42, 0.045)
    ax.plot([x, x - 0.025], [0 * x, 0 * x + 0.025], color="0.6", linewidth=0.6, zorder=1)  # hatched: the ground
    _frames(ax, data, reach)
    _dimensions(ax, data, ahead)
    radius = 0.86 * reach
    _line(ax, (1, 0), (1, -radius - 0.07), color="0.35", linewidth=0.8, linestyle="--", zorder=2)
    ends = sorted((-90.0, -90.0 - np.rad2deg(data.parameters["lambda_s"])))
    ax.add_patch(Arc((1, 0), 2 * radius, 2 * radius, theta1=ends[0], theta2=ends[1], **_THIN))
    _text(ax, (1.055, -radius), r"$\lambda_s$")
    speed, gravity = (ahead + 0.08, 0.03 - reach), (-0.2, 0.06 - reach)
    arrow(ax, speed, np.add(speed, (0.3, 0)), (0.3, 0.6), color=REAL, linewidth=1.5)
    arrow(ax, gravity, np.add(gravity, (0, 0.24)), (0.3, 0.6), color="0.3", linewidth=1.5)
    _text(ax, speed, "$v$", (0.15, -0.06), fontsize=12, color=REAL)
    _text(ax, gravity, "$g$", (0.05, 0.1), fontsize=12, color="0.3")
    _turn(ax, np.array([-0.2, 0.0]), np.array([1.0, 0.0]), r"$\phi$", (-0.1, -0.1))
    _turn(ax, _top(data, reach - 0.04), -data.axis, r"$\delta$", (0.13, -0.03))
    ax.set(aspect="equal", xlim=(-0.42, ahead + 0.5), ylim=(0.36, -reach - 0.12))
    ax.set_axis_off()
    return ax


def draw_distance(data: Sketch, ax: Axes | None = None) -> Axes:
    """The distance u_H = ν_H w of H from the steer axis; the Axes show an enlargement around H and the contact.

    Example:
        >>> from tmsopt.paper import sketch
        >>> design = tmsopt.solve("problems/benchmark.toml")
        >>> axes = tmsopt.plots.draw_distance(sketch(design.dimensionless))
        >>> f"{design.quantities['nu_H']:.4f}" in axes.texts[1].get_text()
        True

    More: docs/tutorials/first_bicycle.md
    """
    ax = on_axes(ax, 3.4, 3.4)
    span = np.array([data.front, data.H, data.foot])
    middle, half = (span.max(axis=0) + span.min(axis=0)) / 2, 0.85 * float(np.ptp(span, axis=0).max())
    _line(ax, data.on_axis(-2), data.on_axis(2), color=FRONT_FRAME, linewidth=1.2, linestyle="-.", gid="axis")
    _line(ax, (middle[0] - 2, 0), (middle[0] + 2, 0), color="0.4", linewidth=1.2)
    _line(ax, data.H, data.foot, color=LINE, linewidth=1.6, gid="distance")
    across = (data.H - data.foot) / max(abs(data.nu_H), 1e-12)
    _line(ax, *(data.foot + 0.07 * half * side for side in (across, across - data.axis, -data.axis)), **_THIN)
    ax.add_patch(Circle(tuple(data.H), 0.06 * half, facecolor=FRONT_FRAME, edgecolor="black", zorder=5))
    ax.plot(*data.front, "o", markersize=4, color="black", zorder=5)
    _text(ax, data.H, "$H$", (0.17 * half, 0))
    ax.annotate(
        rf"$u_H = \nu_H w$" "\n" rf"$\nu_H = {data.nu_H:.4f}$",
        tuple((data.H + data.foot) / 2),
        (middle[0] + 0.58 * half, middle[1] - 0.1 * half),
        fontsize=9,
        horizontalalignment="center",
        verticalalignment="center",
        arrowprops={"arrowstyle": "-", "linewidth": 0.6, "shrinkB": 2},
        bbox=_BOX,
    )
    words: dict[str, Any] = {"fontsize": 8.5, "horizontalalignment": "right"}
    _text(ax, data.on_axis(0.35 * half), "steer axis", (-0.08 * half, 0), color=FRONT_FRAME, **words)
    _text(ax, (data.front[0] - 0.08 * half, 0.13 * half), "front contact", **words)
    low, high = middle - half, middle + half
    ax.set(aspect="equal", xlim=(low[0], high[0]), ylim=(high[1], low[1]), xticks=[], yticks=[])
    return ax


def _line(ax: Axes, *points: ArrayLike, **look: Any) -> None:
    x, y = np.array(points, dtype=float).T
    ax.plot(x, y, **look)


def _text(ax: Axes, at: ArrayLike, text: str, offset: ArrayLike = 0, **look: Any) -> None:
    x, y = np.add(at, offset)
    centred = {"fontsize": 11, "horizontalalignment": "center", "verticalalignment": "center"}
    ax.text(x, y, text, **{**centred, **look})


def _top(data: Sketch, height: float) -> Array:
    """The point of the steer axis at a height."""
    return data.on_axis(height / max(-float(data.axis[1]), 0.3))


def _frames(ax: Axes, data: Sketch, reach: float) -> None:
    """The rear frame from its skate to the steering head and to B; the front assembly along the axis to H."""
    head, end = _top(data, 0.52 * reach), _top(data, reach + 0.06)
    for points, colour, width in (
        ([data.rear, head, data.B], REAR_FRAME, 4),
        ([data.front, _top(data, 0.86 * reach)], FRONT_FRAME, 3),
        ([data.foot, data.H], FRONT_FRAME, 3),
    ):
        _line(ax, *points, color=colour, linewidth=width, solid_capstyle="round", alpha=0.9, zorder=3)
    ax.plot(*head, "o", markersize=8, markerfacecolor="white", markeredgecolor=REAR_FRAME, zorder=4)
    _line(ax, data.on_axis(-0.12), end, color=FRONT_FRAME, linewidth=1.0, linestyle="-.", zorder=2, gid="axis")
    _text(ax, end, "steer axis", (-0.1, -0.04), fontsize=9, color=FRONT_FRAME, horizontalalignment="right")
    for name, mass, contact, colour, radius in (
        ("B", data.B, data.rear, REAR_FRAME, 0.044),
        ("H", data.H, data.front, FRONT_FRAME, 0.03),
    ):
        skate = contact + np.array([[-0.055, -0.03], [0.055, -0.03], [0.03, 0.0], [-0.03, 0.0]])
        look: dict[str, Any] = {"facecolor": colour, "edgecolor": "black", "linewidth": 0.8, "zorder": 6}
        ax.add_patch(Polygon(skate, closed=True, **look))
        ax.add_patch(Circle(tuple(mass), radius, gid=name, **look))
        _text(ax, mass, rf"$m_{name}$", (0.1, -0.05), zorder=7)


def _dimensions(ax: Axes, data: Sketch, ahead: float) -> None:
    """w, x_B and x_H below the ground; z_B and z_H in front of the bicycle; x and z axes at the rear contact."""
    (x_B, z_B), (x_H, z_H) = data.B, data.H
    faint: dict[str, Any] = {"color": "0.6", "linewidth": 0.5, "zorder": 1}
    _line(ax, (0, 0.02), (0, 0.325), **faint)
    for name, x, level in (("w", 1.0, 0.11), ("x_H", x_H, 0.21), ("x_B", x_B, 0.31)):
        _dimension(ax, (0, level), (x, level), name)
        _line(ax, (x, 0.02), (x, level + 0.015), **faint)
    for name, x, z, place in (("z_H", x_H, z_H, ahead + 0.16), ("z_B", x_B, z_B, ahead + 0.3)):
        _dimension(ax, (place, 0), (place, z), name)
        _line(ax, (x + 0.06, z), (place + 0.015, z), **faint)
        _line(ax, (x, z), (x, 0), linestyle=":", **faint)
    for name, end, at in (("$x$", (0.2, 0), (0.235, 0.06)), ("$z$", (0, 0.2), (-0.035, 0.18))):
        arrow(ax, (0, 0), end, zorder=8, color="black")
        _text(ax, at, name, fontsize=10, bbox=_BOX, zorder=4)


def _dimension(ax: Axes, start: tuple[float, float], end: tuple[float, float], name: str) -> None:
    for tip, tail in ((start, end), (end, start)):
        arrow(ax, tail, tip, (0.15, 0.35), zorder=3, **_THIN)
    _text(ax, np.add(start, end) / 2, f"${name}$", bbox=_BOX)


def _turn(ax: Axes, centre: Array, about: Array, name: str, offset: tuple[float, float]) -> None:
    """A circle about an axis of the drawing plane, seen from the side as an ellipse, turning right-handed."""
    across = np.array([-about[1], about[0]])
    angle = np.linspace(np.deg2rad(-150), np.deg2rad(150), 80)
    # the near side of a right-handed turn about x (forward) moves down: y, to the viewer's side, goes to z
    path = centre + 0.075 * np.sin(angle)[:, None] * across + 0.028 * np.cos(angle)[:, None] * about
    _line(ax, *path, color=HEAVY, linewidth=1.8, zorder=7)
    arrow(ax, path[-6], path[-1], (0.28, 0.5), zorder=8, color=HEAVY)
    _text(ax, centre, name, offset, fontsize=12)
