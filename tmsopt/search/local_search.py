"""One local search: run IPOPT from one start, repeat it if it ends badly, and find other starts with the same end."""

import math
from dataclasses import replace
from itertools import islice

import numpy as np

from tmsopt.chains.meetings import is_crossing
from tmsopt.program import NLP, initial_point
from tmsopt.program.ipopt import make_ipopt
from tmsopt.records import Array
from tmsopt.roots import roots
from tmsopt.search.state import LocalEnd, SearchState, Start
from tmsopt.search.stopping import is_proven
from tmsopt.search.subspace_search import solve_by_subspaces


def solve_from(state: SearchState, start: Start) -> LocalEnd:
    """Solve from one start; without a polynomial, by subspaces.

    While IPOPT does not converge and restarts help, it starts again at its end with new factors.
    """
    if state.part.model.polynomial is None and state.part.pattern is None:
        return _add_led_designs(state, solve_by_subspaces(state, start))
    tuning, is_exact = state.tuning, state.nlp.cases and state.nlp.has_exact_starts
    best = run_once(state, start, "near" if start.near else "exact" if is_exact else "far")
    for restart in range(tuning.restarts):
        has_converged = (
            best.feasible and best.run.status == "Solve_Succeeded" and not best.nlp.has_split_double_root(best.run.x)
        )
        is_last = not best.feasible and restart >= count_restarts(state)
        if has_converged or is_last or not np.all(np.isfinite(best.run.x)):
            break
        end = run_once(state, replace(start, design=state.design_at(best)), "far" if restart % 2 else "near")
        if best.feasible and (not end.feasible or end.objective >= best.objective - tuning.same_objective):
            break
        best = end
    return _add_led_designs(state, keep_to_start(state, start, exchange_contacts(state, best)))


def count_restarts(state: SearchState) -> int:
    """Return how often to restart from an end that violates limits: more often if feasible ends are likely."""
    if state.feasible:
        return state.tuning.restarts if state.sample is None else 1
    has_failed_blind = state.sample is None and len(state.ends) >= state.tuning.repeated_blind_starts
    return 0 if has_failed_blind or (state.nlp.formulation != "elastic" and state.out_of_reach) else 1


def run_once(state: SearchState, start: Start, settings: str) -> LocalEnd:
    """Run IPOPT on a few variants of the program and return the best end.

    The variants differ in which root determines each root quantity, and on which side of each kink the program stays.
    """
    x = initial_point(state.nlp, state.part, start.design, settings == "near")
    variants = islice(state.nlp.impose_contacts(x), state.tuning.max_variants)
    return min((_run_ipopt(state, start, x, variant, settings) for variant in variants), key=lambda end: end.rank)


def keep_to_start(state: SearchState, start: Start, best: LocalEnd) -> LocalEnd:
    """Return the end. If the start was better than the end, run IPOPT with other settings; return the better end."""
    if state.sample is None or not best.feasible:
        return best
    box = state.sample.box
    start_batch = box.judge_points(box.space.point(start.design)[None])
    if start_batch.violation[0] > 0 or start_batch.objective[0] >= best.objective - state.tuning.same_objective:
        return best
    second_end = run_once(state, start, "far" if start.near else "near")
    return second_end if second_end.feasible and second_end.objective < best.objective else best


def exchange_contacts(state: SearchState, best: LocalEnd) -> LocalEnd:
    """Run IPOPT on other variants (see `run_once`) that fit the end as well as its own; return the best end."""
    for _ in range(state.tuning.variant_exchanges if state.nlp.contacts and best.feasible else 0):
        x = best.run.x
        others = (
            variant for variant in state.nlp.impose_contacts(x, state.tuning.variant_tolerance) if variant != best.nlp
        )
        ends = [_run_ipopt(state, best.start, x, nlp, "near") for nlp in islice(others, 2 * state.tuning.max_variants)]
        best_exchange = min(ends, key=lambda end: end.rank, default=best)
        if not (best_exchange.feasible and best_exchange.objective < best.objective - state.tuning.same_objective):
            break
        best = best_exchange
    return best


def _run_ipopt(state: SearchState, start: Start, x: Array, variant: NLP, settings: str) -> LocalEnd:
    """Run IPOPT once on a variant of the program and decide whether the end is feasible."""
    run = make_ipopt(state.nlp, state.options, settings)(x, variant)
    end = LocalEnd(start, variant, run, math.inf, False)
    f, rows = variant.evaluate(run.x)
    if not np.all(np.isfinite([f, *rows, *run.x])):
        return end
    excesses = np.maximum(np.array(variant.row_lower) - rows, rows - np.array(variant.row_upper)).clip(0)
    # Rows constrain the squared distance of two roots: if a row holds to 1e-12, the distance may be 1e-6.
    rounding_gain = 2 * float(np.abs(np.nan_to_num(run.row_multipliers)) @ excesses) if variant.contacts else 0.0
    end, is_feasible = (
        replace(end, objective=f + rounding_gain),
        excesses.max(initial=0.0) <= state.tuning.feasible_violation,
    )
    if not is_feasible or run.status == "Infeasible_Problem_Detected" or _is_spurious(state, end):
        return end
    part, pattern = state.part, state.part.pattern
    has_crossing = pattern is not None and is_crossing(part, pattern, part.ordered(state.design_at(end)))
    return replace(end, feasible=not has_crossing, crossing=has_crossing)


def _is_spurious(state: SearchState, end: LocalEnd) -> bool:
    """Whether the abscissa in the program is left of the rightmost root, because the factors are wrong.

    This can happen near a0 = 0, where all terms of the equations vanish.
    """
    nlp = end.nlp
    if "abscissa" not in nlp.variables:
        return False
    a = state.coefficients_at(end)
    if np.any(a[:, 0] == 0):
        return True
    z = roots(a)
    abscissa = end.run.x[nlp.variables.index("abscissa")] * nlp.unit
    size = np.maximum(np.abs(z).max(axis=1), nlp.unit)  # not 0, even if all roots are 0
    scatter = max(state.tuning.root_scatter, state.tuning.max_residual ** (1 / state.part.model.degree))
    return bool(np.any(abscissa < z.real.max(axis=1) - scatter * size))


def _add_led_designs(state: SearchState, end: LocalEnd) -> LocalEnd:
    """Add the sampled designs from which the objective falls on a straight line to this end, and to no earlier end."""
    if not (state.sample and end.feasible and state.part.objective) or state.options.exhaustive:
        return end
    tuning, leaders, box = state.tuning, state.sample.leaders, state.sample.box
    end_point = box.space.point(state.design_at(end))
    known_points = (box.space.point(state.design_at(other)) for other in state.feasible)
    if is_proven(state, end) or any(np.abs(end_point - other).max() <= tuning.same_objective for other in known_points):
        return end  # the search ends here, or an earlier end has the same design
    rows = [row for row in state.left if row != end.start.row]
    batch, tolerance = (
        leaders.take(np.array(rows, dtype=int)),
        tuning.same_objective * (end.nlp.size + abs(end.objective)),
    )
    if not rows:
        return end
    fractions = np.arange(1, 8)[:, None] / 8
    path = box.judge_points((batch.u[:, None] + fractions * (end_point - batch.u[:, None])).reshape(-1, box.space.size))
    objective, violation = (x.reshape(len(rows), -1) for x in (path.objective, path.violation))
    gain = batch.objective - end.objective
    objectives = np.concatenate([batch.objective[:, None], objective], axis=1)
    is_falling = np.all(
        objectives[:, 1:] <= objectives[:, :-1] + (tuning.path_rise * np.abs(gain) + tolerance)[:, None], axis=1
    )
    is_downhill = (
        is_falling & (gain >= -tolerance) & np.isfinite(batch.objective) & (violation.max(axis=1) <= batch.violation)
    )
    is_downhill |= (np.abs(gain) <= tolerance) & (batch.violation == 0)
    return replace(end, led=frozenset(np.array(rows)[is_downhill].tolist()))
