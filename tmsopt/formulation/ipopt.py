"""The one place that calls IPOPT."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.formulation.nlp import NLP
from tmsopt.formulation.options import DEFAULTS, Options
from tmsopt.records import Array

LINEAR_SOLVERS = ("mumps", "spral")
"""The linear solvers in the CasADi wheel; any other name fails there without an error."""

# Larger steps away from the bounds and shorter ones towards them: on the EP4 problem this takes a third fewer
# iterations and reaches EP4 from more of the starts. Scaling and refining linear systems of a dozen unknowns costs
# a quarter of the time and changes no result.
_FAR = {
    "bound_push": 0.1,
    "bound_frac": 0.1,
    "tau_min": 0.9,
    "min_refinement_steps": 0,
    "linear_system_scaling": "none",
}
_NEAR = {"bound_push": 1e-9, "bound_frac": 1e-9, "mu_init": 1e-6}
# A start that satisfies the equations of many cases is worth keeping to: with the barrier of far starts IPOPT
# throws that away, and half as many starts of band designs end at the best optimum.
_EXACT = {"bound_push": 1e-9, "bound_frac": 1e-9, "mu_init": 1e-4, **dict(list(_FAR.items())[3:])}
_SETTINGS: dict[str, dict[str, Any]] = {"far": _FAR, "exact": _EXACT, "near": _NEAR}


@dataclass(frozen=True)
class Run:
    """What one run of IPOPT returned; a claim, to be rechecked.

    Attributes:
        x: variables of the NLP.
        row_multipliers, bound_multipliers: λ in ∇f + Jᵀ λ_rows + λ_bounds = 0.
        status: IPOPT's own word.
    """

    x: Array
    row_multipliers: Array
    bound_multipliers: Array
    status: str
    iterations: int


def ipopt(nlp: NLP, options: Options = DEFAULTS, start: str = "far", max_iterations: int = 150) -> Callable[..., Run]:
    """A solver of one NLP: start, and other limits if wanted → run.

    `start` says what to expect of starts: ``far`` from a solution, ``exact`` in the equations, or ``near`` a solution.

    Not to be shared between threads.

    Raises:
        ValueError: for a linear solver other than mumps and spral.
    """
    if options.linear_solver not in LINEAR_SOLVERS:
        raise ValueError(f"linear solver {options.linear_solver!r}; accepted: {' '.join(LINEAR_SOLVERS)}")
    settings: dict[str, Any] = {
        "print_time": False,
        "show_eval_warnings": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.linear_solver": options.linear_solver,
        "ipopt.tol": 1e-12,
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.max_iter": max_iterations,
        "ipopt.obj_scaling_factor": 1 / nlp.objective_unit,
        **{f"ipopt.{name}": value for name, value in _SETTINGS[start].items()},
    }
    unit = np.array([*nlp.units, *[1.0] * (len(nlp.variables) - len(nlp.units))])
    x, p = ca.SX.sym("x", len(nlp.variables)), ca.SX.sym("p", len(nlp.settings))
    f, g = nlp.at(x if np.all(unit == 1) else x * unit, p)
    solver = ca.nlpsol("solver", "ipopt", {"x": x, "p": p, "f": f, "g": g}, settings)

    def run(x0: Array, limits: NLP = nlp) -> Run:
        lower, upper = np.array(limits.lower), np.array(limits.upper)
        rows = {"lbg": np.array(limits.row_lower), "ubg": np.array(limits.row_upper)}
        with _interruptible():
            answer = solver(x0=x0 / unit, p=limits.settings, lbx=lower / unit, ubx=upper / unit, **rows)
        stats = solver.stats()
        return Run(
            x=np.clip(np.array(answer["x"]).ravel() * unit, lower, upper),
            row_multipliers=np.array(answer["lam_g"]).ravel(),
            bound_multipliers=np.array(answer["lam_x"]).ravel() / unit,
            status=str(stats["return_status"]),
            iterations=int(stats.get("iter_count", 0)),
        )

    return run


@contextmanager
def _interruptible() -> Iterator[None]:
    """Raise an interrupt once IPOPT is done: CasADi takes the exception for a failed evaluation and goes on.

    Only in the main thread, and where the user has no handler of his own.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    heard: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: heard.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if heard:
        raise KeyboardInterrupt
