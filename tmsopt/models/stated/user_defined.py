"""Models of the user's own, by matrices, by a characteristic polynomial, or by a complex H."""

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from numbers import Rational, Real
from typing import Any, NoReturn

import casadi as ca
import flint
import numpy as np

from tmsopt.algebra.balls import DIGITS
from tmsopt.algebra.formula import (
    Formula,
    Node,
    UnsupportedOperation,
    constant,
    fold,
    formula,
    nodes_from_casadi,
    symbol,
)
from tmsopt.algebra.identity import Field
from tmsopt.algebra.kinds import BALLS, NODES, values
from tmsopt.errors import short
from tmsopt.models.built_in import MODELS
from tmsopt.models.model import Matrix, Model, Parameter, ParameterSet, Quantity
from tmsopt.models.names import latex, name_fault, number_text, spell_formula
from tmsopt.models.stated.closed_loop import LOOP, check_loop, close_loop
from tmsopt.models.stated.degree import first_fault
from tmsopt.models.stated.equations import IMAGINARY, pencil, polynomial, sort_places, user_key
from tmsopt.models.stated.pairs import complex_text
from tmsopt.models.stated.real_form import complex_model, frequency_bounds
from tmsopt.models.stated.texts import Unfit, parse_entries, place
from tmsopt.records import AnyNumbers

_ACCEPTED = "accepted: finite numbers, expressions in quotes, and SX expressions"
_FINITE = "accepted: finite numbers, and expressions of them"

MOST = {"M": 6, "A": 12, "H": 6, "coefficients": 12}
"""Largest size of M, D, K; of A; of H; and largest degree."""

_SAMPLES = 24  # designs at which a leading coefficient must vanish before it is examined
_GOLDEN = (math.sqrt(5) - 1) / 2


def from_matrices(
    M: Any = None,
    D: Any = None,
    K: Any = None,
    *,
    A: Any = None,
    B: Any = None,
    C: Any = None,
    G: Any = None,
    name: str = "stated",
    quantities: AnyNumbers | None = None,
) -> Model:
    """A model of M q″ + D q′ + K q = B u, or of x′ = A x + B u, from numbers, texts and CasADi expressions.

    The parameters are the names in texts and the symbols (``ca.SX.sym("k")``), in order of appearance.

    Args:
        M, D, K: square, up to 6 × 6, as nested lists, NumPy arrays, SX or DM; D is 0 by default. An entry is a number,
            text as in a problem file such as ``"1 + mu*w**2"``, or an SX.
        A: square, up to 12 × 12, in place of M, D and K.
        B, C, G: matrices of a controller u = −G y, y = C x, up to 12 × 12. x are the states, or q and then q′. By
            default all are measured. Without B and G there is no controller.
        name: title for reports.
        quantities: name → expression of the same symbols, for objectives and constraints; texts may use one another.

    Raises:
        Unfit: if a matrix is not square, too large or of another size than the others, an entry is not a finite number
            or expression, a name is not accepted, or the polynomial has no root.

    Example:
        >>> pendulum = tmsopt.models.from_matrices(M=[[3, 1], [1, 1]], K=[["2 - p", "p - 1"], [-1, 1]])  # Ziegler's
        >>> print(*pendulum.coefficients({"p": 2.0}))  # 2 s⁴ + (7 - 2 p) s² + 1
        2.0 0.0 3.0 0.0 1.0

    More: docs/tutorials/own_system.md
    """
    every = {"A": A, "M": M, "D": D, "K": K, "B": B, "C": C, "G": G}
    given = {n: value for n, value in every.items() if value is not None}
    if "A" in given and not given.keys().isdisjoint("MDK"):
        raise Unfit("A", "is given together with M, D or K; give either A, or M and K (and D)")
    for n in () if "A" in given else ("M", "K"):
        if n not in given:
            raise Unfit(n, "is missing; give M and K (and D), or A, or coefficients")
    matrices = {n: _rectangular(n, value) if n in LOOP else square(n, value) for n, value in given.items()}
    for n, size in ((n, len(rows)) for n, rows in matrices.items() if n in ("D", "K")):
        if size != (most := len(matrices["M"])):
            raise Unfit(n, f"is {size} × {size}, but M is {most} × {most}; accepted: matrices of one size")
    check_loop({n: (len(rows), len(rows[0])) for n, rows in matrices.items()})
    return build_model("matrices", name, matrices, quantities)


def from_coefficients(coefficients: Any, *, name: str = "stated", quantities: AnyNumbers | None = None) -> Model:
    """A model of a characteristic polynomial with descending coefficients, each like an entry of `from_matrices`.

    Raises:
        Unfit: if there are fewer than 2 coefficients or more than 13, or the leading one is 0.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> tmsopt.solve(tmsopt.Problem(swing, fixed={"k": 4.0}, free={"c": (0, 9)}, minimize="abscissa")).structure
        'EP2'

    More: docs/tutorials/own_system.md
    """
    row = _entries(coefficients)
    if row is None or any(_entries(x) is not None for x in row) or not 2 <= len(row) <= MOST["coefficients"] + 1:
        found = "no list" if row is None else f"{len(row)} entries" if row else "none"
        accepted = f"a list of 2 to {MOST['coefficients'] + 1} coefficients, descending"
        raise Unfit("coefficients", f"found {found}; accepted: {accepted}")
    return build_model("coefficients", name, {"coefficients": [row]}, quantities)


def from_hamiltonian(H: Any, *, name: str = "stated", quantities: AnyNumbers | None = None) -> Model:
    """A model of ψ′ = −i H ψ with a complex matrix H and eigenfrequencies ω = i s.

    Results refer to H: ``EP2`` is an exceptional point of H, the ``abscissa`` is the greatest Im ω (gain minus loss),
    and multiplicities are those of H. Internally the model is the real system of twice the size with
    A = [[J, R], [−R, J]] for H + Ω = R + i J. A `Problem` chooses the carrier Ω for its ranges.

    Args:
        H: square, up to 6 × 6, as nested lists or a NumPy array. An entry is a real or complex number, text as in
            a problem file such as ``"w - 1j*g"`` or ``"k*exp(1j*phi)"``, an SX, or a tuple of two SX, the real and the
            imaginary part. Parameters are real.
        name, quantities: see `from_matrices`; quantities are real.

    Raises:
        Unfit: as in `from_matrices`.

    Example:
        >>> dimer = tmsopt.models.from_hamiltonian([["d - 1j*g1", "k"], ["k", "-1j*g2"]])  # two lossy modes
        >>> free = {"d": (-1, 1), "k": (0.1, 2)}
        >>> found = tmsopt.solve(tmsopt.Problem(dimer, fixed={"g1": 1.0, "g2": 0.2}, free=free, locate="EP2"))
        >>> found.structure, f"{found.parameters['k']:.6f}"  # an EP2 of H at |g1 - g2|/2
        ('EP2', '0.400000')

    More: docs/explanation/exceptional_points.md
    """
    return build_model("hamiltonian", name, {"H": square("H", H)}, quantities)


def _entries(value: Any) -> list[Any] | None:
    """The entries of a list, a CasADi vector or a one-dimensional array; None for other values."""
    if isinstance(value, ca.SX | ca.DM):
        return [value[k] for k in range(value.numel())] if 1 in value.shape and value.numel() > 1 else None
    if isinstance(value, np.ndarray):
        return list(value) if value.ndim == 1 else None
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else None


def _rows(value: Any) -> list[list[Any] | None] | None:
    """The rows of a matrix, None for a row that is not a list; None if the value is not a matrix."""
    if isinstance(value, ca.SX | ca.DM):
        return [[value[i, j] for j in range(value.shape[1])] for i in range(value.shape[0])]
    if isinstance(value, np.ndarray):
        return [list(row) for row in value] if value.ndim == 2 else None
    rows = _entries(value)
    return None if rows is None else [_entries(row) for row in rows]


def square(key: str, value: Any) -> Matrix:
    rows = _rows(value)
    if rows is None:
        found = f"an array of {value.ndim} dimensions" if isinstance(value, np.ndarray) else type(value).__name__
        raise Unfit(key, f"found {found}; accepted: a matrix as nested lists, a NumPy array, SX or DM")
    found_rows = [row for row in rows if row is not None and len(row) == len(rows)]
    if not rows or len(found_rows) < len(rows):
        shape = " + ".join("?" if row is None else str(len(row)) for row in rows)
        raise Unfit(key, f"found rows of {shape or 'no'} entries; accepted: as many rows as entries in each")
    most = MOST.get(key, MOST["M"])
    if len(rows) > most:
        raise Unfit(key, f"is {len(rows)} × {len(rows)}; accepted: up to {most} × {most}")
    return found_rows


def _rectangular(key: str, value: Any) -> Matrix:
    rows = _rows(value)
    found = [row for row in rows or () if row and len(row) == len((rows or [[]])[0] or ())]
    if rows is None or not rows or len(found) < len(rows) or max(len(rows), len(found[0])) > MOST["A"]:
        raise Unfit(key, f"found {short(value)}; accepted: rows of equal length, up to {MOST['A']} × {MOST['A']}")
    return found


def build_model(kind: str, name: Any, matrices: dict[str, Matrix], quantities: Any) -> Model:
    """The model of a system; equal systems give the same object."""
    key = next(iter(matrices))
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise Unfit("name", f"found {name!r}; accepted: a text of one line")
    if name.strip() in MODELS:
        raise Unfit("name", f"'{name.strip()}' is a built-in model; choose another name")
    if not isinstance(quantities or {}, Mapping):
        raise Unfit("quantities", f"found {type(quantities).__name__}; accepted: a mapping of names to expressions")
    matrices, derived = parse_entries(
        matrices, {n: _node("quantities", n, x) for n, x in (quantities or {}).items()}, _unfit
    )
    if kind == "hamiltonian":
        H = matrices["H"]
        matrices = {"H": [[x.re for x in row] for row in H], IMAGINARY: [[x.im for x in row] for row in H]}
    by_place = {
        (n, place(n, i, j)): x
        for n, rows in matrices.items()
        for i, row in enumerate(rows, start=1)
        for j, x in enumerate(row, start=1)
    } | {("quantities", str(n)): x for n, x in derived.items()}
    symbols = [
        x.name() for x in ca.symvar(ca.vertcat(ca.SX(0, 1), *(x for x in by_place.values() if isinstance(x, ca.SX))))
    ]
    entries = {at: _node(user_key(at[0]), at[1], x) for at, x in by_place.items()}
    names = formula(entries[at] for at in sort_places(kind, entries)).names
    duplicates = {n for n in symbols if symbols.count(n) > 1}
    if duplicates:
        raise Unfit(key, f"has two symbols named {min(duplicates)}; make one and use it everywhere")
    if not names:
        raise Unfit(key, "names no parameter, so there is nothing to design; write a name in an entry, such as 'k'")
    for n in names:
        if why := name_fault(n, kind == "hamiltonian"):
            raise Unfit(key, f"has a symbol named {n!r}, which {why}; choose another name")
    for n in derived:
        if why := "is the name of a parameter" if n in names else name_fault(n, kind == "hamiltonian"):
            raise Unfit("quantities", f"{n!r} {why}; choose another name for the quantity")
    shapes = tuple((n, len(rows), len(rows[0])) for n, rows in matrices.items())
    stated = formula(entries.values(), names)
    if wrong := first_fault(stated):
        (key, where), why = list(by_place)[wrong[0]], wrong[1]
        raise Unfit(user_key(key), f"{where}: {why}")
    return _rebuilt(kind, name.strip(), shapes, tuple(derived), stated)


@lru_cache(maxsize=64)
def _rebuilt(
    kind: str,
    name: str,
    shapes: tuple[tuple[str, int, int], ...],
    derived: tuple[str, ...],
    stated: Formula,
    carrier: float = 0.0,
) -> Model:
    """A model from plain data; each process has one object for each model."""
    names = stated.names
    entries = fold(stated, {n: symbol(n) for n in names}, NODES)
    rest = iter(entries)
    blocks = close_loop({n: [[next(rest) for _ in range(columns)] for _ in range(rows)] for n, rows, columns in shapes})
    every = polynomial(kind, blocks, carrier)
    degree = len(every) - 1
    lost = _leading_zeros(formula(every, names))
    lost = lost and _count_identical_zeros(kind, blocks, names, lost)
    if lost == degree:
        raise Unfit(shapes[0][0], "gives a polynomial without s, which has no root")
    coefficients, quantities = formula(every[lost:], names), dict(zip(derived, rest, strict=True))

    parameter_set = ParameterSet("stated", tuple(Parameter(n, "1", "parameter", latex(n)) for n in names), native=dict)
    plain = (kind, name, shapes, derived, stated)
    model = Model(
        name=name,
        title=name,
        degree=degree - lost,
        sets=(parameter_set,),
        algebraic=dict,
        polynomial=lambda **given: values(coefficients, given),
        quantities=tuple(Quantity(n, "1", "quantity", latex(n), _function(x, names)) for n, x in quantities.items()),
        pencil=None if kind == "coefficients" else _matrices(pencil(blocks, carrier), names),
        origin=(_rebuilt, (*plain, carrier) if carrier else plain),
        statement=_statement(stated, shapes, derived),
        numbers=_numbers(stated),
    )
    if kind != "hamiltonian":
        return model
    return complex_model(
        model,
        carrier,
        frequency_bounds(entries[: sum(rows * columns for _, rows, columns in shapes)]),
        lambda c: _rebuilt(*plain, *([c] if c else [])),
        _matrices(pencil(blocks), names),
    )


def _function(x: Any, names: Sequence[str]) -> Callable[[AnyNumbers], Any]:
    own = formula([x], names)
    return lambda given: values(own, given)[0]


def _matrices(rows: Sequence[Matrix], names: Sequence[str]) -> Callable[[AnyNumbers], tuple[Matrix, ...]]:
    """A function from named numbers to matrices, for matrices of nodes."""
    n, own = len(rows[0]), formula((x for P in rows for row in P for x in row), names)

    def evaluate(given: AnyNumbers) -> tuple[Matrix, ...]:
        found = iter(values(own, given))
        return tuple([[next(found) for _ in range(n)] for _ in range(n)] for _ in rows)

    return evaluate


def _count_identical_zeros(kind: str, blocks: Mapping[str, Matrix], names: Sequence[str], leading: int) -> int:
    """How many of the first `leading` coefficients are identically 0, counted up to the first that is not."""
    none = [[0] * len(blocks["M"]) for _ in blocks["M"]] if "M" in blocks else []
    ignored = ("D", "K")[max(leading - 1, 0) :] if none else ()  # without effect on these coefficients
    own = {**blocks, **dict.fromkeys(ignored, none)}
    coefficients = formula(polynomial(kind, own)[:leading], names)
    field = Field(coefficients)
    try:
        row = fold(coefficients, field.inputs, field.kind)
        return next((k for k, c in enumerate(row) if not field.is_zero(c)), leading)
    except (ZeroDivisionError, UnsupportedOperation):  # too large to decide
        return 0


def _numbers(stated: Formula) -> tuple[str, ...]:
    """Texts of the constants that are not whole numbers."""
    return tuple(number_text(x) for x in stated.constants if not (isinstance(x, Fraction) and x.denominator == 1))


def _statement(stated: Formula, shapes: Sequence[tuple[str, int, int]], derived: Sequence[str]) -> dict[str, Any]:
    """Plain data that identify a model, with every digit of its numbers."""
    texts, shared = spell_formula(stated)
    rest = iter(texts)
    matrices = {n: [[next(rest) for _ in range(columns)] for _ in range(rows)] for n, rows, columns in shapes}
    quantities = dict(zip(derived, rest, strict=True))
    if IMAGINARY in matrices:
        imaginary = matrices.pop(IMAGINARY)
        each = (zip(re, im, strict=True) for re, im in zip(matrices["H"], imaginary, strict=True))
        matrices["H"] = [[complex_text(re, im) for re, im in row] for row in each]
    return {"parameters": list(stated.names), **matrices, "quantities": quantities, "shared": shared}


def _leading_zeros(coefficients: Formula) -> int:
    """Number of leading coefficients that may be 0 for all parameters, e.g. if M is singular.

    A ball of 60 digits at one of 24 designs, of many sizes and signs, shows that a coefficient is not.
    """
    lost, is_known, names = 0, False, coefficients.names
    with flint.ctx.workdps(DIGITS):
        for i in range(_SAMPLES):
            share = [math.modf((i * len(names) + k + 1) * _GOLDEN)[0] for k in range(len(names))]
            # A third of the designs has both signs; sizes are near 1 in the first half, then from 1e-6 to 1e6.
            signs = [-1 if i % 3 == 2 and math.modf(8 * x)[0] < 0.5 else 1 for x in share]
            reach = 6 if i < _SAMPLES // 2 else 40
            design = [sign * 2.0 ** (reach * (x - 0.5)) for sign, x in zip(signs, share, strict=True)]
            found = [flint.arb(c) for c in fold(coefficients, dict(zip(names, design, strict=True)), BALLS)]
            nonzero = next(
                (k for k, c in enumerate(found[:-1]) if not c.contains(0) or not c.is_finite()), len(found) - 1
            )
            if all(c.is_finite() for c in found[: nonzero + 1]):
                lost, is_known = (min(lost, nonzero) if is_known else nonzero), True
            if is_known and lost == 0:
                return 0
    return lost


def _unfit(message: str, key: str, *name: str) -> NoReturn:
    raise Unfit(key, ": ".join([*name, message]))


def _node(key: str, where: Any, value: Any) -> Any:
    """An entry as a node; a text unchanged.

    Raises:
        Unfit: if it is not a finite number or a scalar SX.
    """
    if isinstance(value, str | Node):
        return value
    if isinstance(value, ca.MX):
        raise Unfit(key, f"{where}: found MX; accepted: SX, with symbols from ca.SX.sym")
    if isinstance(value, ca.SX | ca.DM):
        if value.numel() != 1:
            raise Unfit(key, f"{where}: is a matrix; accepted: scalar expressions")
        inputs = ca.symvar(entry := ca.densify(ca.SX(value)))
        names = [x.name() for x in inputs]
        return nodes_from_casadi(ca.Function("entry", [ca.vertcat(ca.SX(0, 1), *inputs)], [entry]), names)[0]
    if not isinstance(value, Real) or isinstance(value, bool):
        raise Unfit(key, f"{where}: found {short(value)}; {_ACCEPTED}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise Unfit(key, f"{where}: is {number}; {_FINITE}")
    return constant(Fraction(value) if isinstance(value, Rational) else number)
