"""The elementwise formulas of polynomials, run on traced numbers, as JavaScript functions: they have no second home.

The names `where` and `one` mean something else in these functions. Those of quartics are taken from
`tmsopt.roots.quartics`; the conditions of stability of the lower degrees from `lienard_chipart`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np

from tmsopt.explorer import javascript as js
from tmsopt.explorer.javascript import Spelling, Step
from tmsopt.roots import lienard_chipart
from tmsopt.roots.quartics import factors, quartic, signs

_QUARTIC = 4


def kernel_script(degree: int) -> str:
    """JavaScript functions for polynomials of a degree; arrays are filled, so that nothing is allocated.

    ``factorAbscissa(p, q)``, ``factorDamping(p, q)`` and ``factorRoots(p, q, z)``, real and imaginary parts, of
    s² + p s + q. Up to degree 4 ``stableBySigns(a0, …)``. Of quartics ``quarticStart(a0, …, f)``, which fills in
    b1 … b4, p1, q1, p2, q2 and the backward error; ``quarticStep(b1, …, q2, g)``, new factors and their error;
    ``quarticClass(a0, …)``, the code + 8 × the number of real roots, 64 where a sign is in doubt.
    """
    a = [f"a{k}" for k in range(degree + 1)]
    parts = [
        _traced("factorAbscissa", ["p", "q"], lambda p, q: [_OF.abscissa(p, q)]),
        _traced("factorDamping", ["p", "q"], lambda p, q: [_OF.damping_ratio(p, q)]),
        _traced("factorRoots", ["p", "q"], _parts_of_pair, "z"),
    ]
    if degree < _QUARTIC:
        parts.append(_traced("stableBySigns", a, lambda *c: [_stable(c)]))
    if degree == _QUARTIC:
        rules = f"good: {quartic.GOOD}, accepted: {quartic.ACCEPTED}, steps: {quartic.STEPS}"
        b = ["b1", "b2", "b3", "b4", "p1", "q1", "p2", "q2"]
        parts += [
            f"const QUARTIC = {{{rules}}};",
            _traced("stableBySigns", a, lambda *c: [_OF.stable(*c)]),
            _traced("quarticClass", a, _packed),
            _traced("quarticStart", a, _started, "f"),
            _traced("quarticStep", b, _stepped, "g"),
        ]
    return "\n".join(parts) + "\n"


@dataclass
class _Tape:
    """Steps in the order in which they were taken, each once."""

    steps: list[Step] = field(default_factory=list)
    places: dict[Step, int] = field(default_factory=dict)

    def add(self, spelling: Spelling, *operands: "_Traced | float") -> "_Traced":
        step = Step(spelling, tuple(self.constant(o).place for o in operands))
        if step not in self.places:
            self.places[step] = len(self.steps)
            self.steps.append(step)
        return _Traced(self, self.places[step], spelling.truth)

    def constant(self, value: "_Traced | float") -> "_Traced":
        return value if isinstance(value, _Traced) else self.add(js.number(float(value)))


def _binary(spelling: Spelling, truths: Spelling | None = None) -> Any:
    def forward(self: "_Traced", other: Any) -> Any:
        if isinstance(other, _Pair):
            return NotImplemented
        return self.tape.add(truths if truths and self.truth else spelling, self, other)

    return forward


def _reflected(spelling: Spelling) -> Any:
    return lambda self, other: self.tape.add(spelling, other, self)


_FUNCTIONS = {
    np.sqrt: js.call("sqrt"),
    np.abs: js.call("abs"),
    np.absolute: js.call("abs"),
    np.maximum: js.call("max", 2),
    np.minimum: js.call("min", 2),
    np.cbrt: js.call("cbrt"),
}


@dataclass(frozen=True, eq=False)
class _Traced:
    """A number, or a truth, that is known when the page runs."""

    tape: _Tape
    place: int
    truth: bool = False

    __add__, __radd__ = _binary(js.ADD), _reflected(js.ADD)
    __sub__, __rsub__ = _binary(js.SUBTRACT), _reflected(js.SUBTRACT)
    __mul__, __truediv__ = _binary(js.MULTIPLY), _binary(js.DIVIDE)
    __rtruediv__ = _reflected(js.DIVIDE)
    __lt__, __le__ = _binary(js.LESS), _binary(js.AT_MOST)
    __gt__, __ge__ = _reflected(js.LESS), _reflected(js.AT_MOST)
    __eq__, __ne__ = _binary(js.EQUAL, js.SAME), _binary(js.UNEQUAL, js.DIFFERENT)
    __and__, __or__ = _binary(js.AND), _binary(js.OR)
    __hash__ = object.__hash__

    def __neg__(self) -> "_Traced":
        return self.tape.add(js.NEGATE, self)

    def __invert__(self) -> "_Traced":
        return self.tape.add(js.NOT, self)

    def __rmul__(self, other: Any) -> Any:
        if isinstance(other, complex):
            assert other == 1j
            return _Pair(self.tape.constant(0.0), self)
        return self.tape.add(js.MULTIPLY, other, self)

    def __array_ufunc__(self, function: Any, method: str, *given: Any) -> Any:
        return self.tape.add(_FUNCTIONS[function], *given)


@dataclass(frozen=True)
class _Pair:
    """A complex number: its real and imaginary part."""

    re: _Traced
    im: _Traced

    def __radd__(self, other: _Traced) -> "_Pair":
        return _Pair(other, self.im)

    def __rsub__(self, other: _Traced) -> "_Pair":
        return _Pair(other, -self.im)


def _where(condition: _Traced, yes: Any, no: Any) -> Any:
    if isinstance(yes, _Pair):
        return _Pair(_where(condition, yes.re, no), _where(condition, yes.im, 0.0))
    return condition.tape.add(js.CHOOSE, condition, yes, no)


def _as_integer(condition: _Traced) -> _Traced:
    return condition.tape.add(js.CHOOSE, condition, 1.0, 0.0)


_KNOWN: dict[str, Any] = {"where": _where, "one": _as_integer}
for _each in (
    factors.ordered,
    factors.largest_root,
    factors.monic,
    factors.start,
    factors.error,
    factors.newton,
    factors.abscissa,
    factors.damping_ratio,
    factors.root_pair,
    signs.stable,
    signs.classes,
):  # each uses only those before it
    _KNOWN[_each.__name__] = FunctionType(_each.__code__, {**_each.__globals__, **_KNOWN}, _each.__name__)
_OF = SimpleNamespace(**_KNOWN)


def _started(*a: Any) -> list[Any]:
    monic = _OF.monic(*a)
    found = _OF.start(*monic)
    return [*monic, *found, _OF.error(*monic, *found)]


def _stepped(*given: Any) -> list[Any]:
    found = _OF.newton(*given)
    return [*found, _OF.error(*given[:4], *found)]


def _packed(*a: Any) -> list[Any]:
    kind, count, doubtful = _OF.classes(*a)
    return [_where(doubtful, 64.0, kind + 8.0 * count)]


def _parts_of_pair(p: Any, q: Any) -> list[Any]:
    first, second = _OF.root_pair(p, q)
    return [first.re, first.im, second.re, second.im]


def _stable(c: Sequence[Any]) -> Any:
    """As `tmsopt.roots.is_stable` up to degree 4: the signs of the rounded conditions."""
    up, down = c[0] > 0.0, c[0] < 0.0
    sign = _where(up, 1.0, -1.0)
    held = up | down
    for condition in lienard_chipart([sign * x for x in c]):
        held = held & (condition > 0.0)
    return held


def _traced(name: str, arguments: Sequence[str], formula: Callable[..., list[Any]], into: str = "") -> str:
    tape = _Tape()
    results = formula(*(tape.add(Spelling(n)) for n in arguments))
    places = [tape.constant(r).place for r in results]
    taken = [*arguments, into] if into else arguments
    return js.function(f"function {name}", taken, tape.steps, places, fills=bool(into))
