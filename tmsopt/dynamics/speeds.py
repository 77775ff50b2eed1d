"""The speeds at which a bicycle changes its kind of motion: weave, capsize, and roots that meet, all of them."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint
from flint.utils.flint_exceptions import DomainError

from tmsopt.algebra.balls import rational
from tmsopt.algebra.formula import fold, formula, symbol
from tmsopt.algebra.kinds import BALLS
from tmsopt.boundaries.weighted_design import parameter_faults
from tmsopt.dynamics.crossings import DIGITS, Crossing, Polynomial, Stretch, crossings, user_crossings
from tmsopt.errors import InputError, input_error, short, suggest
from tmsopt.models import ParameterSet
from tmsopt.problem.files import Given, pose
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.solution import Solution
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Table, Tabular, plain
from tmsopt.search.solve import solve


@dataclass(frozen=True, repr=False)
class Speeds(Tabular):
    """What happens to one design over all its speeds.

    Attributes:
        parameter: the speed, or whatever was asked for, e.g. ``v``.
        parameters: every parameter of the design.
        lower, upper: the range that was looked through, its ends left out; an upper end may be inf.
        found: every speed at which a root crosses the imaginary axis or roots meet, in ascending order.
        stable: bands of speeds with all Re s < 0.
        heavily_damped: bands with all s real and negative.
        always: ``capsize``, ``weave``, ``EP2`` or ``infinity`` where that holds at every speed.
        marginal: bands with no root right of the imaginary axis, those on it simple, where roots stay on it; a root 0
            that is there at every speed is left aside.
        zeros: multiplicity of that root 0.

    Example:
        >>> ridden = tmsopt.speeds("problems/whipple_benchmark.toml")
        >>> [f"{a:.6f} {b:.6f}" for a, b in ridden.stable]  # Meijaard et al. (2007), m/s
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
    def weave(self) -> tuple[float, ...]:
        """Speeds with a pair of roots on the imaginary axis."""
        return tuple(c.at for c in self.found if c.kind == "weave")

    @property
    def capsize(self) -> tuple[float, ...]:
        """Speeds with a root 0."""
        return tuple(c.at for c in self.found if c.kind == "capsize")

    @property
    def exceptional(self) -> tuple[Crossing, ...]:
        """Where roots meet."""
        return tuple(c for c in self.found if "EP" in c.kind)

    def records(self) -> Iterable[dict[str, Any]]:
        """What happens at each speed, one a row."""
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
            **plain(self, "always zeros parameters"),
        }


def speeds(
    design: Given | Mapping[str, float],
    parameter: str | None = None,
    *,
    between: Stretch | None = None,
    problem: Given | None = None,
    progress: Listener | None = None,
) -> Speeds:
    """Every weave and capsize speed of a design and every speed at which roots meet, by exact root isolation.

    The coefficients are polynomials in the speed, so these speeds are the roots of polynomials too, and none is missed.

    Args:
        design: a solution, a problem or its file, or the parameters of a design of `problem`. A problem that frees
            more than this parameter is solved first.
        parameter: what varies, by default the speed; any parameter that the coefficients are polynomials in.
        progress: called with a `tmsopt.Progress` now and then.
        between: the range to look through; by default the parameter's box, or all of its physical range.

    Raises:
        NotSolved: where there is no design to look at.
        InputError: where the parameter does not enter as a polynomial.

    Example:
        >>> import math
        >>> (slowest,) = tmsopt.speeds("problems/benchmark.toml").weave  # m/s
        >>> law = tmsopt.laws.Fr_c(0.1, 1.2, 1.02, -0.4, -0.2, math.radians(5))
        >>> f"{slowest:.6f} {law * math.sqrt(9.81 * 1.0):.6f}"  # Fr_c √(g w)
        '2.841008 2.841008'

    More: docs/explanation/weave_and_capsize.md
    """
    whole = pose(problem if problem is not None and isinstance(design, Mapping) else design)
    asked = whole.nominal
    of = asked.parameter_set
    name = parameter if parameter is not None else speed_of(of)
    if name is None:
        message = f"the model '{asked.model.name}' has no parameter that is a speed; say which one varies, "
        message += f"`--parameter NAME` (`parameter=` in Python); accepted: {' '.join(of.names)}"
        raise input_error(message, "parameter")
    if name not in of.names:
        raise input_error(f"unknown parameter '{name}'; {suggest(name, of.names)}", "parameter")
    own = parameters_of(design, whole, name, progress)
    start_steps(progress, "isolating speeds")
    allowed = of[name].range
    try:
        lower, upper = map(float, asked.free.get(name, (allowed.lower, allowed.upper)) if between is None else between)
        if not -math.inf < lower < upper:
            raise ValueError
    except (TypeError, ValueError):
        message = f"found {short(between)}; accepted: a least value and a greater one, `--between LOW,HIGH`"
        raise input_error(message, "between") from None
    met = user_crossings(asked.model, crossings(coefficients_over(asked, of, own, name), lower, upper))
    return Speeds(asked.problem, name, Table(own), lower, upper, **vars(met))


def stable_speeds(design: Solution) -> tuple[Stretch, ...] | None:
    """The bands of its speed in which a design is stable, whatever the box of that is; None without a speed.

    What happens at their ends, which takes most of the time of `speeds`, is not looked at.

    Raises:
        InputError: where the speed does not enter as a polynomial, or the design has none of its own.
    """
    asked = design.problem.posed.nominal
    of, name = asked.parameter_set, speed_of(asked.parameter_set)
    if name is None or not math.isfinite(of[name].range.lower):
        return None
    a, ends = coefficients_over(asked, of, design.parameters, name), of[name].range
    return crossings(a, ends.lower, ends.upper, bands_alone=True).stable


def speed_of(of: ParameterSet) -> str | None:
    """The parameter of a set that is a speed: in m/s, or the Froude number."""
    return next((p.name for p in of.parameters if p.unit == "m/s" or p.name == "Fr"), None)


def coefficients_over(problem: Posed, of: ParameterSet, own: Mapping[str, float], name: str) -> Sequence[Polynomial]:
    """The coefficients of a design as polynomials in one of its parameters.

    Raises:
        InputError: where they are none.
    """
    nodes = {**problem.as_nodes(own), name: symbol(name)}
    at = problem.model.algebraic(of.native({n: nodes[n] for n in of.names}))
    try:
        with flint.ctx.workdps(DIGITS):
            over = fold(formula(at.values()), {name: flint.arb_poly([0, 1])}, BALLS)
            exact_ones = {n: _with_fractions(x) for n, x in zip(at, over, strict=True)}
            a = [list(flint.fmpq_poly([0]) + c) or [flint.fmpq(0)] for c in problem.model.polynomial(**exact_ones)]
    except (TypeError, AttributeError, ValueError, ArithmeticError, DomainError):  # no polynomial on the way
        a = []
    if not any(x != 0 for c in a for x in c):
        raise input_error(f"the coefficients are no polynomials in {name}, or all 0", "parameter")
    return a


def _with_fractions(x: Any) -> Any:
    """A polynomial, or a number, with fractions that are right to the digits carried."""
    return flint.fmpq_poly([rational(c) for c in x]) if isinstance(x, flint.arb_poly) else rational(x)


def parameters_of(design: Any, whole: Posed, name: str, progress: Listener | None) -> dict[str, float]:
    """The parameters of the design; that of a problem which frees more than the one that varies is found first."""
    if isinstance(design, Solution):
        return dict(design.parameters)
    if isinstance(design, Mapping):
        own = {**whole.fixed, **design}
        if faults := [f for f in parameter_faults(whole, own) if f.key[-1] != name]:
            raise InputError(faults)
        return own
    if set(whole.free) <= {name}:
        return dict(whole.fixed)
    return dict(solve(whole, progress=progress, interruptible=False).parameters)
