"""A two-mass-skate bicycle to scale with its parameters, drawn into Axes that the caller made."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, Polygon

from tmsopt.paper.sketch import Sketch, sketch
from tmsopt.plots.style import CRITICAL, HEAVY, LINE, MARK, REAL, on_axes
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
    reach = _reach(data)
    _ground(ax, -0.12, max(1.0, data.B[0], data.H[0]) + 0.42)
    _frames(ax, data, reach)
    _axis(ax, data, reach)
    _masses(ax, data, 0.035)
    _dimensions(ax, data)
    _tilt(ax, data, reach)
    _motion(ax, data, reach)
    ax.set_aspect("equal")
    ax.set_xlim(-0.42, max(1.0, data.B[0], data.H[0]) + 0.5)
    ax.set_ylim(0.36, -reach - 0.12)
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
    ends = np.array([data.on_axis(-2), data.on_axis(2)])
    ax.plot(ends[:, 0], ends[:, 1], color=FRONT_FRAME, linewidth=1.2, linestyle="-.", gid="axis")
    ax.plot([middle[0] - 2, middle[0] + 2], [0, 0], color="0.4", linewidth=1.2)
    ax.plot(*np.array([data.H, data.foot]).T, color=LINE, linewidth=1.6, gid="distance")
    mark = 0.07 * half
    across = (data.H - data.foot) / max(abs(data.nu_H), 1e-12)
    corner = np.array(
        [data.foot + mark * across, data.foot + mark * (across - data.axis), data.foot - mark * data.axis]
    )
    ax.plot(corner[:, 0], corner[:, 1], **_THIN)
    ax.add_patch(Circle((data.H[0], data.H[1]), 0.06 * half, facecolor=FRONT_FRAME, edgecolor="black", zorder=5))
    ax.plot(*data.front, marker="o", markersize=4, color="black", zorder=5)
    ax.text(data.H[0] + 0.11 * half, data.H[1], "$H$", fontsize=11, verticalalignment="center")
    label = (data.H + data.foot) / 2
    ax.annotate(
        rf"$u_H = \nu_H w$" "\n" rf"$\nu_H = {data.nu_H:.4f}$",
        (label[0], label[1]),
        xytext=(middle[0] + 0.58 * half, middle[1] - 0.1 * half),
        fontsize=9,
        horizontalalignment="center",
        verticalalignment="center",
        arrowprops={"arrowstyle": "-", "linewidth": 0.6, "shrinkB": 2},
        bbox=_BOX,
    )
    steer = data.on_axis(0.35 * half)
    ax.text(
        steer[0] - 0.08 * half,
        steer[1],
        "steer axis",
        color=FRONT_FRAME,
        fontsize=8.5,
        horizontalalignment="right",
        verticalalignment="center",
    )
    ax.text(
        data.front[0] - 0.08 * half,
        0.13 * half,
        "front contact",
        fontsize=8.5,
        horizontalalignment="right",
        verticalalignment="center",
    )
    ax.set_aspect("equal")
    ax.set_xlim(middle[0] - half, middle[0] + half)
    ax.set_ylim(middle[1] + half, middle[1] - half)
    ax.set(xticks=[], yticks=[])
    return ax


def _reach(data: Sketch) -> float:
    """Height of the top of the steer axis, clear of both masses."""
    return max(0.62, -float(data.B[1]) + 0.24, -float(data.H[1]) + 0.3)


def _top(data: Sketch, reach: float) -> Array:
    return data.on_axis(reach / max(-float(data.axis[1]), 0.3))


def _ground(ax: Axes, low: float, high: float) -> None:
    ax.plot([low, high], [0, 0], color="0.4", linewidth=1.2, zorder=1)
    for x in np.arange(low + 0.03, high, 0.045):
        ax.plot([x, x - 0.025], [0, 0.025], color="0.6", linewidth=0.6, zorder=1)


def _frames(ax: Axes, data: Sketch, reach: float) -> None:
    """The rear frame from its skate to the steering head and to B; the front assembly along the axis to H."""
    head = data.on_axis(0.52 * reach / max(-float(data.axis[1]), 0.3))
    for points in ([data.rear, head, data.B],):
        ax.plot(*np.array(points).T, color=REAR_FRAME, linewidth=4, solid_capstyle="round", alpha=0.85, zorder=2)
    joint = data.foot
    for points in ([data.front, _top(data, 0.86 * reach)], [joint, data.H]):
        ax.plot(*np.array(points).T, color=FRONT_FRAME, linewidth=3, solid_capstyle="round", alpha=0.9, zorder=3)
    ax.plot(*head, marker="o", markersize=8, markerfacecolor="white", markeredgecolor=REAR_FRAME, zorder=4)
    for contact, colour in ((data.rear, REAR_FRAME), (data.front, FRONT_FRAME)):
        skate = contact + np.array([[-0.055, -0.03], [0.055, -0.03], [0.03, 0.0], [-0.03, 0.0]])
        ax.add_patch(Polygon(skate, closed=True, facecolor=colour, edgecolor="black", linewidth=0.7, zorder=5))


def _axis(ax: Axes, data: Sketch, reach: float) -> None:
    ends = np.array([data.on_axis(-0.12), _top(data, reach + 0.06)])
    ax.plot(*ends.T, color=FRONT_FRAME, linewidth=1.0, linestyle="-.", zorder=2, gid="axis")
    ax.text(
        ends[1][0] - 0.1, ends[1][1] - 0.02, "steer axis", fontsize=9, color=FRONT_FRAME, horizontalalignment="right"
    )


def _masses(ax: Axes, data: Sketch, radius: float) -> None:
    for name, at, colour, size in (("B", data.B, REAR_FRAME, 1.25), ("H", data.H, FRONT_FRAME, 0.85)):
        ax.add_patch(
            Circle(
                (at[0], at[1]), radius * size, facecolor=colour, edgecolor="black", linewidth=0.8, zorder=6, gid=name
            )
        )
        ax.text(
            at[0] + 0.055,
            at[1] - 0.02,
            rf"$m_{name}$",
            fontsize=11,
            zorder=7,
            verticalalignment="bottom",
        )


def _dimensions(ax: Axes, data: Sketch) -> None:
    """w, x_B and x_H below the ground; z_B and z_H in front of the bicycle; x and z axes at the rear contact."""
    for name, x, level in (("w", 1.0, 0.11), ("x_H", data.H[0], 0.21), ("x_B", data.B[0], 0.31)):
        _dimension(ax, np.array([0.0, level]), np.array([float(x), level]), f"${name}$")
        ax.plot([x, x], [0.02, level + 0.015], color="0.6", linewidth=0.5, zorder=1)
    ax.plot([0, 0], [0.02, 0.325], color="0.6", linewidth=0.5, zorder=1)
    for at in (data.B, data.H):
        ax.plot([at[0], at[0]], [at[1], 0.0], color="0.6", linewidth=0.5, linestyle=":", zorder=1)
    ahead = max(1.0, float(data.B[0]), float(data.H[0]))
    for name, at, x in (("z_H", data.H, ahead + 0.16), ("z_B", data.B, ahead + 0.3)):
        _dimension(ax, np.array([x, 0.0]), np.array([x, float(at[1])]), f"${name}$")
        ax.plot([at[0] + 0.06, x + 0.015], [at[1], at[1]], color="0.6", linewidth=0.5, zorder=1)
    for end, name, offset in (((0.2, 0.0), "$x$", (0.035, 0.06)), ((0.0, 0.2), "$z$", (-0.035, 0.0))):
        ax.annotate("", end, (0, 0), zorder=8, arrowprops={"arrowstyle": "-|>", "color": "black", "shrinkA": 0})
        ax.text(
            end[0] + offset[0], end[1] + offset[1], name, fontsize=10, horizontalalignment="center", bbox=_BOX, zorder=4
        )


def _dimension(ax: Axes, start: Array, end: Array, name: str) -> None:
    ax.annotate(
        "",
        tuple(end),
        tuple(start),
        arrowprops={"arrowstyle": "<|-|>,head_width=0.15,head_length=0.35", "shrinkA": 0, "shrinkB": 0, **_THIN},
    )
    middle = (start + end) / 2
    ax.text(
        middle[0], middle[1], name, fontsize=11, horizontalalignment="center", verticalalignment="center", bbox=_BOX
    )


def _tilt(ax: Axes, data: Sketch, reach: float) -> None:
    """λ_s between the vertical and the axis at the front contact."""
    radius = 0.86 * reach
    ax.plot([1, 1], [0, -radius - 0.07], color="0.35", linewidth=0.8, linestyle="--", zorder=2)
    tilt = float(np.rad2deg(data.parameters["lambda_s"]))
    first, last = sorted((-90.0, -90.0 - tilt))
    ax.add_patch(Arc((1, 0), 2 * radius, 2 * radius, theta1=first, theta2=last, **_THIN))
    ax.text(1.03, -radius, r"$\lambda_s$", fontsize=11, verticalalignment="center")


def _motion(ax: Axes, data: Sketch, reach: float) -> None:
    """Speed and gravity as arrows, lean about the line of contacts and steer about its axis as turning arrows."""
    big = "-|>,head_width=0.3,head_length=0.6"
    start, level = max(1.0, float(data.B[0]), float(data.H[0])) + 0.08, -reach + 0.03
    for end, begin, colour in (
        ((start + 0.3, level), (start, level), REAL),
        ((-0.2, -reach + 0.3), (-0.2, -reach + 0.06), "0.3"),
    ):
        ax.annotate("", end, begin, arrowprops={"arrowstyle": big, "linewidth": 1.5, "color": colour})
    ax.text(start + 0.15, level - 0.035, "$v$", fontsize=12, horizontalalignment="center", color=REAL)
    ax.text(-0.17, -reach + 0.17, "$g$", fontsize=12, color="0.3")
    _turn(ax, np.array([-0.2, 0.0]), np.array([1.0, 0.0]), r"$\phi$", np.array([-0.1, -0.1]))
    _turn(ax, _top(data, reach - 0.04), -data.axis, r"$\delta$", np.array([0.13, -0.03]))


def _turn(ax: Axes, centre: Array, about: Array, name: str, offset: Array) -> None:
    """A circle about an axis of the drawing plane, seen from the side as an ellipse, turning right-handed."""
    across = np.array([-about[1], about[0]])
    angle = np.linspace(np.deg2rad(-150), np.deg2rad(150), 80)
    # the near side of a right-handed turn about x (forward) moves down: y, to the viewer's side, goes to z
    path = centre + 0.075 * np.sin(angle)[:, None] * across + 0.028 * np.cos(angle)[:, None] * about
    ax.plot(*path.T, color=HEAVY, linewidth=1.8, zorder=7)
    ax.annotate(
        "",
        tuple(path[-1]),
        tuple(path[-6]),
        zorder=8,
        arrowprops={"arrowstyle": "-|>,head_width=0.28,head_length=0.5", "color": HEAVY, "shrinkA": 0, "shrinkB": 0},
    )
    ax.text(
        centre[0] + offset[0],
        centre[1] + offset[1],
        name,
        fontsize=12,
        horizontalalignment="center",
        verticalalignment="center",
    )
