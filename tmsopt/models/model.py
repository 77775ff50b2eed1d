"""A model as data: named parameters, derived quantities, and a characteristic polynomial in them."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

Formula = Callable[[Mapping[str, Any]], Any]


@dataclass(frozen=True)
class Range:
    """An interval of physically possible values; an end that is not closed is excluded."""

    lower: float = -np.inf
    upper: float = np.inf
    closed: bool = True

    def __contains__(self, value: float) -> bool:
        if self.closed:
            return self.lower <= value <= self.upper
        return self.lower < value < self.upper

    def __str__(self) -> str:
        at_most, at_least = ("<=", ">=") if self.closed else ("<", ">")
        ends = []
        if np.isfinite(self.lower):
            ends.append(f"{at_least} {self.lower:.6g}")
        if np.isfinite(self.upper):
            ends.append(f"{at_most} {self.upper:.6g}")
        return " and ".join(ends) or "any finite number"


@dataclass(frozen=True)
class Parameter:
    """A named number that a user fixes or frees.

    Attributes:
        name: symbol as written in files, e.g. ``chi_B``.
        unit: SI unit, ``1`` when dimensionless.
        meaning: one phrase.
        latex: symbol for figures.
        range: physically possible values.
    """

    name: str
    unit: str
    meaning: str
    latex: str
    range: Range = Range()


@dataclass(frozen=True)
class Quantity:
    """A number derived from the parameters.

    Attributes:
        value: the quantity for given values (of parameters and other quantities); nan where it does not exist.
        equation: an expression without division or radical, of the values and the quantity x itself, that is 0
            exactly when x is the quantity, within `range`. An optimiser then carries x as a variable.
    """

    name: str
    unit: str
    meaning: str
    latex: str
    value: Formula
    equation: Callable[[Mapping[str, Any], Any], Any] | None = None
    range: Range = Range()


@dataclass(frozen=True)
class ParameterSet:
    """One of the ways to write down a design of a model.

    Attributes:
        native: the model's native parameters for given values of this set.
        quantities: derived quantities that only this set has.
    """

    name: str
    parameters: tuple[Parameter, ...]
    native: Callable[[Mapping[str, Any]], dict[str, Any]]
    quantities: tuple[Quantity, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the documentation."""
        return tuple(p.name for p in self.parameters)

    def __getitem__(self, name: str) -> Parameter:
        return next(p for p in self.parameters if p.name == name)


@dataclass(frozen=True)
class Model:
    """A dissipative system by its characteristic polynomial.

    Attributes:
        sets: parameter sets; the first is the native one.
        algebraic: native parameters → the numbers in which the coefficients are polynomials.
        polynomial: algebraic parameters → coefficients, descending, by ``+ - *`` alone.
        quantities: derived quantities, besides the coefficients ``a0 …``.
    """

    name: str
    title: str
    degree: int
    sets: tuple[ParameterSet, ...]
    algebraic: Callable[[Mapping[str, Any]], dict[str, Any]]
    polynomial: Callable[..., list[Any]]
    quantities: tuple[Quantity, ...] = ()

    def coefficients(self, parameters: Mapping[str, Any], of: ParameterSet | None = None) -> list[Any]:
        """Coefficients a0 … aₙ, descending, for values of any kind: floats, arrays, CasADi, balls."""
        native = (of or self.sets[0]).native(parameters)
        return self.polynomial(**self.algebraic(native))

    def coefficient_names(self) -> tuple[str, ...]:
        """``a0 … an``."""
        return tuple(f"a{k}" for k in range(self.degree + 1))

    def quantity_names(self, of: ParameterSet) -> tuple[str, ...]:
        """Everything that an expression may use beside the parameters of a set and the root quantities."""
        native = () if of is self.sets[0] else self.sets[0].names
        derived = tuple(q.name for q in (*self.quantities, *of.quantities))
        return tuple(n for n in (*native, *self.coefficient_names(), *derived) if n not in of.names)

    def parameter_set(self, name: str) -> ParameterSet:
        """The parameter set of that name."""
        return next(s for s in self.sets if s.name == name)


class Values(Mapping[str, Any]):
    """Parameters of a design and everything derived from them, computed when first asked for.

    Args:
        parameters: a value for every parameter of the set `of`.
        given: further names with their values, which take precedence over formulas.
        lift: called for a quantity that has an equation; returns the variable that stands for it.
    """

    def __init__(
        self,
        model: Model,
        of: ParameterSet,
        parameters: Mapping[str, Any],
        given: Mapping[str, Any] | None = None,
        lift: Callable[[Quantity, Mapping[str, Any]], Any] | None = None,
    ) -> None:
        native = of.native(parameters)
        coefficients = model.polynomial(**model.algebraic(native))
        self._known = (
            {**native, **dict(zip(model.coefficient_names(), coefficients, strict=True))}
            | dict(parameters)
            | dict(given or {})
        )
        self._formulas = {q.name: q for q in (*model.quantities, *of.quantities)}
        self._lift = lift

    def __getitem__(self, name: str) -> Any:
        if name not in self._known:
            quantity = self._formulas[name]
            if quantity.equation is not None and self._lift is not None:
                self._known[name] = self._lift(quantity, self)
            else:
                self._known[name] = quantity.value(self)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._known, *self._formulas)))

    def __len__(self) -> int:
        return len(dict.fromkeys((*self._known, *self._formulas)))
