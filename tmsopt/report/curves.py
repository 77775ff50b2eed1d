"""Traces, charts and fronts as text: what is on them, and where their events are."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from tmsopt.charts.chart import Chart
from tmsopt.evaluation import missed_note
from tmsopt.fronts.front import Front
from tmsopt.models import Model, in_words_of
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import Unit, unit_at, unit_of, unit_of_all
from tmsopt.report.text import HEIGHT, columns, screen, yes_no
from tmsopt.tracing.branch import Branch, Trace, kinds_along
from tmsopt.tracing.domain import Domain
from tmsopt.tracing.swallowtail import Swallowtail

_LABEL = 40  # characters of what happens at a point of a front, if not all is wanted
_DIGITS = 12
_ROUNDING = 1e-14  # mismatch of a coefficient at which a point has them all
_FITTING = 1e-6  # mismatch of a coefficient beyond which a point does not belong to its branch


def chart_table(chart: Chart) -> str:
    """Shares of the classes, the best grid point, and the boundaries with their corners of a plane in memory.

    Example:
        >>> chart = tmsopt.chart("problems/chart.toml", points=(20, 20))
        >>> print(tmsopt.report.chart_table(chart).splitlines()[1])
        20 × 20 designs over Fr and lambda_s

    More: docs/how_to/charts.md
    """
    data: dict[str, Any] = chart.to_json()
    model = chart.problem.model
    if chart.path is not None or len(chart.axes) != 2:
        return _summary_table(chart.problem.posed, data)
    first, second = chart.axes
    size = f"{len(chart.grid[0])} × {len(chart.grid[1])}"
    lines = [chart.problem.title or "untitled problem", f"{size} designs over {first} and {second}", ""]
    lines += columns([(in_words_of(model, n), f"{100 * share:.2f} %") for n, share in chart.shares.items() if share])
    if len(chart.problem.constraints) > len(chart.left_aside):
        lines.append(f"  the constraints hold on {100 * data['satisfied']:.2f} %")
    for name in chart.left_aside:
        lines.append(f"  {name} is an equality, which holds on curves and not on a grid: left aside")
    if best := data["least_abscissa"]:
        lines += ["", _best(chart.problem.posed, (first, second), best)]
    if chart.domain is not None:
        lines += ["", domain_table(chart.domain, chart.problem.posed)]
    return "\n".join(line.rstrip() for line in lines)


def domain_table(domain: Domain, problem: Posed | None = None) -> str:
    """What bounds stability and heavy damping, and the corners, in the units of the problem where it is known.

    Example:
        >>> print(tmsopt.report.domain_table(tmsopt.domain("problems/chart.toml")))
        stability is bounded by weave (... points)
        heavy damping is bounded by EP2 (2 curves, ... points)
        ...

    More: docs/how_to/charts.md
    """
    lines, model = [], problem.model if problem else None
    bounded = [("stability", domain.stability)]
    if model is None or model.carrier is None:  # eigenfrequencies of H have no axis on which nothing swings
        bounded.append(("heavy damping", domain.heavy_damping))
    for name, arcs in bounded:
        points: dict[str, list[int]] = {}
        for arc in arcs:
            points.setdefault(_said(model, arc.kind), []).append(len(next(iter(arc.points.values()))))
        kinds = [f"{kind} ({_curves(sizes)}{sum(sizes)} points)" for kind, sizes in points.items()]
        lines.append(f"{name} is bounded by {', '.join(kinds) or 'nothing in the box'}")
    if domain.corners:
        lines += ["", *columns(corner_rows(domain, problem))]
    return "\n".join(line.rstrip() for line in lines)


def _curves(sizes: Sequence[int]) -> str:
    return f"{len(sizes)} curves, " if len(sizes) > 1 else ""


def corner_rows(domain: Domain, problem: Posed | None = None) -> list[tuple[str, ...]]:
    """Headings, and the cells of each corner, to all digits.

    Example:
        >>> tmsopt.report.corner_rows(tmsopt.domain("problems/chart.toml"))
        [('corner', 'Fr', 'lambda_s'), ('EP4', '2.23631751...', '0.41067753...')]

    More: docs/how_to/charts.md
    """
    model = problem.model if problem else None
    names = list(domain.corners[0].parameters) if domain.corners else []
    names = [n for n in names if any(n in arc.points for arc in (*domain.stability, *domain.heavy_damping))]
    units = {n: unit_of(problem, n) if problem else Unit() for n in names}
    rows = [("corner", *(f"{n} {u.text}".rstrip() for n, u in units.items()))]
    return rows + [
        (_said(model, c.name), *(u.number(c.parameters[n], 12) for n, u in units.items())) for c in domain.corners
    ]


def swallowtail_table(found: Swallowtail) -> str:
    """Pieces of the surface, then its edges as traces.

    Example:
        >>> surface = tmsopt.swallowtail("problems/ep_set.toml", rows=4, across=3, starts=4)
        >>> print(tmsopt.report.swallowtail_table(surface).splitlines()[2])
        cuspidal edges: EP3: 1 branch, ...

    More: docs/explanation/exceptional_points.md
    """
    problem = found.problem.posed
    damped = sum(patch.heavily_damped for patch in found.patches)
    lines = [
        problem.title or "untitled problem",
        f"real negative double roots over {', '.join(found.axes)}: {len(found.patches)} patches, {damped} of them "
        "bound heavy damping",
    ]
    edges = (("cuspidal edges", found.cusps), ("self-intersection", found.crossing))
    lines += [f"{name}: {trace_headline(trace)}" for name, trace in edges]
    return "\n".join(lines)


def _said(model: Model | None, name: str) -> str:
    """A kind of boundary, or an event, in the words of a model where that is known."""
    return in_words_of(model, name) if model else name


def _best(problem: Posed, names: Iterable[str], best: Mapping[str, float]) -> str:
    """The best design of a grid."""
    where = ", ".join(f"{n} = {unit_of(problem, n).show(best[n], 6)}" for n in names)
    return f"least abscissa on the grid: {unit_of_all(problem, 'abscissa').show(best['value'], 6)} at {where}"


def _summary_table(problem: Posed, data: Mapping[str, Any]) -> str:
    """A space, or a chart in a folder: shares of the classes, the best grid point, and how fast it was made."""
    axes = data["axes"]
    size = " × ".join(str(a["points"]) for a in axes.values())
    lines = [data["title"] or "untitled problem", f"{size} designs over {', '.join(axes)}", ""]
    if data["classes"]:
        lines += columns([(in_words_of(problem.model, n), f"{100 * x:.2f} %") for n, x in data["classes"].items() if x])
    if data["satisfied"] is not None and data["satisfied"] < 1:
        lines.append(f"  the constraints hold on {100 * data['satisfied']:.2f} %")
    if best := data["least_abscissa"]:
        lines += ["", _best(problem, axes, best)]
    if data.get("designs"):
        lines += ["", f"{data['per_second']:.3g} designs per second with {data['engine']}"]
    return "\n".join(line.rstrip() for line in lines)


def front_table(front: Front, full: bool = False) -> str:
    """Points one a row: objectives, structure, ends and kinks, limits that bind, free parameters, whether stable.

    Args:
        full: every point, with all its digits.

    Example:
        >>> oscillator = tmsopt.models.from_matrices([[1]], [["c"]], [[1]])  # x'' + c x' + x = 0
        >>> problem = tmsopt.Problem(model=oscillator, free={"c": (0.1, 4)}, pareto=["abscissa", "c"])
        >>> print(tmsopt.report.front_table(tmsopt.pareto(problem, points=2)).splitlines()[-1])
          -0.05 0.1 yes least c pair c.min

    More: docs/how_to/fronts.md
    """
    problem = front.problem.posed
    texts = [t.strip() for t in front.objectives]
    count = f"{len(front)} point" + ("s" if len(front) != 1 else "")
    where = f", designs with {problem.locate}" if problem.locate else ""
    special = ((len(front.kinks), "kink"), (len(front.gaps), "gap"))
    counted = "".join(f"{n} {word}{'s' if n > 1 else ''}, " for n, word in special if n)
    lines = [
        problem.title or "untitled problem",
        f"front of least {', '.join(texts)}{where}: {count}, {counted}"
        f"{front.solved} sub-problems; {front.seconds:.2f} s",
        "",
    ]
    rows = front_rows(front, full)
    remarks = [f"gap: {gap.reason}" for gap in front.gaps] + [f"note: {note}" for note in front.notes]
    for k, p in enumerate(front.points, start=1):
        remarks += [f"point {k}: {note}" for note in missed_note(p.solution.problem.posed, p.solution.missed)]
    labelled = [k for k, p in enumerate(front.points) if p.label]
    height = HEIGHT - len(lines) - len(remarks) - 2 * bool(remarks) - 3
    lines += columns(rows) if full else screen(rows, height, labelled, "--full, --csv")
    return "\n".join(line.rstrip() for line in [*lines, *([""] if remarks else []), *remarks])


def front_rows(front: Front, full: bool = False) -> list[tuple[str, ...]]:
    """Headings, and the cells of each point; all digits and whole labels where it is `full`.

    Example:
        >>> oscillator = tmsopt.models.from_matrices([[1]], [["c"]], [[1]])  # x'' + c x' + x = 0
        >>> problem = tmsopt.Problem(model=oscillator, free={"c": (0.1, 4)}, pareto=["abscissa", "c"])
        >>> tmsopt.report.front_rows(tmsopt.pareto(problem, points=2))[1]  # critical damping
        ('-1', '2', 'yes', 'least abscissa', 'EP2', '')

    More: docs/how_to/fronts.md
    """
    texts = [t.strip() for t in front.objectives]
    free = [n for n in front.problem.free if n not in texts]
    units, digits = {n: unit_of(front.problem.posed, n) for n in (*texts, *free)}, 12 if full else 6
    some = dict.fromkeys(front.problem.posed.parameter_set.names, 1.0)  # a unit has one name for all designs
    heads = {n: f"{n} {unit_at(front.problem.posed, n, some).text}".rstrip() for n in units}
    rows = [(*(heads[t] for t in texts), "stable", "", *(heads[n] for n in free), "structure", "limits that bind")]
    for p in front.points:
        each = (unit_at(front.problem.posed, t, p.solution.parameters) for t in texts)
        numbers = [unit.number(v, digits) for unit, v in zip(each, p.objectives, strict=True)]
        design = [units[n].number(p.solution.parameters[n], digits) for n in free]
        label = p.label if full or len(p.label) <= _LABEL else f"{p.label[: _LABEL - 1]}…"
        rows.append((*numbers, yes_no(p.stable), label, *design, p.structure, ", ".join(p.limits)))
    return rows


def trace_table(trace: Trace) -> str:
    """Branches with their events, one a row, in the free parameters.

    Example:
        >>> print(tmsopt.report.trace_table(tmsopt.trace("problems/ep_set.toml")).splitlines()[3])
        branch 1: CEP2 and 2EP2, ...

    More: docs/how_to/tracing.md
    """
    units = {n: unit_of_all(trace.problem.posed, n) for n in (*trace.problem.free, "abscissa")}
    lines = [trace.problem.title or "untitled problem", trace_headline(trace)]
    for number_, branch in enumerate(trace.branches, start=1):
        lines += ["", f"branch {number_}: {_summary(branch, trace)}"]
        lines += columns(event_rows(branch, units, trace.problem.model))
    return "\n".join(line.rstrip() for line in lines)


def trace_headline(trace: Trace) -> str:
    """How many branches and points, and what they took."""
    per_point = 1e6 * trace.seconds_walking / max(trace.points, 1)
    count = f"{len(trace.branches)} branch" + ("es" if len(trace.branches) != 1 else "")
    points = f", {trace.points} points at {per_point:.0f} µs each" if trace.points else ""
    pattern_ = in_words_of(trace.problem.model, trace.pattern)
    return f"{pattern_}: {count}{points}, looked for from {trace.starts} starts; {trace.seconds:.2f} s"


def branch_table(branch: Branch) -> str:
    """One branch with its events, in the free parameters.

    Example:
        >>> branch = tmsopt.trace("problems/ep_set.toml").branches[0]
        >>> print(tmsopt.report.branch_table(branch).splitlines()[3])  # Fr, chi_B, lambda_s, abscissa
          EP4   2.23631751... 1.41421356... 0.41067753... -1.88030154...

    More: docs/how_to/tracing.md
    """
    form = "closed" if branch.closed else "open"
    lines = [f"{branch.pattern}: {len(branch)} points, {form}, coefficients met to {branch.residual:.0e}"]
    lines += columns(event_rows(branch, dict.fromkeys((*branch.tangent, "abscissa"), Unit())))
    return "\n".join(line.rstrip() for line in lines)


def event_rows(branch: Branch, units: Mapping[str, Unit], model: Model | None = None) -> list[tuple[str, ...]]:
    """Headings, and the cells of each event, to as many digits as its coefficients are met, in these units.

    Example:
        >>> branch = tmsopt.trace("problems/ep_set.toml").branches[0]
        >>> tmsopt.report.event_rows(branch, {})  # without columns of numbers
        [('', ''), ('end', 'Fr.max'), ('EP4', ''), ('fold', 'Fr'), ('end', 'Fr.max')]

    More: docs/how_to/tracing.md
    """
    rows = [("", *(f"{n} {unit.text}".rstrip() for n, unit in units.items()), "")]
    for event in branch.events:
        found = {**event.parameters, "abscissa": float(branch.abscissa[event.index])}
        digits = _digits(event.residual)
        rows.append((_said(model, event.name), *(u.number(found[n], digits) for n, u in units.items()), event.detail))
    return rows


def _digits(residual: float) -> int:
    """Of a point whose coefficients are met to so much: two less than that, for it may be off by some times more."""
    return min(max(math.floor(-math.log10(max(residual, _ROUNDING))) - 2, 2), _DIGITS)


def _summary(branch: Branch, trace: Trace) -> str:
    share = f"{100 * float(np.mean(branch.stable)):.0f} % of its points"
    rest = pattern_of(trace.problem.model, branch.pattern).rest
    states = f"{'bounds stability' if rest else 'stable'} on {share}"
    if any(not c.equality for c in trace.problem.posed.conditions.values()):
        states += f", constraints hold on {100 * float(np.mean(branch.satisfied)):.0f} %"
    form = "closed" if branch.closed else "open"
    kinds = " and ".join(dict.fromkeys(kinds_along(branch)))
    met = "met" if branch.residual <= _FITTING else "met only"
    kinds, residual = in_words_of(trace.problem.model, kinds), f"{branch.residual:.0e}"
    return f"{kinds}, {len(branch)} points, {form}, {states}, coefficients {met} to {residual}"
