"""Traces with their branches, domains, and swallowtails: what is on them, and where their events are."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tmsopt.documents.blocks import ALL, Badge, Block, Cell, Chapter, Figure, Level, Sentence, TableBlock, count_things
from tmsopt.documents.maker import Maker, remove_titles
from tmsopt.documents.tables import format_value, thin_rows, write_question
from tmsopt.models import Model, in_words_of
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import Unit, common_unit, unit_of
from tmsopt.tracing.branch import Branch, Trace, kinds_along
from tmsopt.tracing.domain import Domain
from tmsopt.tracing.swallowtail import Swallowtail

_SHORT = 6  # digits of a point on a page
_ROUNDING = 1e-14  # mismatch of a coefficient at which a point has them all
_FITTING = 1e-6  # mismatch of a coefficient beyond which a point does not belong to its branch


def summarise_trace(trace: Trace) -> Iterator[Badge]:
    """Pattern, branches, points, events."""
    yield Badge(trace.pattern)
    yield Badge(count_things(len(trace.branches), "branch", "branches"))
    yield Badge(count_things(trace.points, "point"))
    yield Badge(count_things(len(trace.events), "event"))


def write_trace(trace: Trace, level: Level) -> Iterator[Chapter]:
    """Branches with their events, in the free parameters."""
    problem, model = trace.problem.posed, trace.problem.model
    yield Chapter("answer", (Sentence(describe_trace(trace), tone="answer"),))
    if level == "page":
        from tmsopt import plots

        caption = f"Branches of {in_words_of(model, trace.pattern)}"
        yield Chapter("picture", (Figure(lambda: plots.draw_trace(remove_titles(trace)), caption),), "Branches")
    units = {n: common_unit(problem, n) for n in (*trace.problem.free, "abscissa")}
    for number, branch in enumerate(trace.branches, start=1):
        events = TableBlock(list_events(branch, units, model), f"Events along branch {number}, to all digits")
        blocks = (Sentence(_describe_branch(branch, trace), f"branch {number}"), events)
        yield Chapter(f"branch-{number}", blocks, f"Branch {number}", "whole")
    if level == "page":
        yield write_question(problem)
        yield _tabulate_points(trace)


def describe_trace(trace: Trace) -> str:
    """How many branches and points, and what they took."""
    per_point = 1e6 * trace.seconds_walking / max(trace.points, 1)
    points = f", {trace.points} points, {per_point:.0f} µs per point" if trace.points else ""
    count = count_things(len(trace.branches), "branch", "branches")
    pattern = in_words_of(trace.problem.model, trace.pattern)
    return f"{pattern}: {count}{points}, found from {trace.starts} starts; {trace.seconds:.2f} s"


def _describe_branch(branch: Branch, trace: Trace) -> str:
    share = f"{100 * float(np.mean(branch.stable)):.0f} % of its points"
    rest = pattern_of(trace.problem.model, branch.pattern).rest
    states = f"{'bounds stability' if rest else 'stable'} on {share}"
    if any(not c.equality for c in trace.problem.posed.conditions.values()):
        states += f", constraints hold on {100 * float(np.mean(branch.satisfied)):.0f} %"
    form = "closed" if branch.closed else "open"
    doubt = "" if branch.residual <= _FITTING else " (too large)"
    kinds = in_words_of(trace.problem.model, " and ".join(dict.fromkeys(kinds_along(branch))))
    return f"{kinds}, {len(branch)} points, {form}, {states}, coefficient error {branch.residual:.0e}{doubt}"


def list_events(branch: Branch, units: Mapping[str, Unit], model: Model | None = None) -> list[Sequence[Cell | str]]:
    """Headings, and the cells of each event, to as many digits as its coefficients are met, in these units."""
    heads = (f"{n} {unit.text}".rstrip() for n, unit in units.items())
    rows: list[Sequence[Cell | str]] = [("event", *heads, "at")]
    for event in branch.events:
        found = {**event.parameters, "abscissa": float(branch.abscissa[event.index])}
        # a point may be off by some times the residual of its coefficients: two digits less than that
        digits = min(max(math.floor(-math.log10(max(event.residual, _ROUNDING))) - 2, 2), ALL)
        numbers = (Cell(found[n], unit, digits) for n, unit in units.items())
        rows.append((name_kind(model, event.name), *numbers, event.detail))
    return rows


def name_kind(model: Model | None, name: str) -> str:
    """A kind of boundary, or an event, in the words of a model where that is known."""
    return in_words_of(model, name) if model else name


def _tabulate_points(trace: Trace) -> Chapter:
    """Points of all branches with their events, in the units of the problem."""
    units = {n: unit_of(trace.problem.posed, n) for n in (*trace.problem.free, "abscissa")}
    model = trace.problem.model
    swings = () if model.carrier is not None else ("heavily damped",)
    facts = ("kind", "stable", *swings, "constraints", "event")
    records = [*trace.records()]
    marked = [k for k, record in enumerate(records) if record["event"]]
    kept, note = thin_rows(records, "points", "tmsopt trace FILE --csv curve.csv writes all", marked)
    rows: list[Sequence[Cell | str]] = [("branch", *(f"{n} {u.text}".rstrip() for n, u in units.items()), *facts)]
    for record in kept:
        numbers = (Cell(record[n], unit, _SHORT) for n, unit in units.items())
        said = (in_words_of(model, format_value(record[fact.replace(" ", "_")])) for fact in facts)
        rows.append((str(record["branch"] + 1), *numbers, *said))
    return Chapter("rows", (*note, TableBlock(rows, "Points of the branches")), "Points", "whole")


def summarise_branch(branch: Branch) -> Iterator[Badge]:
    """The same of one branch."""
    yield Badge(branch.pattern)
    yield Badge(count_things(len(branch), "point"))
    yield Badge(count_things(len(branch.events), "event"))
    yield Badge("closed" if branch.closed else "open")


def write_branch(branch: Branch, _level: Level) -> Iterator[Chapter]:
    """One branch with its events, in the free parameters."""
    form = "closed" if branch.closed else "open"
    found = f"{branch.pattern}: {len(branch)} points, {form}, coefficient error {branch.residual:.0e}"
    yield Chapter("answer", (Sentence(found, tone="answer"),))
    units = dict.fromkeys((*branch.tangent, "abscissa"), Unit())
    yield Chapter("events", (TableBlock(list_events(branch, units), "Events along the branch"),))


def summarise_domain(domain: Domain) -> Iterator[Badge]:
    """How many arcs and corners."""
    yield Badge(f"stability: {count_things(len(domain.stability), 'arc')}")
    yield Badge(f"heavy damping: {count_things(len(domain.heavy_damping), 'arc')}")
    yield Badge(count_things(len(domain.corners), "corner"))


def write_domain(domain: Domain, _level: Level) -> Iterator[Chapter]:
    """What bounds stability and heavy damping, and the corners."""
    yield Chapter("answer", tuple(describe_domain(domain)))
    if domain.corners:
        yield Chapter("corners", (tabulate_corners(domain),))


def describe_domain(domain: Domain, problem: Posed | None = None) -> Iterator[Block]:
    """What bounds stability and heavy damping."""
    model = problem.model if problem else None
    bounded = [("stability", domain.stability)]
    if model is None or model.carrier is None:  # eigenfrequencies of H have no axis on which nothing swings
        bounded.append(("heavy damping", domain.heavy_damping))
    for name, arcs in bounded:
        points: dict[str, list[int]] = {}
        for arc in arcs:
            points.setdefault(name_kind(model, arc.kind), []).append(len(next(iter(arc.points.values()))))
        kinds = [
            f"{kind} ({f'{len(sizes)} curves, ' if len(sizes) > 1 else ''}{sum(sizes)} points)"
            for kind, sizes in points.items()
        ]
        yield Sentence(f"{name} is bounded by {', '.join(kinds) or 'nothing in the box'}")


def tabulate_corners(domain: Domain, problem: Posed | None = None) -> TableBlock:
    """Each corner to all digits, in the units of the problem where it is known."""
    model = problem.model if problem else None
    names = list(domain.corners[0].parameters) if domain.corners else []
    names = [n for n in names if any(n in arc.points for arc in (*domain.stability, *domain.heavy_damping))]
    units = {n: unit_of(problem, n) if problem else Unit() for n in names}
    head = ("corner", *(f"{n} {u.text}".rstrip() for n, u in units.items()))
    rows: list[Sequence[Cell | str]] = [head]
    for c in domain.corners:
        rows.append((name_kind(model, c.name), *(Cell(c.parameters[n], u) for n, u in units.items())))
    return TableBlock(rows, "Corners of the domains")


def summarise_swallowtail(found: Swallowtail) -> Iterator[Badge]:
    """Axes and pieces."""
    yield Badge(" ".join(found.axes))
    yield Badge(count_things(len(found.patches), "patch", "patches"))
    yield Badge(f"edges: {count_things(len(found.cusps.branches), 'EP3 curve')}")


def write_swallowtail(found: Swallowtail, _level: Level) -> Iterator[Chapter]:
    """Pieces of the surface, then its edges as traces."""
    damped = sum(patch.heavily_damped for patch in found.patches)
    pieces = f"{len(found.patches)} patches, {damped} of them bound heavy damping"
    yield Chapter(
        "answer",
        (
            Sentence(f"real negative double roots over {', '.join(found.axes)}: {pieces}", tone="answer"),
            Sentence(describe_trace(found.cusps), "cuspidal edges"),
            Sentence(describe_trace(found.crossing), "self-intersection"),
        ),
    )


MAKERS: Mapping[str, Maker] = {
    "Trace": Maker(summarise_trace, write_trace, "draw_trace"),
    "Branch": Maker(summarise_branch, write_branch),
    "Domain": Maker(summarise_domain, write_domain, "draw_domain"),
    "Swallowtail": Maker(summarise_swallowtail, write_swallowtail, "draw_swallowtail"),
}
