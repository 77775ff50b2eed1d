"""Where one start ends: IPOPT on the program of the state, once more where that ended badly."""

import math
from dataclasses import replace
from itertools import islice

import numpy as np

from tmsopt.problem.verdict.meetings import is_crossing
from tmsopt.program.formulate import design_of
from tmsopt.program.ipopt import Run, make_ipopt
from tmsopt.program.nlp import NLP
from tmsopt.program.starts import initial_point
from tmsopt.records import Array
from tmsopt.roots import roots
from tmsopt.search.starts import with_led
from tmsopt.search.state import LocalEnd, SearchState, Start, coefficients_at


def run_from(state: SearchState, start: Start) -> LocalEnd:
    """The best end of a start: its factors are shared out anew where IPOPT did not converge, as long as that helps."""
    tuning, nlp = state.tuning, state.nlp
    exact = bool(nlp.cases) and nlp.exact
    best = run_once(state, start, "near" if start.near else "exact" if exact else "far")
    for again in range(tuning.restarts):
        converged = (
            best.feasible and best.run.status == "Solve_Succeeded" and not best.nlp.has_split_double_root(best.run.x)
        )
        tired = not best.feasible and again >= count_restarts(state)
        if converged or tired or not np.all(np.isfinite(best.run.x)):
            break
        ended = run_once(state, replace(start, design=state.design_at(best)), "far" if again % 2 else "near")
        if best.feasible and (not ended.feasible or ended.objective >= best.objective - tuning.same):
            break
        best = ended
    return with_led(state, keep_to_start(state, start, exchange_contacts(state, best)))


def count_restarts(state: SearchState) -> int:
    """How often an end that violates rows is taken up again: by what speaks for a feasible one."""
    if state.feasible:
        return state.tuning.restarts if state.sample is None else 1
    blind = state.sample is None and len(state.ends) >= state.tuning.blind
    return 0 if blind or (state.nlp.formulation != "elastic" and state.out_of_reach) else 1


def run_once(state: SearchState, start: Start, settings: str) -> LocalEnd:
    """Where IPOPT ends, in the best of the ways in which root quantities and kinks are held at the start."""
    x = initial_point(state.nlp, state.part, start.design, settings == "near")
    ways = islice(state.nlp.impose_contacts(x), state.tuning.ways)
    return min((_ended(state, start, x, way, settings) for way in ways), key=lambda end: end.rank)


def keep_to_start(state: SearchState, start: Start, best: LocalEnd) -> LocalEnd:
    """The end, or that of a run which keeps to the start, or does not, where the start was better than the end."""
    if state.sample is None or not best.feasible:
        return best
    box, known = state.sample.box, start.row >= 0
    seen = state.sample.leaders.take(np.array([start.row])) if known else box.look(box.space.points(start.design)[None])
    if seen.violation[0] > 0 or seen.worth[0] >= best.objective - state.tuning.same:
        return best
    kept = run_once(state, start, "far" if start.near else "near")
    return kept if kept.feasible and kept.objective < best.objective else best


def exchange_contacts(state: SearchState, best: LocalEnd) -> LocalEnd:
    """The best that is reached from an end at which other ways are as close as the one that was held."""
    for _ in range(state.tuning.exchanges if state.nlp.contacts and best.feasible else 0):
        x, held = best.run.x, _limits(best.nlp)
        others = (way for way in state.nlp.impose_contacts(x, state.tuning.meets) if _limits(way) != held)
        ends = [_ended(state, best.start, x, way, "near") for way in islice(others, 2 * state.tuning.ways)]
        other = min(ends, key=lambda end: end.rank, default=best)
        if not (other.feasible and other.objective < best.objective - state.tuning.same):
            break
        best = other
    return best


def _ended(state: SearchState, start: Start, x: Array, limits: NLP, settings: str) -> LocalEnd:
    """What one run of IPOPT came to."""
    run = make_ipopt(state.nlp, state.options, settings)(x, limits)
    f, rows = limits.evaluate(run.x)
    if not (np.all(np.isfinite(rows)) and np.all(np.isfinite(run.x)) and math.isfinite(f)):
        return LocalEnd(start, limits, run, math.inf, False)
    outside = np.maximum(np.array(limits.row_lower) - rows, rows - np.array(limits.row_upper)).clip(0)
    feasible = outside.max(initial=0.0) <= state.tuning.feasible and run.status != "Infeasible_Problem_Detected"
    # What rows, met to 1e-12, may give where they are singular: a double root off by 1e-6, as its square is by that.
    claim = 2 * float(np.abs(np.nan_to_num(run.row_multipliers)) @ outside) if limits.contacts else 0.0
    if not feasible or _is_spurious(state, limits, run):
        return LocalEnd(start, limits, run, f + claim, False)
    design = state.part.ordered(design_of(state.part, run.x.tolist()))
    crossing = state.part.pattern is not None and is_crossing(state.part, state.part.pattern, design)
    return LocalEnd(start, limits, run, f + claim, not crossing, crossing)


def _is_spurious(state: SearchState, nlp: NLP, run: Run) -> bool:
    """Whether the factors claim an abscissa left of the roots: near a0 = 0 equations hold as all terms vanish."""
    if "abscissa" not in nlp.variables:
        return False
    a = coefficients_at(state.part, nlp, run)
    if np.any(a[:, 0] == 0):
        return True
    z = roots(a)
    claimed = run.x[nlp.variables.index("abscissa")] * nlp.unit
    size = np.maximum(np.abs(z).max(axis=1), nlp.unit)  # all of them may be at 0
    scatter = max(state.tuning.scatter, state.tuning.residual ** (1 / state.part.model.degree))
    return bool(np.any(claimed < z.real.max(axis=1) - scatter * size))


def _limits(nlp: NLP) -> tuple[tuple[float, ...], ...]:
    return nlp.lower, nlp.upper, nlp.row_upper
