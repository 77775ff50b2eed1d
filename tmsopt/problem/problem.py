"""A design problem as data: which parameters are fixed, which are free, and what is asked of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

from tmsopt.algebra.formula import Node, fold, formula
from tmsopt.algebra.kinds import BALLS
from tmsopt.errors import Fault, InputError
from tmsopt.models import Model, ParameterSet, Values, controlled
from tmsopt.models.exact import number
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.cases import Band, Case, Scenario, as_scenario, first_cases, middle_of, points_of
from tmsopt.problem.expression import Expression, parse_comparison, parse_value
from tmsopt.problem.quantities import (
    NO_RADIUS,
    RADIUS,
    ROOT_NAMES,
    ROOT_QUANTITIES,
    STRUCTURE,
    expand_names,
    root_names,
)
from tmsopt.problem.units import TABLES, numbers
from tmsopt.problem.validate import faults, guess_parameter_set, shape_faults
from tmsopt.roots import Pattern
from tmsopt.versions import SCHEMA

_POINT = 1e-12
"""Relative width below which a range is a number: a few roundings leave nothing to move in."""


@dataclass(frozen=True)
class Problem:
    """A design problem; see `load` for its file form.

    Args:
        model: e.g. ``tmsopt.models.tms``.
        fixed: value per fixed parameter (radians, SI units).
        free: (least, greatest) value per free parameter.
        constraints: name → comparison of expressions, e.g. ``{"trail": "nu_H >= 0.02"}``.
        minimize, maximize: an expression; at most one of the two.
        pareto: two or three expressions to minimise at once, instead of one; a minus sign maximises, ``"-lambda_s"``.
        locate: name of a root pattern to realise, e.g. ``"EP4"``.
        start: values to start from, for any of the free parameters.
        title: one line for reports.
        scenarios: parameter → a `Band` or a list of values at which the design must do: root quantities are the worst
            over them, inequalities hold at each. Its value in `fixed`, or else its middle, is the nominal one.
        tolerances: parameter → how far it may be off either way; likewise.
        weights: parameter → size of a change that counts as 1 in the robustness radius; by default relative changes
            of every parameter.
        units: parameter → unit in which it was typed, for reports; by default those of numbers given as texts. Any
            number may be given as a text with a unit, such as ``free={"w": ("25 cm", "60 cm")}``, as a constant such as
            ``"8/3"`` or ``"sqrt(2)/2 m"``, or as a Fraction.
        written: parameter → number → the exact one that was typed for it, where its own decimal is another.

    Raises:
        InputError: listing everything that is wrong, each with the accepted values.

    Example:
        >>> K = [["1 + mu*w**2", "-mu*w**2"], ["-mu*w**2", "mu*w**2"]]  # a mass on a spring with an absorber of mass mu
        >>> system = tmsopt.models.from_matrices(M=[[1, 0], [0, "mu"]], D=[["c", "-c"], ["-c", "c"]], K=K)
        >>> tuned = tmsopt.Problem(system, fixed={"mu": 0.1}, free={"c": (0, 1), "w": (0.1, 3)}, minimize="abscissa")
        >>> f"{tmsopt.solve(tuned).parameters['w']:.6f}"  # 1/(1 + mu)
        '0.909091'

    More: docs/reference/problem_file.md
    """

    model: Model
    fixed: Mapping[str, float] = field(default_factory=dict)
    free: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    constraints: Mapping[str, str] = field(default_factory=dict)
    minimize: str | None = None
    maximize: str | None = None
    locate: str | None = None
    start: Mapping[str, float] = field(default_factory=dict)
    title: str = ""
    scenarios: Mapping[str, Scenario | Sequence[float] | Mapping[str, float]] = field(default_factory=dict)
    tolerances: Mapping[str, float] = field(default_factory=dict)
    weights: Mapping[str, float] = field(default_factory=dict)
    pareto: Sequence[str] = ()
    units: Mapping[str, str] = field(default_factory=dict, compare=False)
    written: Mapping[str, Mapping[float, str]] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        if found := list(shape_faults(self)):
            raise InputError(found)
        object.__setattr__(self, "scenarios", {n: as_scenario(s) for n, s in self.scenarios.items()})
        object.__setattr__(self, "model", controlled(self.model, (*self.fixed, *self.free, *self.scenarios)))
        of = guess_parameter_set(self.model, {**self.fixed, **self.free, **self.scenarios})
        read, units, typed, unreadable = numbers({table: getattr(self, table) for table in TABLES}, of)
        written = {n: {**typed.get(n, {}), **self.written.get(n, {})} for n in (*self.written, *typed)}
        for name, value in (*read.items(), ("units", {**units, **self.units}), ("written", written)):
            object.__setattr__(self, name, value)
        places = {f.key[:2] for f in unreadable}
        if found := [*unreadable, *(f for f in faults(self) if f.key[:2] not in places)]:
            raise InputError(found)
        nominal = {n: middle_of(s) for n, s in self.variations.items()}
        given = {p.name: p.default for p in of.parameters if p.default is not None} | nominal | dict(self.fixed)
        given = {n: v for n, v in given.items() if n not in self.free}
        pinned = {n: lo for n, (lo, hi) in self.free.items() if hi - lo <= _POINT * max(abs(lo), abs(hi))}
        ends = {n: (float(lo), float(hi)) for n, (lo, hi) in self.free.items() if n not in pinned}
        kept = {"fixed": {**given, **pinned}, "tolerances": self.tolerances, "weights": self.weights}
        kept["start"] = {n: v for n, v in self.start.items() if n in ends}
        plain: dict[str, Any] = {table: {n: float(v) for n, v in values.items()} for table, values in kept.items()}
        plain |= {"free": ends, "constraints": {n: text.strip() for n, text in self.constraints.items()}}
        plain |= {"pareto": tuple(text.strip() for text in self.pareto)}  # reports show it on one line
        plain |= {s: text and text.strip() for s, text in (("minimize", self.minimize), ("maximize", self.maximize))}
        plain |= {"model": self.model.within(self._reach(plain["fixed"], ends))}
        for name, value in plain.items():
            object.__setattr__(self, name, value)

    def _reach(
        self, fixed: Mapping[str, float], ends: Mapping[str, tuple[float, float]]
    ) -> dict[str, tuple[float, float]]:
        """Least and greatest value of every parameter, in all cases."""
        found = {n: (x, x) for n, x in fixed.items()} | dict(ends)
        for name, scenario in self.variations.items():
            points = [*points_of(scenario), fixed[name]]
            found[name] = min(points), max(points)
        return {
            n: (lo - self.tolerances.get(n, 0.0), hi + self.tolerances.get(n, 0.0)) for n, (lo, hi) in found.items()
        }

    @property
    def variations(self) -> dict[str, Scenario]:
        """The scenarios, each a band or a tuple of values."""
        return {n: s for n, s in self.scenarios.items() if isinstance(s, Band | tuple)}

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """The cases that a search starts with; none for a problem that asks about one design alone."""
        far = weighted(self.parameter_set, self.weights, self.fixed) if self.asks_radius else ()
        return first_cases(self.variations, self.tolerances, far)

    @property
    def nominal(self) -> "Problem":
        """The same question about one design at its nominal values: no scenarios, no tolerances."""
        return replace(self, scenarios={}, tolerances={}) if self.scenarios or self.tolerances else self

    @property
    def heading(self) -> dict[str, Any]:
        """What the JSON of every result begins with."""
        return {"schema": SCHEMA, "title": self.title, "model": self.model.name}

    @property
    def asks_radius(self) -> bool:
        """Whether the objective or a constraint names the robustness radius."""
        return self.asks(RADIUS)

    def asks(self, name: str) -> bool:
        """Whether the objective or a constraint names a quantity."""
        return any(name in e.names for e in (self.objective, *self.objectives, *self.conditions.values()) if e)

    def __getstate__(self) -> dict[str, Any]:
        """What was stated: what follows from it is found anew, and cannot always be pickled."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @cached_property
    def parameter_set(self) -> ParameterSet:
        """The set in which the parameters are written, e.g. dimensionless or SI."""
        return next(s for s in self.model.sets if set(s.names) == {*self.fixed, *self.free})

    @property
    def pattern(self) -> Pattern | None:
        """The pattern to locate."""
        return pattern_of(self.model, self.locate) if self.locate else None

    @property
    def located(self) -> tuple[str, ...]:
        """The names of that pattern: as typed, and its own, as ``2EP2`` of ``EP2+EP2``."""
        return (str(self.locate), self.pattern.name) if self.pattern else ()

    @property
    def sense(self) -> str:
        """``minimize``, ``maximize``, ``pareto``, ``locate``, or ``evaluate`` when nothing is asked."""
        asked = {"minimize": self.minimize is not None, "maximize": self.maximize is not None}
        asked |= {"pareto": bool(self.pareto), "locate": bool(self.locate), "evaluate": True}
        return next(sense for sense, stated in asked.items() if stated)

    @property
    def sign(self) -> float:
        """1, or −1 where the objective is maximised: times this, the less of it the better."""
        return 1.0 if self.maximize is None else -1.0

    @cached_property
    def objective(self) -> Expression | None:
        """The expression to optimise, if there is one."""
        text = self.minimize if self.minimize is not None else self.maximize
        return None if text is None else self.read(text)

    @cached_property
    def objectives(self) -> tuple[Expression, ...]:
        """The expressions of a front, each to be minimised."""
        return tuple(self.read(text) for text in self.pareto)

    @cached_property
    def conditions(self) -> dict[str, Expression]:
        """The constraints, parsed."""
        of = self.parameter_set
        texts = {name: expand_names(text, of) for name, text in self.constraints.items()}
        return {name: parse_comparison(text, self.vocabulary) for name, text in texts.items()}

    def read(self, text: str) -> Expression:
        """An expression in the vocabulary, names that are short for others spelled out.

        Raises:
            ExpressionError: for what is none.
        """
        return parse_value(expand_names(text, self.parameter_set), self.vocabulary)

    @property
    def asked_of_roots(self) -> tuple[str, ...]:
        """Names of the constraints that name a quantity of the roots."""
        return tuple(n for n, c in self.conditions.items() if set(c.names) & set(ROOT_NAMES))

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Every name that an expression may use."""
        of = self.parameter_set
        return (*of.names, *self.model.quantity_names(of), *root_names(self.model))

    def values(self, parameters: Mapping[str, float]) -> Values:
        """Everything derived from a numeric design, root quantities included."""
        ranges = {n: hi - lo for n, (lo, hi) in self.free.items()}
        extra = (*ROOT_QUANTITIES, NO_RADIUS, STRUCTURE)
        return Values(self.model, self.parameter_set, parameters, extra=extra, ranges=ranges)

    def typed(self, parameters: Mapping[str, float]) -> dict[str, str]:
        """The exact numbers that were typed for some of a design's doubles, such as ``8/3`` or ``20 deg``."""
        exact = {n: self.written.get(n, {}).get(x) for n, x in parameters.items()}
        return {n: text for n, text in exact.items() if text}

    def as_nodes(self, parameters: Mapping[str, float]) -> dict[str, Node]:
        """Numbers of the file as they were typed, in formulas."""
        typed = self.typed(parameters)
        return {n: number(x, typed.get(n, "")) for n, x in parameters.items()}

    def exactly(self, parameters: Mapping[str, float]) -> dict[str, Any]:
        """Numbers of the file as they were typed, as fractions or as balls of the working precision."""
        return {n: fold(formula([x]), {}, BALLS)[0] for n, x in self.as_nodes(parameters).items()}

    def ordered(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Every parameter in the model's order: the given values of the free ones, and the fixed ones."""
        complete = {**self.fixed, **values}
        return {name: complete[name] for name in self.parameter_set.names}


def weighted(of: ParameterSet, weights: Mapping[str, float], fixed: Mapping[str, float]) -> tuple[str, ...]:
    """Parameters that the robustness radius lets change: by default all but constants of nature and what is not there.

    Args:
        fixed: values of those that are not free.
    """
    if weights:
        return tuple(n for n, w in weights.items() if w > 0)
    return tuple(p.name for p in of.parameters if p.may_change(fixed.get(p.name, math.inf)))


def question_faults(problem: Problem) -> list[Fault]:
    """What is wrong with solving a problem that has not one question; a chart needs none."""
    if problem.pareto:
        advice = "use tmsopt.pareto, or write minimize with one of the expressions"
        message = f"asks for a front, not for one design; {advice}"
        return [Fault(message, ("objective", "pareto"))]
    if not problem.free or problem.sense != "evaluate":
        return []
    message = (
        "parameters are free, but nothing is asked of them; write minimize, maximize or locate, "
        "or pareto for a front (chart and trace need none)"
    )
    return [Fault(message, ("objective",))]


@dataclass(frozen=True)
class Freedom:
    """Counting of a pattern problem before it is solved.

    Attributes:
        free: free parameters.
        conditions: codimension of the pattern plus the equality constraints.
    """

    free: int
    conditions: int

    @property
    def count(self) -> int:
        """Degrees of freedom left; negative when there are more conditions than parameters."""
        return self.free - self.conditions

    @property
    def kind(self) -> str:
        """``square``, ``under-determined`` or ``over-determined``."""
        return "square" if self.count == 0 else "under-determined" if self.count > 0 else "over-determined"


def degrees_of_freedom(problem: Problem) -> Freedom:
    """Degrees of freedom of a problem: free parameters against pattern conditions and equality constraints."""
    equalities = sum(c.equality for c in problem.conditions.values())
    return Freedom(len(problem.free), (problem.pattern.codimension if problem.pattern else 0) + equalities)
