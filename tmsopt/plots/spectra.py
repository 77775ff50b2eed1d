"""Draw eigenvalues along a loop, and Riemann sheets over a plane of two parameters."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from tmsopt.errors import input_error
from tmsopt.plots.labels import COMPLEX_H_LABELS, Name, abscissa_label, finish_axes, plane_over
from tmsopt.plots.style import (
    CAPSIZE,
    COMPLEX,
    CRITICAL,
    EDGE,
    HEAVY,
    LINE,
    MARK,
    REAL,
    STABLE,
    draw_arrow,
    ensure_axes,
    figure_of,
    new_figure,
)
from tmsopt.problem import Problem
from tmsopt.spectra import Loop, Sheets
from tmsopt.spectra.plane import order_by_parts

_COLOURS = (CRITICAL, MARK, REAL, HEAVY, COMPLEX, STABLE, LINE, CAPSIZE)
_MAX_FACES = 14_000  # largest number of faces of a picture; a finer grid is thinned


def draw_loop(data: Loop, ax: Axes | None = None) -> Axes:
    """Draw the eigenvalues along a loop in the complex plane.

    A disc with a number marks the start of an eigenvalue, and a square marks its end after one turn.

    Example:
        >>> axes = tmsopt.plots.draw_loop(tmsopt.encircle("problems/loss_only_dimer.toml"))
        >>> [text.get_text() for text in axes.texts]
        ['0', '1']

    More: docs/how_to/encircle.md
    """
    ax = ensure_axes(ax, 4.8, 4.4, data.problem.title)
    for k, z in enumerate(data.eigenvalues.T):
        colour = _COLOURS[k % len(_COLOURS)]
        ax.plot(z.real, z.imag, color=colour)
        ax.plot(z.real[0], z.imag[0], "o", color=colour, **EDGE)
        ax.plot(z.real[-1], z.imag[-1], "s", color=colour, fillstyle="none", markersize=10)
    labels = _label_parts(data.problem)
    ax.set(xlabel=labels["real"], ylabel=labels["imag"])
    return finish_axes(ax, [Name(str(k), z.real, z.imag) for k, z in enumerate(data.eigenvalues[0])])


def loop_figure(data: Loop) -> Figure:
    """Draw a loop with the exceptional points inside, and the eigenvalues along the loop, in a new figure.

    Example:
        >>> figure = tmsopt.plots.loop_figure(tmsopt.encircle("problems/loss_only_dimer.toml"))
        >>> [axes.get_xlabel() for axes in figure.axes]
        ['$d$', '$\\\\mathrm{Re}\\\\,\\\\omega$']

    More: docs/how_to/encircle.md
    """
    figure = new_figure(8.4, 4.2)
    left, right = figure.subplots(1, 2)
    plane, waves = plane_over(data.problem.posed, *data.plane), (np.cos(data.angles), np.sin(data.angles))
    circle = plane.to_axis({n: data.parameters[n] + data.radius * w for n, w in zip(data.plane, waves, strict=True)})
    left.plot(*circle, color=LINE)
    left.plot(*circle[:, :1], "o", color=LINE)
    draw_arrow(left, circle[:, 0], circle[:, 1], color=LINE)
    names = [Name(p.name, *plane.to_axis(p.parameters)) for p in data.inside]
    for name in names:
        left.plot(name.x, name.y, "o", color=MARK, **EDGE)
    plane.label(left)
    figure.suptitle(data.problem.title, fontsize=11)
    draw_loop(data, right)
    finish_axes(left, names)
    return figure


def draw_sheets(data: Sheets, ax: Axes | None = None, part: str = "real") -> Axes:
    """Draw one part of the eigenvalues as surfaces over two parameters. The colour shows the other part.

    The surfaces are sorted by the part that is drawn, so they meet along cuts. A disc marks a multiple eigenvalue.

    Args:
        ax: Axes with three dimensions (``projection="3d"``).
        part: ``real`` or ``imag``.

    Example:
        >>> axes = tmsopt.plots.draw_sheets(tmsopt.sheets("problems/loss_only_dimer.toml", grid=(9, 9)))
        >>> axes.get_xlabel(), axes.get_zlabel()
        ('$d$', '$\\\\mathrm{Re}\\\\,\\\\omega$')

    More: docs/how_to/encircle.md
    """
    space: Any = new_figure(5.4, 4.6).add_subplot(projection="3d", title=data.problem.title) if ax is None else ax
    if not hasattr(space, "plot_surface"):
        raise input_error("found Axes of a plane; accepted: Axes made with projection='3d'", "ax")
    values = data.values[:, :, data.picture_indices]
    step = math.ceil(math.sqrt(values.size / _MAX_FACES))
    values = values[::step, ::step] if part == "real" else 1j * values[::step, ::step].conj()  # the real part is drawn
    values = np.moveaxis(np.take_along_axis(values, order_by_parts(values), axis=-1), -1, 0)
    surfaces = np.pad(values, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan).reshape(-1, values.shape[2])
    plane = plane_over(data.problem.posed, *data.axes)
    x, y = (axis.to_axis(numbers[::step]) for axis, numbers in zip(plane, data.grid, strict=True))
    X, Y = np.meshgrid(x, np.tile([*y, np.nan], len(values)))
    colours = ScalarMappable(Normalize(np.nanmin(surfaces.imag), np.nanmax(surfaces.imag)), "cividis")
    look: dict[str, Any] = {"rstride": 1, "cstride": 1, "linewidth": 0, "antialiased": False, "shade": False}
    space.plot_surface(X, Y, surfaces.real, facecolors=colours.to_rgba(surfaces.imag), **look)
    space.computed_zorder = False  # so that surfaces do not hide the discs
    for z in data.multiple:
        space.plot(*plane.to_axis(data.parameters)[:, None], [getattr(z, part)], "o", color=MARK, zorder=9, **EDGE)
    labels = _label_parts(data.problem)
    plane.label(space)
    space.set_zlabel(labels.pop(part))
    figure_of(space).colorbar(colours, ax=space, label=next(iter(labels.values())), shrink=0.6, pad=0.12)
    axes: Axes = space
    return axes


def sheets_figure(data: Sheets) -> Figure:
    """Draw both parts of the eigenvalues as surfaces over two parameters, in a new figure.

    Example:
        >>> figure = tmsopt.plots.sheets_figure(tmsopt.sheets("problems/loss_only_dimer.toml", grid=(9, 9)))
        >>> [axes.get_zlabel() for axes in figure.axes[::2]]
        ['$\\\\mathrm{Re}\\\\,\\\\omega$', '$\\\\mathrm{Im}\\\\,\\\\omega$ (loss negative)']

    More: docs/how_to/encircle.md
    """
    figure = new_figure(10.4, 4.6)
    figure.suptitle(data.problem.title, fontsize=11)
    for k, part in enumerate(("real", "imag"), start=1):
        draw_sheets(data, figure.add_subplot(1, 2, k, projection="3d"), part)
    return figure


def _label_parts(problem: Problem) -> dict[str, str]:
    """Labels of the real and the imaginary part of ω for a complex H, otherwise of s."""
    if problem.model.is_complex:
        return {"real": COMPLEX_H_LABELS["imag"], "imag": COMPLEX_H_LABELS["real"]}
    names = {"real": r"$\mathrm{Re}\,s$", "imag": r"$\mathrm{Im}\,s$"}
    return {part: abscissa_label(problem.posed, name) for part, name in names.items()}
