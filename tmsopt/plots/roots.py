"""Draw roots in the complex plane, and how a multiple root splits."""

import math
from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes

from tmsopt.analysis import Diagnosis, Optimality
from tmsopt.plots.labels import COMPLEX_H_LABELS, finish_axes
from tmsopt.plots.style import CAPSIZE, COMPLEX, CRITICAL, MARK, REAL, ensure_axes, write_note
from tmsopt.problem.solution import Solution
from tmsopt.proofs import Proof

_COLOURS = (CRITICAL, MARK, REAL, COMPLEX, CAPSIZE)
_STYLES = ("-", "--", "-.", ":")


def draw_roots(data: Solution | Proof | Optimality, ax: Axes | None = None) -> Axes:
    """Draw roots with their multiplicities; for an `Optimality`, only the rightmost roots.

    The Axes show the complex plane, in 1/s for a problem in SI. The half where motion grows is grey. For a complex H
    the Axes show eigenfrequencies, and the upper half is grey. For a proof, the title gives the width of the
    proved intervals.

    Example:
        >>> axes = tmsopt.plots.draw_roots(tmsopt.solve("problems/ep4.toml"))
        >>> [text.get_text() for text in axes.texts]
        ['4-fold']

    More: docs/explanation/exceptional_points.md
    """
    rate, unit = 1.0, ""
    if isinstance(data, Optimality):
        is_complex = any(root.eigenfrequency is not None for root in data.roots)
    else:
        is_complex = bool(data.eigenfrequencies)
    if isinstance(data, Solution):
        if (parameters := data.problem.posed.parameter_set).rate is not None:
            rate, unit = float(parameters.rate(data.parameters)), " in 1/s"
        extreme_root = f"rightmost at {rate * data.abscissa:.5g}{unit[3:]}"
        if is_complex:
            extreme_root = f"largest Im ω {max(w.im for w in data.eigenfrequencies):.5g}"
        title = f"{data.problem.title}\n{data.structure}, {extreme_root}".strip()
    elif isinstance(data, Proof):
        precision = f"each number within {data.radius:.1g}" if math.isfinite(data.radius) else data.method
        title = f"{data.claim}:\n" + (f"proved, {precision}" if data.proved else "not proved")
    else:
        title = f"{data.goal or 'abscissa'}: {data.verdict}"
    ax = ensure_axes(ax, 4.6, 4.4)
    ax.set_title(title, fontsize=9.5)
    ax.axhline(0, color="grey", linewidth=0.6)
    roots = [(float(r.re), float(r.im), r.multiplicity) for r in data.roots]
    if is_complex:
        positions = {(0.0 - im, re): m for re, im, m in roots}
        _frame_frequencies(ax, positions)
    else:
        positions = {(rate * re, rate * im * sign): m for re, im, m in roots for sign in (1, -1)}
        size = max((math.hypot(*z) for z in positions), default=1.0) * 1.3 or 1.0
        ax.axvspan(0, size, color="0.92", zorder=0)
        ax.axvline(0, color="grey", linewidth=0.6)
        ax.set(xlim=(-size, max([0.3 * size, *(1.2 * re for re, _ in positions)])), ylim=(-size, size))
        ax.set(xlabel=rf"$\mathrm{{Re}}\,s${unit}", ylabel=rf"$\mathrm{{Im}}\,s${unit}")
    for position, m in positions.items():
        ax.plot(*position, "o" if m == 1 else "s", color=REAL if m == 1 else MARK, markersize=5 + m)
        if m > 1:
            write_note(ax, f"{m}-fold", position, (7, 7), fontsize=9)
    return finish_axes(ax)


def _frame_frequencies(ax: Axes, positions: Iterable[tuple[float, float]]) -> None:
    """Set limits around eigenfrequencies, and colour the half-plane above the real axis, where motion grows."""
    x, y = np.array([*positions]).T
    middle, low, high = np.mean(x), min(0.0, *y), max(0.0, *y)
    size = max(np.ptp(x), high - low)
    size = size if size > 1e-12 * abs(middle) else abs(middle) or 1.0
    ax.axhspan(0, high + size, color="0.92", zorder=0)
    ax.set(xlim=(middle - 0.8 * size, middle + 0.8 * size), ylim=(low - 0.3 * size, high + 0.3 * size))
    ax.set(xlabel=COMPLEX_H_LABELS["imag"], ylabel=COMPLEX_H_LABELS["real"])


def draw_splitting(data: Diagnosis, ax: Axes | None = None) -> Axes:
    """Draw how far a multiple root splits when one parameter changes.

    The Axes show the largest shift of a root over the change ε, both on logarithmic scales. The change is relative, or
    absolute for a parameter that is 0. Each parameter has a line, which ends where its law no longer holds; the legend
    shows the exponent of the law.

    Example:
        >>> diagnosis, = tmsopt.diagnose(tmsopt.solve("problems/ep4.toml"))
        >>> axes = tmsopt.plots.draw_splitting(diagnosis)
        >>> axes.get_title(), ["1/4" in line.get_label() for line in axes.lines] == [True] * len(axes.lines)
        ('4-fold root at -1.8803, defective', True)

    More: docs/explanation/exceptional_points.md
    """
    root_text, root_name = f"pair at {data.re:.5g} ± {data.im:.5g}i" if data.im else f"root at {data.re:.5g}", "root"
    if (omega := data.eigenfrequency) is not None:
        root_name = "eigenfrequency"
        root_text = f"{root_name} {f'{omega:.5g}'.replace('j', 'i') if omega else 0}"
    ax = ensure_axes(ax, 6.0, 4.4, f"{data.algebraic}-fold {root_text}, {data.kind}")
    for k, response in enumerate(data.responses):
        for law in response.laws[:1]:
            max_change = min(max(law.below, law.above, 1e-15), 1.0)
            eps, power = np.array([1e-16, max_change]), law.branches.exponent
            label, style = rf"{response.parameter}: $\varepsilon^{{{power}}}$", "o" + _STYLES[k % 4]
            shift = law.branches.prefactor * eps ** float(power)
            ax.loglog(eps, shift, style, color=_COLOURS[k % 5], label=label, markevery=[1], markersize=4)
    ax.set(xlabel=r"change $\varepsilon$ of a parameter", ylabel=f"shift of the farthest {root_name}")
    return finish_axes(ax)
