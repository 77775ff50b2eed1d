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

_BALL_BITS = 106  # precision of balls; it is so high that their radius comes only from the rounding of the parameters
_EPSILON = 2.0**-53
_NEGLIGIBLE = 1e-9  # a parameter below this share of its range counts as 0
_MAX_LATEX = 3000  # a formula whose LaTeX has more characters is not shown

NumberFunction = Callable[[AnyNumbers], Any]
"""Function of named numbers. It uses ``+ - * /`` and the operations of `tmsopt.algebra.kinds`, so it can be traced."""

Matrix = list[list[Any]]
"""Rows of numbers of any kind."""

Matrices = tuple[Matrix, ...]
"""Matrices of a matrix polynomial, for descending powers."""

ROOTS = ("abscissa", "damping_ratio", "angular_frequency")
"""Quantities of the roots that formulas may use."""


@dataclass(frozen=True)
class Feedback:
    """The torques of a controller, added to M q″ + D q′ + K q = 0 with q = (lean, steer), in native units.

    Attributes:
        mass: the matrix M.
        gains: G of the torques −G (φ, δ, φ̇, δ̇), rows for lean and steer.
        lag: time constant of the actuators; None for torques without delay. With a lag the torque of each row in
            `driven_rows` is an additional state.
        driven_rows: rows with a torque: 0 for lean, 1 for steer.
    """

    mass: Matrix
    gains: Matrix
    lag: Any = None
    driven_rows: tuple[int, ...] = (1,)


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
        unit: SI unit; ``1`` if the parameter is dimensionless.
        meaning: description in one phrase.
        latex: symbol for figures.
        range: physically possible values.
        default: value if the parameter is omitted; None if it is required.
        tangent: for an angle, whether the coefficients are polynomials in its tangent; an optimiser varies the tangent.
        multiple_of: for a parameter that is a multiple of another number, such as the wheelbase: the unit of that
            number, ``m``.
        sides: names of the designs with a negative and a positive value, if these are searched separately.
        counterpart: for a parameter in SI, the name of its dimensionless parameter, if that name differs.

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
        """True if the built value can differ. Constants of nature, and parts that a design does not have, cannot."""
        return self.default is None or (self.default == 0 and value != 0)


@dataclass(frozen=True)
class Quantity:
    """A number derived from the parameters.

    Attributes:
        value: function of parameters and other quantities; nan where the quantity does not exist.
        equation: function of the values and a number x, without division or radical, that is 0 exactly when x is the
            quantity, within `range`. An optimiser then has x as a variable.
        pieces: terms whose maximum is the quantity. An optimiser replaces the quantity by a variable that is greater
            than every term, if a greater quantity is never an advantage.
        counterpart: for a dimensionless quantity, the same quantity in SI.
        aside: whether reports state the quantity in a sentence and not in their table.
        share: whether the quantity is a fraction of a whole, which is shown in percent.
        stands_for: the expression of root quantities and parameters for which the name is an abbreviation.

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
        needs: parameter → (another parameter, which must be above 0 if the first is not 0; the reason).

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
        algebraic: native parameters → algebraic parameters, in which the coefficients are polynomials.
        polynomial: algebraic parameters → coefficients, descending, computed with ``+ - *`` only; None for large
            and for complex matrices, whose roots are computed without it.
        quantities: derived quantities, besides the coefficients ``a0 …``.
        compact: like `polynomial`, but the coefficients are divided by a positive number and computed in few
            operations with common terms, which gives tighter bounds in interval arithmetic.
        pencil: native parameters → matrices of the matrix polynomial with these roots, in descending powers: M, D, K
            of M s² + D s + K, or I, −A; for a complex H the complex matrices I, i H.
        feedback: native parameters → the torques of a controller, which the pencil already includes.
        natural: whether coefficients and roots are near 1 in native units.
        origin: a function and its arguments, plain data, that make this model in another process.
        statement: plain data that identify a model of the user's own.
        numbers: for a model of the user's own, the texts of its numbers that are not integers.
        words: the usual names of ``weave`` (a pair on the imaginary axis) and ``capsize`` (a root 0) in the field of
            the model.
        omits: text about the effects that the model neglects.
        conventions: texts about the signs.
        sketch: drawing as text.
        absent: unknown names that a user may try → what to write instead.
        is_complex: whether the system is stated by complex numbers.

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
    polynomial: Callable[..., list[Any]] | None
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
    is_complex: bool = False

    def __repr__(self) -> str:
        return f"Model(name={self.name!r}, title={self.title!r}, degree={self.degree}, natural={self.natural})"

    def __reduce_ex__(self, protocol: SupportsIndex) -> Any:
        """Pickle the origin, so that another process uses its own object; a changed bicycle is copied."""
        origin = self.origin
        is_unchanged = origin and (origin[0] is not resolve_name or resolve_name(*origin[1]) is self)
        return origin if is_unchanged else super().__reduce_ex__(protocol)

    def evaluate_polynomial(self, algebraic: AnyNumbers) -> list[Any]:
        """The coefficients for algebraic parameters; none without a polynomial."""
        return self.polynomial(**algebraic) if self.polynomial else []

    def coefficients(self, parameters: AnyNumbers, of: ParameterSet | None = None) -> list[Any]:
        """Coefficients a0 … aₙ, descending, for numbers of any kind: floats, arrays, CasADi, balls."""
        return self.computed(of or self.sets[0], parameters)[1]

    def computed(self, of: ParameterSet, parameters: AnyNumbers) -> tuple[dict[str, Any], list[Any]]:
        """Native parameters and coefficients for numbers of any kind."""
        kind, native = kind_of(*parameters.values()), self.sets[0].names
        with np.errstate(all="ignore"):
            outputs = fold(self.formulas[of.name], parameters, kind)
        coefficients = outputs[len(native) :]
        if kind is BALLS and not {flint.arb, flint.arb_series}.isdisjoint(map(type, parameters.values())):
            coefficients = [*map(as_ball, coefficients)]
        return dict(zip(native, outputs, strict=False)), coefficients

    @cached_property
    def formulas(self) -> Mapping[str, Formula]:
        """Parameter set name → formula of the native parameters and coefficients."""
        formulas = {}
        for parameter_set in self.sets:
            native = parameter_set.native({n: symbol(n) for n in parameter_set.names})
            coefficients = self.evaluate_polynomial(self.algebraic(native))
            outputs = [*(native[n] for n in self.sets[0].names), *coefficients]
            formulas[parameter_set.name] = formula(outputs, parameter_set.names)
        return formulas

    @property
    def noun(self) -> str:
        """What reports call a set of parameters: a point of a complex H, otherwise a design."""
        return "point" if self.is_complex else "design"

    def _repr_latex_(self) -> str | None:
        """The characteristic polynomial in the native parameters; None if it is too long."""
        from tmsopt.models.typeset import LATEX, Typeset, polynomial_text

        native_set = self.sets[0]
        if self.polynomial is None:
            return None
        outputs = fold(self.formulas[native_set.name], {p.name: Typeset(p.latex) for p in native_set.parameters}, LATEX)
        text = polynomial_text(outputs[len(native_set.names) :])
        return f"$${text} = 0$$" if len(text) <= _MAX_LATEX else None

    def coefficient_names(self) -> tuple[str, ...]:
        """``a0 … an``, or ``coefficient0 …`` if a parameter or quantity has one of these names."""
        return self._coefficient_names if self.polynomial else ()

    @cached_property
    def _coefficient_names(self) -> tuple[str, ...]:
        used_names = {q.name for s in self.sets for q in (*self.quantities, *s.quantities)}
        used_names |= {n for s in self.sets for n in s.names}
        short_names, long_names = ([f"{word}{k}" for k in range(self.degree + 1)] for word in ("a", "coefficient"))
        return tuple(short_names if used_names.isdisjoint(short_names) else long_names)

    def quantity_names(self, of: ParameterSet) -> tuple[str, ...]:
        """Names that an expression may use besides the parameters of a set and the quantities of the roots."""
        native = () if of is self.sets[0] else self.sets[0].names
        derived = [q.name for q in (*self.quantities, *of.quantities)]
        return tuple([n for n in (*native, *self.coefficient_names(), *derived) if n not in of.names])

    def parameter_set(self, name: str) -> ParameterSet:
        """The parameter set with a name."""
        return next(s for s in self.sets if s.name == name)


def words_of(model: Model) -> Mapping[str, str]:
    """``weave`` and ``capsize`` → their names in the field of a model.

    Example:
        >>> dict(tmsopt.models.words_of(tmsopt.models.from_coefficients([1, "c", "k"])))
        {'weave': 'flutter', 'capsize': 'divergence'}

    More: docs/tutorials/own_system.md
    """
    return dict(zip(("weave", "capsize"), model.words, strict=True))


def in_words_of(model: Model, text: str) -> str:
    """A text such as ``infinity and weave``, with the names of weave and capsize in the field of a model.

    Example:
        >>> tmsopt.models.in_words_of(tmsopt.models.from_coefficients([1, "c", "k"]), "infinity and weave")
        'infinity and flutter'

    More: docs/tutorials/own_system.md
    """
    return re.sub("weave|capsize", lambda match: words_of(model)[match[0]], text)


class Values(Mapping[str, Any]):
    """Parameters of a design and its derived quantities, which are computed on first use.

    Args:
        parameters: a value for every parameter of the set `of`.
        extra: additional quantities, e.g. of the roots.
        lift: function that is called first for each quantity. It returns a variable to use as the value, or None to use
            the formula.
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
        self._computed: dict[str, Any] = {}
        self._formulas = {q.name: q for q in (*model.quantities, *of.quantities)}
        self._procedures = {q.name: q for q in extra}
        self._lift = lift

    def __getitem__(self, name: str) -> Any:
        if name in self._known:
            return self._known[name]
        if name not in self._computed:
            quantity = self._procedures.get(name) or self._formulas[name]
            value = self._lift(quantity, self) if self._lift else None
            if value is None:
                value = quantity.value(self) if name in self._procedures else self.fold(quantity.formula)[0]
            self._computed[name] = value
        return self._computed[name]

    def fold(self, formula: Formula, given_values: AnyNumbers = MappingProxyType({})) -> list[Any]:
        """Evaluate a formula; `given_values` take precedence over these values. Unknown root quantities are nan."""
        unknown = dict.fromkeys(ROOTS, np.nan)
        inputs = {
            n: given_values[n] if n in given_values else self[n] if n in self else unknown[n] for n in formula.inputs
        }
        with np.errstate(all="ignore"):
            return fold(formula, inputs, self.kind)

    def roundings(self) -> list[float]:
        """For each coefficient of a numeric design, the greatest error from rounding the parameters to doubles."""
        (model, parameter_set, parameters), ranges = self.given, self._ranges
        sizes = {n: abs(float(x)) for n, x in parameters.items()}
        sizes |= {n: width for n, width in ranges.items() if sizes[n] <= _NEGLIGIBLE * width}
        with flint.ctx.workprec(_BALL_BITS):
            balls = {n: flint.arb(float(x), sizes[n] * _EPSILON) for n, x in parameters.items()}
            return [float(c.rad()) if c.is_finite() else np.inf for c in model.coefficients(balls, parameter_set)]

    def with_known(self, numbers: AnyNumbers) -> "Values":
        """Values of the same design in which some quantities are given numbers and not computed by their formulas."""
        result = copy(self)
        result._known, result._computed = {**self._known, **numbers}, {}
        return result

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._known, *self._formulas, *self._procedures)))

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __contains__(self, name: object) -> bool:
        return name in self._known or name in self._formulas or name in self._procedures
