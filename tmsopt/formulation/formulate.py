"""From a problem to plain NLP data, by factors of the characteristic polynomial; no eigenvalue, no division.

``abscissa`` lifts root quantities into factor coefficients; ``matching`` equates the coefficients with those of a
pattern. Both share how parameters, quantities and constraints become variables and rows. Every case that the design
must stand up to has factors of its own, and shares the design and the root quantities with the others.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tmsopt.design.cases import Case
from tmsopt.design.dependence import demands_heavy_damping
from tmsopt.design.problem import Problem, freedom
from tmsopt.formulation.builder import Builder
from tmsopt.formulation.nlp import NLP
from tmsopt.roots import Pattern


def formulate(
    problem: Problem,
    cases: Sequence[Case] = (),
    elastic: bool = False,
    damping_ratio: float | None = None,
    settings: Mapping[str, Any] | None = None,
) -> NLP:
    """The formulation that the problem asks for: ``matching`` for a pattern, else ``abscissa``.

    Args:
        cases: what the design must stand up to; the nominal design alone, without any.
        elastic: leave every constraint a row that can be relaxed.
        damping_ratio: take this for it, and leave it to the recheck whether it is.
        settings: symbols for numbers of the problem that are to be parameters of the NLP; see `Family`.
    """
    if problem.pattern:
        return matching(problem, cases=cases, settings=settings)
    return abscissa(problem, cases, elastic, damping_ratio, settings)


def abscissa(
    problem: Problem,
    cases: Sequence[Case] = (),
    elastic: bool = False,
    damping_ratio: float | None = None,
    settings: Mapping[str, Any] | None = None,
) -> NLP:
    """Optimise the objective with every root quantity carried by factors, in every case; real ones if all must be."""
    build = Builder(problem, cases, settings=settings)
    if damping_ratio is not None:
        build.take("damping_ratio", damping_ratio)
    elif not elastic and demands_heavy_damping(problem):
        build.real_roots()
    build.constraints()
    build.optimise()
    return build.finish("abscissa")


def matching(
    problem: Problem,
    pattern: Pattern | None = None,
    cases: Sequence[Case] = (),
    settings: Mapping[str, Any] | None = None,
) -> NLP:
    """Match coefficients with a pattern: a_k = a0 · c_k(unknowns).

    Square: the equations alone. Under-determined: the objective, or the distance to the start relative to the box.
    Over-determined: least squares of the equations.
    """
    pattern = pattern or problem.pattern
    if pattern is None:
        raise ValueError("matching needs a pattern; give the problem locate = 'EP4' or another")
    build = Builder(problem, cases, settings=settings)
    build.pattern(pattern)
    build.constraints()
    left = freedom(problem).count
    if problem.objective is not None and left >= 0:
        build.optimise()
    elif left > 0:
        build.nearest_to(middle(problem))
    return build.finish("matching")


def variables_of(problem: Problem, design: Mapping[str, float]) -> list[float]:
    """The NLP's first variables for free parameters."""
    of = problem.parameter_set
    return [float(np.tan(design[n])) if of[n].tangent else float(design[n]) for n in problem.free]


def design_of(problem: Problem, x: Sequence[float]) -> dict[str, float]:
    """The free parameters for variables of the NLP, inside their ranges."""
    of = problem.parameter_set
    plain = {n: float(np.arctan(v)) if of[n].tangent else float(v) for n, v in zip(problem.free, x, strict=False)}
    return {n: min(max(v, problem.free[n][0]), problem.free[n][1]) for n, v in plain.items()}


def middle(problem: Problem) -> dict[str, float]:
    """The start of each free parameter, or the middle of its range."""
    return {n: problem.start.get(n, (lo + hi) / 2) for n, (lo, hi) in problem.free.items()}
