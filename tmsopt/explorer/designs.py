"""Designs that a page offers: the optimum, an exceptional point, the published benchmark."""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from tmsopt.analysis import proof_line
from tmsopt.chains.meetings import meetings
from tmsopt.errors import InputError
from tmsopt.guide import example
from tmsopt.problem import Posed, Solution, degrees_of_freedom
from tmsopt.problem.files import problem_from_tables
from tmsopt.problem.verdict.stability import MultipleRoot
from tmsopt.problem.verdict.status import describe_status, describe_verdict
from tmsopt.roots import Structure
from tmsopt.search import solve

_BENCHMARKS = {"tms": "benchmark", "whipple": "whipple_benchmark"}
"""Model → name of the example with the published bicycle."""

_EP_STARTS = 2  # number of starts of the search for an exceptional point
_MAX_EP_ORDER = 4  # largest multiplicity of that exceptional point


@dataclass(frozen=True)
class PageDesign:
    """A design with a name, and with the structure of its roots, in which multiple roots are recognised.

    Attributes:
        facts: sentences about the design.
        is_answer: whether the design solves the problem, or is the design nearest to a solution.
        proof_text: one line about its proof; empty without a proof.
        verdict: verdict on its stability, and the power of t with which it grows, as in JSON; empty if not computed.
        meetings: for each multiple root, the roots that meet there.
    """

    name: str
    parameters: Mapping[str, float]
    structure: Structure
    facts: tuple[str, ...]
    is_answer: bool = False
    proof_text: str = ""
    verdict: Mapping[str, Any] = field(default_factory=dict)
    meetings: tuple[MultipleRoot, ...] = ()


def list_designs(
    problem: Posed,
    solution: Solution | None,
    search: bool,
    more_designs: Sequence[tuple[str, Mapping[str, float]]] = (),
) -> list[PageDesign]:
    """The designs that a page offers; the first one is the solution, if there is one.

    Args:
        search: whether to search for an exceptional point if the solution is stable and has none.
        more_designs: names and parameters of further designs that solve the problem.
    """
    designs = [] if solution is None else [_describe_solution(solution)]
    designs += [
        PageDesign(name, values, _compute_structure(problem, values), (), True) for name, values in more_designs
    ]
    if search and (solution is None or (solution.stable and "EP" not in solution.structure)):
        designs += _find_exceptional_point(problem)
    return [
        design
        if design.meetings
        else replace(design, meetings=meetings(problem.nominal, design.parameters, design.structure.roots))
        for design in [*designs, *_find_benchmark(problem)]
    ]


def _describe_solution(solution: Solution) -> PageDesign:
    """The solution with its status, verdict and proof."""
    problem = solution.problem.posed
    names = {"optimal": "optimum", "infeasible": "least infeasible", "not_converged": "best so far"}
    sentences = describe_status(solution), describe_verdict(solution)
    facts, proof = [": ".join(filter(None, sentences)), *solution.notes], f"proof: {proof_line(solution)}"
    proof_text = proof if solution.bound.proven else ""
    if problem.nominal is problem:
        structure = Structure(solution.structure, solution.roots, 0.0)
    else:  # the proof holds for all cases together, and the page shows one case
        structure, proof_text = _compute_structure(problem, solution.parameters), ""
        facts[0] += " in all cases of its bands and tolerances"
    name = names[solution.status] if problem.free else "as given"
    if problem.sense == "locate" and solution.status == "optimal":
        name = str(problem.locate)
    verdict = solution.stability.to_json() if structure.roots is solution.roots else {}
    root_meetings = solution.meetings if verdict else ()
    return PageDesign(name, solution.parameters, structure, (*facts, proof), True, proof_text, verdict, root_meetings)


def _find_benchmark(problem: Posed) -> Iterator[PageDesign]:
    """The published bicycle for the model of a problem, if there is one, without a controller."""
    parameter_set = problem.parameter_set
    if problem.model.name not in _BENCHMARKS:
        return
    try:
        text = example(_BENCHMARKS[problem.model.name])
    except InputError:  # the examples are not installed
        return
    _, benchmark = problem_from_tables(tomllib.loads(text), "")
    assert benchmark is not None
    values = benchmark.posed.values(benchmark.fixed)
    defaults = {
        p.name: problem.fixed.get(p.name, 0.0) if p.default is None else p.default for p in parameter_set.parameters
    }
    parameters = {n: float(values[n] if n in values else defaults[n]) for n in parameter_set.names}
    yield PageDesign("benchmark", parameters, _compute_structure(problem, parameters), (benchmark.title,))


def _find_exceptional_point(problem: Posed) -> Iterator[PageDesign]:
    """Find the exceptional point of the highest order that the free parameters allow, without constraints.

    A k-fold root needs k − 1 free parameters.
    """
    order = min(problem.model.degree, len(problem.free) + 1, _MAX_EP_ORDER)
    changes: dict[str, Any] = {"constraints": {}, "minimize": None, "maximize": None, "pareto": (), "start": {}}
    ep_problem = problem.nominal.derive(**changes, locate=f"EP{order}") if order > 1 else None
    if ep_problem is None or degrees_of_freedom(ep_problem).count < 0:
        return
    solution = solve(ep_problem, throw=False, starts=_EP_STARTS, stability=0.0, alone=False)
    if solution.status == "optimal" and "EP" in solution.structure:
        facts = ("found without the limits",) if problem.constraints else ()
        yield PageDesign(
            solution.structure, solution.parameters, Structure(solution.structure, solution.roots, 0.0), facts
        )


def _compute_structure(problem: Posed, parameters: Mapping[str, float]) -> Structure:
    structure: Structure = problem.nominal.values(parameters)["structure"]
    return structure
