"""A problem as data: `Problem` as the user states it, and `Posed` in the form that is solved."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

from tmsopt.algebra.formula import Node, fold, formula
from tmsopt.algebra.kinds import BALLS
from tmsopt.deprecated import read_from_posed
from tmsopt.models import Model, ParameterSet, Values
from tmsopt.models.exact import number
from tmsopt.models.expression import Expression, parse_comparison, parse_value
from tmsopt.models.user_spectrum import pattern_of
from tmsopt.problem.cases import Case, Scenario, first_cases
from tmsopt.problem.normalise import complete_fields, normalise
from tmsopt.problem.quantities import (
    NO_RADIUS,
    RADIUS,
    ROOT_NAMES,
    ROOT_QUANTITIES,
    STRUCTURE,
    expand_names,
    root_names,
)
from tmsopt.records import AnyNumbers, Numbers, Table
from tmsopt.roots import Pattern
from tmsopt.versions import SCHEMA


@dataclass(frozen=True, eq=False)
class _Fields:
    """The fields of a problem, as stated and as solved."""

    model: Model
    fixed: Numbers
    free: Mapping[str, tuple[float, float]]
    constraints: Mapping[str, str]
    minimize: str | None
    maximize: str | None
    locate: str | None
    start: Numbers
    title: str
    scenarios: Mapping[str, Scenario]
    tolerances: Numbers
    weights: Numbers
    pareto: Sequence[str]
    units: Mapping[str, str] = field(compare=False)
    written: Mapping[str, Mapping[float, str]] = field(compare=False)

    def __getstate__(self) -> dict[str, Any]:
        return _field_values(self)


@dataclass(frozen=True, init=False)
class Problem(_Fields):
    """A design problem; see `load` for its file form.

    Args:
        model: e.g. ``tmsopt.models.tms``.
        fixed: value per fixed parameter (radians, SI units).
        free: (least, greatest) value per free parameter.
        constraints: name → comparison of expressions, e.g. ``{"trail": "nu_H >= 0.02"}``.
        minimize, maximize: an expression; at most one of the two is given.
        pareto: two or three expressions to minimise at once; a minus sign maximises, as in ``"-lambda_s"``.
        locate: name of a root pattern to realise, e.g. ``"EP4"``.
        start: start values for any of the free parameters.
        title: one line for reports.
        scenarios: parameter → a `Band` or a list of values. A root quantity is the worst over these values, and
            inequalities hold at each of them. The nominal value is the one in `fixed`, or else the middle.
        tolerances: parameter → how far it may deviate either way, with the same effect.
        weights: parameter → size of a change that counts as 1 in the robustness radius; by default each parameter's
            own size.
        units: parameter → unit for reports; by default the unit of its text. Any number may be a text with a unit, such
            as ``free={"w": ("25 cm", "60 cm")}``, a constant such as ``"8/3"`` or ``"sqrt(2)/2 m"``, or a Fraction.
        written: parameter → double → the exact number that was typed, such as ``8/3``, if the decimal of the double
            differs from it.

    Raises:
        InputError: listing every fault with the accepted values.

    Example:
        >>> K = [["1 + mu*w**2", "-mu*w**2"], ["-mu*w**2", "mu*w**2"]]  # a mass on a spring with an absorber of mass mu
        >>> system = tmsopt.models.from_matrices(M=[[1, 0], [0, "mu"]], D=[["c", "-c"], ["-c", "c"]], K=K)
        >>> tuned = tmsopt.Problem(system, fixed={"mu": 0.1}, free={"c": (0, 1), "w": (0.1, 3)}, minimize="abscissa")
        >>> f"{tmsopt.solve(tuned).parameters['w']:.6f}"  # 1/(1 + mu)
        '0.909091'

    More: docs/reference/problem_file.md
    """

    def __init__(
        self,
        model: Model,
        fixed: AnyNumbers = Table(),
        free: AnyNumbers = Table(),
        constraints: Mapping[str, str] = Table(),
        minimize: str | None = None,
        maximize: str | None = None,
        locate: str | None = None,
        start: AnyNumbers = Table(),
        title: str = "",
        scenarios: Mapping[str, Scenario | Sequence[Any] | AnyNumbers] = Table(),
        tolerances: AnyNumbers = Table(),
        weights: AnyNumbers = Table(),
        pareto: Sequence[str] = (),
        units: Mapping[str, str] = Table(),
        written: Mapping[str, Mapping[float, str]] = Table(),
    ) -> None:
        arguments = locals()
        vars(self).update(normalise(**{f.name: arguments[f.name] for f in fields(self)}))

    @cached_property
    def posed(self) -> "Posed":
        """The problem as it is solved."""
        posed = Posed(**_field_values(self))
        vars(posed).update(problem=self)
        return posed

    if not TYPE_CHECKING:  # type checkers still report wrong names

        def __getattr__(self, name: str) -> Any:
            """An attribute that a problem had in version 1.1; now its `posed` has it."""
            return read_from_posed(self, name)


@dataclass(frozen=True, eq=False)
class Posed(_Fields):
    """A problem in the form that is solved, with numbers, parsed expressions and cases.

    Caches compare problems by identity: two are equal only if they are the same object.
    """

    def derive(self, **changes: Any) -> "Posed":
        """The problem with some fields replaced, without checks. Numbers must be in rad and SI, and texts valid.

        `dataclasses.replace` must not be used instead, because it does not complete the fields.
        """
        return Posed(**complete_fields(**_field_values(self) | changes))

    @cached_property
    def problem(self) -> Problem:
        """The problem as stated."""
        problem = object.__new__(Problem)
        vars(problem).update(_field_values(self), posed=self)
        return problem

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """The cases of the first search; none without scenarios, tolerances or robustness radius."""
        directions = radius_parameters(self.parameter_set, self.weights, self.fixed) if self.asks_radius else ()
        return first_cases(self.scenarios, self.tolerances, directions)

    @property
    def nominal(self) -> "Posed":
        """The problem at its nominal values, without scenarios and tolerances."""
        return self.derive(scenarios={}, tolerances={}) if self.scenarios or self.tolerances else self

    @property
    def heading(self) -> dict[str, Any]:
        """The first keys of the JSON of every result."""
        return {"schema": SCHEMA, "title": self.title, "model": self.model.name}

    @property
    def asks_radius(self) -> bool:
        """Whether an objective or a constraint names the robustness radius."""
        return self.asks(RADIUS)

    def asks(self, name: str) -> bool:
        """Whether an objective or a constraint names a quantity."""
        return any(name in e.names for e in (self.objective, *self.objectives, *self.conditions.values()) if e)

    @cached_property
    def parameter_set(self) -> ParameterSet:
        """The set that the parameters belong to, e.g. dimensionless or SI."""
        return next(s for s in self.model.sets if set(s.names) == {*self.fixed, *self.free})

    @property
    def pattern(self) -> Pattern | None:
        """The pattern to locate."""
        return pattern_of(self.model, self.locate) if self.locate else None

    @property
    def located(self) -> tuple[str, ...]:
        """The names of the located pattern: the typed one, such as ``EP2+EP2``, and the standard one, ``2EP2``."""
        return (str(self.locate), self.pattern.name) if self.pattern else ()

    @property
    def sense(self) -> str:
        """``minimize``, ``maximize``, ``pareto``, ``locate``, or ``evaluate`` without an objective."""
        senses = (n for n in ("minimize", "maximize", "pareto", "locate") if getattr(self, n) not in (None, "", ()))
        return next(senses, "evaluate")

    @property
    def goal(self) -> str:
        """The text of the objective; empty without one."""
        return (self.minimize or self.maximize or "").strip()

    @property
    def sign(self) -> float:
        """−1 if the objective is maximised, else 1: sign times objective is minimised."""
        return 1.0 if self.maximize is None else -1.0

    @cached_property
    def objective(self) -> Expression | None:
        """The expression to optimise; None without one."""
        return next((self.read(text) for text in (self.minimize, self.maximize) if text is not None), None)

    @cached_property
    def objectives(self) -> tuple[Expression, ...]:
        """The expressions of a Pareto front, each to be minimised."""
        return tuple(self.read(text) for text in self.pareto)

    @cached_property
    def conditions(self) -> dict[str, Expression]:
        """The constraints, parsed."""
        texts = {name: expand_names(text, self.parameter_set) for name, text in self.constraints.items()}
        return {name: parse_comparison(text, self.vocabulary) for name, text in texts.items()}

    def read(self, text: str) -> Expression:
        """Parse an expression in the vocabulary, with short names expanded.

        Raises:
            ExpressionError: if it is no expression.
        """
        return parse_value(expand_names(text, self.parameter_set), self.vocabulary)

    @property
    def asked_of_roots(self) -> tuple[str, ...]:
        """Names of the constraints that use a root quantity."""
        return tuple(n for n, c in self.conditions.items() if set(c.names) & set(ROOT_NAMES))

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Every name that an expression may use."""
        parameter_set = self.parameter_set
        return (*parameter_set.names, *self.model.quantity_names(parameter_set), *root_names(self.model))

    def values(self, parameters: Numbers) -> Values:
        """Everything derived from a numeric design, including root quantities."""
        ranges = {n: hi - lo for n, (lo, hi) in self.free.items()}
        extra = (*ROOT_QUANTITIES, NO_RADIUS, STRUCTURE)
        return Values(self.model, self.parameter_set, parameters, extra=extra, ranges=ranges)

    def typed(self, parameters: Numbers) -> dict[str, str]:
        """Parameter → the text that was typed, such as ``8/3`` or ``20 deg``, if its double is not the exact number."""
        exact = {n: self.written.get(n, {}).get(x) for n, x in parameters.items()}
        return {n: text for n, text in exact.items() if text}

    def as_nodes(self, parameters: Numbers) -> dict[str, Node]:
        """Parameter → the exact number that was typed, as a node of a formula."""
        typed = self.typed(parameters)
        return {n: number(x, typed.get(n, "")) for n, x in parameters.items()}

    def exactly(self, parameters: Numbers) -> dict[str, Any]:
        """Parameter → the exact number that was typed, as a fraction, or as an interval of the working precision."""
        return {n: fold(formula([x]), {}, BALLS)[0] for n, x in self.as_nodes(parameters).items()}

    def ordered(self, values: AnyNumbers) -> dict[str, Any]:
        """Every parameter in the order of the model: the given values, and the fixed parameters."""
        complete = {**self.fixed, **values}
        return {name: complete[name] for name in self.parameter_set.names}


def _field_values(record: _Fields) -> dict[str, Any]:
    """The fields of a record, without cached properties, some of which cannot be pickled."""
    return {f.name: getattr(record, f.name) for f in fields(record)}


def radius_parameters(parameter_set: ParameterSet, weights: Numbers, fixed: Numbers) -> tuple[str, ...]:
    """Parameters that the robustness radius changes: those with a weight, or all that `Parameter.may_change` allows.

    Args:
        fixed: values of the parameters that are not free.
    """
    if weights:
        return tuple(n for n, w in weights.items() if w > 0)
    return tuple(p.name for p in parameter_set.parameters if p.may_change(fixed.get(p.name, math.inf)))
