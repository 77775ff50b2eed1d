"""CasADi's sequential quadratic programming, for small programs that are solved without IPOPT."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.program.ipopt import Run, delay_signals
from tmsopt.program.nlp import NLP, CompiledProgram, PerThread
from tmsopt.records import Array

_PRINT_OPTIONS = (
    "print_header",
    "print_iteration",
    "print_status",
    "print_time",
    "show_eval_warnings",
    "error_on_fail",
)
_QP_PRINT_OPTIONS = ("print_header", "print_iter", "print_info", "error_on_fail")


def make_sqp(nlp: NLP, max_iterations: int = 100) -> Callable[[Array], Run]:
    """A solver of one NLP: start → run. It approximates the Hessian from gradients. Do not share it between threads."""
    solver = _SOLVERS.get(nlp.program, max_iterations)
    lower, upper = np.array(nlp.lower), np.array(nlp.upper)
    limits = {"lbx": nlp.lower, "ubx": nlp.upper, "lbg": nlp.row_lower, "ubg": nlp.row_upper, "p": nlp.constants}

    def run(x0: Array) -> Run:
        start = np.clip(x0, lower, upper)
        with delay_signals():
            answer = solver(x0=start.tolist(), **limits)
        x, rows, bounds = (np.nan_to_num(answer[name].full().ravel()) for name in ("x", "lam_g", "lam_x"))
        return Run(np.clip(x, lower, upper), rows, bounds, str(solver.stats()["return_status"]))

    return run


def _solver(program: CompiledProgram, max_iterations: int) -> ca.Function:
    x, p, _ = program.symbols
    f, g = program.function(x, p)
    settings: dict[str, Any] = {
        **dict.fromkeys(_PRINT_OPTIONS, False),
        "qpsol": "qrqp",
        "qpsol_options": dict.fromkeys(_QP_PRINT_OPTIONS, False),
        "hessian_approximation": "limited-memory",
        "max_iter": max_iterations,
        "tol_pr": 1e-11,
        "tol_du": 1e-9,
    }
    return ca.nlpsol("sqp", "sqpmethod", {"x": x, "p": p, "f": f, "g": g}, settings)


_SOLVERS = PerThread(_solver, 32)
