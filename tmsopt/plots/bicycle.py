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
_FAINT: dict[str, Any] = {"linewidth": 0.5, "color": "0.6", "zorder": 1}
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
    ahead = max(1.0, data.B[0], data.H[0])
    reach = max(0.62, 0.24 - data.B[1], 0.3 - data.H[1])  # the top of the steer axis, clear of both masses
    _line(ax, (-0.12, 0), (ahead + 0.42, 0), color="0.4", linewidth=1.2)
    x = np.arange(-0.09, ahead + 0.42, 0.045)
    ax.plot([x, x - 0.025], [0 * x, 0 * x + 0.025], **_FAINT)  # hatched: the ground
    _frames(ax, data, reach)
    _dimensions(ax, data, ahead)
    radius, tilt = 0.86 * reach, np.rad2deg(data.parameters["lambda_s"])
    _line(ax, (1, 0), (1, -radius - 0.07), linestyle="--", **_THIN)
    arc = Arc((1, 0), 2 * radius, 2 * radius, angle=-90, theta1=min(0, -tilt), theta2=max(0, -tilt), **_THIN)
    ax.add_patch(arc)
    _text(ax, (1.055, -radius), r"$\lambda_s$")
    for start, step, name, offset, colour in (
        ((ahead + 0.08, 0.03 - reach), (0.3, 0), "$v$", (0.15, -0.06), REAL),
        ((-0.2, 0.06 - reach), (0, 0.24), "$g$", (0.05, 0.1), "0.3"),
        ((0, 0), (0.2, 0), "$x$", (0.235, 0.06), "black"),
        ((0, 0), (0, 0.2), "$z$", (-0.035, 0.18), "black"),
    ):
        arrow(ax, start, np.add(start, step), color=colour)
        _text(ax, np.add(start, offset), name, color=colour)
    for centre, about, name, offset in (
        (np.array([-0.2, 0.0]), np.array([1.0, 0.0]), r"$\phi$", (-0.1, -0.1)),
        (_top(data, reach - 0.04), -data.axis, r"$\delta$", (0.13, -0.03)),
    ):
        # a circle about an axis of the drawing plane, seen from the side as an ellipse; the near side of a right-handed
        # turn about x (forward) moves down: y, to the viewer's side, goes to z
        angle = np.deg2rad(np.linspace(-150, 150, 80))[:, None]
        path = centre + 0.075 * np.sin(angle) * (-about[1], about[0]) + 0.028 * np.cos(angle) * about
        _line(ax, *path, color=HEAVY)
        arrow(ax, path[-6], path[-1], color=HEAVY)
        _text(ax, np.add(centre, offset), name)
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
    middle, half = (span.max(axis=0) + span.min(axis=0)) / 2, 0.85 * np.ptp(span, axis=0).max()
    _line(ax, data.on_axis(-2), data.on_axis(2), color=FRONT_FRAME, linestyle="-.", gid="axis")
    _line(ax, (middle[0] - 2, 0), (middle[0] + 2, 0), color="0.4", linewidth=1.2)
    _line(ax, data.H, data.foot, color=LINE, gid="distance")
    across = (data.H - data.foot) / max(abs(data.nu_H), 1e-12)
    _line(ax, *(data.foot + 0.07 * half * side for side in (across, across - data.axis, -data.axis)), **_THIN)
    ax.add_patch(Circle(tuple(data.H), 0.06 * half, facecolor=FRONT_FRAME, edgecolor="black", zorder=5))
    ax.plot(*data.front, "ko", markersize=4)
    _text(ax, np.add(data.H, (0.17 * half, 0)), "$H$")
    _text(
        ax,
        (data.H + data.foot) / 2,
        rf"$u_H = \nu_H w$" "\n" rf"$\nu_H = {data.nu_H:.4f}$",
        xytext=np.add(middle, (0.58 * half, -0.1 * half)),
        arrowprops={"arrowstyle": "-", "linewidth": 0.6},
        bbox=_BOX,
    )
    words: dict[str, Any] = {"fontsize": 8.5, "horizontalalignment": "right"}
    _text(ax, np.add(data.on_axis(0.35 * half), (-0.08 * half, 0)), "steer axis", color=FRONT_FRAME, **words)
    _text(ax, (data.front[0] - 0.08 * half, 0.13 * half), "front contact", **words)
    low, high = middle - half, middle + half
    ax.set(aspect="equal", xlim=(low[0], high[0]), ylim=(high[1], low[1]), xticks=[], yticks=[])
    return ax


def _line(ax: Axes, *points: ArrayLike, **look: Any) -> None:
    ax.plot(*np.array(points, dtype=float).T, **look)


def _text(ax: Axes, at: Any, text: str, **look: Any) -> None:
    centred = {"fontsize": 11, "horizontalalignment": "center", "verticalalignment": "center"}
    ax.annotate(text, at, **{**centred, **look})


def _top(data: Sketch, height: float) -> Array:
    """The point of the steer axis at a height."""
    return data.on_axis(height / max(-data.axis[1], 0.3))


def _frames(ax: Axes, data: Sketch, reach: float) -> None:
    """The rear frame from its skate to the steering head and to B; the front assembly along the axis to H."""
    head, end = _top(data, 0.52 * reach), _top(data, reach + 0.06)
    _line(ax, data.on_axis(-0.12), end, color=FRONT_FRAME, linewidth=1.0, linestyle="-.", gid="axis")
    _text(ax, np.add(end, (-0.1, -0.04)), "steer axis", color=FRONT_FRAME, horizontalalignment="right")
    front = [data.front, _top(data, 0.86 * reach)], [data.foot, data.H]
    for name, mass, contact, colour, parts in (
        ("B", data.B, data.rear, REAR_FRAME, [[data.rear, head, data.B]]),
        ("H", data.H, data.front, FRONT_FRAME, front),
    ):
        for points in parts:
            _line(ax, *points, color=colour, linewidth=3.5, alpha=0.9)
        skate = contact + np.array([[-0.055, -0.03], [0.055, -0.03], [0.03, 0.0], [-0.03, 0.0]])
        for shape in (Polygon(skate), Circle(tuple(mass), 0.037, gid=name)):
            shape.set(facecolor=colour, edgecolor="black", linewidth=0.8, zorder=6)
            ax.add_patch(shape)
        _text(ax, np.add(mass, (0.1, -0.05)), rf"$m_{name}$")
    ax.plot(*head, "o", markersize=8, markerfacecolor="white", markeredgecolor=REAR_FRAME)


def _dimensions(ax: Axes, data: Sketch, ahead: float) -> None:
    """w, x_B and x_H below the ground; z_B and z_H in front of the bicycle, each from the ground or rear contact."""
    (x_B, z_B), (x_H, z_H) = data.B, data.H
    _line(ax, (0, 0.02), (0, 0.325), **_FAINT)
    for name, start, end, measured in (
        ("w", (0, 0.11), (1, 0.11), (1, 0.02)),
        ("x_H", (0, 0.21), (x_H, 0.21), (x_H, 0.02)),
        ("x_B", (0, 0.31), (x_B, 0.31), (x_B, 0.02)),
        ("z_H", (ahead + 0.16, 0), (ahead + 0.16, z_H), (x_H + 0.06, z_H)),
        ("z_B", (ahead + 0.3, 0), (ahead + 0.3, z_B), (x_B + 0.06, z_B)),
    ):
        _line(ax, measured, end, **_FAINT)
        for tip, tail in ((start, end), (end, start)):
            arrow(ax, tail, tip, **_THIN)
        _text(ax, np.add(start, end) / 2, f"${name}$", bbox=_BOX)
    for x, z in (data.B, data.H):
        _line(ax, (x, z), (x, 0), linestyle=":", **_FAINT)
