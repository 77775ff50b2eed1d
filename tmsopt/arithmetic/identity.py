"""Whether expressions are 0 for all values of their symbols: by normal forms of rational functions, not by trying.

A function that is not rational is an unknown of its own, one for each argument, with what binds it: sin² + cos² = 1,
tan = sin/cos, √x² = x and |x|² = x². What vanishes for another reason is not seen to.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import casadi as ca
import flint

from tmsopt.arithmetic.walk import Arithmetic, steps

_WHOLE = 64  # exponent up to which a power is a product


@dataclass(frozen=True)
class Quotient:
    """A quotient of polynomials with fractions for coefficients; numbers may stand beside it."""

    above: Any
    below: Any

    def __add__(self, other: Any) -> "Quotient":
        o = self._made(other)
        return _reduced(self.above * o.below + o.above * self.below, self.below * o.below)

    def __mul__(self, other: Any) -> "Quotient":
        o = self._made(other)
        return _reduced(self.above * o.above, self.below * o.below)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> "Quotient":
        return Quotient(-self.above, self.below)

    def inverse(self) -> "Quotient":
        """1 over this; ZeroDivisionError for 0."""
        if not self.above:
            raise ZeroDivisionError
        return Quotient(self.below, self.above)

    def _made(self, other: Any) -> "Quotient":
        return other if isinstance(other, Quotient) else Quotient(0 * self.below + other, 0 * self.below + 1)


class Field:
    """Rational functions of the inputs of a function, and of what else it makes of them; one for each function."""

    def __init__(self, function: ca.Function) -> None:
        count = function.nnz_in(0)
        others = sum(step.operation not in (ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST) for step in steps(function))
        context = flint.fmpq_mpoly_ctx.get(tuple(f"x{k}" for k in range(count + 2 * others + 1)), "lex")
        self._context, self._one = context, context.constant(1)
        self.inputs = [self._free(k) for k in range(count)]
        self._used = count
        self._known: list[tuple[int, tuple[Quotient, ...], Quotient]] = []
        self._squares: list[tuple[int, Quotient]] = []

    def arithmetic(self) -> Arithmetic:
        """CasADi's operations; numbers are the decimals that they print as."""
        rational: dict[int, Callable[..., Any]] = {
            ca.OP_CONST: self.number,
            ca.OP_ADD: lambda a, b: a + b,
            ca.OP_SUB: lambda a, b: a + -b,
            ca.OP_MUL: lambda a, b: a * b,
            ca.OP_DIV: lambda a, b: a * b.inverse(),
            ca.OP_INV: Quotient.inverse,
            ca.OP_NEG: lambda a: -a,
            ca.OP_SQ: lambda a: a * a,
            ca.OP_TWICE: lambda a: 2 * a,
            ca.OP_POW: self._power,
            ca.OP_CONSTPOW: self._power,
            ca.OP_SQRT: lambda a: self._applied(ca.OP_SQRT, a, square=lambda: a),
            ca.OP_FABS: lambda a: self._applied(ca.OP_FABS, a, square=lambda: a * a),
            ca.OP_COS: partial(self._applied, ca.OP_COS),
            ca.OP_SIN: self._sine,
            ca.OP_TAN: lambda a: self._sine(a) * self._applied(ca.OP_COS, a).inverse(),
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
            for exponents, coefficient in x.above.to_dict().items():
                while len(powers) <= exponents[at] // 2:
                    powers.append(powers[-1] * square)
                kept = (*exponents[:at], exponents[at] % 2, *exponents[at + 1 :])
                term = self._context.from_dict({kept: coefficient})
                rest = rest + powers[exponents[at] // 2] * Quotient(term, self._one)
            x = rest
        return not x.above

    def _applied(self, operation: int, *operands: Quotient, square: Callable[[], Quotient] | None = None) -> Quotient:
        """An unknown for what a function makes of its operands, the same for the same."""
        for known, given, made in self._known:
            if known == operation and all(not (a + -b).above for a, b in zip(given, operands, strict=True)):
                return made
        at, self._used = self._used, self._used + 1
        made = self._free(at)
        self._known.append((operation, operands, made))
        if square is not None:
            self._squares.append((at, square()))
        return made

    def _sine(self, a: Quotient) -> Quotient:
        cosine = self._applied(ca.OP_COS, a)
        return self._applied(ca.OP_SIN, a, square=lambda: 1 + -(cosine * cosine))

    def _power(self, a: Quotient, b: Quotient) -> Quotient:
        exponent = b.above.leading_coefficient() / b.below.leading_coefficient() if b.above else flint.fmpq(0)
        whole = b.above.is_constant() and b.below.is_constant() and exponent.q == 1
        if not whole or abs(exponent) > _WHOLE:
            return self._applied(ca.OP_POW, a, b)
        raised = math.prod([a] * abs(int(exponent.p)), start=self.number(1.0))
        return raised if exponent >= 0 else raised.inverse()

    def _free(self, at: int) -> Quotient:
        return Quotient(self._context.gens()[at], self._one)


def _reduced(above: Any, below: Any) -> Quotient:
    if below.is_constant():
        return Quotient(above, below)
    shared = above.gcd(below)
    return Quotient(above // shared, below // shared)
