"""Roots in the complex plane, and how a multiple one splits."""

import math
from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes

from tmsopt.analysis import Diagnosis, Optimality
from tmsopt.plots.labels import OF_H, finish_axes
from tmsopt.plots.style import CAPSIZE, COMPLEX, CRITICAL, MARK, REAL, note, on_axes
from tmsopt.problem.solution import Solution
from tmsopt.proofs import Proof

_COLOURS = (CRITICAL, MARK, REAL, COMPLEX, CAPSIZE)
_STYLES = ("-", "--", "-.", ":")


def draw_roots(data: Solution | Proof | Optimality, ax: Axes | None = None) -> Axes:
    """Roots with their multiplicities, of a judgement of an optimum those on the rightmost line.

    The Axes show the complex plane, in 1/s for a problem in SI; the half of it where motion grows is grey: of a complex
    H, whose eigenfrequencies they show, the upper one. The title of a proof says how narrow the proved balls are.

    Example:
        >>> axes = tmsopt.plots.draw_roots(tmsopt.solve("problems/ep4.toml"))
        >>> [text.get_text() for text in axes.texts]
        ['4-fold']

    More: docs/explanation/exceptional_points.md
    """
    rate, unit = 1.0, ""
    if isinstance(data, Optimality):
        of_H = any(root.eigenfrequency is not None for root in data.roots)
    else:
        of_H = bool(data.eigenfrequencies)
    if isinstance(data, Solution):
        if (of := data.problem.posed.parameter_set).rate is not None:
            rate, unit = float(of.rate(data.parameters)), " in 1/s"
        reach = f"rightmost at {rate * data.abscissa:.5g}{unit[3:]}"
        if of_H:
            reach = f"largest Im ω {max(w.im for w in data.eigenfrequencies):.5g}"
        title = f"{data.problem.title}\n{data.structure}, {reach}".strip()
    elif isinstance(data, Proof):
        narrow = f"each number within {data.radius:.1g}" if math.isfinite(data.radius) else data.method
        title = f"{data.claim}:\n" + (f"proved, {narrow}" if data.proved else "not proved")
    else:
        title = f"{data.goal or 'abscissa'}: {data.verdict}"
    ax = on_axes(ax, 4.6, 4.4)
    ax.set_title(title, fontsize=9.5)
    ax.axhline(0, color="grey", linewidth=0.6)
    roots = [(float(r.re), float(r.im), r.multiplicity) for r in data.roots]
    if of_H:
        found = {(0.0 - im, re): m for re, im, m in roots}
        problem = getattr(data, "problem", None)
        _frame_frequencies(ax, found, abs(problem.model.carrier or 1.0) if problem else 1.0)
    else:
        found = {(rate * re, rate * im * side): m for re, im, m in roots for side in (1, -1)}
        size = max((math.hypot(*z) for z in found), default=1.0) * 1.3 or 1.0
        ax.axvspan(0, size, color="0.92", zorder=0)
        ax.axvline(0, color="grey", linewidth=0.6)
        ax.set(xlim=(-size, max([0.3 * size, *(1.2 * re for re, _ in found)])), ylim=(-size, size))
        ax.set(xlabel=rf"$\mathrm{{Re}}\,s${unit}", ylabel=rf"$\mathrm{{Im}}\,s${unit}")
    for place, m in found.items():
        ax.plot(*place, "o" if m == 1 else "s", color=REAL if m == 1 else MARK, markersize=5 + m)
        if m > 1:
            note(ax, f"{m}-fold", place, (7, 7), fontsize=9)
    return finish_axes(ax)


def _frame_frequencies(ax: Axes, found: Iterable[tuple[float, float]], scale: float) -> None:
    """Limits around eigenfrequencies, and the half of the plane above the real axis, where motion grows.

    Args:
        scale: of the problem: less than 1e-12 of it is 0 but for rounding.
    """
    x, y = np.array([*found]).T
    middle, low, high = np.mean(x), min(0.0, *y), max(0.0, *y)
    size = max(np.ptp(x), high - low)
    size = size if size > 1e-12 * scale else max(abs(middle), scale)
    ax.axhspan(0, high + size, color="0.92", zorder=0)
    ax.set(xlim=(middle - 0.8 * size, middle + 0.8 * size), ylim=(low - 0.3 * size, high + 0.3 * size))
    ax.set(xlabel=OF_H["imag"], ylabel=OF_H["real"])


def draw_splitting(data: Diagnosis, ax: Axes | None = None) -> Axes:
    """How far a multiple root splits when one parameter changes.

    The Axes show the largest shift over the change ε, relative or for a parameter that is 0 absolute, both logarithmic:
    a line per parameter as far as the law holds, with its exponent.

    Example:
        >>> diagnosis, = tmsopt.diagnose(tmsopt.solve("problems/ep4.toml"))
        >>> axes = tmsopt.plots.draw_splitting(diagnosis)
        >>> axes.get_title(), ["1/4" in line.get_label() for line in axes.lines] == [True] * len(axes.lines)
        ('4-fold root at -1.8803, defective', True)

    More: docs/explanation/exceptional_points.md
    """
    place, farthest = f"pair at {data.re:.5g} ± {data.im:.5g}i" if data.im else f"root at {data.re:.5g}", "root"
    if (omega := data.eigenfrequency) is not None:
        farthest = "eigenfrequency"
        place = f"{farthest} {f'{omega:.5g}'.replace('j', 'i') if omega else 0}"
    ax = on_axes(ax, 6.0, 4.4, f"{data.algebraic}-fold {place}, {data.kind}")
    for k, response in enumerate(data.responses):
        for law in response.laws[:1]:
            reach = min(max(law.below, law.above, 1e-15), 1.0)
            eps, power = np.array([1e-16, reach]), law.branches.exponent
            label, style = rf"{response.parameter}: $\varepsilon^{{{power}}}$", "o" + _STYLES[k % 4]
            shift = law.branches.size * eps ** float(power)
            ax.loglog(eps, shift, style, color=_COLOURS[k % 5], label=label, markevery=[1], markersize=4)
    ax.set(xlabel=r"change $\varepsilon$ of a parameter", ylabel=f"shift of the farthest {farthest}")
    return finish_axes(ax)
