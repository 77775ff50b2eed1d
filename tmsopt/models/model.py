"""A model as data: named parameters, derived quantities, and a characteristic polynomial in them."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from pkgutil import resolve_name
from types import MappingProxyType
from typing import Any, SupportsIndex

import flint
import numpy as np

from tmsopt.algebra.balls import as_ball
from tmsopt.algebra.formula import Formula, fold, formula, symbol
from tmsopt.algebra.kinds import BALLS, kind_of
from tmsopt.records import Table

_BITS = 106  # the parameters' own roundings are all that widens a ball
_EPSILON = 2.0**-53
_NOTHING = 1e-9  # of a range
_PAGE = 3000  # characters of a formula in LaTeX

Computed = Callable[[Mapping[str, Any]], Any]
"""A number of named ones, by ``+ - * /`` and the operations of `tmsopt.algebra.kinds`: stated once, and traced."""

Matrix = list[list[Any]]
"""Rows of any numbers."""

ROOTS = ("abscissa", "damping_ratio", "angular_frequency")
"""What quantities may say of the roots."""


@dataclass(frozen=True)
class Feedback:
    """Torques that a controller adds to M q″ + D q′ + K q, q = (lean, steer), in the model's own units.

    Attributes:
        mass: M.
        gains: G of the torques −G (φ, δ, φ̇, δ̇), rows for lean and steer.
        lag: time constant of the actuators; None for torques without delay. With it the states are those four and the
            torque of each row that may be driven, lean before steer.
        driven: those rows: 0 for lean, 1 for steer.
    """

    mass: Matrix
    gains: Matrix
    lag: Any = None
    driven: tuple[int, ...] = (1,)


@dataclass(frozen=True)
class Range:
    """An interval of physically possible values; an end that is not closed is excluded.

    Example:
        >>> positive = tmsopt.models.Range(0, closed=False)
        >>> str(positive), 0 in positive
        ('> 0', False)

    More: docs/reference/problem_file.md
    """

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
        default: value of a parameter that is left out, if it may be.
        tangent: whether the coefficients are polynomial in the tangent, so that an optimiser moves that.
        multiple_of: unit of the scale that a dimensionless parameter is a multiple of, e.g. ``m`` for wheelbases.
        sides: names of the designs with a negative and a positive value, where these are searched separately.
        counterpart: of one in SI, the dimensionless parameter that it gives, where that has another name.

    Example:
        >>> tilt = tmsopt.models.tms.sets[0]["lambda_s"]
        >>> tilt.unit, tilt.tangent, 1.6 in tilt.range  # less than a right angle
        ('rad', True, False)

    More: docs/reference/quantities.md
    """

    name: str
    unit: str
    meaning: str
    latex: str
    range: Range = Range()
    default: float | None = None
    tangent: bool = False
    multiple_of: str = ""
    sides: tuple[str, str] | None = None
    counterpart: str = ""

    def may_change(self, value: float) -> bool:
        """Whether a builder may get it wrong: no constant of nature, nor something that a design does not have."""
        return self.default is None or (self.default == 0 and value != 0)


@dataclass(frozen=True)
class Quantity:
    """A number derived from the parameters.

    Attributes:
        value: the quantity for given values (of parameters and other quantities); nan where it does not exist.
        equation: an expression without division or radical, of the values and the quantity x itself, that is 0
            exactly when x is the quantity, within `range`. An optimiser then carries x as a variable.
        pieces: where the quantity is the greatest of several, each of these. An optimiser then carries a variable
            above all of them, if more of the quantity is never an advantage.
        counterpart: what a dimensionless one is in SI, derived from SI parameters.
        aside: whether a report has it in a sentence, and not in its table.
        share: whether it is a part of a whole, read in percent.
        stands_for: the expression that a name is short for, in root quantities and parameters.

    Example:
        >>> import math
        >>> arm = next(q for q in tmsopt.models.tms.quantities if q.name == "nu_H")  # (chi_H - 1) cos - zeta_H sin
        >>> f"{arm.value({'chi_H': 1.0, 'zeta_H': -0.2, 'lambda_s': math.pi / 6}):.6f}"
        '0.100000'

    More: docs/reference/quantities.md
    """

    name: str
    unit: str
    meaning: str
    latex: str
    value: Computed
    equation: Callable[[Mapping[str, Any], Any], Any] | None = None
    range: Range = Range()
    pieces: tuple[Computed, ...] = ()
    counterpart: "Quantity | None" = None
    aside: bool = False
    share: bool = False
    stands_for: str = ""

    @cached_property
    def formula(self) -> Formula:
        """Its value."""
        return formula([self.value(_ANY)])

    @cached_property
    def left_side(self) -> Formula:
        """Of its equation, in its own name beside others."""
        assert self.equation is not None
        return formula([self.equation(_ANY, symbol(self.name))])

    @cached_property
    def each_piece(self) -> Formula:
        """Of its pieces."""
        return formula(piece(_ANY) for piece in self.pieces)


class _Any(Mapping[str, Any]):
    """A number of every name, not known yet."""

    def __getitem__(self, name: str) -> Any:
        return symbol(name)

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0


_ANY = _Any()


@dataclass(frozen=True)
class ParameterSet:
    """One of the ways to write down a design of a model.

    Attributes:
        native: the model's native parameters for given values of this set.
        quantities: derived quantities that only this set has.
        rate: for values of this set, how many 1/s a rate of 1 is; None where the set has no unit of time.
        root_unit: unit of the roots of the model's polynomial for values of this set.
        torque: for values of this set, how many N m a torque of 1 is; None where the set has no unit of torque.
        needs: parameter → one that must be above 0 where the first is not 0, and what is impossible otherwise.

    Example:
        >>> tmsopt.models.tms.parameter_set("SI").names
        ('w', 'v', 'g', 'lambda_s', 'm_B', 'x_B', 'z_B', 'm_H', 'x_H', 'z_H')

    More: docs/how_to/units.md
    """

    name: str
    parameters: tuple[Parameter, ...]
    native: Callable[[Mapping[str, Any]], dict[str, Any]]
    quantities: tuple[Quantity, ...] = ()
    rate: Computed | None = None
    root_unit: str = "1"
    torque: Computed | None = None
    needs: Mapping[str, tuple[str, str]] = field(default=Table(), hash=False)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the documentation."""
        return tuple(p.name for p in self.parameters)

    @cached_property
    def _by_name(self) -> dict[str, Parameter]:
        return {p.name: p for p in self.parameters}

    def __getitem__(self, name: str) -> Parameter:
        return self._by_name[name]


@dataclass(frozen=True, eq=False)
class Model:
    """A dissipative system by its characteristic polynomial; there is one of each in a process.

    Attributes:
        sets: parameter sets; the first is the native one.
        algebraic: native parameters → the numbers in which the coefficients are polynomials.
        polynomial: algebraic parameters → coefficients, descending, by ``+ - *`` alone.
        quantities: derived quantities, besides the coefficients ``a0 …``.
        compact: like `polynomial`, the coefficients divided by a positive number, in few products and quotients, each
            shared by all that need it: interval arithmetic and relaxations are the tighter for it.
        pencil: native parameters → matrices of the matrix polynomial with these roots, in descending powers: M, D, K
            of M s² + D s + K, or I, −A.
        feedback: native parameters → the torques of a controller, whose part in the pencil is there already.
        natural: whether coefficients and roots are near 1 in the model's own units.
        origin: a function and its arguments, plain data, that make this model again in another process.
        statement: of a model that a user states, plain data that tell it from others.
        numbers: texts of the numbers in the formulas of a stated model that are not whole.
        words: what its users call a pair on the imaginary axis, ``weave`` in data, and a root 0, ``capsize``.
        omits, conventions, sketch: what the model leaves out, signs, the system drawn with the symbols on it, in text.
        absent: names that a user may look for in vain → what to write instead.
        carrier: of a complex H, what is added to each eigenfrequency, lest a root of the polynomial, of twice
            the degree, meets the conjugate of another; None of a real system.
        carried: of a complex H, ranges of the native parameters → the model with a carrier for them.
        double: of a complex H, the pencil without carrier, I and −A of (Re ψ, Im ψ)′ = A (Re ψ, Im ψ).

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> print(swing.degree, *swing.coefficients({"c": 0.5, "k": 2.0}))
        2 1.0 0.5 2.0

    More: docs/tutorials/own_system.md
    """

    name: str
    title: str
    degree: int
    sets: tuple[ParameterSet, ...]
    algebraic: Callable[[Mapping[str, Any]], dict[str, Any]]
    polynomial: Callable[..., list[Any]]
    quantities: tuple[Quantity, ...] = ()
    compact: Callable[..., list[Any]] | None = None
    pencil: Callable[[Mapping[str, Any]], tuple[Matrix, ...]] | None = None
    feedback: Callable[[Mapping[str, Any]], Feedback] | None = None
    natural: bool = False
    origin: tuple[Callable[..., "Model"], tuple[Any, ...]] | None = None
    statement: Mapping[str, Any] | None = None
    numbers: tuple[str, ...] = ()
    words: tuple[str, str] = ("flutter", "divergence")
    omits: str = ""
    conventions: tuple[str, ...] = ()
    sketch: str = ""
    absent: Mapping[str, str] = Table()
    carrier: float | None = None
    carried: Callable[[Mapping[str, tuple[float, float]]], "Model"] | None = None
    double: Callable[[Mapping[str, Any]], tuple[Matrix, ...]] | None = None

    def __repr__(self) -> str:
        return f"Model(name={self.name!r}, title={self.title!r}, degree={self.degree}, natural={self.natural})"

    def __reduce_ex__(self, protocol: SupportsIndex) -> Any:
        """By its origin: in another process it is that process's own, no copy of this; but for a changed bicycle."""
        origin = self.origin
        known = origin and (origin[0] is not resolve_name or resolve_name(*origin[1]) is self)
        return origin if known else super().__reduce_ex__(protocol)

    def coefficients(self, parameters: Mapping[str, Any], of: ParameterSet | None = None) -> list[Any]:
        """Coefficients a0 … aₙ, descending, for values of any kind: floats, arrays, CasADi, balls."""
        return self.computed(of or self.sets[0], parameters)[1]

    def computed(self, of: ParameterSet, parameters: Mapping[str, Any]) -> tuple[dict[str, Any], list[Any]]:
        """Native parameters and coefficients for values of any kind."""
        kind, native = kind_of(*parameters.values()), self.sets[0].names
        with np.errstate(all="ignore"):
            found = fold(self.formulas[of.name], parameters, kind)
        rounded = kind is BALLS and not {flint.arb, flint.arb_series}.isdisjoint(map(type, parameters.values()))
        coefficients = found[len(native) :]
        return dict(zip(native, found, strict=False)), [*map(as_ball, coefficients)] if rounded else coefficients

    @cached_property
    def formulas(self) -> Mapping[str, Formula]:
        """Native parameters and coefficients, by the name of the parameter set that they are formulas in."""
        found = {}
        for of in self.sets:
            native = of.native({n: symbol(n) for n in of.names})
            listed = [native[n] for n in self.sets[0].names]
            found[of.name] = formula([*listed, *self.polynomial(**self.algebraic(native))], of.names)
        return found

    def within(self, ranges: Mapping[str, tuple[float, float]]) -> "Model":
        """The model for parameters within ranges: of a complex H with a carrier for these, any other itself."""
        return self if self.carried is None else self.carried(ranges)

    def _repr_latex_(self) -> str | None:
        """The characteristic polynomial in the native parameters; None for one that fills pages."""
        from tmsopt.models.typeset import LATEX, Typeset, polynomial_text

        of = self.sets[0]
        found = fold(self.formulas[of.name], {p.name: Typeset(p.latex) for p in of.parameters}, LATEX)
        text = polynomial_text(found[len(of.names) :])
        return f"$${text} = 0$$" if len(text) <= _PAGE else None

    def coefficient_names(self) -> tuple[str, ...]:
        """``a0 … an``, or ``coefficient0 …`` where a parameter or quantity has one of these names."""
        return self._coefficient_names

    @cached_property
    def _coefficient_names(self) -> tuple[str, ...]:
        taken = {n for of in self.sets for n in (*of.names, *(q.name for q in of.quantities))}
        taken |= {q.name for q in self.quantities}
        plain = tuple(f"a{k}" for k in range(self.degree + 1))
        return plain if taken.isdisjoint(plain) else tuple(f"coefficient{k}" for k in range(self.degree + 1))

    def quantity_names(self, of: ParameterSet) -> tuple[str, ...]:
        """Everything that an expression may use beside the parameters of a set and the root quantities."""
        native = () if of is self.sets[0] else self.sets[0].names
        derived = [q.name for q in (*self.quantities, *of.quantities)]
        return tuple([n for n in (*native, *self.coefficient_names(), *derived) if n not in of.names])

    def parameter_set(self, name: str) -> ParameterSet:
        """The parameter set of that name."""
        return next(s for s in self.sets if s.name == name)


def words_of(model: Model) -> Mapping[str, str]:
    """``weave`` and ``capsize``, as data have them, → the words that the users of a model read.

    Example:
        >>> dict(tmsopt.models.words_of(tmsopt.models.from_coefficients([1, "c", "k"])))
        {'weave': 'flutter', 'capsize': 'divergence'}

    More: docs/tutorials/own_system.md
    """
    return dict(zip(("weave", "capsize"), model.words, strict=True))


def in_words_of(model: Model, text: str) -> str:
    """A name such as ``infinity and weave`` in the words of a model.

    Example:
        >>> tmsopt.models.in_words_of(tmsopt.models.from_coefficients([1, "c", "k"]), "infinity and weave")
        'infinity and flutter'

    More: docs/tutorials/own_system.md
    """
    return re.sub("weave|capsize", lambda found: words_of(model)[found[0]], text)


class Values(Mapping[str, Any]):
    """Parameters of a design and everything derived from them, computed when first asked for.

    Args:
        parameters: a value for every parameter of the set `of`.
        extra: quantities beside those of the model, e.g. of the roots.
        lift: asked first for each quantity; returns a variable that stands for it, or None for its formula.
        ranges: width of the range of each parameter that may move: what is far smaller stands for 0.

    Example:
        >>> p = {"Fr": 1.0, "mu": 0.1, "chi_B": 1.2, "chi_H": 1.02, "zeta_B": -0.4, "zeta_H": -0.2, "lambda_s": 0.1}
        >>> values = tmsopt.models.Values(tmsopt.models.tms, tmsopt.models.tms.sets[0], p)
        >>> f"{values['Fr_c']:.6f} {tmsopt.laws.Fr_c(0.1, 1.2, 1.02, -0.4, -0.2, 0.1):.6f}"  # the law of the paper
        '0.962682 0.962682'

    More: docs/reference/quantities.md
    """

    def __init__(
        self,
        model: Model,
        of: ParameterSet,
        parameters: Mapping[str, Any],
        extra: Iterable[Quantity] = (),
        lift: Callable[[Quantity, "Values"], Any] | None = None,
        ranges: Mapping[str, float] | None = None,
    ) -> None:
        native, self.coefficients = model.computed(of, parameters)
        self.model, self.kind = model, kind_of(*parameters.values())
        self.given, self._ranges = (model, of, dict(parameters)), dict(ranges or {})
        self._known = {**native, **dict(zip(model.coefficient_names(), self.coefficients, strict=True)), **parameters}
        self._found: dict[str, Any] = {}
        self._formulas = {q.name: q for q in (*model.quantities, *of.quantities)}
        self._procedures = {q.name: q for q in extra}
        self._lift = lift

    def __getitem__(self, name: str) -> Any:
        if name in self._known:
            return self._known[name]
        if name not in self._found:
            quantity = self._procedures.get(name) or self._formulas[name]
            value = self._lift(quantity, self) if self._lift else None
            if value is None:
                value = quantity.value(self) if name in self._procedures else self.fold(quantity.formula)[0]
            self._found[name] = value
        return self._found[name]

    def fold(self, formula: Formula, own: Mapping[str, Any] = MappingProxyType({})) -> list[Any]:
        """The outputs of a formula in these values, and others of one's own; nan for what is not known of the roots."""
        unknown = dict.fromkeys(ROOTS, np.nan)
        known = {n: own[n] if n in own else self[n] if n in self else unknown[n] for n in formula.inputs}
        with np.errstate(all="ignore"):
            return fold(formula, known, self.kind)

    def roundings(self) -> list[float]:
        """How far each coefficient of a numeric design may be off as its parameters are rounded to doubles."""
        (model, of, parameters), ranges = self.given, self._ranges
        sizes = {n: abs(float(x)) for n, x in parameters.items()}
        sizes |= {n: width for n, width in ranges.items() if sizes[n] <= _NOTHING * width}
        with flint.ctx.workprec(_BITS):
            balls = {n: flint.arb(float(x), sizes[n] * _EPSILON) for n, x in parameters.items()}
            found = model.coefficients(balls, of)
        return [float(c.rad()) if c.is_finite() else np.inf for c in found]

    def with_known(self, known: Mapping[str, Any]) -> "Values":
        """Values of the same design in which some quantities have given numbers in place of their formulas."""
        other = copy(self)
        other._known, other._found = {**self._known, **known}, {}
        return other

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._known, *self._formulas, *self._procedures)))

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __contains__(self, name: object) -> bool:
        return name in self._known or name in self._formulas or name in self._procedures
