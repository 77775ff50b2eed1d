"""Translates an NLP to factorable polynomial equations for SCIP.

A quadratic expression gets a variable when it is multiplied again. It gets the variable only once, so that the
relaxation shares it as the formula does. Equations replace quotients, radicals and arctangents.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import flint

from tmsopt.algebra.formula import Kind, UnsupportedOperation
from tmsopt.algebra.intervals import Interval, ball, interval
from tmsopt.algebra.kinds import INTERVALS, as_double
from tmsopt.program.nlp import NLP

FEASIBILITY = 1e-9
"""SCIP's feasibility tolerance of a row."""

_MIN_POWER = -60  # exponent of the least scale, a power of two; smaller numbers count as 0
_MAX_NUMBER = 1e15  # largest number accepted; SCIP treats 1e20 as infinite
_MAX_SCALED_NUMBER = (
    1e3  # largest number that a coefficient below 1e-9 may multiply, since SCIP drops such a coefficient
)
_MAX_EXPONENT = 1000  # largest exponent of a power

_RANGES = INTERVALS.operations

_CANCELLATION = 2.0**-10
"""Least scale of a row relative to its largest summand; a smaller scale would need more than double precision."""


@dataclass(frozen=True)
class Term:
    """An intermediate result: a SCIP expression with its degree and its range.

    Attributes:
        expression: a number if the degree is 0.
        degree: 0, 1 or 2.
        ball: its range, as a midpoint and a radius.
        size: bound on its summands, which may cancel each other.
        tangent: the operand, if the term is an arctangent.
        symbol: the SCIP variable, if the term is scale · symbol.
        scale: its scale.
    """

    expression: Any
    degree: int
    ball: Any
    size: float
    tangent: "Term | None" = None
    symbol: Any = None
    scale: float = 1.0

    @property
    def ends(self) -> Interval:
        """Least and greatest value."""
        return interval(self.ball) if self.degree else (self.expression, self.expression)

    @property
    def unit(self) -> float:
        """The power of two, at most 1, by which a row of this term is divided to make it about 1."""
        return max(_scale_of(max(map(abs, self.ends))), min(_CANCELLATION * _scale_of(self.size), 1.0))


class Translation:
    """The SCIP model of an NLP, for one solve.

    Attributes:
        model: of pyscipopt, without objective.
        x: the variables of the NLP, each a SCIP variable times its scale.
        objective: the expression to minimise.
        is_impossible: whether no point is feasible, because a constant row is violated or a value undefined.
    """

    def __init__(self, nlp: NLP) -> None:
        """Translate an NLP.

        Raises:
            UnsupportedOperation: for an operation that SCIP does not support.
        """
        import pyscipopt

        self.scip = pyscipopt
        self.model = pyscipopt.Model()
        self.model.hideOutput()
        self.count = 0
        self.is_impossible = False
        self.cache: dict[tuple[str, int], tuple[Term, Any]] = {}
        self.x = [self.add_variable(*ends) for ends in zip(nlp.lower, nlp.upper, strict=True)]
        objective, *rows = nlp.fold(self.x, self.kind(), self.as_affine)
        for row, lower, upper in zip(rows, nlp.row_lower, nlp.row_upper, strict=True):
            self.add_row(row, lower, upper)
        self.objective = self.as_affine(objective).expression

    def add_variable(self, lower: float, upper: float, enclosure: Any = None) -> Term:
        """Add a variable, scaled by a power of two to about 1."""
        scale = _scale_of(max(abs(lower), abs(upper)))
        ends = [e / scale if math.isfinite(e) else None for e in (lower, upper)]
        self.count += 1
        symbol = self.model.addVar(f"v{self.count}", lb=ends[0], ub=ends[1])
        enclosure = ball((lower, upper)) if enclosure is None else enclosure
        return Term(scale * symbol, 1, enclosure, max(abs(lower), abs(upper)), symbol=symbol, scale=scale)

    def add_bounded_variable(self, enclosure: Any, lower: float = -math.inf) -> Term:
        """Add a variable with a range."""
        ends = interval(enclosure)
        return self.add_variable(max(ends[0], lower), ends[1], enclosure)

    def as_affine(self, term: Term) -> Term:
        """Return a term of degree 1 at most; a quadratic term gets a variable, once."""
        affine_term: Term = term if term.degree < 2 else self.remember("variable", term, self.add_equal_variable)
        return affine_term

    def add_equal_variable(self, term: Term) -> Term:
        """Add a variable equal to a term."""
        variable = self.add_bounded_variable(term.ball)
        self.add_row(Term(variable.expression - term.expression, 2, term.ball, term.size), 0.0, 0.0)
        return variable

    def remember(self, name: str, term: Term, make: Callable[[Term], Any]) -> Any:
        """Return `make(term)`, computed once for each term; the cache keeps the term, so its id stays unique."""
        if (name, id(term)) not in self.cache:
            self.cache[name, id(term)] = term, make(term)
        return self.cache[name, id(term)][1]

    def add_equation(self, left: Any, right: Any, size: float = 1.0) -> None:
        """Add an equation between expressions of about this size."""
        self.model.addCons(left / size == right / size)

    def add_row(self, term: Term, lower: float, upper: float) -> None:
        """Add a row, scaled to about 1."""
        if term.degree == 0:
            self.is_impossible |= not lower - FEASIBILITY <= term.expression <= upper + FEASIBILITY
            return
        size = term.unit
        if lower == upper:
            return self.add_equation(term.expression, lower, size)
        if math.isfinite(lower):
            self.model.addCons(term.expression / size >= lower / size)
        if math.isfinite(upper):
            self.model.addCons(term.expression / size <= upper / size)

    def kind(self) -> Kind:
        """Return the operations (a `Kind` of numbers) that translate a formula to terms."""
        return Kind(
            {
                "add": lambda a, b: self.add(a, b, 1.0),
                "sub": lambda a, b: self.add(a, b, -1.0),
                "neg": lambda a: self.scale_by(a, -1.0),
                "mul": self.multiply,
                "square": self.square,
                "div": self.divide,
                "quotient_or_nan": self.divide,
                "quotient_or_zero": self.divide_by_nonzero,
                "sqrt": self.take_root,
                "pow": self.raise_to_power,
                "tan": self.tangent,
                "atan": lambda a: self.remember("angle", self.as_affine(a), self.add_arctangent),
                "asin": lambda a: self.add_inverse(a, "sin", "asin"),
                "acos": lambda a: self.add_inverse(a, "cos", "acos"),
                "abs": self.absolute,
                "max": lambda a, b: self.take_extreme(a, b, 0.5),
                "min": lambda a, b: self.take_extreme(a, b, -0.5),
                **{name: partial(self.apply, name) for name in ("exp", "log", "sin", "cos")},
            },
            lambda value: _constant(float(as_double(value))),
        )

    def add(self, a: Term, b: Term, sign: float) -> Term:
        enclosure = a.ball + sign * b.ball
        return Term(a.expression + sign * b.expression, max(a.degree, b.degree), enclosure, max(a.size, b.size))

    def scale_by(self, a: Term, factor: float) -> Term:
        if 0 < abs(factor) < FEASIBILITY:
            _check_size(a.ball, "a small multiple", _MAX_SCALED_NUMBER)
        return Term(factor * a.expression, a.degree, factor * a.ball, abs(factor) * a.size)

    def multiply(self, a: Term, b: Term) -> Term:
        for constant_factor, factor in ((a, b), (b, a)):
            if constant_factor.degree == 0:
                return self.scale_by(factor, constant_factor.expression)
        a, b = self.as_affine(a), self.as_affine(b)
        return Term(a.expression * b.expression, 2, a.ball * b.ball, a.size * b.size)

    def square(self, a: Term) -> Term:
        return replace(self.multiply(a, a), ball=_RANGES["square"](a.ball))

    def divide(self, a: Term, b: Term) -> Term:
        """q with q b = a; unbounded if b may vanish."""
        if b.degree == 0:
            return self.scale_by(a, 1 / b.expression) if b.expression else self.mark_impossible()
        b = self.as_affine(b)
        q = self.add_bounded_variable(a.ball / b.ball)
        self.add_row(Term(q.expression * b.expression - a.expression, 2, a.ball, a.size), 0.0, 0.0)
        return q

    def divide_by_nonzero(self, a: Term, b: Term) -> Term:
        """q with q b = a; for 0/0 any q.

        Raises:
            UnsupportedOperation: for the constant b = 0.
        """
        if b.degree == 0 and not b.expression:
            raise UnsupportedOperation("a ratio to 0")
        return self.divide(a, b)

    def nonnegative_ends(self, a: Term) -> Interval:
        """The range of a term that must be ≥ 0."""
        self.is_impossible |= a.ends[1] < 0
        return max(a.ends[0], 0.0), max(a.ends[1], 0.0)

    def take_root(self, a: Term) -> Term:
        """r ≥ 0 with r² = a."""
        lower, upper = self.nonnegative_ends(a)
        r = self.add_variable(math.nextafter(math.sqrt(lower), 0), math.nextafter(math.sqrt(upper), math.inf))
        self.add_row(Term(r.expression * r.expression - a.expression, 2, a.ball, a.size), 0.0, 0.0)
        return r

    def raise_to_power(self, a: Term, b: Term) -> Term:
        if b.degree > 0:  # a^b = exp(b log a) needs a > 0
            if not a.ends[0] > 0:
                raise UnsupportedOperation("a power with a variable exponent and a base that may be 0 or negative")
            return self.apply("exp", self.multiply(b, self.apply("log", a)))
        exponent = b.expression
        if exponent == 0.5:
            return self.take_root(a)
        if abs(exponent) > _MAX_EXPONENT:
            raise UnsupportedOperation(f"a power with an exponent beyond {_MAX_EXPONENT}")
        if exponent != int(exponent) and a.degree > 0 and a.ball.is_finite():
            _check_size(_RANGES["pow"](a.ball, b.ball), "a power")
        if exponent < 0:
            return self.divide(_constant(1.0), self.raise_to_power(a, _constant(-exponent)))
        if exponent != int(exponent):
            return self.raise_to_fraction(a, exponent)
        if exponent == 0:
            return _constant(1.0)
        half_power = self.raise_to_power(a, _constant(exponent // 2)) if exponent > 1 else _constant(1.0)
        even_power = self.square(half_power) if exponent > 1 else half_power
        return self.multiply(even_power, a) if exponent % 2 else even_power

    def raise_to_fraction(self, a: Term, exponent: float) -> Term:
        """A positive power of a ≥ 0."""
        lower, upper = self.nonnegative_ends(a)
        a = self.as_affine(a)
        power = flint.arb(exponent)
        low, high = (flint.arb(e) ** power if math.isfinite(e) else flint.arb("inf") for e in (lower, upper))
        v = self.add_variable(max(interval(low)[0], 0.0), interval(high)[1])
        self.add_equation(v.expression, a.expression**exponent, v.scale)
        return v

    def apply(self, name: str, a: Term) -> Term:
        """exp, log, sin or cos of a term."""
        if a.degree == 0:
            return _constant(getattr(math, name)(a.expression))
        if name == "exp":
            _check_size(_RANGES[name](a.ball), "exp")
        if a.tangent is not None and name in ("sin", "cos"):
            part: Term = self.remember("circle", a.tangent, self.add_circle_point)[name == "sin"]
            return part
        a = self.as_affine(a)
        v = self.add_bounded_variable(_RANGES[name](a.ball))
        if name == "log":  # as exp, since SCIP keeps the argument of log away from 0
            self.add_equation(a.expression, self.scip.exp(v.expression), a.scale)
        else:  # the tolerance of the argument makes a smaller scale of sin and cos useless
            size = v.scale if name == "exp" else max(v.scale, _CANCELLATION)
            self.add_equation(v.expression, getattr(self.scip, name)(a.expression), size)
        return v

    def add_circle_point(self, t: Term) -> tuple[Term, Term]:
        """Cosine and sine of the arctangent of t: C > 0, S = t C, C² + S² = 1."""
        angle = t.ball.atan()
        cosine, sine = self.add_bounded_variable(angle.cos(), lower=0.0), self.add_bounded_variable(angle.sin())
        self.add_row(self.add(sine, self.multiply(t, cosine), -1.0), 0.0, 0.0)
        self.add_row(self.add(self.square(sine), self.square(cosine), 1.0), 1.0, 1.0)
        return cosine, sine

    def add_arctangent(self, t: Term) -> Term:
        """Add an angle, tied by its sine and cosine to its tangent."""
        angle = self.add_bounded_variable(t.ball.atan())
        for part, name in zip(self.remember("circle", t, self.add_circle_point), ("cos", "sin"), strict=True):
            self.add_equation(part.expression, getattr(self.scip, name)(angle.expression))
        return Term(angle.expression, 1, angle.ball, angle.size, tangent=t)

    def tangent(self, a: Term) -> Term:
        if a.tangent is not None:
            return a.tangent
        return self.divide(self.apply("sin", a), self.apply("cos", a))

    def add_inverse(self, a: Term, name: str, inverse: str) -> Term:
        """Add an angle with a given sine or cosine."""
        ends = (-math.pi / 2, math.pi / 2) if name == "sin" else (0.0, math.pi)
        enclosure = _RANGES[inverse](a.ball)
        angle = self.add_bounded_variable(enclosure) if enclosure.is_finite() else self.add_variable(*ends)
        self.add_equation(self.as_affine(a).expression, getattr(self.scip, name)(angle.expression))
        return angle

    def absolute(self, a: Term) -> Term:
        """|a|."""
        a = self.as_affine(a)
        lower, upper = a.ends
        if lower >= 0 or upper <= 0:
            return self.scale_by(a, 1.0 if lower >= 0 else -1.0)
        v = self.add_bounded_variable(abs(a.ball), lower=0.0)
        self.add_equation(v.expression, abs(a.expression), v.scale)
        return v

    def take_extreme(self, a: Term, b: Term, half: float) -> Term:
        """(a + b)/2 + half · |a − b|: the greater for half = 1/2, the lesser for −1/2."""
        middle = self.scale_by(self.add(a, b, 1.0), 0.5)
        return self.add(middle, self.scale_by(self.absolute(self.add(a, b, -1.0)), half), 1.0)

    def mark_impossible(self) -> Term:
        """Mark the NLP as infeasible, since no design has a value."""
        self.is_impossible = True
        return _constant(0.0)


def _constant(value: float) -> Term:
    if math.isfinite(value) and abs(value) > _MAX_NUMBER:
        raise UnsupportedOperation(f"numbers beyond {_MAX_NUMBER:g}")
    return Term(float(value), 0, flint.arb(value), abs(float(value)))


def _check_size(enclosure: Any, name: str, limit: float = _MAX_NUMBER) -> None:
    if enclosure.is_finite() and max(map(abs, interval(enclosure))) > limit:
        raise UnsupportedOperation(f"{name} of numbers beyond {limit:g}")


def _scale_of(size: float) -> float:
    """The power of two that scales a variable or row of at most this size."""
    if not (math.isfinite(size) and size > 0):
        return 1.0
    return float(2.0 ** min(max(math.ceil(math.log2(size)), _MIN_POWER), 0))
