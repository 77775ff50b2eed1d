"""One local search: IPOPT from one start, repeated if it ends badly."""

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
from tmsopt.search.starts import add_led_designs
from tmsopt.search.state import LocalEnd, SearchState, Start, coefficients_at


def solve_from(state: SearchState, start: Start) -> LocalEnd:
    """Solve from one start; if IPOPT does not converge, factor the roots anew and go on while that helps."""
    tuning, nlp = state.tuning, state.nlp
    exact = bool(nlp.cases) and nlp.exact
    best = run_once(state, start, "near" if start.near else "exact" if exact else "far")
    for again in range(tuning.restarts):
        converged = (
            best.feasible and best.run.status == "Solve_Succeeded" and not best.nlp.has_split_double_root(best.run.x)
        )
        exhausted = not best.feasible and again >= count_restarts(state)
        if converged or exhausted or not np.all(np.isfinite(best.run.x)):
            break
        end = run_once(state, replace(start, design=state.design_at(best)), "far" if again % 2 else "near")
        if best.feasible and (not end.feasible or end.objective >= best.objective - tuning.same):
            break
        best = end
    return add_led_designs(state, keep_to_start(state, start, exchange_contacts(state, best)))


def count_restarts(state: SearchState) -> int:
    """How often to restart from an end that violates rows: more often if feasible ends are likely."""
    if state.feasible:
        return state.tuning.restarts if state.sample is None else 1
    blind = state.sample is None and len(state.ends) >= state.tuning.blind
    return 0 if blind or (state.nlp.formulation != "elastic" and state.out_of_reach) else 1


def run_once(state: SearchState, start: Start, settings: str) -> LocalEnd:
    """The best end of IPOPT over the ways in which root quantities and kinks can be held at the start."""
    x = initial_point(state.nlp, state.part, start.design, settings == "near")
    ways = islice(state.nlp.impose_contacts(x), state.tuning.ways)
    return min((_run_ipopt(state, start, x, way, settings) for way in ways), key=lambda end: end.rank)


def keep_to_start(state: SearchState, start: Start, best: LocalEnd) -> LocalEnd:
    """The end, or the end of a run with other settings if the start was better."""
    if state.sample is None or not best.feasible:
        return best
    box, leaders, known = state.sample.box, state.sample.leaders, start.row >= 0
    seen = leaders.take(np.array([start.row])) if known else box.judge_points(box.space.points(start.design)[None])
    if seen.violation[0] > 0 or seen.objective[0] >= best.objective - state.tuning.same:
        return best
    kept = run_once(state, start, "far" if start.near else "near")
    return kept if kept.feasible and kept.objective < best.objective else best


def exchange_contacts(state: SearchState, best: LocalEnd) -> LocalEnd:
    """The best end over other ways of holding root quantities that are as close as the current one."""
    for _ in range(state.tuning.exchanges if state.nlp.contacts and best.feasible else 0):
        x, held = best.run.x, _limits(best.nlp)
        others = (way for way in state.nlp.impose_contacts(x, state.tuning.meets) if _limits(way) != held)
        ends = [_run_ipopt(state, best.start, x, way, "near") for way in islice(others, 2 * state.tuning.ways)]
        other = min(ends, key=lambda end: end.rank, default=best)
        if not (other.feasible and other.objective < best.objective - state.tuning.same):
            break
        best = other
    return best


def _run_ipopt(state: SearchState, start: Start, x: Array, limits: NLP, settings: str) -> LocalEnd:
    """Run IPOPT once and judge its end."""
    run = make_ipopt(state.nlp, state.options, settings)(x, limits)
    f, rows = limits.evaluate(run.x)
    if not (np.all(np.isfinite(rows)) and np.all(np.isfinite(run.x)) and math.isfinite(f)):
        return LocalEnd(start, limits, run, math.inf, False)
    outside = np.maximum(np.array(limits.row_lower) - rows, rows - np.array(limits.row_upper)).clip(0)
    feasible = outside.max(initial=0.0) <= state.tuning.feasible and run.status != "Infeasible_Problem_Detected"
    # Rows that hold to 1e-12 may hide 1e-6 in a double root, whose square they constrain.
    claim = 2 * float(np.abs(np.nan_to_num(run.row_multipliers)) @ outside) if limits.contacts else 0.0
    if not feasible or _is_spurious(state, limits, run):
        return LocalEnd(start, limits, run, f + claim, False)
    design = state.part.ordered(design_of(state.part, run.x.tolist()))
    crossing = state.part.pattern is not None and is_crossing(state.part, state.part.pattern, design)
    return LocalEnd(start, limits, run, f + claim, not crossing, crossing)


def _is_spurious(state: SearchState, nlp: NLP, run: Run) -> bool:
    """Whether the factors claim an abscissa left of the roots: near a0 = 0 all terms of the equations vanish."""
    if "abscissa" not in nlp.variables:
        return False
    a = coefficients_at(state.part, nlp, run)
    if np.any(a[:, 0] == 0):
        return True
    z = roots(a)
    claimed = run.x[nlp.variables.index("abscissa")] * nlp.unit
    size = np.maximum(np.abs(z).max(axis=1), nlp.unit)  # all roots may be 0
    scatter = max(state.tuning.scatter, state.tuning.residual ** (1 / state.part.model.degree))
    return bool(np.any(claimed < z.real.max(axis=1) - scatter * size))


def _limits(nlp: NLP) -> tuple[tuple[float, ...], ...]:
    return nlp.lower, nlp.upper, nlp.row_upper
