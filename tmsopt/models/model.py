"""Models as data: parameters, derived quantities and a characteristic polynomial."""

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
from tmsopt.records import AnyNumbers, Numbers, Table

_BITS = 106  # precision of balls, whose radii then come from the roundings of the parameters alone
_EPSILON = 2.0**-53
_NEGLIGIBLE = 1e-9  # of a range: a smaller parameter counts as 0
_PAGE = 3000  # most characters of a formula in LaTeX

NumberFunction = Callable[[AnyNumbers], Any]
"""Function of named numbers that uses ``+ - * /`` and the operations of `tmsopt.algebra.kinds`, so it can be traced."""

Matrix = list[list[Any]]
"""Rows of numbers of any kind."""

Matrices = tuple[Matrix, ...]
"""Matrices of a matrix polynomial, in descending powers."""

ROOTS = ("abscissa", "damping_ratio", "angular_frequency")
"""Quantities of the roots that formulas may use."""


@dataclass(frozen=True)
class Feedback:
    """Torques of a controller on M q″ + D q′ + K q, q = (lean, steer), in native units.

    Attributes:
        mass: M.
        gains: G of the torques −G (φ, δ, φ̇, δ̇), rows for lean and steer.
        lag: time constant of the actuators; None for torques without delay. With a lag the torque of each row in
            `driven` is a further state.
        driven: rows with a torque: 0 for lean, 1 for steer.
    """

    mass: Matrix
    gains: Matrix
    lag: Any = None
    driven: tuple[int, ...] = (1,)


@dataclass(frozen=True)
class Range:
    """An interval of physically possible values, which includes its ends if it is closed.

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
        is_end = value in (self.lower, self.upper)
        return self.lower <= value <= self.upper and (self.closed or not is_end)

    def __str__(self) -> str:
        ends = zip("><", (self.lower, self.upper), strict=True)
        texts = [f"{sign}{'=' * self.closed} {end:.6g}" for sign, end in ends if np.isfinite(end)]
        return " and ".join(texts) or "any finite number"


@dataclass(frozen=True)
class Parameter:
    """A named number that a user fixes or frees.

    Attributes:
        name: symbol as written in files, e.g. ``chi_B``.
        unit: SI unit, ``1`` when dimensionless.
        meaning: one phrase.
        latex: symbol for figures.
        range: physically possible values.
        default: value if the parameter is omitted; None if it is required.
        tangent: whether the coefficients are polynomials in its tangent, which an optimiser then varies instead.
        multiple_of: unit of the scale of a dimensionless parameter, e.g. ``m`` for multiples of the wheelbase.
        sides: names of the designs with a negative and a positive value, if these are searched separately.
        counterpart: the dimensionless parameter of one in SI, if its name differs.

    Example:
        >>> tilt = tmsopt.models.tms.sets[0]["lambda_s"]
        >>> tilt.unit, tilt.tangent, 1.6 in tilt.range  # the range ends at a right angle
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
        """True if a builder may miss the value: not for constants of nature and parts that a design does not have."""
        return self.default is None or (self.default == 0 and value != 0)


@dataclass(frozen=True)
class Quantity:
    """A number derived from the parameters.

    Attributes:
        value: function of parameters and other quantities; nan where the quantity does not exist.
        equation: function of the values and a number x, without division or radical, that is 0 exactly when x is the
            quantity, within `range`. An optimiser then has x as a variable.
        pieces: terms whose maximum is the quantity. An optimiser then has a variable above all of them, if more of the
            quantity is never an advantage.
        counterpart: the SI quantity of a dimensionless one.
        aside: whether reports have it in a sentence instead of their table.
        share: whether it is a fraction of a whole, shown in percent.
        stands_for: the expression, in root quantities and parameters, that the name abbreviates.

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
    value: NumberFunction
    equation: Callable[[AnyNumbers, Any], Any] | None = None
    range: Range = Range()
    pieces: tuple[NumberFunction, ...] = ()
    counterpart: "Quantity | None" = None
    aside: bool = False
    share: bool = False
    stands_for: str = ""

    @cached_property
    def formula(self) -> Formula:
        """Formula of the value."""
        return formula([self.value(_SYMBOLS)])

    @cached_property
    def left_side(self) -> Formula:
        """Formula of the equation, with the quantity as an input."""
        assert self.equation is not None
        return formula([self.equation(_SYMBOLS, symbol(self.name))])

    @cached_property
    def each_piece(self) -> Formula:
        """Formula of the pieces."""
        return formula(piece(_SYMBOLS) for piece in self.pieces)


class _Symbols(dict[str, Any]):
    """Maps every name to its symbol."""

    def __getitem__(self, name: str) -> Any:
        return symbol(name)

    def __contains__(self, name: object) -> bool:
        return True


_SYMBOLS = _Symbols()


@dataclass(frozen=True)
class ParameterSet:
    """A set of parameters that describes a design of a model.

    Attributes:
        native: function from values of this set to the native parameters.
        quantities: derived quantities that only this set has.
        rate: function from values of this set to a rate of 1 in 1/s; None if the set has no unit of time.
        root_unit: unit of the roots of the polynomial.
        torque: function from values of this set to a torque of 1 in N m; None if the set has no unit of torque.
        needs: parameter → another that must be above 0 if the first is not 0, and the reason.

    Example:
        >>> tmsopt.models.tms.parameter_set("SI").names
        ('w', 'v', 'g', 'lambda_s', 'm_B', 'x_B', 'z_B', 'm_H', 'x_H', 'z_H')

    More: docs/how_to/units.md
    """

    name: str
    parameters: tuple[Parameter, ...]
    native: Callable[[AnyNumbers], dict[str, Any]]
    quantities: tuple[Quantity, ...] = ()
    rate: NumberFunction | None = None
    root_unit: str = "1"
    torque: NumberFunction | None = None
    needs: Mapping[str, tuple[str, str]] = field(default=Table(), hash=False)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return tuple(p.name for p in self.parameters)

    @cached_property
    def _by_name(self) -> dict[str, Parameter]:
        return {p.name: p for p in self.parameters}

    def __getitem__(self, name: str) -> Parameter:
        return self._by_name[name]


@dataclass(frozen=True, eq=False)
class Model:
    """A dissipative system with its characteristic polynomial. Each process has one object for each model.

    Attributes:
        sets: parameter sets; the first is the native one.
        algebraic: native parameters → the numbers in which the coefficients are polynomials.
        polynomial: algebraic parameters → coefficients, descending, by ``+ - *`` alone.
        quantities: derived quantities, besides the coefficients ``a0 …``.
        compact: like `polynomial`, but the coefficients divided by a positive number, with few operations and shared
            terms: bounds by intervals and relaxations are tighter.
        pencil: native parameters → matrices of the matrix polynomial with these roots, in descending powers: M, D, K
            of M s² + D s + K, or I, −A.
        feedback: native parameters → the torques of a controller, which the pencil already includes.
        natural: whether coefficients and roots are near 1 in native units.
        origin: a function and its arguments, plain data, that make this model in another process.
        statement: plain data that identify a model of the user's own.
        numbers: texts of the numbers in a model of the user's own that are not whole.
        words: names of the field for a pair on the imaginary axis, ``weave`` in data, and a root 0, ``capsize``.
        omits, conventions, sketch: text on what the model leaves out and on its signs, and a drawing in characters.
        absent: unknown names that a user may try → what to write instead.
        carrier: number added to each eigenfrequency of a complex H, so that no root of the polynomial, which has twice
            the degree, meets the conjugate of another; None for a real system.
        carried: ranges of the native parameters of a complex H → the model with a carrier for them.
        double: pencil of a complex H without carrier: I and −A of (Re ψ, Im ψ)′ = A (Re ψ, Im ψ).

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
    algebraic: Callable[[AnyNumbers], dict[str, Any]]
    polynomial: Callable[..., list[Any]]
    quantities: tuple[Quantity, ...] = ()
    compact: Callable[..., list[Any]] | None = None
    pencil: Callable[[AnyNumbers], Matrices] | None = None
    feedback: Callable[[AnyNumbers], Feedback] | None = None
    natural: bool = False
    origin: tuple[Callable[..., "Model"], tuple[Any, ...]] | None = None
    statement: AnyNumbers | None = None
    numbers: tuple[str, ...] = ()
    words: tuple[str, str] = ("flutter", "divergence")
    omits: str = ""
    conventions: tuple[str, ...] = ()
    sketch: str = ""
    absent: Mapping[str, str] = Table()
    carrier: float | None = None
    carried: Callable[[Mapping[str, tuple[float, float]]], "Model"] | None = None
    double: Callable[[AnyNumbers], Matrices] | None = None

    def __repr__(self) -> str:
        return f"Model(name={self.name!r}, title={self.title!r}, degree={self.degree}, natural={self.natural})"

    def __reduce_ex__(self, protocol: SupportsIndex) -> Any:
        """Pickle the origin, so that another process uses its own object; a changed bicycle is copied."""
        origin = self.origin
        is_unchanged = origin and (origin[0] is not resolve_name or resolve_name(*origin[1]) is self)
        return origin if is_unchanged else super().__reduce_ex__(protocol)

    def coefficients(self, parameters: AnyNumbers, of: ParameterSet | None = None) -> list[Any]:
        """Coefficients a0 … aₙ, descending, for numbers of any kind: floats, arrays, CasADi, balls."""
        return self.computed(of or self.sets[0], parameters)[1]

    def computed(self, of: ParameterSet, parameters: AnyNumbers) -> tuple[dict[str, Any], list[Any]]:
        """Native parameters and coefficients for numbers of any kind."""
        kind, native = kind_of(*parameters.values()), self.sets[0].names
        with np.errstate(all="ignore"):
            found = fold(self.formulas[of.name], parameters, kind)
        rounded = kind is BALLS and not {flint.arb, flint.arb_series}.isdisjoint(map(type, parameters.values()))
        coefficients = found[len(native) :]
        return dict(zip(native, found, strict=False)), [*map(as_ball, coefficients)] if rounded else coefficients

    @cached_property
    def formulas(self) -> Mapping[str, Formula]:
        """Parameter set name → formula of the native parameters and coefficients."""
        found = {}
        for of in self.sets:
            native = of.native({n: symbol(n) for n in of.names})
            coefficients = self.polynomial(**self.algebraic(native))
            found[of.name] = formula([*(native[n] for n in self.sets[0].names), *coefficients], of.names)
        return found

    def within(self, ranges: Mapping[str, tuple[float, float]]) -> "Model":
        """The model for parameters within ranges: a complex H gets a carrier for them, other models stay the same."""
        return self if self.carried is None else self.carried(ranges)

    def _repr_latex_(self) -> str | None:
        """The characteristic polynomial in the native parameters; None if it is too long."""
        from tmsopt.models.typeset import LATEX, Typeset, polynomial_text

        of = self.sets[0]
        found = fold(self.formulas[of.name], {p.name: Typeset(p.latex) for p in of.parameters}, LATEX)
        text = polynomial_text(found[len(of.names) :])
        return f"$${text} = 0$$" if len(text) <= _PAGE else None

    def coefficient_names(self) -> tuple[str, ...]:
        """``a0 … an``, or ``coefficient0 …`` if a parameter or quantity has one of these names."""
        return self._coefficient_names

    @cached_property
    def _coefficient_names(self) -> tuple[str, ...]:
        taken = {q.name for of in self.sets for q in (*self.quantities, *of.quantities)} | {
            n for of in self.sets for n in of.names
        }
        plain, long = ([f"{word}{k}" for k in range(self.degree + 1)] for word in ("a", "coefficient"))
        return tuple(plain if taken.isdisjoint(plain) else long)

    def quantity_names(self, of: ParameterSet) -> tuple[str, ...]:
        """Names that an expression may use besides the parameters of a set and the quantities of the roots."""
        native = () if of is self.sets[0] else self.sets[0].names
        derived = [q.name for q in (*self.quantities, *of.quantities)]
        return tuple([n for n in (*native, *self.coefficient_names(), *derived) if n not in of.names])

    def parameter_set(self, name: str) -> ParameterSet:
        """The parameter set with a name."""
        return next(s for s in self.sets if s.name == name)


def words_of(model: Model) -> Mapping[str, str]:
    """``weave`` and ``capsize``, the words in data → the words of a model's field.

    Example:
        >>> dict(tmsopt.models.words_of(tmsopt.models.from_coefficients([1, "c", "k"])))
        {'weave': 'flutter', 'capsize': 'divergence'}

    More: docs/tutorials/own_system.md
    """
    return dict(zip(("weave", "capsize"), model.words, strict=True))


def in_words_of(model: Model, text: str) -> str:
    """A name such as ``infinity and weave`` in the words of a model's field.

    Example:
        >>> tmsopt.models.in_words_of(tmsopt.models.from_coefficients([1, "c", "k"]), "infinity and weave")
        'infinity and flutter'

    More: docs/tutorials/own_system.md
    """
    return re.sub("weave|capsize", lambda found: words_of(model)[found[0]], text)


class Values(Mapping[str, Any]):
    """Parameters of a design and its derived quantities, which are computed on first use.

    Args:
        parameters: a value for every parameter of the set `of`.
        extra: quantities besides those of the model, e.g. of the roots.
        lift: called first for each quantity; returns a variable in its place, or None to use its formula.
        ranges: free parameter → width of its range; a value far smaller counts as 0.

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
        parameters: AnyNumbers,
        extra: Iterable[Quantity] = (),
        lift: Callable[[Quantity, "Values"], Any] | None = None,
        ranges: Numbers | None = None,
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

    def fold(self, formula: Formula, own: AnyNumbers = MappingProxyType({})) -> list[Any]:
        """Outputs of a formula in these values and those of `own`; unknown quantities of the roots are nan."""
        unknown = dict.fromkeys(ROOTS, np.nan)
        known = {n: own[n] if n in own else self[n] if n in self else unknown[n] for n in formula.inputs}
        with np.errstate(all="ignore"):
            return fold(formula, known, self.kind)

    def roundings(self) -> list[float]:
        """Error bound of each coefficient of a numeric design, from the rounding of its parameters to doubles."""
        (model, of, parameters), ranges = self.given, self._ranges
        sizes = {n: abs(float(x)) for n, x in parameters.items()}
        sizes |= {n: width for n, width in ranges.items() if sizes[n] <= _NEGLIGIBLE * width}
        with flint.ctx.workprec(_BITS):
            balls = {n: flint.arb(float(x), sizes[n] * _EPSILON) for n, x in parameters.items()}
            return [float(c.rad()) if c.is_finite() else np.inf for c in model.coefficients(balls, of)]

    def with_known(self, known: AnyNumbers) -> "Values":
        """Values of the same design, with given numbers in place of some formulas."""
        other = copy(self)
        other._known, other._found = {**self._known, **known}, {}
        return other

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._known, *self._formulas, *self._procedures)))

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __contains__(self, name: object) -> bool:
        return name in self._known or name in self._formulas or name in self._procedures
