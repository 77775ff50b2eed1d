"""The explorer on the page of a result, and the designs that it has buttons for: the best first, then special ones."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from tmsopt.models import in_words_of
from tmsopt.problem import Posed, Solution, pose, unit_at

if TYPE_CHECKING:
    from tmsopt.charts import Chart
    from tmsopt.fronts import Front
    from tmsopt.proofs import Proof
    from tmsopt.search import Every
    from tmsopt.studies import Results, Row
    from tmsopt.tracing import Trace

Named = tuple[str, Mapping[str, float]]

_MOST = 8  # designs that have a button


def frame_explorer(result: Any, design: Solution | None) -> str:
    """The page that moves the design, in a frame from which nothing gets out; empty for a result without a problem."""
    of, designs = find_designs(result, design)
    if of is None:
        return ""
    from tmsopt.explorer import frame, page_of

    problem: Any = getattr(of, "problem", None) or of
    of_H = problem.model.carrier is not None
    roots, side = ("eigenfrequencies", "below the real axis") if of_H else ("roots", "left of the imaginary axis")
    return (
        f"<p>Move a parameter, and see the {roots} move: disturbances die out where all are {side}.</p>\n"
        f"{frame(page_of(of, designs, trace_curves=True), 'Explorer of this problem')}\n"
        '<p class="print">The explorer is in the file itself, not on paper.</p>'
    )


def find_designs(result: Any, design: Solution | None) -> tuple[Posed | Solution | None, list[Named]]:
    """What the explorer of a result is about, None for one without a problem, and designs by their names."""
    name = type(result).__name__
    holder = getattr(result, "study", result)
    of = result if name == "Solution" else design or getattr(holder, "problem", None)
    of = of or next(iter(getattr(result, "solutions", ())), None)
    if of is None or of is design or name not in _DESIGNS:
        return of, []
    problem = pose(of)
    names = set(problem.parameter_set.names)
    return of, _number_designs((n, values) for n, values in _DESIGNS[name](result) if names <= set(values))


def _number_designs(designs: Iterable[Named]) -> list[Named]:
    """The first of them; those with the same values are one, those with the same name are numbered."""
    found: dict[tuple[float, ...], Named] = {}
    for name, values in designs:
        found.setdefault(tuple(values.values()), (name, values))
    kept = [*found.values()][:_MOST]
    met, seen, listed = Counter(name for name, _ in kept), Counter[str](), []
    for name, values in kept:
        seen[name] += 1
        listed.append((f"{name}, {seen[name]} of {met[name]}" if met[name] > 1 else name, values))
    return listed


def _list_front(front: "Front") -> Iterator[Named]:
    """The fastest decay, then both ends and what changes between them."""
    if front.points:
        best = min(front.points, key=lambda p: _replace_nan(_decay_rate(front.problem.posed, p.solution)))
        yield best.label or "least abscissa", best.solution.parameters
    yield from ((point.label, point.solution.parameters) for point in front.points if point.label)


def _decay_rate(problem: Posed, design: "Solution | Row") -> float:
    """Abscissa by the clock, where there is one."""
    return design.abscissa / unit_at(problem, "abscissa", design.parameters).one


def _list_trace(trace: "Trace") -> Iterator[Named]:
    """Events at which more roots meet, then the fastest decay, then what else happens; not where a limit ends it."""
    events = [(e, branch) for branch in trace.branches for e in branch.events if e.name not in _ENDS]
    events.sort(key=lambda at: _replace_nan(at[1].abscissa[at[0].index]))
    named = [("EP" in e.name, in_words_of(trace.problem.model, e.name), e.parameters) for e, _ in events]
    yield from ((name, values) for meets, name, values in named if meets)
    points = [(branch, k) for branch in trace.branches for k in range(len(branch))]
    if points:
        branch, k = min(points, key=lambda at: _replace_nan(at[0].abscissa[at[1]]))
        yield "least abscissa", {n: float(column[k]) for n, column in branch.parameters.items()}
    yield from ((name, values) for meets, name, values in named if not meets)


def _list_chart(chart: "Chart") -> Iterator[Named]:
    """The best design of the grid."""
    if best := chart.to_json()["least_abscissa"]:
        yield "least abscissa", chart.problem.posed.ordered({n: best[n] for n in chart.axes})


def _list_results(results: "Results") -> Iterator[Named]:
    """The best row, and the one that decays least."""
    problem = results.study.problem.posed
    known = [row for row in results.rows if math.isfinite(row.abscissa)]
    rate = partial(_decay_rate, problem)
    if known:
        best, last = results.summary.best or min(known, key=rate), max(known, key=rate)
        yield f"best, row {best.number}", best.parameters
        yield f"greatest abscissa, row {last.number}", last.parameters


def _list_proof(proof: "Proof") -> Iterator[Named]:
    """The design as it was proved, to the digits of a double."""
    if proof.parameters:
        yield "proved", {n: float(number.value) for n, number in proof.parameters.items()}


def _list_every(every: "Every") -> Iterator[Named]:
    """All but the first, at which the page opens anyway."""
    yield from ((f"design {k}", s.parameters) for k, s in enumerate(every.solutions[1:], start=2))


def _replace_nan(value: float) -> float:
    return math.inf if math.isnan(value) else value


_ENDS = ("end", "constraint")
"""Events at which a branch only meets a limit."""

_DESIGNS: Mapping[str, Callable[[Any], Iterator[Named]]] = {
    "Chart": _list_chart,
    "Every": _list_every,
    "Front": _list_front,
    "Proof": _list_proof,
    "Results": _list_results,
    "Trace": _list_trace,
}
