"""Models of any system that a user states: by its matrices, or by its characteristic polynomial."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from numbers import Rational, Real
from typing import Any, NoReturn

import casadi as ca
import flint
import numpy as np

from tmsopt.algebra.elementary import exact, is_ball
from tmsopt.algebra.formal import Formal
from tmsopt.algebra.formulas import Formulas
from tmsopt.algebra.identity import Field
from tmsopt.algebra.rounding import Bounded
from tmsopt.algebra.walk import NotAccepted, steps, walk
from tmsopt.errors import short
from tmsopt.models.built_in import MODELS
from tmsopt.models.constants import formulas, number_symbol, number_texts, rebuilt
from tmsopt.models.model import Matrix, Model, Parameter, ParameterSet, Quantity
from tmsopt.models.names import latex, spelled, unusable
from tmsopt.models.stated.closed_loop import check_loop, closed
from tmsopt.models.stated.degree import faulty
from tmsopt.models.stated.equations import IMAGINARY, in_order, pencil, polynomial, whole
from tmsopt.models.stated.pairs import complex_text
from tmsopt.models.stated.real_form import carriers, complex_model
from tmsopt.models.stated.texts import Unfit, untexted

_ACCEPTED = "accepted: finite numbers, expressions in quotes, and SX expressions"
_FINITE = "accepted: finite numbers, and expressions of them"

MOST = {"M": 6, "A": 12, "H": 6, "coefficients": 12}
"""Largest size of M, D, K; of A; of H; largest degree."""

_SAMPLES = 24  # designs at which a leading coefficient must vanish for it to be looked at
_DIGITS = 60
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
    quantities: Mapping[str, Any] | None = None,
) -> Model:
    """A model of M q″ + D q′ + K q = B u, or of x′ = A x + B u, from expressions in text or of CasADi.

    Args:
        M, D, K: square, up to 6 × 6, as nested lists, NumPy arrays, SX or DM; D left out is 0. An entry is a number,
            text as in a problem file such as ``"1 + mu*w**2"``, or an SX.
        A: square, up to 12 × 12, instead of these.
        B, C, G: of a controller u = −G y, y = C x; up to 12 each way. x are the states, or q and then q′. C left out,
            all of them are measured. Without B and G there is no u.
        name: one word or more for reports.
        quantities: name → expression of the same symbols, for objectives and constraints; those in text may use one
            another.

    The parameters are the names in texts and the symbols (``ca.SX.sym("k")``), in the order in which they appear.

    Raises:
        Unfit: for matrices that are not square, of different sizes or too large, for entries that are no finite
            numbers or SX expressions, for names that are taken, or where no polynomial comes of it.

    Example:
        >>> pendulum = tmsopt.models.from_matrices(M=[[3, 1], [1, 1]], K=[["2 - p", "p - 1"], [-1, 1]])  # Ziegler's
        >>> print(*pendulum.coefficients({"p": 2.0}))  # 2 s⁴ + (7 - 2 p) s² + 1
        2.0 0.0 3.0 0.0 1.0

    More: docs/tutorials/own_system.md
    """
    if A is not None:
        if M is not None or D is not None or K is not None:
            raise Unfit("A", "stands beside M, D or K; give either A, or M and K with D")
        matrices: dict[str, Matrix] = {"A": square("A", A)}
    else:
        missing = [n for n, value in (("M", M), ("K", K)) if value is None]
        if missing:
            raise Unfit(missing[0], "is missing; give M and K (and D), or A, or coefficients")
        matrices = {n: square(n, value) for n, value in (("M", M), ("D", D), ("K", K)) if value is not None}
        sizes = {n: len(rows) for n, rows in matrices.items()}
        for n, size in sizes.items():
            if size != sizes["M"]:
                raise Unfit(n, f"is {size} × {size}, and M is {sizes['M']} × {sizes['M']}; give all the same size")
    matrices |= {n: _rectangular(n, value) for n, value in (("B", B), ("C", C), ("G", G)) if value is not None}
    check_loop({n: (len(rows), len(rows[0])) for n, rows in matrices.items()})
    return made("matrices", name, matrices, quantities)


def from_coefficients(coefficients: Any, *, name: str = "stated", quantities: Mapping[str, Any] | None = None) -> Model:
    """A model by the coefficients of its characteristic polynomial, descending, each as an entry of `from_matrices`.

    Raises:
        Unfit: for fewer than two coefficients, more than 13, or a leading one that is 0.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> tmsopt.solve(tmsopt.Problem(swing, fixed={"k": 4.0}, free={"c": (0, 9)}, minimize="abscissa")).structure
        'EP2'

    More: docs/tutorials/own_system.md
    """
    row = _listed(coefficients)
    if row is None or any(_listed(x) is not None for x in row) or not 2 <= len(row) <= MOST["coefficients"] + 1:
        found = "no list" if row is None else f"{len(row)} entries" if row else "none"
        raise Unfit("coefficients", f"found {found}; accepted: from 2 to {MOST['coefficients'] + 1}, descending")
    return made("coefficients", name, {"coefficients": [row]}, quantities)


def _listed(value: Any) -> list[Any] | None:
    """The entries of a list, a vector of CasADi or an array of one dimension; None for anything else."""
    if isinstance(value, ca.SX | ca.DM):
        return [value[k] for k in range(value.numel())] if 1 in value.shape and value.numel() > 1 else None
    if isinstance(value, np.ndarray):
        return list(value) if value.ndim == 1 else None
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else None


def _rows(value: Any) -> list[list[Any] | None] | None:
    """The rows of a matrix, None for one that is no list; None for what is no matrix."""
    if isinstance(value, ca.SX | ca.DM):
        return [[value[i, j] for j in range(value.shape[1])] for i in range(value.shape[0])]
    if isinstance(value, np.ndarray):
        return [list(row) for row in value] if value.ndim == 2 else None
    rows = _listed(value)
    return None if rows is None else [_listed(row) for row in rows]


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


def made(kind: str, name: Any, matrices: dict[str, Matrix], quantities: Any) -> Model:
    """The model of a statement; the same object for the same statement."""
    key = next(iter(matrices))
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise Unfit("name", f"found {name!r}; accepted: a text of one line")
    if name.strip() in MODELS:
        raise Unfit("name", f"'{name.strip()}' is a model of tmsopt's own; give yours another name")
    if not isinstance(quantities or {}, Mapping):
        raise Unfit("quantities", f"found {type(quantities).__name__}; accepted: a mapping of names to expressions")
    matrices, derived = untexted(matrices, quantities or {}, _unfit)
    given = {
        (n, f"entry {j}" if kind == "coefficients" else f"row {i}, column {j}"): x
        for n, rows in matrices.items()
        for i, row in enumerate(rows, start=1)
        for j, x in enumerate(row, start=1)
    } | {("quantities", str(n)): x for n, x in derived.items()}
    entries = {place: scalar(whole(place[0]), place[1], x) for place, x in given.items()}
    every = ca.vertcat(*entries.values())
    texts = number_texts(every)
    numbers = [number_symbol(text) for text in texts]
    in_numbers = {x.name() for x in numbers}
    ordered = ca.vertcat(*(entries[place] for place in in_order(kind, entries)))
    symbols = [x for x in ca.symvar(ordered) if x.name() not in in_numbers]
    names = tuple(x.name() for x in symbols)
    twice = {n for n in names if names.count(n) > 1}
    if twice:
        raise Unfit(key, f"has two symbols named {min(twice)}; make one and use it everywhere")
    if not names:
        raise Unfit(key, "names no parameter, so there is nothing to design; name one entry, such as 'k'")
    for n in names:
        if why := unusable(n, kind == "hamiltonian"):
            raise Unfit(key, f"has a symbol named {n!r}, which {why}; give it another name")
    for n in derived:
        if why := "is the name of a parameter" if n in names else unusable(n, kind == "hamiltonian"):
            raise Unfit("quantities", f"{n!r} {why}; give the quantity a name of its own")
    shapes = tuple((n, len(rows), len(rows[0])) for n, rows in matrices.items())
    exact = ca.Function("stated", [ca.vertcat(*symbols, *numbers)], [ca.densify(every)])
    if wrong := faulty(rebuilt(names, texts, exact).function):
        (key, where), why = list(given)[wrong[0]], wrong[1]
        raise Unfit(whole(key), f"{where}: {why}")
    return _rebuilt(kind, name.strip(), names, shapes, tuple(derived), exact.serialize(), texts)


@lru_cache(maxsize=64)
def _rebuilt(
    kind: str,
    name: str,
    names: tuple[str, ...],
    shapes: tuple[tuple[str, int, int], ...],
    derived: tuple[str, ...],
    serialized: str,
    texts: tuple[str, ...],
    carrier: float = 0.0,
) -> Model:
    """A model from plain data; in each process there is one of each."""
    entry = rebuilt(names, texts, ca.Function.deserialize(serialized))
    count = sum(rows * columns for _, rows, columns in shapes)
    symbols = {n: ca.SX.sym(n) for n in names}
    written = ca.vertsplit(entry.exact(ca.vertcat(*symbols.values(), *map(number_symbol, texts))))
    zero = [e.is_zero() for e in written]

    def blocks(entries: Sequence[Any]) -> dict[str, Matrix]:
        found = [0 if zero[k] else x for k, x in enumerate(entries[:count])]
        taken, at = {}, 0
        for n, rows, columns in shapes:
            taken[n] = [found[at + i * columns : at + (i + 1) * columns] for i in range(rows)]
            at += rows * columns
        return closed(taken)

    def every(values: Mapping[str, Any]) -> list[Any]:
        return polynomial(kind, blocks(entry(values)), carrier)

    def vanish(leading: int) -> int:
        """How many of so many leading coefficients are 0 by their expressions, one after the other."""
        field = Field(entry.exact, entry.numbers())
        try:
            found = blocks(walk(entry.exact, field.inputs, field.arithmetic())[0])
            for n in ("D", "K")[max(leading - 1, 0) :] if "M" in found else ():  # without part in these coefficients
                found[n] = [[0] * len(found["M"]) for _ in found["M"]]
            row = polynomial(kind, found)[:leading]
            return next((k for k, c in enumerate(row) if not field.vanishes(c)), leading)
        except (ZeroDivisionError, NotAccepted):  # or too large to tell
            return 0

    def alone(written: Any) -> Any:
        formula = formulas([written], names)
        return lambda values: formula(values)[0]

    lost = _vanishing(every, names)
    lost = lost and vanish(lost)
    if lost == (degree := count - 1 if kind == "coefficients" else shapes[0][1] * (1 if shapes[0][0] == "A" else 2)):
        raise Unfit(shapes[0][0], "makes a polynomial without s, which has no root")
    quick = formulas(every(symbols)[lost:], names)

    def coefficients(**values: Any) -> list[Any]:
        # The determinant of the entries themselves where numbers are exact: CasADi folds constants as doubles.
        if not any(map(is_ball, values.values())):
            return quick(values)
        number = exact if all(isinstance(x, flint.fmpq | Bounded | Formal) for x in values.values()) else _ball
        return [number(c) for c in every(values)[lost:]]

    of = ParameterSet("stated", tuple(Parameter(n, "1", "parameter", latex(n)) for n in names), native=dict)
    made = Model(
        name=name,
        title=name,
        degree=degree - lost,
        sets=(of,),
        algebraic=dict,
        polynomial=coefficients,
        quantities=tuple(
            Quantity(n, "1", "quantity", latex(n), alone(x)) for n, x in zip(derived, written[count:], strict=True)
        ),
        pencil=None if kind == "coefficients" else lambda values: pencil(blocks(entry(values)), carrier),
    )
    plain = (kind, name, names, shapes, derived, serialized, texts)
    decimals = dict.fromkeys(step.constant for step in steps(entry.exact) if step.operation == ca.OP_CONST)
    made = replace(
        made,
        origin=(_rebuilt, (*plain, carrier) if carrier else plain),
        statement=_statement(entry, shapes, derived),
        numbers=(*(n for n in texts if not n.lstrip("-").isdigit()), *(repr(x) for x in decimals if x % 1)),
    )
    if kind != "hamiltonian":
        return made
    return complex_model(
        made,
        carrier,
        carriers(entry(symbols)[:count]),
        lambda c: _rebuilt(*plain, *([c] if c else [])),
        lambda values: pencil(blocks(entry(values))),
    )


def _statement(entry: Formulas, shapes: Sequence[tuple[str, int, int]], derived: Sequence[str]) -> dict[str, Any]:
    """What tells a model from others, every number in full."""
    texts, shared = spelled(entry.function, entry.names)
    rest = iter(texts)
    matrices = {n: [[next(rest) for _ in range(columns)] for _ in range(rows)] for n, rows, columns in shapes}
    quantities = dict(zip(derived, rest, strict=True))
    if IMAGINARY in matrices:
        imaginary = matrices.pop(IMAGINARY)
        each = (zip(re, im, strict=True) for re, im in zip(matrices["H"], imaginary, strict=True))
        matrices["H"] = [[complex_text(re, im) for re, im in row] for row in each]
    return {"parameters": list(entry.names), **matrices, "quantities": quantities, "shared": shared}


def _ball(x: Any) -> Any:
    """A coefficient as a ball, or as the series or the formula that it is."""
    x = exact(x)
    return flint.arb(x) if isinstance(x, flint.fmpq) else x


def _vanishing(polynomial: Any, names: Sequence[str]) -> int:
    """Number of leading coefficients that may be 0 for all parameters, as of a singular M: others are not, at a design.

    In balls of 60 digits at designs of many sizes and signs, for numbers as they print: [[0.1, 0.7], [0.3, 2.1]] is
    meant to be singular, and in binary it is not.
    """
    lost, known = 0, False
    with flint.ctx.workdps(_DIGITS):
        for i in range(_SAMPLES):
            share = [math.modf((i * len(names) + k + 1) * _GOLDEN)[0] for k in range(len(names))]
            # Both signs, sizes near 1 and then from 1e-6 to 1e6; at first positive numbers, where most formulas exist.
            signs = [-1 if i % 3 == 2 and math.modf(8 * x)[0] < 0.5 else 1 for x in share]
            reach = 6 if i < _SAMPLES // 2 else 40
            design = [sign * 2.0 ** (reach * (x - 0.5)) for sign, x in zip(signs, share, strict=True)]
            row = polynomial({n: exact(x) for n, x in zip(names, design, strict=True)})
            found = [flint.arb(c) for c in row]
            nonzero = next(
                (k for k, c in enumerate(found[:-1]) if not c.contains(0) or not c.is_finite()), len(row) - 1
            )
            if all(c.is_finite() for c in found[: nonzero + 1]):
                lost, known = (min(lost, nonzero) if known else nonzero), True
            if known and lost == 0:
                return 0
    return lost


def _unfit(message: str, key: str, *name: str) -> NoReturn:
    raise Unfit(key, ": ".join([*name, message]))


def scalar(key: str, where: str, value: Any) -> ca.SX:
    """An entry as an SX of one element.

    Raises:
        Unfit: for what is no finite number or SX.
    """
    if isinstance(value, ca.MX):
        raise Unfit(key, f"{where}: is MX; make the symbols by ca.SX.sym")
    if isinstance(value, ca.SX | ca.DM):
        if value.numel() != 1:
            raise Unfit(key, f"{where}: is a matrix; accepted: scalar expressions")
        return ca.densify(ca.SX(value))
    number = _number(key, where, value)
    return number_symbol(str(value)) if isinstance(value, Rational) else ca.SX(number)


def _number(key: str, where: str, value: Any) -> float:
    known = isinstance(value, Real) and not isinstance(value, bool)
    try:
        number = float(value) if known else math.nan
    except OverflowError:
        number = math.inf
    if known and not math.isfinite(number):
        raise Unfit(key, f"{where}: is {number}; {_FINITE}")
    if not known:
        raise Unfit(key, f"{where}: found {short(value)}; {_ACCEPTED}")
    return number
