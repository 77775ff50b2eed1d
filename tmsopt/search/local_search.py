"""One local search: run IPOPT from one start, repeat it if it ends badly, and find other starts with the same end."""

import math
from dataclasses import replace
from itertools import islice

import numpy as np

from tmsopt.problem.verdict.meetings import is_crossing
from tmsopt.program import NLP, initial_point
from tmsopt.program.ipopt import make_ipopt
from tmsopt.records import Array
from tmsopt.roots import roots
from tmsopt.search.state import LocalEnd, SearchState, Start
from tmsopt.search.stopping import is_proven


def solve_from(state: SearchState, start: Start) -> LocalEnd:
    """Solve from one start; if IPOPT does not converge, start again from its end with new factors, while that helps."""
    tuning, exact = state.tuning, state.nlp.cases and state.nlp.exact
    best = run_once(state, start, "near" if start.near else "exact" if exact else "far")
    for restart in range(tuning.restarts):
        converged = (
            best.feasible and best.run.status == "Solve_Succeeded" and not best.nlp.has_split_double_root(best.run.x)
        )
        exhausted = not best.feasible and restart >= count_restarts(state)
        if converged or exhausted or not np.all(np.isfinite(best.run.x)):
            break
        end = run_once(state, replace(start, design=state.design_at(best)), "far" if restart % 2 else "near")
        if best.feasible and (not end.feasible or end.objective >= best.objective - tuning.same):
            break
        best = end
    return _add_led_designs(state, keep_to_start(state, start, exchange_contacts(state, best)))


def count_restarts(state: SearchState) -> int:
    """Return how often to restart from an end that violates rows: more often if feasible ends are likely."""
    if state.feasible:
        return state.tuning.restarts if state.sample is None else 1
    blind = state.sample is None and len(state.ends) >= state.tuning.blind
    return 0 if blind or (state.nlp.formulation != "elastic" and state.out_of_reach) else 1


def run_once(state: SearchState, start: Start, settings: str) -> LocalEnd:
    """Run IPOPT in a few ways and return the best end.

    The ways differ in which root determines each root quantity, and on which side of each kink the program stays.
    """
    x = initial_point(state.nlp, state.part, start.design, settings == "near")
    ways = islice(state.nlp.impose_contacts(x), state.tuning.ways)
    return min((_run_ipopt(state, start, x, way, settings) for way in ways), key=lambda end: end.rank)


def keep_to_start(state: SearchState, start: Start, best: LocalEnd) -> LocalEnd:
    """Return the end; if the start was better, run with other settings, and return the better of the two ends."""
    if state.sample is None or not best.feasible:
        return best
    box = state.sample.box
    start_batch = box.judge_points(box.space.points(start.design)[None])
    if start_batch.violation[0] > 0 or start_batch.objective[0] >= best.objective - state.tuning.same:
        return best
    rerun = run_once(state, start, "far" if start.near else "near")
    return rerun if rerun.feasible and rerun.objective < best.objective else best


def exchange_contacts(state: SearchState, best: LocalEnd) -> LocalEnd:
    """Return the best end over other ways (see `run_once`) that fit the end as well as the current one."""
    for _ in range(state.tuning.exchanges if state.nlp.contacts and best.feasible else 0):
        x = best.run.x
        other_ways = (way for way in state.nlp.impose_contacts(x, state.tuning.meets) if way != best.nlp)
        ends = [_run_ipopt(state, best.start, x, way, "near") for way in islice(other_ways, 2 * state.tuning.ways)]
        best_exchange = min(ends, key=lambda end: end.rank, default=best)
        if not (best_exchange.feasible and best_exchange.objective < best.objective - state.tuning.same):
            break
        best = best_exchange
    return best


def _run_ipopt(state: SearchState, start: Start, x: Array, limits: NLP, settings: str) -> LocalEnd:
    """Run IPOPT once and judge its end."""
    run = make_ipopt(state.nlp, state.options, settings)(x, limits)
    end = LocalEnd(start, limits, run, math.inf, False)
    f, rows = limits.evaluate(run.x)
    if not np.all(np.isfinite([f, *rows, *run.x])):
        return end
    outside = np.maximum(np.array(limits.row_lower) - rows, rows - np.array(limits.row_upper)).clip(0)
    # Rows constrain the square of the distance in a double root: if they hold to 1e-12, it may be 1e-6.
    claim = 2 * float(np.abs(np.nan_to_num(run.row_multipliers)) @ outside) if limits.contacts else 0.0
    end, feasible = replace(end, objective=f + claim), outside.max(initial=0.0) <= state.tuning.feasible
    if not feasible or run.status == "Infeasible_Problem_Detected" or _is_spurious(state, end):
        return end
    part, pattern = state.part, state.part.pattern
    crossing = pattern is not None and is_crossing(part, pattern, part.ordered(state.design_at(end)))
    return replace(end, feasible=not crossing, crossing=crossing)


def _is_spurious(state: SearchState, end: LocalEnd) -> bool:
    """Whether the factors claim an abscissa left of the roots.

    This can happen near a0 = 0, where all terms of the equations vanish.
    """
    nlp = end.nlp
    if "abscissa" not in nlp.variables:
        return False
    a = state.coefficients_at(end)
    if np.any(a[:, 0] == 0):
        return True
    z = roots(a)
    claimed = end.run.x[nlp.variables.index("abscissa")] * nlp.unit
    size = np.maximum(np.abs(z).max(axis=1), nlp.unit)  # all roots may be 0
    scatter = max(state.tuning.scatter, state.tuning.residual ** (1 / state.part.model.degree))
    return bool(np.any(claimed < z.real.max(axis=1) - scatter * size))


def _add_led_designs(state: SearchState, end: LocalEnd) -> LocalEnd:
    """Add to an end the sampled designs that lead straight down to it and to no earlier end."""
    if not (state.sample and end.feasible and state.part.objective) or state.options.exhaustive:
        return end
    tuning, leaders, box = state.tuning, state.sample.leaders, state.sample.box
    place = box.space.points(state.design_at(end))
    known_points = (box.space.points(state.design_at(other)) for other in state.feasible)
    if is_proven(state, end) or any(np.abs(place - other).max() <= tuning.same for other in known_points):
        return end  # the search ends here, or an earlier end has the same design
    rows = [row for row in state.left if row != end.start.row]
    batch, tolerance = leaders.take(np.array(rows, dtype=int)), tuning.same * (end.nlp.size + abs(end.objective))
    if not rows:
        return end
    shares = np.arange(1, 8)[:, None] / 8
    path = box.judge_points((batch.u[:, None] + shares * (place - batch.u[:, None])).reshape(-1, box.space.size))
    objective, violation = (x.reshape(len(rows), -1) for x in (path.objective, path.violation))
    gain = batch.objective - end.objective
    heights = np.concatenate([batch.objective[:, None], objective], axis=1)
    falls = np.all(heights[:, 1:] <= heights[:, :-1] + (tuning.level * np.abs(gain) + tolerance)[:, None], axis=1)
    leads_down = (
        falls & (gain >= -tolerance) & np.isfinite(batch.objective) & (violation.max(axis=1) <= batch.violation)
    )
    leads_down |= (np.abs(gain) <= tolerance) & (batch.violation == 0)
    return replace(end, led=frozenset(np.array(rows)[leads_down].tolist()))
