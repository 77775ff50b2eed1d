"""Traces with their branches, domains, and swallowtails: what is on them, and where their events are."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from tmsopt import plots
from tmsopt.documents.blocks import (
    ALL,
    Cell,
    Chapter,
    Figure,
    Level,
    Parts,
    Row,
    Sentence,
    TableBlock,
    count_things,
)
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


def write_trace(trace: Trace, level: Level) -> Parts:
    """Branches with their events, in the free parameters."""
    counts = count_things(trace.points, "point"), count_things(trace.events, "event")
    yield trace.pattern, count_things(trace.branches, "branch", "branches"), *counts
    problem, model = trace.problem.posed, trace.problem.model
    yield Sentence(describe_trace(trace), tone="answer")
    if level == "page":
        yield Chapter("picture", "Branches")
        yield Figure(plots.draw_trace, trace, f"Branches of {in_words_of(model, trace.pattern)}")
    units = {n: common_unit(problem, n) for n in (*trace.problem.free, "abscissa")}
    for number, branch in enumerate(trace.branches, start=1):
        yield Chapter(f"branch-{number}", f"Branch {number}", "whole")
        yield Sentence(_describe_branch(branch, trace), f"branch {number}")
        yield TableBlock(list_events(branch, units, model), f"Events along branch {number}, to all digits")
    if level == "page":
        yield from write_question(problem)
        yield from _tabulate_points(trace)


def describe_trace(trace: Trace) -> str:
    """How many branches and points, and what they took."""
    per_point = 1e6 * trace.seconds_walking / max(trace.points, 1)
    points = f", {trace.points} points at {per_point:.0f} µs each" if trace.points else ""
    count = count_things(trace.branches, "branch", "branches")
    pattern = in_words_of(trace.problem.model, trace.pattern)
    return f"{pattern}: {count}{points}, searched from {trace.starts} starts; {trace.seconds:.2f} s"


def _describe_branch(branch: Branch, trace: Trace) -> str:
    share = f"{100 * float(np.mean(branch.stable)):.0f} % of its points"
    rest = pattern_of(trace.problem.model, branch.pattern).rest
    states = f"{'bounds stability' if rest else 'stable'} on {share}"
    if any(not c.equality for c in trace.problem.posed.conditions.values()):
        states += f", constraints hold on {100 * float(np.mean(branch.satisfied)):.0f} %"
    form = "closed" if branch.closed else "open"
    met = "met" if branch.residual <= _FITTING else "met only"
    kinds = in_words_of(trace.problem.model, " and ".join(dict.fromkeys(kinds_along(branch))))
    return f"{kinds}, {len(branch)} points, {form}, {states}, coefficients {met} to {branch.residual:.0e}"


def list_events(branch: Branch, units: Mapping[str, Unit], model: Model | None = None) -> list[Row]:
    """Headings, and the cells of each event, to as many digits as its coefficients are met, in these units."""
    rows: list[Row] = [("event", *_head_columns(units), "at")]
    for event in branch.events:
        found = {**event.parameters, "abscissa": float(branch.abscissa[event.index])}
        # a point may be off by some times the residual of its coefficients: two digits less than that
        digits = min(max(math.floor(-math.log10(max(event.residual, _ROUNDING))) - 2, 2), ALL)
        rows.append((name_kind(model, event.name), *_list_numbers(found, units, digits), event.detail))
    return rows


def name_kind(model: Model | None, name: str) -> str:
    """A kind of boundary, or an event, in the words of a model where that is known."""
    return in_words_of(model, name) if model else name


def _head_columns(units: Mapping[str, Unit]) -> Iterator[str]:
    return (f"{n} {unit.text}".rstrip() for n, unit in units.items())


def _list_numbers(values: Mapping[str, float], units: Mapping[str, Unit], digits: int = ALL) -> Iterator[Cell]:
    return (Cell(values[n], unit, digits) for n, unit in units.items())


def _tabulate_points(trace: Trace) -> Parts:
    """Points of all branches with their events, in the units of the problem."""
    units = {n: unit_of(trace.problem.posed, n) for n in (*trace.problem.free, "abscissa")}
    model = trace.problem.model
    swings = () if model.carrier is not None else ("heavily damped",)
    facts = ("kind", "stable", *swings, "constraints", "event")
    records = [*trace.records()]
    marked = [k for k, record in enumerate(records) if record["event"]]
    kept, note = thin_rows(records, "points", "tmsopt trace FILE --csv curve.csv writes all", marked)
    rows: list[Row] = [("branch", *_head_columns(units), *facts)]
    for record in kept:
        said = (in_words_of(model, format_value(record[fact.replace(" ", "_")])) for fact in facts)
        rows.append((str(record["branch"] + 1), *_list_numbers(record, units, _SHORT), *said))
    yield Chapter("rows", "Points", "whole")
    yield from note
    yield TableBlock(rows, "Points of the branches")


def write_branch(branch: Branch, _level: Level) -> Parts:
    """One branch with its events, in the free parameters."""
    form = "closed" if branch.closed else "open"
    yield branch.pattern, count_things(branch, "point"), count_things(branch.events, "event"), form
    found = f"{branch.pattern}: {len(branch)} points, {form}, coefficients met to {branch.residual:.0e}"
    yield Sentence(found, tone="answer")
    yield Chapter("events")
    units = dict.fromkeys((*branch.tangent, "abscissa"), Unit())
    yield TableBlock(list_events(branch, units), "Events along the branch")


def write_domain(domain: Domain, _level: Level) -> Parts:
    """What bounds stability and heavy damping, and the corners."""
    stability, damping = (count_things(arcs, "arc") for arcs in (domain.stability, domain.heavy_damping))
    yield f"stability: {stability}", f"heavy damping: {damping}", count_things(domain.corners, "corner")
    yield from describe_domain(domain)
    yield Chapter("corners")
    yield from tabulate_corners(domain)


def describe_domain(domain: Domain, problem: Posed | None = None) -> Iterator[str]:
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
        yield f"{name} is bounded by {', '.join(kinds) or 'nothing in the box'}"


def tabulate_corners(domain: Domain, problem: Posed | None = None) -> Iterator[TableBlock]:
    """Each corner to all digits, in the units of the problem where it is known; nothing without corners."""
    if not domain.corners:
        return
    model = problem.model if problem else None
    names = {n for arc in (*domain.stability, *domain.heavy_damping) for n in arc.points}
    units = {n: unit_of(problem, n) if problem else Unit() for n in domain.corners[0].parameters if n in names}
    rows: list[Row] = [(name_kind(model, c.name), *_list_numbers(c.parameters, units)) for c in domain.corners]
    yield TableBlock((("corner", *_head_columns(units)), *rows), "Corners of the domains")


def write_swallowtail(found: Swallowtail, _level: Level) -> Parts:
    """Pieces of the surface, then its edges as traces."""
    edges = f"edges: {count_things(found.cusps.branches, 'EP3 curve')}"
    yield " ".join(found.axes), count_things(found.patches, "patch", "patches"), edges
    damped = sum(patch.heavily_damped for patch in found.patches)
    pieces = f"{len(found.patches)} patches, {damped} of them bound heavy damping"
    yield Sentence(f"real negative double roots over {', '.join(found.axes)}: {pieces}", tone="answer")
    yield Sentence(describe_trace(found.cusps), "cuspidal edges")
    yield Sentence(describe_trace(found.crossing), "self-intersection")
