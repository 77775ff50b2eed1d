"""Decides whether an expression is 0 for all values of its symbols, by normal forms of rational functions.

Each value of a function that is not rational, such as sin x, is an additional unknown. These relations between unknowns
are used: sin² + cos² = 1, tan = sin/cos, sin(−x) = −sin x, (√x)² = x and |x|² = x². An expression that is 0 for another
reason is not recognised as 0.
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
    make_node,
    symbol,
)
from tmsopt.algebra.kinds import ARITHMETIC, NODES

_MAX_EXPONENT = 64  # a power with a larger exponent is not multiplied out
_MAX_PRODUCTS = 10**7  # products of two terms in one multiplication; more would take minutes and all memory


@dataclass(frozen=True, eq=False)
class Quotient:  # noqa: PLW1641 - equality up to a common factor has no cheap hash
    """A quotient of two polynomials; two quotients are equal if their cross products are equal."""

    numerator: Any
    denominator: Any = None  # by default the polynomial 1

    def __post_init__(self) -> None:
        if self.denominator is None:
            object.__setattr__(self, "denominator", self.numerator**0)
            return
        common = self.numerator.gcd(self.denominator)
        if not common.is_constant():
            object.__setattr__(self, "numerator", self.numerator // common)
            object.__setattr__(self, "denominator", self.denominator // common)

    def __add__(self, other: Any) -> "Quotient":
        o = self._convert(other)
        cross_sum = _multiply(self.numerator, o.denominator) + _multiply(o.numerator, self.denominator)
        return Quotient(cross_sum, _multiply(self.denominator, o.denominator))

    def __mul__(self, other: Any) -> "Quotient":
        o = self._convert(other)
        return Quotient(_multiply(self.numerator, o.numerator), _multiply(self.denominator, o.denominator))

    def __truediv__(self, other: Any) -> "Quotient":
        o = self._convert(other)
        if o.numerator == 0:
            raise ZeroDivisionError("division by the zero quotient")
        return Quotient(_multiply(self.numerator, o.denominator), _multiply(self.denominator, o.numerator))

    def __neg__(self) -> "Quotient":
        return Quotient(-self.numerator, self.denominator)

    def __sub__(self, other: Any) -> "Quotient":
        return self + (-self._convert(other))

    def __rsub__(self, other: Any) -> "Quotient":
        return self._convert(other) - self

    def __rtruediv__(self, other: Any) -> "Quotient":
        return self._convert(other) / self

    def __pow__(self, n: int) -> "Quotient":
        quotient = Quotient(_power(self.numerator, abs(n)), _power(self.denominator, abs(n)))
        return quotient if n >= 0 else 1 / quotient

    @property
    def is_negative(self) -> bool:
        """Whether its leading coefficient is negative: of a and −a, one is."""
        return bool(self.numerator) and bool(
            self.numerator.leading_coefficient() * self.denominator.leading_coefficient() < 0
        )

    def sqrt(self) -> "Quotient":
        """The square root of a square, with positive leading coefficients."""
        return Quotient(self.numerator.sqrt(), self.denominator.sqrt())

    __radd__ = __add__
    __rmul__ = __mul__

    def __eq__(self, other: object) -> bool:
        o = self._convert(other)
        return bool(_multiply(self.numerator, o.denominator) == _multiply(o.numerator, self.denominator))

    def _convert(self, other: Any) -> "Quotient":
        return other if isinstance(other, Quotient) else Quotient(self.denominator * 0 + other)


def _multiply(a: Any, b: Any) -> Any:
    if len(a) * len(b) > _MAX_PRODUCTS:
        raise UnsupportedOperation(f"a formula of more than {_MAX_PRODUCTS} products")
    return a * b


def _power(a: Any, n: int) -> Any:
    if len(a) > 1 and math.comb(len(a) + n - 1, n) > math.isqrt(_MAX_PRODUCTS) * 10:
        raise UnsupportedOperation(f"a formula of more than {_MAX_PRODUCTS} products")
    return a**n


class Field:
    """The rational functions of the inputs of one formula, and of the values of its functions that are not rational."""

    def __init__(self, formula: Formula) -> None:
        formulas = [formula, *(step.value for step in formula.steps if isinstance(step.value, Formula))]
        function_count = sum(step.op not in (INPUT, CONSTANT) for f in formulas for step in f.steps)
        unknown_count = len(formula.names) + 2 * function_count + 1
        context = flint.fmpq_mpoly_ctx.get(tuple(f"x{k}" for k in range(unknown_count)), "lex")
        self._context = context
        self.inputs = {name: self._generator(k) for k, name in enumerate(formula.names)}
        self._nodes = [symbol(name) for name in formula.names]  # index of an unknown → its meaning
        self._functions: list[
            tuple[str, tuple[Quotient, ...], Quotient]
        ] = []  # each has a name, operands, and an unknown
        self._squares: list[tuple[int, Quotient]] = []  # each has the index of an unknown, and its square
        self.kind = Kind(
            {
                **{op: partial(self._apply, op) for op in NODES.operations},
                **ARITHMETIC,
                "pow": self._power,
                "sqrt": lambda a: self._apply("sqrt", a, square=lambda: a),
                "abs": lambda a: self._apply("abs", a, square=lambda: a * a),
                "sin": self._sine,
                "cos": self._cosine,
                "tan": lambda a: self._sine(a) / self._cosine(a),
            },
            self.number,
        )

    def number(self, x: Constant) -> Quotient:
        """A constant of a formula; an irrational constant contains unknowns for its functions."""
        if isinstance(x, Formula):
            return fold(x, {}, self.kind)[0]  # type: ignore[no-any-return]
        return Quotient(self._context.constant(rational(x)))

    def is_zero(self, x: Any) -> bool:
        """Whether an element is 0 for all values of the inputs. True is certain; False is not."""
        if not isinstance(x, Quotient):
            return bool(x == 0)
        for index, square in reversed(self._squares):
            powers, total = [self.number(Fraction(1))], self.number(Fraction(0))
            for exponents, coefficient in x.numerator.to_dict().items():
                while len(powers) <= exponents[index] // 2:
                    powers.append(powers[-1] * square)
                reduced = (*exponents[:index], exponents[index] % 2, *exponents[index + 1 :])
                total += powers[exponents[index] // 2] * Quotient(self._context.from_dict({reduced: coefficient}))
            x = total
        return not x.numerator

    def node(self, x: Quotient) -> Node:
        """An element as a node, multiplied out and then written by Horner's rule."""
        lead = x.denominator.leading_coefficient()
        return self._factor_out((x.numerator / lead).to_dict()) / self._factor_out((x.denominator / lead).to_dict())

    def _factor_out(self, terms: Mapping[tuple[int, ...], Any]) -> Node:
        """A sum of terms with the most frequent unknown factored out, recursively."""
        use_counts = [sum(exponent > 0 for exponent in exponents) for exponents in zip(*terms, strict=True)]
        if not any(use_counts):
            return constant(terms[next(iter(terms))] if terms else 0)
        names = [str(node.value) for node in self._nodes]
        names += [""] * (len(use_counts) - len(names))
        k = max(range(len(use_counts)), key=lambda j: (use_counts[j], names[j]))
        power = min(monomial[k] for monomial in terms if monomial[k])
        inner_terms = {(*m[:k], m[k] - power, *m[k + 1 :]): c for m, c in terms.items() if m[k]}
        remaining_terms = {m: c for m, c in terms.items() if not m[k]}
        product = self._factor_out(inner_terms) * self._nodes[k] ** int(power)
        return product + self._factor_out(remaining_terms) if remaining_terms else product

    def _apply(self, operation: str, *operands: Quotient, square: Callable[[], Quotient] | None = None) -> Quotient:
        """The unknown for a function of some operands; equal operands give the same unknown."""
        for known_operation, known_operands, unknown in self._functions:
            if known_operation == operation and all(a == b for a, b in zip(known_operands, operands, strict=True)):
                return unknown
        index = len(self._nodes)
        unknown = self._generator(index)
        self._nodes.append(make_node(operation, *map(self.node, operands)))
        self._functions.append((operation, operands, unknown))
        if square is not None:
            self._squares.append((index, square()))
        return unknown

    def _cosine(self, a: Quotient) -> Quotient:
        return self._apply("cos", -a if a.is_negative else a)

    def _sine(self, a: Quotient) -> Quotient:
        if a.is_negative:
            return -self._sine(-a)
        cosine = self._cosine(a)
        return self._apply("sin", a, square=lambda: 1 - cosine * cosine)

    def _power(self, a: Quotient, b: Quotient) -> Quotient:
        numerator, denominator = b.numerator, b.denominator
        exponent = numerator.leading_coefficient() / denominator.leading_coefficient() if numerator else flint.fmpq(0)
        is_integer = numerator.is_constant() and denominator.is_constant() and exponent.q == 1
        if not is_integer or abs(exponent) > _MAX_EXPONENT:
            return self._apply("pow", a, b)
        return a ** int(exponent.p)

    def _generator(self, index: int) -> Quotient:
        return Quotient(self._context.gens()[index])


def multiply_out(formula: Formula) -> Formula:
    """The formula as quotients of polynomials in lowest terms. Functions that are not rational count as inputs.

    Raises:
        UnsupportedOperation: if there would be too many terms.
    """
    field = Field(formula)
    return formula_of(map(field.node, fold(formula, field.inputs, field.kind)), formula.names)


def is_linear(formula: Formula) -> bool:
    """Whether a formula of one output is linear in its inputs. True is certain; False is not."""
    field = Field(formula)
    (output,) = fold(formula, field.inputs, field.kind)
    terms_are_linear = (
        sum(exponents) == sum(exponents[: len(formula.names)]) <= 1 for exponents in output.numerator.to_dict()
    )
    return bool(output.denominator.is_constant()) and all(terms_are_linear)
