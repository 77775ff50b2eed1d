"""What each idea does for the proof of a bound: the plain model for SCIP, and one idea after the other added to it."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import casadi as ca
import numpy as np
from tqdm import tqdm

from benchmarks.references import references
from benchmarks.report import origin, table
from benchmarks.suite import RANGES, random_problem
from tmsopt.arithmetic.intervals import root_bound
from tmsopt.certificates.half_planes import over
from tmsopt.certificates.question import Question
from tmsopt.certificates.translation import FEASIBILITY, Translated, translate
from tmsopt.checks.bound import omega0_bound
from tmsopt.design.problem import Problem
from tmsopt.formulation.formulate import Builder
from tmsopt.models import Model
from tmsopt.roots import product, shift

GAP = 1e-4
"""Relative gap to prove, or a tenth of it absolute."""


@dataclass(frozen=True)
class Rung:
    """One way to put the problem.

    Attributes:
        words: what is new.
        models: SCIP models whose bounds together, the least of them, are the bound.
    """

    words: str
    models: Callable[[Problem, float], list[Translated]]


def _factored(
    problem: Problem,
    value: float,
    *,
    ranges: bool = False,
    incumbent: bool = False,
    averages: bool = False,
    symmetry: bool = False,
    priorities: bool = False,
    known: bool = False,
    sharing: bool = False,
) -> list[Translated]:
    """The minimum of γ with p(t + γ) = a0 (t² + β₁t + κ₁)(t² + β₂t + κ₂)."""
    build = Builder(problem, ())
    a = build.values[0].coefficients
    largest = root_bound(over(build, a)) if ranges else math.inf
    gap = GAP * max(0.1, abs(value))
    lower = max(omega0_bound(problem, value).value, -largest) if incumbent else -largest
    line = ca.SX(value - gap) if known else build.variable("abscissa", lower, value if incumbent else largest)
    build.shared["abscissa"] = line
    pairs = [
        (build.variable(f"beta{k}", 0.0, 4 * largest), build.variable(f"kappa{k}", 0.0, 4 * largest**2)) for k in (1, 2)
    ]
    build.equal("abscissa", shift(a, line), [a[0] * c for c in product(*([1, *p] for p in pairs))])
    build.constraints()
    if averages:  # the mean of the roots, and their product, say as much of every node's box
        build.row("mean", (4 * line * a[0] + a[1]) * a[0], 0.0, np.inf)
        build.row("product", a[4] * a[0] - a[0] * a[0] * line**4 if value < 0 else ca.SX(0), 0.0, np.inf)
    if symmetry:
        build.row("order", pairs[1][0] - pairs[0][0], 0.0, np.inf)
    build.objective = ca.SX(0) if known else line
    translated = translate(build.finish("plain"), sharing=sharing)
    if priorities:
        for symbol, _ in translated.variables[: len(problem.free)]:
            translated.model.chgVarBranchPriority(symbol, 100)
    return [_aimed(translated, gap, known)]


def _questions(problem: Problem, value: float, *, compact: bool) -> list[Translated]:
    """Whether any design reaches a line, by interlacing parts, for both signs of a0."""
    own = problem if compact else replace(problem, model=_expanded(problem.model))
    question = Question(own, (), value - GAP * max(0.1, abs(value)), _unit(problem, value))
    return [_aimed(translate(question.program(sign)), 0.0, True) for sign in question.signs()]


def _aimed(translated: Translated, gap: float, known: bool) -> Translated:
    model = translated.model
    model.setParam("numerics/feastol", FEASIBILITY)
    if known:
        model.setParam("limits/solutions", 1)
    else:
        model.setObjective(translated.objective)
        model.setParam("limits/absgap", gap)
    return translated


def _expanded(model: Model) -> Model:
    return replace(model, compact=None)


def _unit(problem: Problem, value: float) -> float:
    """The product of the roots in the middle of the box, for want of a design."""
    middle = {n: (lo + hi) / 2 for n, (lo, hi) in problem.free.items()}
    omega = abs(float(problem.values(problem.ordered(middle))["omega0"]))
    return float(2.0 ** round(math.log2(omega))) if math.isfinite(omega) and omega > 0 else 1.0


RUNGS = (
    Rung("plain: factors and γ free, as multiplied out", _factored),
    Rung("+ ranges of γ and factors by the root bound", partial(_factored, ranges=True)),
    Rung("+ incumbent and ω0 bound as limits of γ", partial(_factored, ranges=True, incumbent=True)),
    Rung(
        "+ mean and product of the roots as inequalities",
        partial(_factored, ranges=True, incumbent=True, averages=True),
    ),
    Rung("+ β₁ ≤ β₂", partial(_factored, ranges=True, incumbent=True, averages=True, symmetry=True)),
    Rung(
        "+ branching on the parameters first",
        partial(_factored, ranges=True, incumbent=True, averages=True, symmetry=True, priorities=True),
    ),
    Rung(
        "variables for what formulas share, ranges and incumbent",
        partial(_factored, ranges=True, incumbent=True, sharing=True),
    ),
    Rung(
        "γ known: is there any design below the incumbent?", partial(_factored, ranges=True, known=True, sharing=True)
    ),
    Rung("interlacing parts: one unknown in place of four factors", partial(_questions, compact=False)),
    Rung("coefficients but for a common factor, in few products", partial(_questions, compact=True)),
)
"""The plain model first; the sixth has all that is usually tried, the last is one of the ways of `certify`."""


@dataclass(frozen=True)
class Climb:
    """How one problem went on one rung."""

    index: int
    proved: bool
    seconds: float
    nodes: int


def climb(index: int, rung: int, value: float, limit: float) -> Climb:
    """Prove one bound."""
    problem = random_problem(index)
    began, nodes, bounds = time.perf_counter(), 0, []
    for translated in RUNGS[rung].models(problem, value):
        model = translated.model
        model.setParam("limits/time", max(limit - (time.perf_counter() - began), 0.01))
        if not translated.impossible:
            model.optimize()
            nodes += int(model.getNTotalNodes())
        infeasible = translated.impossible or model.getStatus() == "infeasible"
        known = model.getParam("limits/solutions") == 1
        bounds.append(math.inf if infeasible else -math.inf if known else float(model.getDualbound()))
    goal = value - GAP * max(0.1, abs(value))
    return Climb(index, min(bounds) >= goal * (1 + 1e-9 if goal < 0 else 1 - 1e-9), time.perf_counter() - began, nodes)


def ladder(limit: float, workers: int) -> list[list[Climb]]:
    """All rungs on the feasible problems with seven free parameters."""
    known = {i: r.value for i, r in references().items() if r.solvable and len(random_problem(i).free) == len(RANGES)}
    found = []
    with ProcessPoolExecutor(workers) as pool:
        for rung in tqdm(range(len(RUNGS)), unit="rung"):
            each = pool.map(partial(_climb, rung=rung, limit=limit), known.items())
            found.append(list(each))
    return found


def _climb(item: tuple[int, float], rung: int, limit: float) -> Climb:
    return climb(item[0], rung, item[1], limit)


def ladder_section(found: Sequence[Sequence[Climb]], limit: float, command: str) -> str:
    """The report in Markdown."""
    return "\n\n".join(["## What helps the proof", origin(command), *_parts(found, limit)]) + "\n"


def _parts(found: Sequence[Sequence[Climb]], limit: float) -> Iterator[str]:
    count = len(found[0])
    rows = []
    for rung, climbs in zip(RUNGS, found, strict=True):
        seconds = [c.seconds if c.proved else limit for c in climbs]
        nodes = sorted(c.nodes for c in climbs if c.proved)
        rows.append(
            (
                rung.words,
                sum(c.proved for c in climbs),
                f"{sum(seconds):.0f} s",
                f"{float(np.median(seconds)):.2g} s",
                nodes[len(nodes) // 2] if nodes else "–",
            )
        )
    header = ("model", f"proved of {count} in {limit:g} s", "total time", "median time", "median nodes")
    yield table(header, rows)
    yield (
        f"The {count} feasible problems of the suite with all seven parameters free; proved is a gap of {GAP:g}, "
        "relative or a tenth of it absolute, to the best value known. What is not proved counts with the whole time. "
        "One process a problem, two at once. Every model has SCIP's own presolve, bound tightening and cuts."
    )
