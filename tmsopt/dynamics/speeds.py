"""Finds all critical speeds of a bicycle: weave speeds, capsize speeds, and speeds at which roots meet."""

import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint
from flint.utils.flint_exceptions import DomainError

from tmsopt.algebra.balls import rational
from tmsopt.algebra.formula import fold, formula, symbol
from tmsopt.algebra.kinds import BALLS
from tmsopt.boundaries.weighted_design import parameter_faults
from tmsopt.dynamics.crossings import DIGITS, Crossing, Polynomial, Stretch, find_crossings
from tmsopt.dynamics.eigenvalue_crossings import find_eigenvalue_crossings
from tmsopt.errors import InputError, input_error, short, suggest
from tmsopt.models import ParameterSet
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.solution import Solution
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Table, Tabular, plain
from tmsopt.search.solve import solve


@dataclass(frozen=True, repr=False)
class Speeds(Tabular):
    """Critical speeds of one design.

    Attributes:
        parameter: the speed, or another parameter, e.g. ``v``.
        parameters: every parameter of the design.
        lower, upper: the open range of speeds; `upper` may be inf.
        found: every speed at which a root crosses the imaginary axis or roots meet, in ascending order.
        stable: bands of speeds with all Re s < 0.
        heavily_damped: bands with all s real and negative.
        always: the kinds ``capsize``, ``weave``, ``EP2`` or ``infinity`` that are present at every speed.
        marginal: if roots stay on the imaginary axis, the bands with no root right of the axis and only simple roots on
            it. A root 0 that is present at every speed does not count.
        zeros: multiplicity of the root 0 that is present at every speed.

    Example:
        >>> found = tmsopt.speeds("problems/whipple_benchmark.toml")
        >>> [f"{a:.6f} {b:.6f}" for a, b in found.stable]  # Meijaard et al. (2007), m/s
        ['4.292383 6.024262']

    More: docs/explanation/weave_and_capsize.md
    """

    problem: Problem
    parameter: str
    parameters: Table[float]
    lower: float
    upper: float
    found: tuple[Crossing, ...]
    stable: tuple[Stretch, ...]
    heavily_damped: tuple[Stretch, ...]
    always: tuple[str, ...]
    marginal: tuple[Stretch, ...] = ()
    zeros: int = 0

    @property
    def is_exact(self) -> bool:
        """Whether every event is found, by exact root isolation; else eigenvalues on a grid show the events."""
        return self.problem.model.polynomial is not None

    @property
    def weave(self) -> tuple[float, ...]:
        """Speeds with a pair of roots on the imaginary axis."""
        return tuple(c.at for c in self.found if c.kind == "weave")

    @property
    def capsize(self) -> tuple[float, ...]:
        """Speeds with a root 0."""
        return tuple(c.at for c in self.found if c.kind == "capsize")

    @property
    def exceptional(self) -> tuple[Crossing, ...]:
        """Speeds at which roots meet."""
        return tuple(c for c in self.found if "EP" in c.kind)

    def records(self) -> Iterable[dict[str, Any]]:
        """The critical speeds, one per row."""
        return (
            {self.parameter: c.at, "kind": c.kind, **vars(c.root), "rightmost": c.rightmost}
            | {"stability_changes": c.changes}
            for c in self.found
        )

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; an end at infinity is null."""
        return {
            **self.problem.posed.heading,
            "parameter": self.parameter,
            "unit": self.problem.posed.parameter_set[self.parameter].unit,
            "range": list(plain(self, "lower upper").values()),
            "found": [plain(row) for row in self.records()],
            **plain(self, "stable heavily_damped"),
            "marginally_stable": plain(self, "marginal")["marginal"],
            **plain(self, "always zeros is_exact parameters"),
        }


def speeds(
    design: ProblemSource | Mapping[str, float],
    parameter: str | None = None,
    *,
    between: Stretch | None = None,
    problem: ProblemSource | None = None,
    progress: Listener | None = None,
) -> Speeds:
    """Every weave and capsize speed of a design, and every speed at which roots meet, by exact root isolation.

    The coefficients are polynomials in the speed. The critical speeds are also roots of polynomials, so none is missed.
    Eigenvalues of complex or large matrices are computed on a grid instead, and nothing is proved between its values.

    Args:
        design: a solution, a problem or its file, or the parameters of a design of `problem`. A problem with further
            free parameters is solved first.
        parameter: the parameter that varies, by default the speed; polynomial coefficients must be polynomials in it.
        between: the range of the parameter; by default the range in the problem if the parameter is free, otherwise its
            whole physical range.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        NotSolved: if no design is found.
        InputError: if the coefficients are not polynomials in the parameter.

    Example:
        >>> import math
        >>> (slowest,) = tmsopt.speeds("problems/benchmark.toml").weave  # m/s
        >>> law = tmsopt.laws.Fr_c(0.1, 1.2, 1.02, -0.4, -0.2, math.radians(5))
        >>> f"{slowest:.6f} {law * math.sqrt(9.81 * 1.0):.6f}"  # Fr_c √(g w)
        '2.841008 2.841008'

    More: docs/explanation/weave_and_capsize.md
    """
    posed = pose(problem if problem is not None and isinstance(design, Mapping) else design)
    nominal = posed.nominal
    parameter_set = nominal.parameter_set
    name = parameter if parameter is not None else speed_of(parameter_set)
    if name is None:
        message = f"the model '{nominal.model.name}' has no speed; name the parameter that varies, "
        message += f"`--parameter NAME` (`parameter=` in Python); accepted: {' '.join(parameter_set.names)}"
        raise input_error(message, "parameter")
    if name not in parameter_set.names:
        raise input_error(f"unknown parameter '{name}'; {suggest(name, parameter_set.names)}", "parameter")
    parameters = parameters_of(design, posed, name, progress)
    start_steps(progress, "isolating speeds")
    physical_range, is_exact = parameter_set[name].range, nominal.model.polynomial is not None
    try:
        lower, upper = map(
            float, nominal.free.get(name, (physical_range.lower, physical_range.upper)) if between is None else between
        )
        if not -math.inf < lower < upper <= (math.inf if is_exact else sys.float_info.max):
            raise ValueError
    except (TypeError, ValueError):
        message = f"found {short(between)}; accepted: a smaller and a larger number, `--between LOW,HIGH`"
        raise input_error(message, "between") from None
    if is_exact:
        crossings = find_crossings(coefficients_over(nominal, parameter_set, parameters, name), lower, upper)
    else:
        crossings = find_eigenvalue_crossings(nominal, parameters, name, lower, upper)
    return Speeds(nominal.problem, name, Table(parameters), lower, upper, **vars(crossings))


def stable_speeds(design: Solution) -> tuple[Stretch, ...] | None:
    """The bands of all physical speeds in which a design is stable; None without a speed. It is faster than `speeds`.

    Raises:
        InputError: if the coefficients are not polynomials in the speed.
    """
    problem = design.problem.posed.nominal
    parameter_set, name = problem.parameter_set, speed_of(problem.parameter_set)
    if name is None or not math.isfinite(parameter_set[name].range.lower):
        return None
    a, physical_range = coefficients_over(problem, parameter_set, design.parameters, name), parameter_set[name].range
    return find_crossings(a, physical_range.lower, physical_range.upper, bands_only=True).stable


def speed_of(parameter_set: ParameterSet) -> str | None:
    """The parameter of a set that is a speed: its unit is m/s, or it is the Froude number."""
    return next((p.name for p in parameter_set.parameters if p.unit == "m/s" or p.name == "Fr"), None)


def coefficients_over(
    problem: Posed, parameter_set: ParameterSet, parameters: Mapping[str, float], name: str
) -> Sequence[Polynomial]:
    """The coefficients of a design as polynomials in one of its parameters.

    Raises:
        InputError: if they are not polynomials.
    """
    nodes = {**problem.as_nodes(parameters), name: symbol(name)}
    values = problem.model.algebraic(parameter_set.native({n: nodes[n] for n in parameter_set.names}))
    try:
        with flint.ctx.workdps(DIGITS):
            polynomials = fold(formula(values.values()), {name: flint.arb_poly([0, 1])}, BALLS)
            exact_values = {n: _to_fractions(x) for n, x in zip(values, polynomials, strict=True)}
            a = [
                list(flint.fmpq_poly([0]) + c) or [flint.fmpq(0)]
                for c in problem.model.evaluate_polynomial(exact_values)
            ]
    except (TypeError, AttributeError, ValueError, ArithmeticError, DomainError):  # not a polynomial
        a = []
    if not any(x != 0 for c in a for x in c):
        raise input_error(f"the coefficients are not polynomials in {name}, or all are 0", "parameter")
    return a


def _to_fractions(x: Any) -> Any:
    """A polynomial or number with fractions that are correct to `DIGITS`."""
    return flint.fmpq_poly([rational(c) for c in x]) if isinstance(x, flint.arb_poly) else rational(x)


def parameters_of(design: Any, problem: Posed, name: str, progress: Listener | None) -> dict[str, float]:
    """The parameters of the design; a problem with free parameters other than `name` is solved first."""
    if isinstance(design, Solution):
        return dict(design.parameters)
    if isinstance(design, Mapping):
        parameters = {**problem.fixed, **design}
        if faults := [f for f in parameter_faults(problem, parameters) if f.key[-1] != name]:
            raise InputError(faults)
        return parameters
    if set(problem.free) <= {name}:
        return dict(problem.fixed)
    return dict(solve(problem, progress=progress, interruptible=False).parameters)
