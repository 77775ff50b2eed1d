"""One local search without a polynomial: IPOPT on the invariant subspace of the rightmost eigenvalues, step by step.

The subspace has few eigenvalues at first. Each step stays within a trust region. If another eigenvalue crosses the line
Re s = γ of the program, the step is rejected, and the subspace takes more eigenvalues.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import islice

import numpy as np

from tmsopt.problem import Case, Posed
from tmsopt.program import NLP, formulate, initial_point
from tmsopt.program.formulate import design_of, variables_of
from tmsopt.program.ipopt import Run, make_ipopt
from tmsopt.program.lifts import covered_indices
from tmsopt.program.subspaces import Spectrum, case_matrices, find_others, find_spectra, start_subspaces
from tmsopt.program.unit_box import UnitBox
from tmsopt.records import Array
from tmsopt.roots.chains import eigenvalues_of
from tmsopt.search.descent import Descent
from tmsopt.search.state import LocalEnd, SearchState, Start, clip_to_box, make_failed_end

_MAX_STEPS = 40
_FIRST_RADIUS = 0.05  # of the box, in a scale that resolves small values
_MIN_RADIUS = 1e-7
_SHRINK, _GROW = 0.25, 3.0
_NEAR_LINE = 0.05  # of the size of the eigenvalues: those nearer to the rightmost one are in the first subspace
_CROSSING = 1e-9  # of the size of the eigenvalues: an eigenvalue farther to the right of the line has crossed it
_WORSE = 1e-7  # relative difference of objectives that the interior-point method may leave
_PROGRESS = 1e-12  # relative improvement of the objective below which the search ends
_AT_END = 0.99  # of the trust region: a step that is longer may go on


def solve_by_subspaces(state: SearchState, start: Start) -> LocalEnd:
    """Solve from one start; the end is feasible if no eigenvalue lies to the right of the line of the program."""
    part, design, radius = state.part, clip_to_box(state.part, start.design), _FIRST_RADIUS
    best, extra = make_failed_end(start, state.nlp), 0
    space, is_elastic = UnitBox(part), state.nlp.formulation == "elastic"
    if not is_elastic:
        design = _descend(state, space, design)
    for _ in range(_MAX_STEPS):
        try:
            least = () if is_elastic else _count_near(part, state.nlp, design)
            spectra = find_spectra(part, design, state.nlp.cases, state.nlp.unit, [count + extra for count in least])
            counts = tuple(len(one.eigenvalues) for one in spectra)
            nlp = state.nlp if is_elastic else make_program(part, state.nlp.cases, counts)
            nlp = start_subspaces(nlp, part, spectra)
            start_end, trial = _run_ipopt(state, start, nlp, design, _trust_region(space, design, radius))
            has_crossed = trial.feasible and _has_crossed(part, spectra, trial)
        except np.linalg.LinAlgError:
            break
        tolerance = _WORSE * (nlp.size + abs(trial.objective))
        is_worse = not nlp.contacts and start_end.feasible and trial.objective > start_end.objective + tolerance
        if not trial.feasible or has_crossed or is_worse:
            radius *= _SHRINK
            extra += 2 * has_crossed
            if radius < _MIN_RADIUS:
                break
            continue
        new_design = state.design_at(trial)
        step = np.abs(_position(space, new_design) - _position(space, design)).max(initial=0.0)
        is_better = trial.objective < best.objective - _PROGRESS * (nlp.size + abs(trial.objective))
        if trial.objective <= best.objective:
            best, design = trial, new_design
        if step < _AT_END * radius or not is_better:
            break
        radius = min(_GROW * radius, 1.0)
    return best


def _descend(state: SearchState, space: UnitBox, design: Mapping[str, float]) -> dict[str, float]:
    """The design where the descent from another one ends, in the units of the sample."""
    spread, scales = 1.0, np.ones(len(state.part.conditions))
    if state.sample:
        spread, scales = state.sample.spread or 1.0, state.sample.box.scales
    return clip_to_box(state.part, Descent(space, spread, scales).run(design))


@lru_cache(maxsize=16)
def make_program(problem: Posed, cases: tuple[Case, ...], counts: tuple[int, ...]) -> NLP:
    """The program of subspaces of these sizes, without the constants of a start."""
    return formulate(problem, cases, counts=counts)


def _count_near(problem: Posed, nlp: NLP, design: Mapping[str, float]) -> list[int]:
    """The number of eigenvalues near the rightmost one in each case; at least two."""
    counts = list[int]()
    for matrices in case_matrices(problem, design, nlp.cases, nlp.unit):
        s = eigenvalues_of(matrices)
        size = float(np.abs(s - s.mean() * problem.model.is_complex).mean())
        counts.append(min(max(2, int(np.sum(s.real >= s.real.max() - _NEAR_LINE * size))), len(s)))
    return counts


def _position(space: UnitBox, design: Mapping[str, float]) -> Array:
    return space.spread_near_zero(space.point(design))


def _trust_region(space: UnitBox, design: Mapping[str, float], radius: float) -> list[dict[str, float]]:
    """The corners of the trust region with the least and with the greatest values."""
    centre = _position(space, design)
    ends = (np.clip(centre + change, 0.0, 1.0) for change in (-radius, radius))
    return [{n: float(x) for n, x in space.designs(space.sample_near_zero(end)).items()} for end in ends]


def _run_ipopt(
    state: SearchState, start: Start, nlp: NLP, design: Mapping[str, float], region: Sequence[Mapping[str, float]]
) -> tuple[LocalEnd, LocalEnd]:
    """The start, and the best end of IPOPT on a few variants of the program within a trust region."""
    x, count = initial_point(nlp, state.part, design), len(state.part.free)
    if len(x) != len(nlp.variables):
        raise np.linalg.LinAlgError("the subspace has another size than that of the program")
    low, high = (variables_of(state.part, corner) for corner in region)
    limited = replace(nlp, lower=(*low, *nlp.lower[count:]), upper=(*high, *nlp.upper[count:]))

    def end_at(run: Run, variant: NLP) -> LocalEnd:
        f, rows = variant.evaluate(run.x)
        lower, upper = (*nlp.lower[:count], *variant.lower[count:]), (*nlp.upper[:count], *variant.upper[count:])
        excesses = np.maximum(np.array(variant.row_lower) - rows, rows - np.array(variant.row_upper)).clip(0)
        is_finite = bool(np.all(np.isfinite([f, *rows, *run.x])))
        is_feasible = is_finite and bool(excesses.max(initial=0.0) <= state.tuning.feasible_violation)
        rounding_gain = 2 * float(np.abs(np.nan_to_num(run.row_multipliers)) @ excesses) if is_feasible else math.inf
        return LocalEnd(start, replace(variant, lower=lower, upper=upper), run, f + rounding_gain, is_feasible)

    variants = [*islice(limited.impose_contacts(x), state.tuning.max_variants)]
    runs = [make_ipopt(nlp, state.options, "near")(x, variant) for variant in variants]
    ends = [end_at(run, variant) for run, variant in zip(runs, variants, strict=True)]
    return end_at(replace(runs[0], x=x), nlp), min(ends, key=lambda end: end.rank)


def _has_crossed(problem: Posed, spectra: Sequence[Spectrum], end: LocalEnd) -> bool:
    """Whether an eigenvalue outside the subspace lies to the right of the line."""
    nlp, x = end.nlp, end.run.x
    if "abscissa" not in nlp.variables:
        return False
    gamma, names = x[nlp.variables.index("abscissa")], np.array(nlp.variables)
    every = case_matrices(problem, design_of(problem, x.tolist()), nlp.cases, nlp.unit)
    for k, matrices, one in zip(covered_indices(nlp.cases), every, spectra, strict=True):
        vectors = x[names == f"subspace.{k}"].reshape(len(one.eigenvalues), -1)
        others = find_others(matrices, vectors[:, ::2] + 1j * vectors[:, 1::2] if problem.model.is_complex else vectors)
        size = float(np.abs(np.concatenate([others, one.eigenvalues])).max())
        if others.real.max(initial=-math.inf) > gamma + _CROSSING * size:
            return True
    return False
