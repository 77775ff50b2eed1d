"""SciPy's SLSQP on an NLP: for what a claim of IPOPT is rechecked by, which must not be IPOPT."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from tmsopt.program.ipopt import Run
from tmsopt.program.nlp import NLP
from tmsopt.records import Array

_ENOUGH = 1e-14  # change of the objective; Newton's method goes on from there
_HELD = 1e-7  # slack of a row that is held, near 1 as they are


def slsqp(nlp: NLP, max_iterations: int) -> Callable[[Array], Run]:
    """A solver of one NLP, whose rows are equations, or expressions that must not be negative: start → run."""
    from scipy.optimize import minimize  # a quarter of a second, paid only where something is rechecked

    compiled, constants = nlp.compiled, nlp.constants
    lower, upper, equal = np.array(nlp.lower), np.array(nlp.upper), np.equal(nlp.row_lower, nlp.row_upper)

    @lru_cache(maxsize=2)
    def at(x: bytes) -> tuple[Any, ...]:
        """Objective and its gradient, rows and their Jacobian."""
        parts = (compiled.derivatives[d](np.frombuffer(x).tolist(), constants) for d in ("grad_f", "jac_g"))
        f, slope, g, jacobian = (part.full() for each in parts for part in each)
        return float(f.item()), slope.ravel(), g.ravel(), jacobian

    def rows(which: Array, part: int) -> Callable[[Array], Any]:
        return lambda x: at(x.tobytes())[part][which]

    limits: list[Any] = [
        {"type": kind, "fun": rows(which, 2), "jac": rows(which, 3)}
        for kind, which in (("eq", equal), ("ineq", ~equal))
        if which.any()
    ]

    def objective(x: Any) -> Any:
        return at(x.tobytes())[:2]

    def run(x0: Array) -> Run:
        with np.errstate(all="ignore"):  # steps may leave where roots and logarithms exist
            ended = minimize(
                objective,
                np.clip(x0, lower, upper),
                method="SLSQP",
                jac=True,
                bounds=list(zip(nlp.lower, nlp.upper, strict=True)),
                constraints=limits,
                options={"maxiter": max_iterations, "ftol": _ENOUGH},
            )
        x = np.clip(ended.x, lower, upper)
        _, slope, g, jacobian = at(x.tobytes())
        held, stopped = equal | (np.abs(g) <= _HELD), (x <= lower) | (x >= upper)
        of_rows, of_bounds = np.zeros(len(g)), np.zeros(len(x))
        columns = np.hstack([jacobian[held].T, np.eye(len(x))[:, stopped]])
        if np.all(np.isfinite(columns)) and np.all(np.isfinite(slope)):
            found = np.linalg.lstsq(columns, -slope, rcond=None)[0]
            of_rows[held], of_bounds[stopped] = found[: held.sum()], found[held.sum() :]
        return Run(x, of_rows, of_bounds, str(ended.message))

    return run
