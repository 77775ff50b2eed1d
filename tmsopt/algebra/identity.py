"""Whether expressions are 0 for all values of their symbols: by normal forms of rational functions, not by trying.

A function that is not rational is an unknown of its own, one for each argument, with what binds it: sin² + cos² = 1,
tan = sin/cos, √x² = x and |x|² = x². What vanishes for another reason is not seen to.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import casadi as ca
import flint

from tmsopt.algebra.walk import Arithmetic, NotAccepted, steps

_WHOLE = 64  # exponent up to which a power is a product
_MOST = 10**7  # products of two terms in one multiplication; more take minutes, and more memory than there is


@dataclass(frozen=True, eq=False)
class Quotient:  # noqa: PLW1641 - equality up to a common factor has no cheap hash
    """A quotient of two polynomials; equal to another if the cross products are."""

    over: Any
    under: Any

    def __post_init__(self) -> None:
        common = self.over.gcd(self.under)
        if not common.is_constant():
            object.__setattr__(self, "over", self.over // common)
            object.__setattr__(self, "under", self.under // common)

    def __add__(self, other: Any) -> "Quotient":
        o = self._other(other)
        return Quotient(_times(self.over, o.under) + _times(o.over, self.under), _times(self.under, o.under))

    def __mul__(self, other: Any) -> "Quotient":
        o = self._other(other)
        return Quotient(_times(self.over, o.over), _times(self.under, o.under))

    def __truediv__(self, other: Any) -> "Quotient":
        o = self._other(other)
        if o.over == 0:
            raise ZeroDivisionError("division by the zero quotient")
        return Quotient(_times(self.over, o.under), _times(self.under, o.over))

    def __neg__(self) -> "Quotient":
        return Quotient(-self.over, self.under)

    def __sub__(self, other: Any) -> "Quotient":
        return self + (-self._other(other))

    def __rsub__(self, other: Any) -> "Quotient":
        return self._other(other) - self

    def __rtruediv__(self, other: Any) -> "Quotient":
        return self._other(other) / self

    def __pow__(self, n: int) -> "Quotient":
        over, under = (_power(x, abs(n)) for x in (self.over, self.under))
        return Quotient(over, under) if n >= 0 else Quotient(under, over)

    def sqrt(self) -> "Quotient":
        """The square root of a square, with positive leading coefficients."""
        return Quotient(self.over.sqrt(), self.under.sqrt())

    __radd__ = __add__
    __rmul__ = __mul__

    def __eq__(self, other: object) -> bool:
        o = self._other(other)
        return bool(_times(self.over, o.under) == _times(o.over, self.under))

    def _other(self, other: Any) -> "Quotient":
        if isinstance(other, Quotient):
            return other
        return Quotient(self.under * 0 + other, self.under * 0 + 1)


def _times(a: Any, b: Any) -> Any:
    if len(a) * len(b) > _MOST:
        raise NotAccepted(f"a formula of more than {_MOST} products")
    return a * b


def _power(a: Any, n: int) -> Any:
    if len(a) > 1 and math.comb(len(a) + n - 1, n) > math.isqrt(_MOST) * 10:
        raise NotAccepted(f"a formula of more than {_MOST} products")
    return a**n


class Field:
    """Rational functions of the inputs of a function, and of what else it makes of them; one for each function.

    Args:
        numbers: what the last inputs are; one that is no fraction is an unknown.
    """

    def __init__(self, function: ca.Function, numbers: Sequence[Any] = ()) -> None:
        count = function.nnz_in(0)
        others = sum(step.operation not in (ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST) for step in steps(function))
        context = flint.fmpq_mpoly_ctx.get(tuple(f"x{k}" for k in range(count + 2 * others + 1)), "lex")
        self._context, self._one = context, context.constant(1)
        self.inputs = [self._free(k) for k in range(count)]
        for k, number in enumerate(numbers, start=count - len(numbers)):
            if isinstance(number, flint.fmpq):
                self.inputs[k] = Quotient(number * self._one, self._one)
        self._used = count
        self._known: list[tuple[int, tuple[Quotient, ...], Quotient]] = []
        self._squares: list[tuple[int, Quotient]] = []

    def arithmetic(self) -> Arithmetic:
        """CasADi's operations; numbers are the decimals that they print as."""
        rational: dict[int, Callable[..., Any]] = {
            ca.OP_CONST: self.number,
            ca.OP_ADD: lambda a, b: a + b,
            ca.OP_SUB: lambda a, b: a - b,
            ca.OP_MUL: lambda a, b: a * b,
            ca.OP_DIV: lambda a, b: a / b,
            ca.OP_INV: lambda a: 1 / a,
            ca.OP_NEG: lambda a: -a,
            ca.OP_SQ: lambda a: a * a,
            ca.OP_TWICE: lambda a: 2 * a,
            ca.OP_POW: self._power,
            ca.OP_CONSTPOW: self._power,
            ca.OP_SQRT: lambda a: self._applied(ca.OP_SQRT, a, square=lambda: a),
            ca.OP_FABS: lambda a: self._applied(ca.OP_FABS, a, square=lambda: a * a),
            ca.OP_COS: partial(self._applied, ca.OP_COS),
            ca.OP_SIN: self._sine,
            ca.OP_TAN: lambda a: self._sine(a) / self._applied(ca.OP_COS, a),
        }
        every = {getattr(ca, name) for name in dir(ca) if name.startswith("OP_")}
        return {**{op: partial(self._applied, op) for op in every}, **rational}

    def number(self, x: float) -> Quotient:
        return Quotient(flint.fmpq(*Fraction(repr(x)).as_integer_ratio()) * self._one, self._one)

    def vanishes(self, x: Any) -> bool:
        """Whether an element is 0 for all values; what is true is certain."""
        if not isinstance(x, Quotient):
            return bool(x == 0)
        for at, square in reversed(self._squares):
            powers, rest = [self.number(1.0)], self.number(0.0)
            for exponents, coefficient in x.over.to_dict().items():
                while len(powers) <= exponents[at] // 2:
                    powers.append(powers[-1] * square)
                kept = (*exponents[:at], exponents[at] % 2, *exponents[at + 1 :])
                term = self._context.from_dict({kept: coefficient})
                rest = rest + powers[exponents[at] // 2] * Quotient(term, self._one)
            x = rest
        return not x.over

    def _applied(self, operation: int, *operands: Quotient, square: Callable[[], Quotient] | None = None) -> Quotient:
        """An unknown for what a function makes of its operands, the same for the same."""
        for known, given, made in self._known:
            if known == operation and all(a == b for a, b in zip(given, operands, strict=True)):
                return made
        at, self._used = self._used, self._used + 1
        made = self._free(at)
        self._known.append((operation, operands, made))
        if square is not None:
            self._squares.append((at, square()))
        return made

    def _sine(self, a: Quotient) -> Quotient:
        cosine = self._applied(ca.OP_COS, a)
        return self._applied(ca.OP_SIN, a, square=lambda: 1 - cosine * cosine)

    def _power(self, a: Quotient, b: Quotient) -> Quotient:
        exponent = b.over.leading_coefficient() / b.under.leading_coefficient() if b.over else flint.fmpq(0)
        whole = b.over.is_constant() and b.under.is_constant() and exponent.q == 1
        if not whole or abs(exponent) > _WHOLE:
            return self._applied(ca.OP_POW, a, b)
        n = int(exponent.p)
        return a**n if n >= 0 else 1 / a**-n

    def _free(self, at: int) -> Quotient:
        return Quotient(self._context.gens()[at], self._one)
