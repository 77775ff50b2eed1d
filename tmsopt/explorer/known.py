"""Designs worth going to: the optimum, an exceptional point of the box, the published benchmark."""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from tmsopt.analysis import proof_line
from tmsopt.errors import InputError
from tmsopt.guide import example
from tmsopt.models.user_spectrum import user_structure
from tmsopt.problem import Posed, Solution, degrees_of_freedom
from tmsopt.problem.files import problem_from_tables
from tmsopt.problem.verdict.meetings import meetings
from tmsopt.problem.verdict.stability import MultipleRoot
from tmsopt.problem.verdict.status import describe_status, describe_verdict
from tmsopt.roots import Structure
from tmsopt.search import solve

_BENCHMARKS = {"tms": "benchmark", "whipple": "whipple_benchmark"}
"""Models → the example with the published bicycle."""

_STARTS, _ORDER = 2, 4  # of the search for an exceptional point, of which there need be none: starts, roots that meet


@dataclass(frozen=True)
class Known:
    """A design with a name, and the structure of its roots as the user reads them, multiple ones recognised.

    Attributes:
        facts: what is known of it, a sentence each.
        is_answer: whether it is what the problem asks for, or the nearest to it.
        proved: what is proved of it, in one line; empty without a proof.
        verdict: on its stability, with the power of t by which it grows, as in JSON; empty where nobody asked.
        meetings: what meets in each multiple root.
    """

    name: str
    parameters: Mapping[str, float]
    structure: Structure
    facts: tuple[str, ...]
    is_answer: bool = False
    proved: str = ""
    verdict: Mapping[str, Any] = field(default_factory=dict)
    meetings: tuple[MultipleRoot, ...] = ()


def known_designs(
    problem: Posed,
    solution: Solution | None,
    search: bool,
    others: Sequence[tuple[str, Mapping[str, float]]] = (),
) -> list[Known]:
    """The designs that a page can go to, the one that it opens with first if a solution is given.

    Args:
        search: whether to look for an exceptional point, unless the optimum is one or no design is stable.
        others: names and parameters of designs that were found otherwise, which are answers too.
    """
    of = problem.nominal
    named = [Known(name, values, _structure(problem, values), (), True) for name, values in others]
    found = [*([] if solution is None else [_of_solution(solution)]), *named]
    if search and (solution is None or (solution.stable and "EP" not in solution.structure)):
        found += _exceptional(problem)
    return [
        known
        if known.meetings
        else replace(known, meetings=meetings(of, known.parameters, of.values(known.parameters)["structure"].roots))
        for known in [*found, *_benchmark(problem)]
    ]


def _of_solution(solution: Solution) -> Known:
    """The solution, with how good it is known to be."""
    problem = solution.problem.posed
    names = {"optimal": "optimum", "infeasible": "least infeasible", "not_converged": "best so far"}
    words = describe_status(solution), describe_verdict(solution)
    facts, proof = [": ".join(filter(None, words)), *solution.notes], f"proof: {proof_line(solution)}"
    proved = proof if solution.bound.proven else ""
    if problem.nominal is problem:
        known = Structure(solution.structure, solution.roots, 0.0)
    else:  # what is proved is proved of every case, and the page shows one
        known, proved = _structure(problem, solution.parameters), ""
        facts[0] += " over every case of its bands and tolerances"
    name = names[solution.status] if problem.free else "as given"
    if problem.sense == "locate" and solution.status == "optimal":
        name = str(problem.locate)
    said = solution.stability.to_json() if known.roots is solution.roots else {}
    met = solution.meetings if said else ()
    return Known(name, solution.parameters, known, (*facts, proof), True, proved, said, met)


def _benchmark(problem: Posed) -> Iterator[Known]:
    """The published bicycle of the problem's model in its own parameters, without a controller, if there is one."""
    of = problem.parameter_set
    if problem.model.name not in _BENCHMARKS:
        return
    try:
        text = example(_BENCHMARKS[problem.model.name])
    except InputError:  # an installation without the examples
        return
    _, found = problem_from_tables(tomllib.loads(text), "")
    assert found is not None
    values = found.posed.values(found.fixed)
    rest = {p.name: problem.fixed.get(p.name, 0.0) if p.default is None else p.default for p in of.parameters}
    parameters = {n: float(values[n] if n in values else rest[n]) for n in of.names}
    yield Known("benchmark", parameters, _structure(problem, parameters), (found.title,))


def _exceptional(problem: Posed) -> Iterator[Known]:
    """The highest exceptional point that the freedom of a problem allows, limits left aside, if one is found.

    A k-fold root takes k − 1 free parameters.
    """
    order = min(problem.model.degree, len(problem.free) + 1, _ORDER)
    alone: dict[str, Any] = {"constraints": {}, "minimize": None, "maximize": None, "pareto": (), "start": {}}
    asked = problem.nominal.derive(**alone, locate=f"EP{order}") if order > 1 else None
    if asked is None or degrees_of_freedom(asked).count < 0:
        return
    found = solve(asked, throw=False, starts=_STARTS, stability=0.0, alone=False)
    if found.status == "optimal" and "EP" in found.structure:
        facts = ("limits left aside",) if problem.constraints else ()
        yield Known(found.structure, found.parameters, Structure(found.structure, found.roots, 0.0), facts)


def _structure(problem: Posed, parameters: Mapping[str, float]) -> Structure:
    return user_structure(problem.model, problem.nominal.values(parameters)["structure"])
