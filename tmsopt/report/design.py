"""Solutions and comparisons as text for a reader."""

from collections.abc import Iterable, Mapping

from tmsopt.completeness import Completeness
from tmsopt.design.solution import Solution
from tmsopt.models import GRAVITY, tms, to_si
from tmsopt.report.limits import bound_lines, case_lines, relaxation_lines
from tmsopt.report.rows import parameter_rows, pitching, quantity_rows
from tmsopt.report.text import columns, number
from tmsopt.roots import Root
from tmsopt.solver.all_designs import Coverage, Every

_ASKED = {"a0": "must not be 0", "coefficients": "must have values"}


def si_parameters(solution: Solution, w: float = 1.0, m_B: float = 1.0, g: float = GRAVITY) -> Mapping[str, float]:
    """SI parameters: as solved for, or of dimensionless skates for the given wheelbase, rear mass and gravity."""
    own = solution.problem.model is not tms or solution.problem.parameter_set.name == "SI"
    return solution.parameters if own else to_si(solution.dimensionless, w, m_B, g)


def solution_table(solution: Solution, w: float = 1.0, m_B: float = 1.0, g: float = GRAVITY) -> str:
    """A design with its roots, bound, limits and remarks; of skates, dimensionless and in SI side by side."""
    lines = [solution.problem.title or "untitled problem", headline(solution), ""]
    si = si_parameters(solution, w, m_B, g)
    lines += [*columns(parameter_rows(solution, si)), "", *columns(quantity_rows(solution, si)), ""]
    if "load_rear" in solution.quantities:
        lines.append(pitching(solution, si))
    lines += facts(solution)
    return "\n".join(line.rstrip() for line in lines).rstrip()


def every_table(every: Every) -> str:
    """All designs with a pattern, one column each, and what the proof or the search says about others."""
    found, coverage, proof = every.solutions, every.coverage, every.completeness
    known = proof is not None and proof.complete
    many = f"{len(found)} solution{'' if len(found) == 1 else 's'}"
    effort = f"{proof.boxes} boxes, {proof.seconds:.2g} s" if proof else ""
    if not found:
        none = f"no design in the box has the pattern (proved; {effort})"
        lines = [none if known else "no single solution was met"]
    else:
        problem = found[0].problem
        names = [n for n in found[0].parameters if n in problem.free]
        rows = [("", *(str(k) for k in range(1, len(found) + 1)))]
        rows += [(n, *(number(s.parameters[n]) for s in found)) for n in names]
        rows += [("abscissa", *(number(s.abscissa) for s in found)), ("structure", *(s.structure for s in found))]
        rows += [("met", *(str(h) for h in coverage.hits))] if coverage else []
        rows += [("proved", *("yes" if p else "no" for p in every.proved))] if any(every.proved) and not known else []
        all_of_them = f"these are all: {many} in the box (proved; {effort})"
        lines = [problem.title or "untitled problem", f"locate {problem.locate}: {all_of_them if known else many}"]
        lines[-1] += "" if known else " in the box"
        lines += ["", *columns(rows), ""]
    lines += _proof_lines(proof, effort) if proof else []
    lines += _search_lines(coverage) if coverage else []
    return "\n".join(line.rstrip() for line in lines).rstrip()


def _proof_lines(proof: Completeness, effort: str) -> list[str]:
    lines = [
        f"solution {k} lies on a limit, {limit}, as far as 25 digits tell: it may be just beyond"
        for k, limit in enumerate(proof.limits, start=1)
        if limit
    ]
    if proof.complete:
        return lines
    many = f"; {len(proof.designs)} proved" if proof.designs else ""
    lines.append(f"proof that these are all: none, {proof.reason}{f' ({effort}{many})' if proof.boxes else ''}")
    for place in proof.undecided:
        at = ", ".join(f"{n} {number(lo)} … {number(hi)}" for n, (lo, hi) in place.ranges.items())
        lines.append(f"  undecided: {at}")
    return lines


def _search_lines(coverage: Coverage) -> list[str]:
    doubt = (
        f"; {coverage.singular} ended at designs with the pattern where its equations are singular: one of a "
        "continuum of solutions, or one where two meet (tmsopt solve shows one)"
        if coverage.singular
        else ""
    )
    return [
        f"coverage of a search: {coverage.starts} starts over the box{doubt}; "
        f"{coverage.expected:.2f} solutions to be expected in all; "
        f"the chance that one more start finds another is below {coverage.chance:.2g} (95 % confidence; no proof)"
    ]


def headline(solution: Solution) -> str:
    problem = solution.problem
    text = problem.minimize or problem.maximize
    asked = f"{problem.sense} {text} = {number(solution.value)}" if text else ""
    located = f"locate {problem.locate}" if problem.locate else ""
    by = f" to {solution.bound.gap:.0e}" if solution.bound.solver else ""
    proven = f", proven globally{by}" if solution.bound.proven else ""
    words = solution.status.replace("_", " ")
    if solution.status == "infeasible":
        proven = ", proven" if solution.bound.proven else ""
    parts = (f"{words}{proven}", stability(solution), located, asked, f"structure {solution.structure}")
    return "   ".join(part for part in parts if part)


def stability(solution: Solution) -> str:
    """Of a design that is not stable though that was looked for: whether any is."""
    problem, known = solution.problem, solution.any_stable
    if solution.stable is not False or not (known is False or solution.stability_sought):
        return ""
    if known is None:
        return "no stable design found, not proved"
    if known:
        return "not stable, though there are stable designs in the box"
    limited = problem.locate or len(problem.constraints) > len(problem.asked_of_roots)
    return f"no design in the box is stable (proved){' under its constraints' if limited else ''}"


def facts(solution: Solution) -> list[str]:
    lines = ["roots: " + (", ".join(_roots(solution.roots)) or "none")]
    lines += bound_lines(solution)
    lines += case_lines(solution)
    free = solution.freedom
    if solution.problem.locate:
        parameters = "parameter" if free.free == 1 else "parameters"
        conditions = "condition" if free.conditions == 1 else "conditions"
        lines.append(f"freedom: {free.kind}, {free.free} free {parameters} and {free.conditions} {conditions}")
    if solution.active:
        gains = ", ".join(f"{name} ({value:.4g})" for name, value in solution.active.items())
        lines.append(f"limits that bind (gain per unit relaxed): {gains}")
    for name, value in solution.violations.items():
        asked = "pattern" if name == solution.problem.locate else _ASKED.get(name, "")
        text = solution.problem.constraints.get(name, asked)
        lines.append(f"violated: {name} ({text}) by {value:.4g}")
    lines += relaxation_lines(solution)
    for branch in solution.branches:
        where = ", ".join(f"{n} = {branch.parameters[n]:.10g}" for n in solution.problem.free)
        lines.append(f"also solved by {where}; excluded by {', '.join(branch.excluded_by) or 'nothing'}")
    if solution.starts.tried:
        s = solution.starts
        looked = f"; {s.looked} designs looked at" if s.looked else ""
        tried = f"starts: {s.tried} tried, {s.converged} converged, {s.at_best} at the best"
        lines.append(f"{tried}{looked}; {solution.seconds:.2f} s")
    return [*lines, *(f"note: {note}" for note in solution.notes)]


def _roots(roots: Iterable[Root]) -> list[str]:
    """Roots as text, a conjugate pair as one entry."""
    words = []
    for root in roots:
        if root.im < 0:
            continue
        value = f"{root.re:.8g}" + (f" ± {root.im:.8g}i" if root.im else "")
        words.append(value + (f" ({root.multiplicity}-fold)" if root.multiplicity > 1 else ""))
    return words
