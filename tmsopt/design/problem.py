"""A design problem as data: which parameters are fixed, which are free, and what is asked of them."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from tmsopt.design.errors import Fault, InputError, suggest
from tmsopt.design.expression import Expression, ExpressionError, parse_comparison, parse_value
from tmsopt.models import Model, ParameterSet, Quantity, Values
from tmsopt.roots import PATTERNS, Pattern, Structure, structure

STRUCTURE_TOLERANCE = 1e-11
"""Relative change of a coefficient within which roots count as multiple: a polished optimum is within 1e-14."""

_POINT = 1e-12
"""Relative width below which a range is a number: a few roundings leave nothing to move in."""


def _structure(values: Mapping[str, Any]) -> Structure:
    assert isinstance(values, Values)
    a = [float(c) for c in values.coefficients]
    if a[0] == 0 or not all(map(math.isfinite, a)):
        return Structure("undecided", (), math.inf)  # a singular mass matrix: a root is at infinity
    return structure(a, STRUCTURE_TOLERANCE)


def _abscissa(values: Mapping[str, Any]) -> float:
    return float(values["structure"].abscissa)


def _damping_ratio(values: Mapping[str, Any]) -> float:
    roots = values["structure"].roots
    ratios = (-r.re / math.hypot(r.re, r.im) if r.re or r.im else 0.0 for r in roots)
    return min(ratios, default=math.nan)


ROOT_QUANTITIES = (
    Quantity("abscissa", "1", "largest real part of the roots", r"\alpha", _abscissa),
    Quantity("damping_ratio", "1", "least −Re s/|s| over the roots", r"\zeta", _damping_ratio),
)
"""Quantities of the roots, for any model."""

_STRUCTURE = Quantity("structure", "", "structure of the roots, multiple roots recognised", "", _structure)

_ROOT_NAMES = tuple(q.name for q in ROOT_QUANTITIES)


@dataclass(frozen=True)
class Problem:
    """A design problem; see `load` for its file form.

    Args:
        model: e.g. ``tmsopt.models.tms``.
        fixed: value per fixed parameter (radians, SI units).
        free: (least, greatest) value per free parameter.
        constraints: name → comparison of expressions, e.g. ``{"trail": "nu_H >= 0.02"}``.
        minimize, maximize: an expression; at most one of the two.
        locate: name of a root pattern to realise, e.g. ``"EP4"``.
        start: values to start from, for any of the free parameters.
        title: one line for reports.

    Raises:
        InputError: listing everything that is wrong, each with the accepted values.
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

    def __post_init__(self) -> None:
        faults = list(_faults(self))
        if faults:
            raise InputError(faults)
        of = guess_parameter_set(self.model, {**self.fixed, **self.free})
        given = {p.name: p.default for p in of.parameters if p.default is not None} | dict(self.fixed)
        given = {n: v for n, v in given.items() if n not in self.free}
        pinned = {n: lo for n, (lo, hi) in self.free.items() if hi - lo <= _POINT * max(abs(lo), abs(hi))}
        ends = {n: (float(lo), float(hi)) for n, (lo, hi) in self.free.items() if n not in pinned}
        object.__setattr__(self, "fixed", {n: float(v) for n, v in {**given, **pinned}.items()})
        object.__setattr__(self, "free", ends)
        object.__setattr__(self, "constraints", dict(self.constraints))
        object.__setattr__(self, "start", {n: float(v) for n, v in self.start.items() if n in ends})

    @cached_property
    def parameter_set(self) -> ParameterSet:
        """The set in which the parameters are written, e.g. dimensionless or SI."""
        return next(s for s in self.model.sets if set(s.names) == {*self.fixed, *self.free})

    @property
    def pattern(self) -> Pattern | None:
        """The pattern to locate."""
        return PATTERNS[self.locate] if self.locate else None

    @property
    def sense(self) -> str:
        """``minimize``, ``maximize``, ``locate``, or ``evaluate`` when nothing is asked."""
        if self.minimize is not None:
            return "minimize"
        if self.maximize is not None:
            return "maximize"
        return "locate" if self.locate else "evaluate"

    @cached_property
    def objective(self) -> Expression | None:
        """The expression to optimise, if there is one."""
        text = self.minimize if self.minimize is not None else self.maximize
        return None if text is None else parse_value(text, self.vocabulary)

    @cached_property
    def conditions(self) -> dict[str, Expression]:
        """The constraints, parsed."""
        return {name: parse_comparison(text, self.vocabulary) for name, text in self.constraints.items()}

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Every name that an expression may use."""
        of = self.parameter_set
        return (*of.names, *self.model.quantity_names(of), *_ROOT_NAMES)

    def values(self, parameters: Mapping[str, float]) -> Values:
        """Everything derived from a numeric design, root quantities included."""
        return Values(self.model, self.parameter_set, parameters, extra=(*ROOT_QUANTITIES, _STRUCTURE))

    def ordered(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Every parameter in the model's order: the given values of the free ones, and the fixed ones."""
        complete = {**self.fixed, **values}
        return {name: complete[name] for name in self.parameter_set.names}


def checked(problem: object) -> Problem:
    """A problem as it is.

    Raises:
        InputError: for anything else, such as the name of a file.
    """
    if isinstance(problem, Problem):
        return problem
    message = f"found {problem!r}; accepted: a Problem, such as tmsopt.load('problems/chart.toml', asks=False)"
    raise InputError([Fault(message, ("problem",))])


def unasked(problem: Problem) -> list[Fault]:
    """What is wrong with solving a problem that frees parameters without a question; a chart needs none."""
    if not problem.free or problem.sense != "evaluate":
        return []
    message = (
        "parameters are free, but nothing is asked of them; write minimize, maximize or locate "
        "(chart and trace need none: in Python, load(file, asks=False))"
    )
    return [Fault(message, ("objective",))]


def guess_parameter_set(model: Model, names: Mapping[str, Any]) -> ParameterSet:
    """The parameter set that most of the names belong to, the native one when in doubt."""
    return max(model.sets, key=lambda s: sum(n in s.names for n in names))


def _faults(problem: Problem) -> Iterator[Fault]:
    if not isinstance(problem.model, Model):
        accepted = "a model, such as tmsopt.models.tms"
        yield Fault(f"found {type(problem.model).__name__}; accepted: {accepted}", ("model",))
        return
    names = {**problem.fixed, **problem.free}
    of = guess_parameter_set(problem.model, names)
    yield from _name_faults(problem, of)
    for name in of.names:
        yield from _value_faults(problem, of, name)
    yield from _objective_faults(problem)
    yield from _expression_faults(problem, of)


def _name_faults(problem: Problem, of: ParameterSet) -> Iterator[Fault]:
    others = {n: s.name for s in problem.model.sets if s is not of for n in s.names}
    for name in dict.fromkeys([*problem.fixed, *problem.free]):
        if name in of.names:
            continue
        if name in others:
            yield Fault(
                f"{others[name]} parameter '{name}' beside {of.name} ones; the two sets are not mixed: "
                f"write all in one of them ({' '.join(of.names)})",
                ("parameters", name),
            )
        else:
            yield Fault(f"unknown parameter '{name}'; {suggest(name, of.names)}", ("parameters", name))
    for name in problem.fixed:
        if name in problem.free:
            yield Fault(f"'{name}' is both fixed and free; keep one", ("parameters", name))
    missing = _missing(problem, of)
    if missing:
        example = f"{missing[0]} = 1.0, or {missing[0]} = {{ min = 0.5, max = 2 }}"
        yield Fault(f"missing parameter {', '.join(missing)}; write e.g. {example}", ("parameters",))
    for name in problem.start:
        if name not in problem.free:
            yield Fault(f"start for '{name}', which is not a free parameter", ("parameters", name, "start"))


def _missing(problem: Problem, of: ParameterSet) -> list[str]:
    given = {*problem.fixed, *problem.free}
    return [p.name for p in of.parameters if p.name not in given and p.default is None]


def _value_faults(problem: Problem, of: ParameterSet, name: str) -> Iterator[Fault]:
    key = ("parameters", name)
    if name in problem.fixed:
        yield from _number_faults(of, name, problem.fixed[name], key)
    if name not in problem.free:
        return
    try:
        lower, upper = problem.free[name]
    except (TypeError, ValueError):
        yield Fault(f"found {problem.free[name]!r}; accepted: a pair (least, greatest)", key)
        return
    ends = {"min": lower, "max": upper}
    if name in problem.start:
        ends["start"] = problem.start[name]
    found = [f for end, value in ends.items() for f in _number_faults(of, name, value, (*key, end))]
    yield from found
    if found:
        return
    if lower > upper:
        yield Fault(f"min = {lower:.6g} is greater than max = {upper:.6g}; swap them", key)
    elif name in problem.start and not lower <= problem.start[name] <= upper:
        yield Fault(
            f"start = {problem.start[name]:.6g} lies outside the bounds {lower:.6g} … {upper:.6g}",
            (*key, "start"),
        )


def _number_faults(of: ParameterSet, name: str, value: Any, key: tuple[str, ...]) -> Iterator[Fault]:
    parameter = of[name]
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    try:
        number = math.nan if isinstance(value, bool | str) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        yield Fault(f"found {value!r}; accepted: a finite number{unit and ' in' + unit}", key)
    elif number not in parameter.range:
        yield Fault(
            f"{name} = {number:.6g}{unit} is not physical; {parameter.meaning} is {parameter.range}{unit}",
            key,
        )


def _objective_faults(problem: Problem) -> Iterator[Fault]:
    key = ("objective",)
    if problem.minimize is not None and problem.maximize is not None:
        yield Fault("minimize and maximize together; keep one of them", key)
    if problem.locate is not None and problem.locate not in PATTERNS:
        yield Fault(f"unknown pattern {problem.locate!r}; {suggest(str(problem.locate), PATTERNS)}", (*key, "locate"))


def _expression_faults(problem: Problem, of: ParameterSet) -> Iterator[Fault]:
    accepted = (*of.names, *problem.model.quantity_names(of), *_ROOT_NAMES)
    for sense, text in (("minimize", problem.minimize), ("maximize", problem.maximize)):
        if text is not None:
            yield from _parse_faults(parse_value, text, accepted, ("objective", sense))
    for name, text in problem.constraints.items():
        yield from _parse_faults(parse_comparison, text, accepted, ("constraints", name))


def _parse_faults(parse: Any, text: Any, accepted: tuple[str, ...], key: tuple[str, ...]) -> Iterator[Fault]:
    if not isinstance(text, str):
        yield Fault(f"found {text!r}; accepted: an expression in quotes", key)
        return
    try:
        parse(text, accepted)
    except ExpressionError as error:
        yield Fault(str(error), key)
