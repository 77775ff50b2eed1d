"""The least-violating point of a problem that has no feasible one: constraints and patterns with slack."""

import math

import casadi as ca
import numpy as np

from tmsopt.design.formulations import design_of
from tmsopt.design.ipopt import ipopt
from tmsopt.design.nlp import NLP
from tmsopt.design.problem import Problem
from tmsopt.design.recheck import recheck
from tmsopt.design.starts import complete, designs

_TRIED = 6


def least_violating(problem: Problem, nlp: NLP, seed: int, linear_solver: str) -> dict[str, float]:
    """Free parameters with the smallest sum of violations that a few starts reach."""
    relaxed, rows = _elastic(problem, nlp)
    run = ipopt(relaxed, linear_solver)
    starting = list(designs(problem, seed, _TRIED))
    best, least = starting[0], math.inf
    for design in starting:
        x = complete(nlp, problem, design)
        g = np.array(nlp.functions(x)[1]).ravel()[rows]
        slack = np.maximum(np.maximum(np.array(nlp.row_lower)[rows] - g, g - np.array(nlp.row_upper)[rows]), 0.0)
        ended = run(np.concatenate([x, np.where(np.isfinite(slack), slack, 1.0) + 1e-3])).x
        if not np.all(np.isfinite(ended)):
            continue
        reached = design_of(problem, ended.tolist())
        violation = sum(recheck(problem, problem.ordered(reached)).violations.values())
        if violation < least:
            best, least = reached, violation
    return best


def _elastic(problem: Problem, nlp: NLP) -> tuple[NLP, list[int]]:
    """minimise Σ slack, each named row widened by its slack; the equations of lifted quantities stay exact."""
    rows = [k for k, name in enumerate(nlp.rows) if name in problem.constraints or name == problem.locate]
    x, slack = ca.SX.sym("x", len(nlp.variables)), ca.SX.sym("s", len(rows))
    g = nlp.functions(x)[1]
    parts, lower, upper, names = [], [], [], []
    for k, name in enumerate(nlp.rows):
        s = slack[rows.index(k)] if k in rows else 0
        for side, low, high in ((g[k] - s, -np.inf, nlp.row_upper[k]), (g[k] + s, nlp.row_lower[k], np.inf)):
            if k in rows and (np.isfinite(low) or np.isfinite(high)):
                parts.append(side)
                names.append(name)
                lower.append(low)
                upper.append(high)
        if k not in rows:
            parts.append(g[k])
            names.append(name)
            lower.append(nlp.row_lower[k])
            upper.append(nlp.row_upper[k])
    variables = ca.vertcat(x, slack)
    return (
        NLP(
            formulation="elastic",
            variables=(*nlp.variables, *(f"slack of {nlp.rows[k]}" for k in rows)),
            functions=ca.Function(
                "elastic", [variables], [ca.densify(ca.sum1(slack)), ca.densify(ca.vertcat(*parts))], ["x"], ["f", "g"]
            ),
            lower=(*nlp.lower, *(0.0 for _ in rows)),
            upper=(*nlp.upper, *(np.inf for _ in rows)),
            rows=tuple(names),
            row_lower=tuple(lower),
            row_upper=tuple(upper),
        ),
        rows,
    )
