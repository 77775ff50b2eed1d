"""The table of results: who writes the text of each, its one line, and who draws it."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tmsopt import guide, plots, report as texts
from tmsopt.display import headlines
from tmsopt.errors import Fault, InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH = 100
"""Characters of a line at most."""


@dataclass(frozen=True)
class Writer:
    """Who shows results of one class.

    Attributes:
        text: of a result, and whether all the rest is asked for.
        words: what it is and how it ended, a few words each.
        picture: the name in `tmsopt.plots` of what draws it; empty where nothing does.
    """

    text: Callable[[Any, bool], str]
    words: Callable[[Any], Iterable[str]]
    picture: str


WRITERS: Mapping[str, Writer] = {
    "Solution": Writer(
        lambda x, full: texts.design_report(x, texts.findings(x, full), full), headlines.of_solution, "draw_growth"
    ),
    "Front": Writer(texts.front_table, headlines.of_front, "draw_front"),
    "Trace": Writer(lambda x, full: texts.trace_table(x), headlines.of_trace, "draw_trace"),
    "Branch": Writer(lambda x, full: texts.branch_table(x), headlines.of_branch, ""),
    "Chart": Writer(lambda x, full: texts.chart_table(x), headlines.of_chart, "draw_chart"),
    "Speeds": Writer(lambda x, full: texts.speeds_table(x), headlines.of_speeds, "draw_speeds"),
    "Growth": Writer(lambda x, full: texts.growth_table(x), headlines.of_growth, "draw_growth"),
    "Simulation": Writer(texts.motion_table, headlines.of_motion, "draw_motion"),
    "Comparison": Writer(lambda x, full: texts.comparison_table(x), headlines.of_comparison, "draw_comparison"),
    "Results": Writer(
        lambda x, full: texts.study_table(x.study, x.summary, x.rows, full), headlines.of_results, "draw_histogram"
    ),
    "Proof": Writer(lambda x, full: texts.proof_text(x.problem.posed, x), headlines.of_proof, "draw_roots"),
    "Every": Writer(lambda x, full: texts.every_table(x), headlines.of_every, "draw_designs"),
    "Explanation": Writer(
        lambda x, full: "\n".join(texts.explained_lines(x)), headlines.of_explanation, "draw_rounding"
    ),
    "Optimality": Writer(lambda x, full: "\n".join(texts.optimality_lines(x)), headlines.of_optimality, "draw_roots"),
    "Robustness": Writer(lambda x, full: texts.robustness_table(x), headlines.of_robustness, "draw_robustness"),
    "Nearest": Writer(lambda x, full: texts.nearest_table(x), headlines.of_nearest, "draw_robustness"),
    "Diagnosis": Writer(
        lambda x, full: "\n".join(texts.diagnosis_lines([x], details=full)), headlines.of_diagnosis, "draw_splitting"
    ),
    "Domain": Writer(lambda x, full: texts.domain_table(x), headlines.of_domain, "draw_domain"),
    "Swallowtail": Writer(lambda x, full: texts.swallowtail_table(x), headlines.of_swallowtail, "draw_swallowtail"),
    "Ledger": Writer(lambda x, full: texts.ledger_table(x), headlines.of_ledger, "draw_ledger"),
    "Description": Writer(lambda x, full: guide.description_text(x), headlines.of_description, ""),
}
"""Class of a result → who shows it. By name, so that to show one loads no other."""


def report(result: Any, full: bool = False) -> str:
    """The text of a result."""
    return _writer(result).text(result, full)


def headline(result: Any) -> str:
    """What it is and how it ended, then its title as far as there is room."""
    name = type(result).__name__
    said = ", ".join(" ".join(word.split()) for word in _writer(result).words(result) if word != "stable")
    room = WIDTH - len(name) - 2
    title = title_of(result)
    return f"{name}({_cut(said + (f'; {title}' if title else ''), room)})"


def title_of(result: Any) -> str:
    """The title of a result, or of the study, problem or design that it is of, on one line; empty without one."""
    designs = (getattr(result, "design", None), *getattr(result, "solutions", ()))
    holders = (result, getattr(result, "study", None), *designs)
    titled = (*holders, *(getattr(holder, "problem", None) for holder in holders))
    told = getattr(result, "about", {}).get("title", "")  # of a chart, whose folder may not hold its problem
    return " ".join(next((t for x in titled if (t := getattr(x, "title", ""))), told).split())


def drawn(result: Any, ax: "Axes | None" = None) -> "Axes":
    """A result drawn into Axes.

    Raises:
        InputError: where nothing draws it, or for what are no Axes.
    """
    from matplotlib.axes import Axes

    if not isinstance(ax, Axes | None):
        raise InputError([Fault(f"found {type(ax).__name__}; accepted: Axes of Matplotlib, or None", ("ax",))])
    if not (name := _writer(result).picture):
        advice = "plot a solution of it, or what it is a part of"
        raise InputError([Fault(f"there is no picture of a {type(result).__name__} alone; {advice}")])
    axes: Axes = getattr(plots, name)(result, ax=ax)
    return axes


def plotted(result: Any, ax: "Axes | None" = None) -> "Axes":
    """The same for a user: a new figure is one of pyplot's, which a notebook and ``plt.show()`` show.

    Raises:
        InputError: as `drawn`.
    """
    axes = drawn(result, ax)
    if ax is None:
        import matplotlib.pyplot as plt
        from matplotlib._pylab_helpers import Gcf

        blank = plt.figure()
        number, canvas = blank.number, type(blank.canvas)
        plt.close(blank)
        figure: Any = axes.get_figure()
        Gcf._set_new_active_manager(canvas.new_manager(figure, number))
    return axes


def response(solution: Any, **asked: Any) -> Any:
    """The motion of a solution, for its method of that name."""
    from tmsopt.dynamics import simulate  # and SciPy, which to show a result takes not

    return simulate(solution, **asked)


def _writer(result: Any) -> Writer:
    return WRITERS[type(result).__name__]


def _cut(text: str, room: int) -> str:
    return text if len(text) <= room else text[: room - 1].rstrip() + "…"
