"""The elementwise formulas of polynomials, traced, as JavaScript functions: they have no second home.

The names `where` and `one` mean something else in these functions. Those of quartics are taken from
`tmsopt.roots.quartics`; the conditions of stability of the lower degrees from `lienard_chipart`.
"""

import operator
from collections.abc import Callable, Sequence
from functools import partial, reduce
from types import FunctionType, SimpleNamespace
from typing import Any

from tmsopt.algebra.formula import make_node, trace
from tmsopt.explorer.javascript import function
from tmsopt.roots import lienard_chipart
from tmsopt.roots.numeric import GOOD
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
        _trace_function("factorAbscissa", ["p", "q"], lambda p, q: [_OF.abscissa(p, q)]),
        _trace_function("factorDamping", ["p", "q"], lambda p, q: [_OF.damping_ratio(p, q)]),
        _trace_function("factorRoots", ["p", "q"], _OF.root_pair, "z"),
    ]
    if degree <= _QUARTIC:
        is_stable = _OF.stable if degree == _QUARTIC else _is_stable
        parts.append(_trace_function("stableBySigns", a, lambda *c: [is_stable(*c)]))
    if degree == _QUARTIC:
        rules = f"good: {GOOD}, accepted: {quartic.ACCEPTED}, steps: {quartic.STEPS}"
        parts += [
            f"const QUARTIC = {{{rules}}};",
            _trace_function("quarticClass", a, _pack_classes),
            _trace_function("quarticStart", a, _start_roots, "f"),
            _trace_function("quarticStep", ["b1", "b2", "b3", "b4", "p1", "q1", "p2", "q2"], _step_roots, "g"),
        ]
    return "\n".join(parts) + "\n"


_where = partial(make_node, "choose")
_KNOWN: dict[str, Any] = {**vars(factors), **vars(signs)}
for _name, _each in [*_KNOWN.items()]:
    if isinstance(_each, FunctionType):
        _KNOWN[_name] = FunctionType(_each.__code__, _KNOWN, _name)  # so that each calls the others here
_KNOWN |= {"where": _where, "one": lambda condition: _where(condition, 1, 0)}
_OF = SimpleNamespace(**_KNOWN)


def _start_roots(*a: Any) -> Sequence[Any]:
    monic = _OF.monic(*a)
    found = _OF.start(*monic)
    return [*monic, *found, _OF.error(*monic, *found)]


def _step_roots(*given: Any) -> list[Any]:
    found = _OF.newton(*given)
    return [*found, _OF.error(*given[:4], *found)]


def _pack_classes(*a: Any) -> list[Any]:
    kind, count, doubtful = _OF.classes(*a)
    return [_where(doubtful, 64.0, kind + 8.0 * count)]


def _is_stable(*c: Any) -> Any:
    """As `tmsopt.roots.is_stable` up to degree 4: the signs of the rounded conditions."""
    up, down = c[0] > 0.0, c[0] < 0.0
    sign = _where(up, 1.0, -1.0)
    conditions = (condition > 0.0 for condition in lienard_chipart([sign * x for x in c]))
    return reduce(operator.and_, conditions, up | down)


def _trace_function(name: str, arguments: Sequence[str], compute: Callable[..., Sequence[Any]], into: str = "") -> str:
    traced = trace(lambda x: compute(*x.values()), arguments)
    taken = [*arguments, into] if into else arguments
    return function(f"function {name}", taken, traced, {n: n for n in arguments}, fills=bool(into))
