"""What a result is and how it ended, in a few words each."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from tmsopt.evaluation import abscissa_as_stored
from tmsopt.problem import Unit, amounts_text, show_at, status_text, unit_of
from tmsopt.problem.verdict.stability import ROUNDED

if TYPE_CHECKING:
    from tmsopt.analysis import Diagnosis, Explanation, Optimality
    from tmsopt.boundaries import Nearest, Robustness
    from tmsopt.charts import Chart
    from tmsopt.dynamics import Growth, Simulation, Speeds
    from tmsopt.fronts import Front
    from tmsopt.guide import Description
    from tmsopt.paper import Comparison, Ledger
    from tmsopt.problem import Solution
    from tmsopt.proofs import Proof
    from tmsopt.search import Every
    from tmsopt.studies import Results
    from tmsopt.tracing import Branch, Domain, Swallowtail, Trace

Words = Iterator[str]


def of_solution(solution: "Solution") -> Words:
    """Status, objective, structure, proof, stability."""
    problem = solution.problem.posed
    yield status_text(problem, solution.status)
    asked = problem.minimize or problem.maximize
    name, value = (asked, solution.value) if asked else ("abscissa", solution.abscissa)
    yield f"{' '.join(name.split())} = {show_at(problem, name, solution.parameters, value)}"
    yield from filter(None, [abscissa_as_stored(solution)])
    if solution.missed:
        yield f"misses {amounts_text(problem, solution.missed)}"
    yield solution.structure
    if solution.bound.proven:
        yield "proved"
    if verdict := solution.stability.verdict:
        rounded = ROUNDED if solution.stability.on_edge and not solution.edge_is_exact else ""
        yield f"{verdict}{f' as {growth}' if (growth := solution.stability.growth) else ''}{rounded}"


def of_front(front: "Front") -> Words:
    """Objectives and the number of points."""
    yield ", ".join(front.objectives)
    yield _count(len(front), "point")
    if unstable := sum(not point.stable for point in front.points):
        yield f"{unstable} not stable"


def of_trace(trace: "Trace") -> Words:
    """Pattern, branches, points, events."""
    yield trace.pattern
    yield _count(len(trace.branches), "branch", "branches")
    yield _count(trace.points, "point")
    yield _count(len(trace.events), "event")


def of_branch(branch: "Branch") -> Words:
    """The same of one branch."""
    yield branch.pattern
    yield _count(len(branch), "point")
    yield _count(len(branch.events), "event")
    yield "closed" if branch.closed else "open"


def of_chart(chart: "Chart") -> Words:
    """Its grid, and the commonest classes."""
    yield f"{' × '.join(str(len(v)) for v in chart.grid)} designs over {', '.join(chart.axes)}"
    for name, share in sorted(chart.shares.items(), key=lambda item: -item[1])[:2]:
        yield f"{100 * share:.3g} % {name}"


def of_speeds(speeds: "Speeds") -> Words:
    """Where the design is stable."""
    yield speeds.parameter
    yield f"stable {_bands(speeds.stable, unit_of(speeds.problem.posed, speeds.parameter))}"
    yield _count(len(speeds.found), "critical value")


def of_growth(growth: "Growth") -> Words:
    """Where the design is stable."""
    yield f"over {growth.over.name}"
    yield f"stable {_bands(growth.stable, unit_of(growth.problem.posed, growth.over.name))}"
    yield growth.structure


def of_motion(motion: "Simulation") -> Words:
    """How long, and how far its first coordinates go."""
    yield f"over {motion['t'][-1]:.4g} {motion.units.get('t', '')}".rstrip()
    for measure in motion.measures[:2]:
        yield f"peak {measure.name} = {measure.peak:.4g} {motion.units.get(measure.name, '')}".rstrip()
    yield motion.structure
    yield from _stable(motion.stable)


def of_comparison(comparison: "Comparison") -> Words:
    """How many laws apply and agree."""
    told = [row for row in comparison.laws if row.applies]
    yield f"{sum(row.agrees is True for row in told)} of {len(told)} laws agree"
    yield f"solved as {comparison.other.formulation} too" if comparison.other else "no other formulation"


def of_results(results: "Results") -> Words:
    """Rows and how they ended."""
    yield _count(len(results.rows), "row")
    for status, count in results.summary.counts.items():
        yield f"{count} {status_text(results.study.problem.posed, status)}"


def of_proof(proof: "Proof") -> Words:
    """Whether it is proved, and what."""
    yield "proved" if proof.proved else "not proved"
    yield proof.pattern or "nothing"
    yield f"{proof.digits} digits"
    yield from _stable(proof.stable.holds)


def of_every(every: "Every") -> Words:
    """How many designs, and whether they are all."""
    yield _count(len(every.solutions), "design")
    complete = every.completeness is not None and every.completeness.complete
    yield "proved to be all" if complete else "not proved to be all"


def of_explanation(explanation: "Explanation") -> Words:
    """Structure, verdict, and how many limits and warnings there are."""
    yield explanation.structure
    yield explanation.optimality.verdict
    yield _count(len(explanation.levers), "limit")
    if explanation.warnings:
        yield _count(len(explanation.warnings), "warning")


def of_optimality(optimality: "Optimality") -> Words:
    """The verdict."""
    yield optimality.verdict
    if optimality.order:
        yield f"by order {optimality.order}"


def of_robustness(found: "Robustness") -> Words:
    """How far stability reaches, and to what."""
    yield from _stable(found.stable)
    yield _value("radius" if found.stable else "to stability", found.limit.distance)
    if found.limit.found:
        yield f"to {found.limit.kind}"


def of_nearest(nearest: "Nearest") -> Words:
    """Which boundary, and how far."""
    yield nearest.kind
    yield _value("distance", nearest.distance) if nearest.found else "none found"


def of_diagnosis(diagnosis: "Diagnosis") -> Words:
    """The root and its chains."""
    yield f"{diagnosis.algebraic}-fold {'pair' if diagnosis.im else 'root'}"
    yield f"{diagnosis.re:.5g}" + (f" ± {diagnosis.im:.5g}i" if diagnosis.im else "")
    yield diagnosis.kind


def of_domain(domain: "Domain") -> Words:
    """How many arcs and corners."""
    yield f"stability: {_count(len(domain.stability), 'arc')}"
    yield f"heavy damping: {_count(len(domain.heavy_damping), 'arc')}"
    yield _count(len(domain.corners), "corner")


def of_swallowtail(found: "Swallowtail") -> Words:
    """Axes and pieces."""
    yield " ".join(found.axes)
    yield _count(len(found.patches), "patch", "patches")
    yield f"edges: {_count(len(found.cusps.branches), 'EP3 curve')}"


def of_ledger(ledger: "Ledger") -> Words:
    """Entries per verdict."""
    yield _count(len(ledger.entries), "entry", "entries")
    for verdict, count in ledger.counts.items():
        if count:
            yield f"{count} {verdict}"


def of_description(found: "Description") -> Words:
    """The model, and of how many parameters."""
    yield found.model
    yield f"degree {found.degree}"
    yield " or ".join(_count(len(of.parameters), "parameter") for of in found.sets)


def _stable(stable: bool | None) -> Words:
    if stable is not None:
        yield "stable" if stable else "not stable"


def _value(name: str, value: float) -> str:
    return f"{name} = {value:.5g}" if math.isfinite(value) else f"no {name}"


def _count(count: int, one: str, many: str = "") -> str:
    return f"{count} {one if count == 1 else many or one + 's'}"


def _bands(bands: tuple[tuple[float, float], ...], unit: Unit) -> str:
    words = ", ".join(f"{unit.number(low)} to {unit.number(high)}" for low, high in bands)
    return f"{words} {unit.text}".strip() if words else "nowhere"
