"""What a number of a problem stands for when it is taken exactly."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import flint

from tmsopt.arithmetic.elementary import rational
from tmsopt.errors import Fault, InputError, short, suggest, table_faults
from tmsopt.models.model import ParameterSet
from tmsopt.records import Table

SAME = 4e-15
"""Relative difference of an exact value from the design's double: a few roundings, of a tangent too."""

MOST_DIGITS = 400
"""Of an exact number: doubles end with those of 309."""

_POWER_OF_TEN = re.compile(r"[eE]([+-]?[\d_]+)")
_DEGREES = re.compile(r"(.*?)\s*(?:deg|°)")


@dataclass(frozen=True)
class Exact:
    """A fraction, or a fraction of degrees.

    Attributes:
        value: of degrees, where `degrees`.
    """

    value: Fraction
    degrees: bool = False

    def ball(self) -> Any:
        """The number, an angle in radians, as a ball at the working precision."""
        ball = flint.arb(rational(self.value))
        return ball * flint.arb.pi() / 180 if self.degrees else ball

    def __str__(self) -> str:
        return f"{self.value} deg" if self.degrees else str(self.value)


def decimal(x: Any) -> Fraction:
    """A number as the user wrote it: a double stands for the shortest decimal that prints it, 0.1 for 1/10.

    Raises:
        ValueError: for what is no number, and for one of more digits than `MOST_DIGITS`.

    Example:
        >>> tmsopt.models.decimal(0.1)
        Fraction(1, 10)

    More: docs/explanation/proofs.md
    """
    if isinstance(x, str):
        power = _POWER_OF_TEN.search(x[:MOST_DIGITS])
        if len(x) > MOST_DIGITS or (power and abs(int(power[1])) > MOST_DIGITS):  # before it becomes a number
            raise ValueError("too many digits")
    found = Fraction(repr(float(x))) if isinstance(x, float) else Fraction(x)
    if _is_long(found):
        raise ValueError("too many digits")
    return found


def _is_long(x: Any) -> bool:
    return isinstance(x, int | Fraction) and max(abs(x.numerator), x.denominator) >= 10**MOST_DIGITS




@dataclass(frozen=True)
class Written:
    """A design in exact numbers.

    Attributes:
        values: every parameter but those in `tangents`.
        tangents: angle → its tangent, where that is the number that is exact.
        stated: those that were given exactly, as parameter or ``tan(parameter)``.
    """

    values: Table[Exact]
    tangents: Table[Exact]
    stated: tuple[str, ...] = ()

    def balls(self) -> dict[str, Any]:
        """Parameter → ball, angles in radians."""
        balls = {name: number.ball() for name, number in self.values.items()}
        return balls | {name: number.ball().atan() for name, number in self.tangents.items()}

    def fractions(self, of: ParameterSet) -> dict[str, Any] | None:
        """Parameter → fraction, an angle as a `Tilt`; None where a tangent is not a fraction."""
        found: dict[str, Any] = {}
        for name in of.names:
            if not of[name].tangent:
                found[name] = rational(self.values[name].value)
            elif name in self.tangents:
                found[name] = Tilt(rational(self.tangents[name].value))
            elif self.values[name].value == 0:
                found[name] = Tilt(flint.fmpq(0))
            else:
                return None
        return found

    def text(self, name: str) -> tuple[str, str]:
        """A number as it is taken: its name, which may be ``tan(name)``, and the fraction."""
        if name in self.tangents:
            return f"tan({name})", str(self.tangents[name])
        return name, str(self.values[name])


@dataclass(frozen=True)
class Tilt:
    """An angle by its tangent, which is all that coefficients ask of it."""

    tangent: Any

    def tan(self) -> Any:
        """The tangent."""
        return self.tangent


def written(of: ParameterSet, parameters: Mapping[str, float], stated: Mapping[str, Any] | None = None) -> Written:
    """A design's doubles as decimals, save those for which an exact number is given.

    Args:
        stated: parameter, or ``tan(parameter)`` of an angle → int, Fraction, fmpq, a float that stands for its decimal,
            or text such as ``"-2/5"``, ``"1.02"``, and for an angle ``"20 deg"``.

    Raises:
        InputError: for an unknown name, another kind of number, or one that is not the design's.
    """
    if wrong := table_faults("exact", {} if stated is None else stated, "{'zeta_B': '-1/3'}"):
        raise InputError(wrong)
    names = {n: n for n in of.names} | {f"tan({p.name})": p.name for p in of.parameters if p.tangent}
    values = {n: Exact(decimal(float(parameters[n]))) for n in of.names}
    tangents: dict[str, Exact] = {}
    faults = []
    for key, given in (stated or {}).items():
        if key not in names:
            faults.append(Fault(f"unknown parameter '{key}'; {suggest(key, names)}", ("exact", key)))
            continue
        name = names[key]
        number = _parsed(given, angle=of[name].unit == "rad" and key == name)
        if number is None:
            faults.append(Fault(_accepted(given, key == name and of[name].unit == "rad"), ("exact", key)))
            continue
        stored = math.tan(parameters[name]) if key != name else float(parameters[name])
        if not math.isclose(float(number.ball()), stored, rel_tol=SAME, abs_tol=1e-300):
            message = f"found {number}, but the design has {stored!r}; give the exact form of the same number"
            faults.append(Fault(message, ("exact", key)))
            continue
        if key != name:
            tangents[name] = number
        else:
            values[name] = number
    if faults:
        raise InputError(faults)
    left = Table({n: v for n, v in values.items() if n not in tangents})
    return Written(left, Table(tangents), tuple(stated or ()))


def _parsed(given: Any, angle: bool) -> Exact | None:
    if isinstance(given, bool):
        return None
    degrees = _DEGREES.fullmatch(given.strip()) if isinstance(given, str) and angle else None
    try:
        if isinstance(given, flint.fmpq | flint.fmpz):
            fraction = rational(given) if isinstance(given, flint.fmpq) else flint.fmpq(given)
            given = Fraction(int(fraction.p), int(fraction.q))
        return Exact(decimal(degrees[1] if degrees else given), bool(degrees))
    except (ValueError, TypeError, ZeroDivisionError, OverflowError):
        return None


def _accepted(given: Any, angle: bool) -> str:
    angles = ", or an angle such as '20 deg'" if angle else ""
    accepted = (
        f"an int, a Fraction, a decimal or fraction in quotes such as '-2/5'{angles}, of up to {MOST_DIGITS} digits"
    )
    return f"found {'a number of more digits' if _is_long(given) else short(given)}; accepted: {accepted}"
