"""Draw a two-mass-skate bicycle to scale, with its parameters."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, Polygon
from numpy.typing import ArrayLike

from tmsopt.paper.sketch import Sketch, sketch
from tmsopt.plots.style import CRITICAL, HEAVY, LINE, MARK, REAL, draw_arrow, ensure_axes
from tmsopt.problem.solution import Solution
from tmsopt.records import Array

REAR_FRAME, FRONT_FRAME = CRITICAL, MARK
"""Colours of the rear frame, which has the mass B, and of the front assembly, which has the mass H."""

_THIN_LINE: dict[str, Any] = {"linewidth": 0.8, "color": "0.25"}
_FAINT_LINE: dict[str, Any] = {"linewidth": 0.5, "color": "0.6", "zorder": 1}
_TEXT_BOX: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}


def draw_bicycle(data: Sketch | Solution, ax: Axes | None = None) -> Axes:
    """Draw a two-mass-skate bicycle to scale.

    The Axes show its side view, with the wheelbase as unit and z pointing down. They also show dimension lines, speed,
    gravity, lean φ and steer δ.

    Example:
        >>> axes = tmsopt.plots.draw_bicycle(tmsopt.solve("problems/benchmark.toml"))
        >>> {"steer axis", "$m_B$", "$m_H$", "$w$", "$x_B$", "$z_B$"} <= {text.get_text() for text in axes.texts}
        True

    More: docs/tutorials/first_bicycle.md
    """
    data = data if isinstance(data, Sketch) else sketch(data.dimensionless)
    ax = ensure_axes(ax, 6.4, 4.1)
    front_end = max(1.0, data.B[0], data.H[0])
    top_height = max(0.62, 0.24 - data.B[1], 0.3 - data.H[1])  # top of the drawn steer axis, above both masses
    _draw_line(ax, (-0.12, 0), (front_end + 0.42, 0), color="0.4", linewidth=1.2)
    x = np.arange(-0.09, front_end + 0.42, 0.045)
    ax.plot([x, x - 0.025], [0 * x, 0 * x + 0.025], **_FAINT_LINE)  # hatching of the ground
    _draw_frames(ax, data, top_height)
    _draw_dimensions(ax, data, front_end)
    radius, tilt = 0.86 * top_height, np.rad2deg(data.parameters["lambda_s"])
    _draw_line(ax, (1, 0), (1, -radius - 0.07), linestyle="--", **_THIN_LINE)
    arc = Arc((1, 0), 2 * radius, 2 * radius, angle=-90, theta1=min(0, -tilt), theta2=max(0, -tilt), **_THIN_LINE)
    ax.add_patch(arc)
    _draw_text(ax, (1.055, -radius), r"$\lambda_s$")
    for start, step, name, offset, colour in (
        ((front_end + 0.08, 0.03 - top_height), (0.3, 0), "$v$", (0.15, -0.06), REAL),
        ((-0.2, 0.06 - top_height), (0, 0.24), "$g$", (0.05, 0.1), "0.3"),
        ((0, 0), (0.2, 0), "$x$", (0.235, 0.06), "black"),
        ((0, 0), (0, 0.2), "$z$", (-0.035, 0.18), "black"),
    ):
        draw_arrow(ax, start, np.add(start, step), color=colour)
        _draw_text(ax, np.add(start, offset), name, color=colour)
    for centre, turn_axis, name, offset in (
        (np.array([-0.2, 0.0]), np.array([1.0, 0.0]), r"$\phi$", (-0.1, -0.1)),
        (_axis_point(data, top_height - 0.04), -data.axis, r"$\delta$", (0.13, -0.03)),
    ):
        # The path of a rotation about an axis in the drawing plane is a circle, which looks like an ellipse. In a
        # right-handed rotation about x (forward), y (towards the viewer) turns to z (down): the near side moves down.
        angle = np.deg2rad(np.linspace(-150, 150, 80))[:, None]
        path = centre + 0.075 * np.sin(angle) * (-turn_axis[1], turn_axis[0]) + 0.028 * np.cos(angle) * turn_axis
        _draw_line(ax, *path, color=HEAVY)
        draw_arrow(ax, path[-6], path[-1], color=HEAVY)
        _draw_text(ax, np.add(centre, offset), name)
    ax.set(aspect="equal", xlim=(-0.42, front_end + 0.5), ylim=(0.36, -top_height - 0.12))
    ax.set_axis_off()
    return ax


def draw_distance(data: Sketch, ax: Axes | None = None) -> Axes:
    """Draw the distance u_H = ν_H w of the mass H from the steer axis.

    The Axes show an enlargement around H and the front contact.

    Example:
        >>> from tmsopt.paper import sketch
        >>> design = tmsopt.solve("problems/benchmark.toml")
        >>> axes = tmsopt.plots.draw_distance(sketch(design.dimensionless))
        >>> f"{design.quantities['nu_H']:.4f}" in axes.texts[1].get_text()
        True

    More: docs/tutorials/first_bicycle.md
    """
    ax = ensure_axes(ax, 3.4, 3.4)
    points = np.array([data.front, data.H, data.foot])
    centre, half_width = (points.max(axis=0) + points.min(axis=0)) / 2, 0.85 * np.ptp(points, axis=0).max()
    _draw_line(ax, data.on_axis(-2), data.on_axis(2), color=FRONT_FRAME, linestyle="-.", gid="axis")
    _draw_line(ax, (centre[0] - 2, 0), (centre[0] + 2, 0), color="0.4", linewidth=1.2)
    _draw_line(ax, data.H, data.foot, color=LINE, gid="distance")
    normal = (data.H - data.foot) / max(abs(data.nu_H), 1e-12)
    _draw_line(
        ax,
        *(data.foot + 0.07 * half_width * offset for offset in (normal, normal - data.axis, -data.axis)),
        **_THIN_LINE,
    )
    ax.add_patch(Circle(tuple(data.H), 0.06 * half_width, facecolor=FRONT_FRAME, edgecolor="black", zorder=5))
    ax.plot(*data.front, "ko", markersize=4)
    _draw_text(ax, np.add(data.H, (0.17 * half_width, 0)), "$H$")
    _draw_text(
        ax,
        (data.H + data.foot) / 2,
        rf"$u_H = \nu_H w$" "\n" rf"$\nu_H = {data.nu_H:.4f}$",
        xytext=np.add(centre, (0.58 * half_width, -0.1 * half_width)),
        arrowprops={"arrowstyle": "-", "linewidth": 0.6},
        bbox=_TEXT_BOX,
    )
    text_style: dict[str, Any] = {"fontsize": 8.5, "horizontalalignment": "right"}
    _draw_text(
        ax,
        np.add(data.on_axis(0.35 * half_width), (-0.08 * half_width, 0)),
        "steer axis",
        color=FRONT_FRAME,
        **text_style,
    )
    _draw_text(ax, (data.front[0] - 0.08 * half_width, 0.13 * half_width), "front contact", **text_style)
    low, high = centre - half_width, centre + half_width
    ax.set(aspect="equal", xlim=(low[0], high[0]), ylim=(high[1], low[1]), xticks=[], yticks=[])
    return ax


def _draw_line(ax: Axes, *points: ArrayLike, **look: Any) -> None:
    ax.plot(*np.array(points, dtype=float).T, **look)


def _draw_text(ax: Axes, point: Any, text: str, **look: Any) -> None:
    default_look = {"fontsize": 11, "horizontalalignment": "center", "verticalalignment": "center"}
    ax.annotate(text, point, **{**default_look, **look})


def _axis_point(data: Sketch, height: float) -> Array:
    """The point of the steer axis at a height."""
    return data.on_axis(height / max(-data.axis[1], 0.3))


def _draw_frames(ax: Axes, data: Sketch, top_height: float) -> None:
    """Draw the rear frame from its skate to the steering head and to B, and the front assembly along the axis to H."""
    head, end = _axis_point(data, 0.52 * top_height), _axis_point(data, top_height + 0.06)
    _draw_line(ax, data.on_axis(-0.12), end, color=FRONT_FRAME, linewidth=1.0, linestyle="-.", gid="axis")
    _draw_text(ax, np.add(end, (-0.1, -0.04)), "steer axis", color=FRONT_FRAME, horizontalalignment="right")
    front_lines = [data.front, _axis_point(data, 0.86 * top_height)], [data.foot, data.H]
    for name, mass, contact, colour, lines in (
        ("B", data.B, data.rear, REAR_FRAME, [[data.rear, head, data.B]]),
        ("H", data.H, data.front, FRONT_FRAME, front_lines),
    ):
        for points in lines:
            _draw_line(ax, *points, color=colour, linewidth=3.5, alpha=0.9)
        skate = contact + np.array([[-0.055, -0.03], [0.055, -0.03], [0.03, 0.0], [-0.03, 0.0]])
        for shape in (Polygon(skate), Circle(tuple(mass), 0.037, gid=name)):
            shape.set(facecolor=colour, edgecolor="black", linewidth=0.8, zorder=6)
            ax.add_patch(shape)
        _draw_text(ax, np.add(mass, (0.1, -0.05)), rf"$m_{name}$")
    ax.plot(*head, "o", markersize=8, markerfacecolor="white", markeredgecolor=REAR_FRAME)


def _draw_dimensions(ax: Axes, data: Sketch, front_end: float) -> None:
    """Draw dimension lines: w, x_B and x_H below the ground, and z_B and z_H in front of the bicycle.

    The dimensions start at the rear contact or at the ground.
    """
    (x_B, z_B), (x_H, z_H) = data.B, data.H
    _draw_line(ax, (0, 0.02), (0, 0.325), **_FAINT_LINE)
    for name, start, end, line_start in (
        ("w", (0, 0.11), (1, 0.11), (1, 0.02)),
        ("x_H", (0, 0.21), (x_H, 0.21), (x_H, 0.02)),
        ("x_B", (0, 0.31), (x_B, 0.31), (x_B, 0.02)),
        ("z_H", (front_end + 0.16, 0), (front_end + 0.16, z_H), (x_H + 0.06, z_H)),
        ("z_B", (front_end + 0.3, 0), (front_end + 0.3, z_B), (x_B + 0.06, z_B)),
    ):
        _draw_line(ax, line_start, end, **_FAINT_LINE)
        for tip, tail in ((start, end), (end, start)):
            draw_arrow(ax, tail, tip, **_THIN_LINE)
        _draw_text(ax, np.add(start, end) / 2, f"${name}$", bbox=_TEXT_BOX)
    for x, z in (data.B, data.H):
        _draw_line(ax, (x, z), (x, 0), linestyle=":", **_FAINT_LINE)
