"""Formulas in named symbols, for numbers of any kind: floats, arrays, CasADi expressions, balls."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import casadi as ca
import numpy as np

from tmsopt.algebra.elementary import is_ball, is_symbolic
from tmsopt.algebra.operations import ARRAYS, BALLS
from tmsopt.algebra.walk import walk


class Constant(Protocol):
    """A number, such as 8/3 or √2."""

    @property
    def text(self) -> str:
        """As it is written."""

    def enclosure(self, values: Mapping[str, Any]) -> Any:
        """The number as a fraction, or as a ball of the working precision; `values` are none."""


@dataclass(frozen=True)
class Formulas:
    """Expressions of CasADi, the same for every kind of number.

    CasADi keeps numbers as doubles, and folds them. So numbers are arguments of the function, given as doubles to what
    computes in doubles, and exactly to balls.

    Attributes:
        names: of the symbols.
        exact: one vector, an entry for each name and for each constant → one vector, an entry for each formula.
        constants: numbers in them.
    """

    names: tuple[str, ...]
    exact: ca.Function
    constants: tuple[Constant, ...] = ()

    @cached_property
    def function(self) -> ca.Function:
        """The same with constants as doubles: one vector, an entry for each name → one vector."""
        x = ca.SX.sym("x", len(self.names))
        return ca.Function("formulas", [x], [self.exact(ca.vertcat(x, *map(float, self.numbers())))])

    def numbers(self) -> list[Any]:
        """The constants as fractions, or as balls of the working precision."""
        return [constant.enclosure({}) for constant in self.constants]

    def __call__(self, values: Mapping[str, Any]) -> list[Any]:
        """The value of each formula; floats give nan and inf where a formula has no value, without a warning."""
        given = [values[name] for name in self.names]
        if any(is_symbolic(x) for x in given):
            found = self.function(ca.vertcat(*given))
            return [found[k] for k in range(found.numel())]
        if any(is_ball(x) for x in given):
            return walk(self.exact, [*given, *self.numbers()], BALLS)[0]
        if all(np.ndim(x) == 0 for x in given):
            return list(np.array(self.function(given)).ravel())
        with np.errstate(all="ignore"):
            return walk(self.function, [np.asarray(x, dtype=float)[()] for x in given], ARRAYS)[0]
