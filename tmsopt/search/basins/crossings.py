"""Where roots only cross nearest to a start: exceptional points elsewhere, or the word that none was found."""

from collections.abc import Mapping
from itertools import islice

from tmsopt.problem.searches import Starts
from tmsopt.problem.verdict.meetings import nearest_crossing
from tmsopt.program.formulate import matching
from tmsopt.program.nlp import NLP
from tmsopt.program.starts import designs
from tmsopt.search.multistart import Runner
from tmsopt.search.outcome import CheckedEnd, Outcome, best_checked, evaluated_cases
from tmsopt.search.workspace import LocalEnd, Workspace

_HOPEFUL = 16  # starts for an exceptional point where the nearest one is a crossing


def search_elsewhere(
    work: Workspace, nlp: NLP, candidates: list[LocalEnd]
) -> tuple[NLP, list[LocalEnd], CheckedEnd | None]:
    """An exceptional point nearest to another start, where roots only cross nearest to the first."""
    part, ended = work.part, list(candidates)
    most = _HOPEFUL if work.freedom.count > 0 else 0
    for design in islice(designs(part, work.options.seed, work.options.starts), most):
        near = matching(part.derive(minimize=None, maximize=None, start=design))
        ended.append(Runner(work, near).solve_from(design, near=True))
        if ended[-1].feasible and (trial := best_checked(work, near, ended[-1:])):
            return near, ended, trial
    return nlp, ended, None


def crossing_finding(work: Workspace, design: Mapping[str, float], tried: int, nlp: NLP) -> Outcome:
    """Roots meet, but nowhere with the Jordan chains of an exceptional point."""
    problem = work.problem
    parameters = problem.ordered(design)
    if problem.pattern is not None:
        parameters = problem.ordered(nearest_crossing(problem, problem.pattern, parameters))
    cases = evaluated_cases(problem, parameters)
    checked = work.recheck(parameters, cases)
    note = f"of {tried} starts, none ended at an exceptional point: roots meet with more than one eigenvector"
    return Outcome(parameters, checked, "not_converged", {}, Starts(tried), nlp.formulation, cases, notes=(note,))
