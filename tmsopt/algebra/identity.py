"""Whether expressions are 0 for all values of their symbols: by normal forms of rational functions, not by trying.

A function that is not rational is an unknown of its own, one for each argument, with what binds it: sin² + cos² = 1,
tan = sin/cos, √x² = x and |x|² = x². What vanishes for another reason is not seen to.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import flint

from tmsopt.algebra.balls import rational
from tmsopt.algebra.formula import (
    CONSTANT,
    INPUT,
    Constant,
    Formula,
    Kind,
    Node,
    UnsupportedOperation,
    constant,
    fold,
    formula as formula_of,
    make_node as made_of,
    symbol,
)
from tmsopt.algebra.kinds import ARITHMETIC, NODES

_WHOLE = 64  # exponent up to which a power is a product
_MOST = 10**7  # products of two terms in one multiplication; more take minutes, and more memory than there is


@dataclass(frozen=True, eq=False)
class Quotient:  # noqa: PLW1641 - equality up to a common factor has no cheap hash
    """A quotient of two polynomials; equal to another if the cross products are."""

    over: Any
    under: Any = None  # the polynomial 1, where it is left out

    def __post_init__(self) -> None:
        if self.under is None:
            object.__setattr__(self, "under", self.over**0)
            return
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
        return Quotient(over, under) if n >= 0 else 1 / Quotient(over, under)

    def sqrt(self) -> "Quotient":
        """The square root of a square, with positive leading coefficients."""
        return Quotient(self.over.sqrt(), self.under.sqrt())

    __radd__ = __add__
    __rmul__ = __mul__

    def __eq__(self, other: object) -> bool:
        o = self._other(other)
        return bool(_times(self.over, o.under) == _times(o.over, self.under))

    def _other(self, other: Any) -> "Quotient":
        return other if isinstance(other, Quotient) else Quotient(self.under * 0 + other)


def _times(a: Any, b: Any) -> Any:
    if len(a) * len(b) > _MOST:
        raise UnsupportedOperation(f"a formula of more than {_MOST} products")
    return a * b


def _power(a: Any, n: int) -> Any:
    if len(a) > 1 and math.comb(len(a) + n - 1, n) > math.isqrt(_MOST) * 10:
        raise UnsupportedOperation(f"a formula of more than {_MOST} products")
    return a**n


class Field:
    """Rational functions of the inputs of a formula, and of what else it makes of them; one for each formula."""

    def __init__(self, formula: Formula) -> None:
        each = [formula, *(step.value for step in formula.steps if isinstance(step.value, Formula))]
        others = sum(step.op not in (INPUT, CONSTANT) for one in each for step in one.steps)
        count = len(formula.names)
        context = flint.fmpq_mpoly_ctx.get(tuple(f"x{k}" for k in range(count + 2 * others + 1)), "lex")
        self._context = context
        self.inputs = {name: self._free(k) for k, name in enumerate(formula.names)}
        self._used = count
        self._nodes = [symbol(name) for name in formula.names]  # what each unknown is
        self._known: list[tuple[str, tuple[Quotient, ...], Quotient]] = []
        self._squares: list[tuple[int, Quotient]] = []
        self.kind = Kind(
            {
                **{op: partial(self._applied, op) for op in NODES.operations},
                **ARITHMETIC,
                "pow": self._power,
                "sqrt": lambda a: self._applied("sqrt", a, square=lambda: a),
                "abs": lambda a: self._applied("abs", a, square=lambda: a * a),
                "sin": self._sine,
                "tan": lambda a: self._sine(a) / self._applied("cos", a),
            },
            self.number,
        )

    def number(self, x: Constant) -> Quotient:
        """A constant; one that is no fraction by what is known of its functions."""
        if isinstance(x, Formula):
            return fold(x, {}, self.kind)[0]  # type: ignore[no-any-return]
        return Quotient(self._context.constant(rational(x)))

    def vanishes(self, x: Any) -> bool:
        """Whether an element is 0 for all values; what is true is certain."""
        if not isinstance(x, Quotient):
            return bool(x == 0)
        for at, square in reversed(self._squares):
            powers, rest = [self.number(Fraction(1))], self.number(Fraction(0))
            for exponents, coefficient in x.over.to_dict().items():
                while len(powers) <= exponents[at] // 2:
                    powers.append(powers[-1] * square)
                kept = (*exponents[:at], exponents[at] % 2, *exponents[at + 1 :])
                rest += powers[exponents[at] // 2] * Quotient(self._context.from_dict({kept: coefficient}))
            x = rest
        return not x.over

    def node(self, x: Quotient) -> Node:
        """An element in inputs, multiplied out, each unknown taken out of as many terms as hold it (Horner's rule)."""
        lead = x.under.leading_coefficient()
        return self._taken_out((x.over / lead).to_dict()) / self._taken_out((x.under / lead).to_dict())

    def _taken_out(self, terms: Mapping[tuple[int, ...], Any]) -> Node:
        count = [sum(exponent > 0 for exponent in each) for each in zip(*terms, strict=True)]
        if not any(count):
            return constant(terms[next(iter(terms))] if terms else 0)
        k = max(range(len(count)), key=lambda j: (count[j], str(self._nodes[j].value if j < len(self._nodes) else "")))
        power = min(monomial[k] for monomial in terms if monomial[k])
        inner = {(*m[:k], m[k] - power, *m[k + 1 :]): c for m, c in terms.items() if m[k]}
        rest = {m: c for m, c in terms.items() if not m[k]}
        product = self._taken_out(inner) * self._nodes[k] ** int(power)
        return product + self._taken_out(rest) if rest else product

    def _applied(self, operation: str, *operands: Quotient, square: Callable[[], Quotient] | None = None) -> Quotient:
        """An unknown for what a function makes of its operands, the same for the same."""
        for known, given, make_node in self._known:
            if known == operation and all(a == b for a, b in zip(given, operands, strict=True)):
                return make_node
        at, self._used = self._used, self._used + 1
        make_node = self._free(at)
        self._nodes.append(made_of(operation, *map(self.node, operands)))
        self._known.append((operation, operands, make_node))
        if square is not None:
            self._squares.append((at, square()))
        return make_node

    def _sine(self, a: Quotient) -> Quotient:
        cosine = self._applied("cos", a)
        return self._applied("sin", a, square=lambda: 1 - cosine * cosine)

    def _power(self, a: Quotient, b: Quotient) -> Quotient:
        exponent = b.over.leading_coefficient() / b.under.leading_coefficient() if b.over else flint.fmpq(0)
        whole = b.over.is_constant() and b.under.is_constant() and exponent.q == 1
        if not whole or abs(exponent) > _WHOLE:
            return self._applied("pow", a, b)
        return a ** int(exponent.p)

    def _free(self, at: int) -> Quotient:
        return Quotient(self._context.gens()[at])


def multiply_out(asked: Formula) -> Formula:
    """A formula of quotients of polynomials, in which sums cancel, in inputs and what is not rational in them.

    Raises:
        NotAccepted: where there would be too many terms.
    """
    field = Field(asked)
    return formula_of(map(field.node, fold(asked, field.inputs, field.kind)), asked.names)


def is_linear(asked: Formula) -> bool:
    """Whether a formula of one output is linear in its inputs, as far as that is known."""
    field = Field(asked)
    (found,) = fold(asked, field.inputs, field.kind)
    plain = (sum(exponents) == sum(exponents[: len(asked.names)]) <= 1 for exponents in found.over.to_dict())
    return bool(found.under.is_constant()) and all(plain)
