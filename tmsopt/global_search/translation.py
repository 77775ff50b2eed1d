"""An NLP as factorable polynomial equations for SCIP.

Every product of two expressions that are not affine gets a variable, and so does every expression that is used twice:
what the formula shares, the relaxation shares. Quotients, radicals and arctangents become equations without them.
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
"""SCIP's feasibility tolerance: rows may be off by so much."""

_LEAST_POWER = -60  # of two, of a scale: what is smaller is as good as 0
_HUGE = 1e15  # beyond which numbers are left to nobody: from 1e20 SCIP takes them for infinite
_LARGE = 1e3  # numbers up to which a coefficient below 1e-9 counts for nothing: SCIP drops it
_WHOLE = 1000  # exponent up to which a power is taken

_OVER = INTERVALS.operations

_CANCELLED = 2.0**-10
"""Of the largest summand: rows are not scaled by less, lest they be held to less than a rounding."""


@dataclass(frozen=True)
class Term:
    """A result on the way: an expression of SCIP with its degree and range.

    Attributes:
        expression: a number where it is constant.
        degree: 0, 1 or 2.
        ball: its range.
        size: bound on its summands, which may cancel.
        tangent: what it is the arctangent of.
        symbol, scale: of a variable, which is the expression divided by its scale.
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
        return interval(self.ball) if self.degree else (self.expression, self.expression)

    @property
    def unit(self) -> float:
        """What a row of it is divided by to be about 1, a power of two; never more than 1."""
        return max(_scale_of(max(map(abs, self.ends))), min(_CANCELLED * _scale_of(self.size), 1.0))


class Translation:
    """The SCIP model of an NLP; discarded once it is solved.

    Attributes:
        model: of pyscipopt; its objective is not set.
        x: the variables of the NLP, each a variable of SCIP times its scale.
        objective: expression to minimise.
        impossible: whether a row without any variable is violated.
    """

    def __init__(self, nlp: NLP) -> None:
        """Translate an NLP.

        Raises:
            UnsupportedOperation: for an operation that cannot be written for SCIP.
        """
        import pyscipopt

        self.functions = pyscipopt
        self.model = pyscipopt.Model()
        self.model.hideOutput()
        self.count = 0
        self.impossible = False
        self.known: dict[tuple[str, int], tuple[Term, Any]] = {}
        self.x = [self.free(*ends) for ends in zip(nlp.lower, nlp.upper, strict=True)]
        objective, *rows = nlp.fold(self.x, self.kind(), self.variable)
        for row, lower, upper in zip(rows, nlp.row_lower, nlp.row_upper, strict=True):
            self.between(row, lower, upper)
        self.objective = self.variable(objective).expression

    def free(self, lower: float, upper: float, over: Any = None) -> Term:
        """A variable, scaled by a power of two to about 1."""
        scale = _scale_of(max(abs(lower), abs(upper)))
        ends = [e / scale if math.isfinite(e) else None for e in (lower, upper)]
        self.count += 1
        symbol = self.model.addVar(f"v{self.count}", lb=ends[0], ub=ends[1])
        over = ball((lower, upper)) if over is None else over
        return Term(scale * symbol, 1, over, max(abs(lower), abs(upper)), symbol=symbol, scale=scale)

    def defined(self, over: Any, lower: float = -math.inf) -> Term:
        """A variable for something with a known range."""
        ends = interval(over)
        return self.free(max(ends[0], lower), ends[1], over)

    def variable(self, term: Term) -> Term:
        """The same, at most affine: what is of degree 2 gets a variable, once."""
        found: Term = term if term.degree < 2 else self.once("variable", term, self.replaced)
        return found

    def replaced(self, term: Term) -> Term:
        """A variable that is equal to a term."""
        new = self.defined(term.ball)
        self.between(Term(new.expression - term.expression, 2, term.ball, term.size), 0.0, 0.0)
        return new

    def once(self, name: str, term: Term, make: Callable[[Term], Any]) -> Any:
        """What is made of a term, the same for each of its uses; the term is kept, lest another get its id."""
        if (name, id(term)) not in self.known:
            self.known[name, id(term)] = term, make(term)
        return self.known[name, id(term)][1]

    def equal(self, left: Any, right: Any, size: float = 1.0) -> None:
        """An equation between expressions about as large as `size`."""
        self.model.addCons(left / size == right / size)

    def between(self, term: Term, lower: float, upper: float) -> None:
        """A row, scaled to about 1."""
        if term.degree == 0:
            self.impossible |= not lower - FEASIBILITY <= term.expression <= upper + FEASIBILITY
            return
        size = term.unit
        if lower == upper:
            return self.equal(term.expression, lower, size)
        if math.isfinite(lower):
            self.model.addCons(term.expression / size >= lower / size)
        if math.isfinite(upper):
            self.model.addCons(term.expression / size <= upper / size)

    def kind(self) -> Kind:
        """Terms as numbers of a formula."""
        return Kind(
            {
                "add": lambda a, b: self.sum(a, b, 1.0),
                "sub": lambda a, b: self.sum(a, b, -1.0),
                "neg": lambda a: self.times(a, -1.0),
                "mul": self.product,
                "square": self.square,
                "div": self.quotient,
                "quotient": self.quotient,
                "ratio": self.ratio,
                "sqrt": self.root,
                "pow": self.power,
                "tan": self.tangent,
                "atan": lambda a: self.once("angle", self.variable(a), self.arctangent),
                "asin": lambda a: self.inverse(a, "sin", "asin"),
                "acos": lambda a: self.inverse(a, "cos", "acos"),
                "abs": self.size,
                "max": lambda a, b: self.extreme(a, b, 0.5),
                "min": lambda a, b: self.extreme(a, b, -0.5),
                **{name: partial(self.applied, name) for name in ("exp", "log", "sin", "cos")},
            },
            lambda value: _constant(float(as_double(value))),
        )

    def sum(self, a: Term, b: Term, sign: float) -> Term:
        over = a.ball + sign * b.ball
        return Term(a.expression + sign * b.expression, max(a.degree, b.degree), over, max(a.size, b.size))

    def times(self, a: Term, factor: float) -> Term:
        if 0 < abs(factor) < FEASIBILITY:
            _refuse_huge(a.ball, "a small multiple", _LARGE)
        return Term(factor * a.expression, a.degree, factor * a.ball, abs(factor) * a.size)

    def product(self, a: Term, b: Term) -> Term:
        for fixed, other in ((a, b), (b, a)):
            if fixed.degree == 0:
                return self.times(other, fixed.expression)
        a, b = self.variable(a), self.variable(b)
        return Term(a.expression * b.expression, 2, a.ball * b.ball, a.size * b.size)

    def square(self, a: Term) -> Term:
        return replace(self.product(a, a), ball=_OVER["square"](a.ball))

    def quotient(self, a: Term, b: Term) -> Term:
        """q with q b = a; where b may vanish, of any size."""
        if b.degree == 0:
            return self.times(a, 1 / b.expression) if b.expression else self.undefined()
        b = self.variable(b)
        q = self.defined(a.ball / b.ball)
        self.between(Term(q.expression * b.expression - a.expression, 2, a.ball, a.size), 0.0, 0.0)
        return q

    def ratio(self, a: Term, b: Term) -> Term:
        """The same, which leaves 0/0 open; where b is 0 throughout, a/b is 0 or does not exist."""
        if b.degree == 0 and not b.expression:
            raise UnsupportedOperation("a ratio to 0")
        return self.quotient(a, b)

    def root(self, a: Term) -> Term:
        """r ≥ 0 with r² = a."""
        least, most = (max(e, 0.0) for e in a.ends)
        self.impossible |= a.ends[1] < 0
        r = self.free(math.nextafter(math.sqrt(least), 0), math.nextafter(math.sqrt(most), math.inf))
        self.between(Term(r.expression * r.expression - a.expression, 2, a.ball, a.size), 0.0, 0.0)
        return r

    def power(self, a: Term, b: Term) -> Term:
        if b.degree > 0:  # a^b = exp(b log a), where a cannot be 0, nor negative with a b that is whole
            if not a.ends[0] > 0:
                raise UnsupportedOperation("a power with a variable exponent of what may be 0 or negative")
            return self.applied("exp", self.product(b, self.applied("log", a)))
        exponent = b.expression
        if exponent == 0.5:
            return self.root(a)
        if abs(exponent) > _WHOLE:
            raise UnsupportedOperation(f"a power with an exponent beyond {_WHOLE}")
        if exponent != int(exponent) and a.degree > 0 and a.ball.is_finite():
            _refuse_huge(_OVER["pow"](a.ball, b.ball), "a power")
        if exponent < 0:
            return self.quotient(_constant(1.0), self.power(a, _constant(-exponent)))
        if exponent != int(exponent):
            return self.fractional(a, exponent)
        if exponent == 0:
            return _constant(1.0)
        half = self.power(a, _constant(exponent // 2)) if exponent > 1 else _constant(1.0)
        even = self.square(half) if exponent > 1 else half
        return self.product(even, a) if exponent % 2 else even

    def fractional(self, a: Term, exponent: float) -> Term:
        """a ≥ 0 to a positive power, 0 included."""
        least, most = (max(e, 0.0) for e in a.ends)
        self.impossible |= a.ends[1] < 0
        a = self.variable(a)
        power = flint.arb(exponent)
        low, high = (flint.arb(e) ** power if math.isfinite(e) else flint.arb("inf") for e in (least, most))
        v = self.free(max(interval(low)[0], 0.0), interval(high)[1])
        self.equal(v.expression, a.expression**exponent, v.scale)
        return v

    def applied(self, name: str, a: Term) -> Term:
        """A function that SCIP has; of a number where that is the base of a power."""
        if a.degree == 0:
            return _constant(getattr(math, name)(a.expression))
        if name == "exp":
            _refuse_huge(_OVER[name](a.ball), "exp")
        if a.tangent is not None and name in ("sin", "cos"):
            part: Term = self.once("circle", a.tangent, self.on_circle)[name == "sin"]
            return part
        a = self.variable(a)
        v = self.defined(_OVER[name](a.ball))
        if name == "log":  # SCIP keeps the argument of its own away from 0
            self.equal(a.expression, self.functions.exp(v.expression), a.scale)
        else:
            # Others than exp are as small as their argument is known.
            size = v.scale if name == "exp" else max(v.scale, _CANCELLED)
            self.equal(v.expression, getattr(self.functions, name)(a.expression), size)
        return v

    def on_circle(self, t: Term) -> tuple[Term, Term]:
        """Cosine and sine of the arctangent of t: C > 0, S = t C, C² + S² = 1."""
        angle = t.ball.atan()
        cosine, sine = self.defined(angle.cos(), lower=0.0), self.defined(angle.sin())
        self.between(self.sum(sine, self.product(t, cosine), -1.0), 0.0, 0.0)
        self.between(self.sum(self.square(sine), self.square(cosine), 1.0), 1.0, 1.0)
        return cosine, sine

    def arctangent(self, t: Term) -> Term:
        """An angle, its sine and cosine through its tangent."""
        angle = self.defined(t.ball.atan())
        for part, name in zip(self.once("circle", t, self.on_circle), ("cos", "sin"), strict=True):
            self.equal(part.expression, getattr(self.functions, name)(angle.expression))
        return Term(angle.expression, 1, angle.ball, angle.size, tangent=t)

    def tangent(self, a: Term) -> Term:
        if a.tangent is not None:
            return a.tangent
        return self.quotient(self.applied("sin", a), self.applied("cos", a))

    def inverse(self, a: Term, name: str, inverse: str) -> Term:
        """An angle whose sine or cosine is given."""
        ends = (-math.pi / 2, math.pi / 2) if name == "sin" else (0.0, math.pi)
        over = _OVER[inverse](a.ball)
        angle = self.defined(over) if over.is_finite() else self.free(*ends)
        self.equal(self.variable(a).expression, getattr(self.functions, name)(angle.expression))
        return angle

    def size(self, a: Term) -> Term:
        """|a|, which SCIP has."""
        a = self.variable(a)
        lower, upper = a.ends
        if lower >= 0 or upper <= 0:
            return self.times(a, 1.0 if lower >= 0 else -1.0)
        v = self.defined(abs(a.ball), lower=0.0)
        self.equal(v.expression, abs(a.expression), v.scale)
        return v

    def extreme(self, a: Term, b: Term, half: float) -> Term:
        """The greater of two, for half 1/2, or the lesser, for −1/2: (a + b)/2 ± |a − b|/2."""
        middle = self.times(self.sum(a, b, 1.0), 0.5)
        return self.sum(middle, self.times(self.size(self.sum(a, b, -1.0)), half), 1.0)

    def undefined(self) -> Term:
        """What does not exist, for any design."""
        self.impossible = True
        return _constant(0.0)


def _constant(value: float) -> Term:
    if math.isfinite(value) and abs(value) > _HUGE:
        raise UnsupportedOperation(f"numbers beyond {_HUGE:g}")
    return Term(float(value), 0, flint.arb(value), abs(float(value)))


def _refuse_huge(over: Any, name: str, most: float = _HUGE) -> None:
    if over.is_finite() and max(map(abs, interval(over))) > most:
        raise UnsupportedOperation(f"{name} of numbers beyond {most:g}")


def _scale_of(size: float) -> float:
    """What to divide a variable or row by that is at most so large."""
    if not (math.isfinite(size) and size > 0):
        return 1.0
    return float(2.0 ** min(max(math.ceil(math.log2(size)), _LEAST_POWER), 0))
