"""Exact values of the numbers of a problem: fractions, and irrational constants such as sqrt(2)."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from types import MappingProxyType
from typing import Any

import flint

from tmsopt.algebra.balls import DIGITS, Tilt, rational
from tmsopt.algebra.formula import PI, Node, constant as node_of, fold, formula
from tmsopt.algebra.kinds import BALLS, NODES
from tmsopt.errors import Fault, InputError, short, suggest, table_faults
from tmsopt.models.expression import parse_value
from tmsopt.models.model import Model, ParameterSet
from tmsopt.records import AnyNumbers, Numbers, Table

MAX_DIFFERENCE = 4e-15
"""Largest accepted relative difference between an exact value and the double of the design: a few rounding errors."""

MAX_DIGITS = 400
"""Largest number of digits of an exact number. A double has up to 309 digits before the point."""

_POWER_OF_TEN = re.compile(r"[eE]([+-]?[\d_]+)")
_DEGREES = re.compile(r"(.*?)\s*(?:deg|°)")


@dataclass(frozen=True)
class Exact:
    """An exact constant; constants with the same text are equal.

    Attributes:
        node: the number as part of a formula, an angle in radians.
        text: the number as written, such as ``8/3``, ``sqrt(2)`` or ``20 deg``.
    """

    node: Node = field(compare=False)
    text: str

    @classmethod
    def from_fraction(cls, x: Fraction) -> "Exact":
        """The constant of a fraction."""
        return cls(node_of(x), str(x))

    @property
    def fraction(self) -> Fraction | None:
        """The number as a fraction; None if it is irrational or an angle in degrees."""
        return self.node.fraction

    def ball(self) -> Any:
        """The number as a ball (a midpoint with a radius) of the working precision; an angle is in radians."""
        return flint.arb(fold(formula([self.node]), {}, BALLS)[0])

    def times(self, factor: Fraction) -> "Exact":
        """The product with a fraction."""
        if self.fraction is not None:
            return Exact.from_fraction(self.fraction * factor)
        return self if factor == 1 else Exact(self.node * factor, f"({self.text})*{factor}")

    def to_radians(self) -> "Exact":
        """The same angle in radians; the number must be an angle in degrees."""
        return Exact(self.node * PI / 180, f"{self.text} deg") if self.fraction != 0 else self

    def __float__(self) -> float:
        if self.fraction is not None:
            return _double(self.fraction)
        with flint.ctx.workdps(DIGITS):
            ball = self.ball()
            return 0.0 if ball.contains(0) else _double(Fraction(str(rational(ball))))

    def __str__(self) -> str:
        return self.text


def constant(text: str) -> Exact:
    """The constant of a text such as ``8/3``, ``-0.1`` or ``2*pi/3``.

    Raises:
        ValueError: if the text is not a constant, has no value, or is too large or too small for double precision.
    """
    try:
        exact_number = Exact.from_fraction(decimal(text))
    except (ValueError, ZeroDivisionError):
        expression = parse_value(text, (), "8/3")
        exact_number = Exact(fold(expression.formula, {}, NODES)[0], expression.text)
        with flint.ctx.workdps(DIGITS):
            value = fold(expression.formula, {}, BALLS)[0]
        if isinstance(value, flint.fmpq):
            exact_number = Exact.from_fraction(Fraction(int(value.p), int(value.q)))
        elif not value.is_finite():
            raise ValueError(f"'{text}' has no value") from None
    if not math.isfinite(float(exact_number)) or (float(exact_number) == 0 and exact_number.fraction):
        raise ValueError(f"'{text}' is a number beyond double precision")
    return exact_number


def number(x: float, text: str = "") -> Node:
    """A double as a node of a formula: the exact number in `text`, or without a text its shortest decimal."""
    typed = _parse_exact(text, is_angle=True) if text else None
    return typed.node if typed else node_of(float(x))


def decimal(x: Any) -> Fraction:
    """A number as the user wrote it. A double means its shortest decimal, so 0.1 is 1/10.

    Raises:
        ValueError: if it is not a number, or has more than 400 digits.

    Example:
        >>> tmsopt.models.decimal(0.1)
        Fraction(1, 10)

    More: docs/explanation/proofs.md
    """
    if isinstance(x, str):
        power = _POWER_OF_TEN.search(x[:MAX_DIGITS])
        if len(x) > MAX_DIGITS or (power and abs(int(power[1])) > MAX_DIGITS):  # checked before the slow conversion
            raise ValueError("too many digits")
    fraction = Fraction(repr(float(x))) if isinstance(x, float) else Fraction(x)
    if _is_long(fraction):
        raise ValueError("too many digits")
    return fraction


def _double(x: Fraction) -> float:
    """The nearest double, or infinity."""
    try:
        return float(x)
    except OverflowError:
        return math.inf if x > 0 else -math.inf


def _is_long(x: Any) -> bool:
    return isinstance(x, int | Fraction) and max(abs(x.numerator), x.denominator) >= 10**MAX_DIGITS


@dataclass(frozen=True)
class ExactDesign:
    """A design in exact numbers.

    Attributes:
        values: parameter → its value, except for the parameters in `tangents`.
        tangents: angle → its tangent, if the tangent was given exactly.
        given_exactly: names that were given exactly, a parameter or ``tan(parameter)``.
    """

    values: Table[Exact]
    tangents: Table[Exact]
    given_exactly: tuple[str, ...] = ()

    def balls(self) -> dict[str, Any]:
        """Parameter → ball, angles in radians."""
        balls = {name: number.ball() for name, number in self.values.items()}
        return balls | {name: number.ball().atan() for name, number in self.tangents.items()}

    def fractions(self, parameter_set: ParameterSet) -> dict[str, Any] | None:
        """Parameter → fraction, an angle as a `Tilt`; None if a number or a tangent is not a fraction."""
        fractions: dict[str, Any] = {}
        for name in parameter_set.names:
            number, tangent = self.tangents.get(name, self.values.get(name)), parameter_set[name].tangent
            if number is None or number.fraction is None or (tangent and number.fraction and name not in self.tangents):
                return None
            value = rational(number.fraction)
            fractions[name] = Tilt(value) if tangent else value
        return fractions

    def coefficients(self, model: Model, parameter_set: ParameterSet) -> list[Any] | None:
        """The coefficients as fractions; None if one of them is irrational."""
        numbers = self.fractions(parameter_set)
        coefficients = [] if numbers is None else model.coefficients(numbers, parameter_set)
        return coefficients if coefficients and all(isinstance(c, flint.fmpq) for c in coefficients) else None

    def matrices(self, model: Model, parameter_set: ParameterSet) -> list[list[list[Any]]] | None:
        """The matrices of the model as fractions; None if the model has no matrices or an entry is irrational."""
        numbers = self.fractions(parameter_set)
        if numbers is None or model.pencil is None:
            return None
        try:
            return [[[rational(x) for x in row] for row in P] for P in model.pencil(parameter_set.native(numbers))]
        except (TypeError, ValueError, AttributeError):  # the matrices use other functions of an angle than its tangent
            return None

    def text(self, name: str) -> tuple[str, str]:
        """Two texts: the name of the number that is exact, which may be ``tan(name)``, and the number."""
        if name in self.tangents:
            return f"tan({name})", str(self.tangents[name])
        return name, str(self.values[name])


def as_exact_design(
    parameter_set: ParameterSet,
    parameters: Numbers,
    exact_numbers: AnyNumbers | None = None,
    typed: Mapping[str, str] = MappingProxyType({}),
) -> ExactDesign:
    """The exact design for parameters in doubles. A double means its shortest decimal if no exact number is given.

    Args:
        exact_numbers: parameter, or ``tan(parameter)`` of an angle → its exact value: an int, a Fraction, an fmpq, a
            float, which means its shortest decimal, or a text such as ``"-2/5"``, ``"sqrt(2)/2"`` or ``"20 deg"``.
        typed: parameter → its exact value as a text of the problem, as in `Posed.typed`.

    Raises:
        InputError: if a name is unknown, a value is not exact, or it differs from the double of the design.
    """
    if table_errors := table_faults("exact", {} if exact_numbers is None else exact_numbers, "{'zeta_B': '-1/3'}"):
        raise InputError(table_errors)
    names = {n: n for n in parameter_set.names} | {
        f"tan({p.name})": p.name for p in parameter_set.parameters if p.tangent
    }
    values = {n: Exact.from_fraction(decimal(float(parameters[n]))) for n in parameter_set.names}
    values |= {
        n: number
        for n, text in typed.items()
        if (number := _parse_exact(text, is_angle=parameter_set[n].unit == "rad"))
    }
    tangents: dict[str, Exact] = {}
    faults = []
    for key, entry in (exact_numbers or {}).items():
        name = names.get(key)
        is_angle = key == name and parameter_set[key].unit == "rad"
        if name is None:
            message = f"unknown parameter '{key}'; {suggest(key, names)}"
        elif (number := _parse_exact(entry, is_angle)) is None:
            description = "a number of more digits" if _is_long(entry) else short(entry)
            message = (
                f"found {description}; accepted: an int, a Fraction, a constant in quotes such as '-2/5' or 'sqrt(2)'"
                f"{', or an angle such as ' + repr('20 deg') if is_angle else ''}, of up to {MAX_DIGITS} digits"
            )
        else:
            (values if key == name else tangents)[name] = number
            stored = float(parameters[name]) if key == name else math.tan(parameters[name])
            if math.isclose(float(number.ball()), stored, rel_tol=MAX_DIFFERENCE, abs_tol=1e-300):
                continue
            message = f"found {number}, but the design has {stored!r}; give the exact form of the same number"
        faults.append(Fault(message, ("exact", key)))
    if faults:
        raise InputError(faults)
    other_values = Table({n: v for n, v in values.items() if n not in tangents})
    return ExactDesign(other_values, Table(tangents), tuple(exact_numbers or ()))


def _parse_exact(value: Any, is_angle: bool) -> Exact | None:
    if isinstance(value, bool):
        return None
    try:
        if isinstance(value, str):
            degrees = _DEGREES.fullmatch(value.strip()) if is_angle else None
            return constant(degrees[1]).to_radians() if degrees else constant(value)
        if isinstance(value, flint.fmpq | flint.fmpz):
            fraction = rational(value) if isinstance(value, flint.fmpq) else flint.fmpq(value)
            value = Fraction(int(fraction.p), int(fraction.q))
        return Exact.from_fraction(decimal(value))
    except (ValueError, TypeError, OverflowError):
        return None
