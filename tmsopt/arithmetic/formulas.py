"""Formulas in named symbols, for numbers of any kind: floats, arrays, CasADi expressions, balls."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.arithmetic.elementary import is_ball, is_symbolic
from tmsopt.arithmetic.operations import ARRAYS, BALLS
from tmsopt.arithmetic.walk import walk


@dataclass(frozen=True)
class Formulas:
    """Expressions of CasADi, the same for every kind of number.

    Attributes:
        names: of the symbols.
        function: one vector, an entry for each name → one vector, an entry for each formula.
    """

    names: tuple[str, ...]
    function: ca.Function

    def __call__(self, values: Mapping[str, Any]) -> list[Any]:
        """The value of each formula; floats give nan and inf where a formula has no value, without a warning."""
        given = [values[name] for name in self.names]
        if any(is_symbolic(x) for x in given):
            found = self.function(ca.vertcat(*given))
            return [found[k] for k in range(found.numel())]
        if any(is_ball(x) for x in given):
            return walk(self.function, given, BALLS)[0]
        if all(np.ndim(x) == 0 for x in given):
            return list(np.array(self.function(given)).ravel())
        with np.errstate(all="ignore"):
            return walk(self.function, [np.asarray(x, dtype=float)[()] for x in given], ARRAYS)[0]


def formulas(expressions: Sequence[Any], names: Sequence[str]) -> Formulas:
    """Formulas from CasADi expressions or numbers, in symbols of these names."""
    column = ca.vertcat(*[ca.SX(e) for e in expressions])
    known = {x.name(): x for x in ca.symvar(column)}
    symbols = [known.get(name, ca.SX.sym(name)) for name in names]
    function = ca.Function("formulas", [ca.vertcat(*symbols) if symbols else ca.SX(0, 1)], [ca.densify(column)])
    return Formulas(tuple(names), function)
