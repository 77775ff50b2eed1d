"""Formulas multiplied out: polynomials in symbols with exact fractions, or balls, for coefficients.

What a model computes of balls it computes of these too, so no constant is folded in doubles on the way.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import flint

from tmsopt.algebra.formula import NotAccepted

_WHOLE = 64  # exponent up to which a power is multiplied out
_MOST = 20_000  # terms


@dataclass(frozen=True)
class Symbol:
    """A variable, or a function of a formula that is no polynomial.

    Attributes:
        name: of the variable, or of the function: ``inv``, ``sqrt``, ``atan`` and so on.
        argument: of the function; None for a variable.
    """

    name: str
    argument: "Formal | None" = None

    @cached_property
    def key(self) -> str:
        """Equal for equal symbols."""
        return self.name if self.argument is None else f"{self.name}({self.argument.key})"


Monomial = tuple[tuple[Symbol, int], ...]
"""Symbols in the order of their keys, each with a positive power."""


class Formal:
    """A polynomial in symbols, made by `variable` and by arithmetic.

    Attributes:
        terms: monomial → coefficient, none of them certainly 0.

    Raises:
        NotAccepted: for what cannot be multiplied out within reason.
    """

    def __init__(self, terms: Mapping[Monomial, Any]) -> None:
        self.terms = {m: c for m, c in terms.items() if c != 0 or not _exact(c)}
        if len(self.terms) > _MOST:
            raise NotAccepted(f"a formula of more than {_MOST} terms")

    @cached_property
    def key(self) -> str:
        """Equal for the same terms."""
        return " + ".join(sorted(f"{_digits(c)} {[(s.key, p) for s, p in m]}" for m, c in self.terms.items()))

    @property
    def constant(self) -> Any:
        """The number that it is; None where it holds a symbol."""
        return None if any(self.terms) else self.terms.get((), flint.fmpq(0))

    def __eq__(self, other: object) -> bool:
        return self.key == _formal(other).key

    def __hash__(self) -> int:
        return hash(self.key)

    def __gt__(self, other: Any) -> bool:
        raise NotAccepted("a choice by the sign of what varies")

    __lt__ = __ge__ = __le__ = __gt__

    def __add__(self, other: Any) -> "Formal":
        found = dict(self.terms)
        for m, c in _formal(other).terms.items():
            found[m] = found[m] + c if m in found else c
        return Formal(found)

    def __mul__(self, other: Any) -> "Formal":
        found: dict[Monomial, Any] = {}
        for m, c in self.terms.items():
            for n, d in _formal(other).terms.items():
                both = _times(m, n)
                found[both] = found[both] + c * d if both in found else c * d
        return Formal(found)

    def __radd__(self, other: Any) -> "Formal":
        return self.__add__(other)

    def __rmul__(self, other: Any) -> "Formal":
        return self.__mul__(other)

    def __neg__(self) -> "Formal":
        return Formal({m: -c for m, c in self.terms.items()})

    def __sub__(self, other: Any) -> "Formal":
        return self + -_formal(other)

    def __rsub__(self, other: Any) -> "Formal":
        return -self + _formal(other)

    def __truediv__(self, other: Any) -> "Formal":
        return self * _inverse(_formal(other))

    def __rtruediv__(self, other: Any) -> "Formal":
        return _inverse(self) * _formal(other)

    def __pow__(self, exponent: Any) -> "Formal":
        power = _formal(exponent).constant
        if power == flint.fmpq(1, 2):
            return self.sqrt()
        whole = int(float(power)) if power is not None else 0
        if power is None or power != whole or abs(whole) > _WHOLE:
            raise NotAccepted("a power that is not whole, or too high")
        if whole < 0:
            return _inverse(self**-whole)
        found = Formal({(): flint.fmpq(1)})
        for _ in range(whole):
            found = found * self
        return found

    def __rpow__(self, base: Any) -> "Formal":
        return _formal(base) ** self

    def __abs__(self) -> "Formal":
        return self.applied("abs")

    def applied(self, name: str) -> "Formal":
        """A function of it, as a symbol of its own unless it is a number."""
        if (number := self.constant) is None:
            return variable(name, self)
        return _formal(abs(number) if name == "abs" else getattr(flint.arb(number), name)())

    def tan(self) -> "Formal":
        """Of an arctangent, its argument."""
        return self.sin() / self.cos() if (t := self._tangent) is None else t

    def sin(self) -> "Formal":
        """Of an arctangent, by its argument."""
        return self.applied("sin") if (t := self._tangent) is None else t / (1 + t * t).sqrt()

    def cos(self) -> "Formal":
        """Of an arctangent, by its argument."""
        return self.applied("cos") if (t := self._tangent) is None else 1 / (1 + t * t).sqrt()

    @property
    def _tangent(self) -> "Formal | None":
        for monomial, coefficient in self.terms.items():
            if len(self.terms) == 1 and coefficient == 1 and len(monomial) == 1 and monomial[0][1] == 1:
                return monomial[0][0].argument if monomial[0][0].name == "atan" else None
        return None

    def sqrt(self) -> "Formal":
        """Square root."""
        return self.applied("sqrt")

    def exp(self) -> "Formal":
        """Exponential."""
        return self.applied("exp")

    def log(self) -> "Formal":
        """Natural logarithm."""
        return self.applied("log")

    def asin(self) -> "Formal":
        """Arcsine."""
        return self.applied("asin")

    def acos(self) -> "Formal":
        """Arccosine."""
        return self.applied("acos")

    def atan(self) -> "Formal":
        """Arctangent."""
        return self.applied("atan")


def variable(name: str, argument: Formal | None = None) -> Formal:
    """A symbol as a formula."""
    return Formal({((Symbol(name, argument), 1),): flint.fmpq(1)})


def by_symbol(terms: Mapping[Monomial, Any]) -> tuple[Symbol, int, dict[Monomial, Any], dict[Monomial, Any]] | None:
    """The symbol that most terms hold, its least power there, these terms divided by it, and the others."""
    count = Counter(s for monomial in terms for s, _ in monomial)
    if not count:
        return None
    symbol = max(count, key=lambda s: (count[s], s.key))
    power = min(p for monomial in terms for s, p in monomial if s == symbol)
    inner, rest = {}, {}
    for monomial, c in terms.items():
        powers = dict(monomial)
        if symbol not in powers:
            rest[monomial] = c
        else:
            inner[tuple((s, p - power * (s == symbol)) for s, p in monomial if s != symbol or p > power)] = c
    return symbol, power, inner, rest


def _formal(x: Any) -> Formal:
    if isinstance(x, Formal):
        return x
    return Formal({(): flint.fmpq(*x.as_integer_ratio()) if isinstance(x, int | float) else x})


def _inverse(x: Formal) -> Formal:
    return x.applied("inv") if x.constant is None else _formal(1 / x.constant)


def _exact(x: Any) -> bool:
    return isinstance(x, flint.fmpq) or x.is_exact()


def _digits(c: Any) -> str:
    """All of a coefficient."""
    finite = isinstance(c, flint.arb) and c.is_finite()
    return f"{c.mid().man_exp()} {c.rad().man_exp()}" if finite else str(c)


def _times(m: Monomial, n: Monomial) -> Monomial:
    powers = dict(m)
    for s, p in n:
        powers[s] = powers.get(s, 0) + p
    return tuple(sorted(powers.items(), key=lambda item: item[0].key))
