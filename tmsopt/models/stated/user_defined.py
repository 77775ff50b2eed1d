"""Models of the user's own, by matrices, by a characteristic polynomial, or by a complex H."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from itertools import islice
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
from tmsopt.models.model import Matrices, Matrix, Model, Parameter, ParameterSet, Quantity
from tmsopt.models.names import latex, name_fault, number_text, spell_formula
from tmsopt.models.stated.closed_loop import LOOP_KEYS, check_loop, close_loop
from tmsopt.models.stated.degree import first_fault
from tmsopt.models.stated.equations import IMAGINARY, join_parts, pencil, polynomial, sort_places, user_key
from tmsopt.models.stated.pairs import Pair, complex_text, join
from tmsopt.models.stated.real_form import ABSENT, CONVENTIONS, WORDS
from tmsopt.models.stated.texts import Unfit, are_complex, describe_position, parse_entries
from tmsopt.records import AnyNumbers

_ACCEPTED_ENTRIES = "accepted: finite numbers, expressions in quotes, and SX expressions"
_ACCEPTED_NUMBERS = "accepted: finite numbers, and expressions of them"

_MAX_SIZE = dict.fromkeys("MDK", 50) | dict.fromkeys("AH", 100) | dict.fromkeys(("coefficients", *LOOP_KEYS), 12)
"""Key → largest number of rows and columns of a matrix; for coefficients, largest degree."""

_MAX_POLYNOMIAL_SIZE = dict.fromkeys("MDK", 6) | {"A": 12}
"""Key → largest number of rows of a real matrix whose characteristic polynomial is used."""

_Shape = tuple[str, int, int]  # key, number of rows and number of columns of a matrix
_SAMPLES = 24  # a coefficient that is 0 at so many designs is then tested exactly


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
        M, D, K: square, up to 50 × 50, as nested lists, NumPy arrays, SX or DM; D is 0 by default. An entry is a
            number, text as in a problem file such as ``"1 + mu*w**2"``, or an SX. If an entry is complex, such as
            ``"1 + 0.1j*h"``, the system is complex, as in `from_hamiltonian`, and results are about ω = i s.
        A: square, up to 100 × 100, in place of M, D and K.
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
    all_matrices = {"A": A, "M": M, "D": D, "K": K, "B": B, "C": C, "G": G}
    given_matrices = {n: value for n, value in all_matrices.items() if value is not None}
    if "A" in given_matrices and not given_matrices.keys().isdisjoint("MDK"):
        raise Unfit("A", "is given together with M, D or K; give either A, or M and K (and D)")
    for n in () if "A" in given_matrices else ("M", "K"):
        if n not in given_matrices:
            raise Unfit(n, "is missing; give M and K (and D), or A, or coefficients")
    matrices = {n: _read_matrix(n, value) for n, value in given_matrices.items()}
    rows_of_M = len(masses := matrices.get("M", []))
    for n in ("D", "K"):
        if (size := len(matrices.get(n, masses))) != rows_of_M:
            raise Unfit(n, f"is {size} × {size}, but M is {rows_of_M} × {rows_of_M}; accepted: matrices of one size")
    check_loop({n: (len(rows), len(rows[0])) for n, rows in matrices.items()})
    return _build_model("matrices", name, matrices, quantities)


def from_coefficients(coefficients: Any, *, name: str = "stated", quantities: AnyNumbers | None = None) -> Model:
    """A model of a characteristic polynomial with descending coefficients, which are like entries of `from_matrices`.

    Raises:
        Unfit: if there are fewer than 2 coefficients or more than 13, or the leading one is 0.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> tmsopt.solve(tmsopt.Problem(swing, fixed={"k": 4.0}, free={"c": (0, 9)}, minimize="abscissa")).structure
        'EP2'

    More: docs/tutorials/own_system.md
    """
    entries, max_entries = _list_entries(coefficients), _MAX_SIZE["coefficients"] + 1
    row = None if entries is None or any(_list_entries(x) is not None for x in entries) else entries
    if row is None or not 2 <= len(row) <= max_entries:
        description = "no list" if row is None else f"{len(row)} entries"
        accepted = f"a list of 2 to {max_entries} coefficients, descending"
        raise Unfit("coefficients", f"found {description}; accepted: {accepted}")
    return _build_model("coefficients", name, {"coefficients": [row]}, quantities)


def from_hamiltonian(H: Any, *, name: str = "stated", quantities: AnyNumbers | None = None) -> Model:
    """A model of ψ′ = −i H ψ with a complex matrix H and eigenfrequencies ω = i s.

    Results refer to H: ``EP2`` is an exceptional point of H, the ``abscissa`` is the greatest Im ω (gain minus loss),
    and multiplicities belong to H.

    Args:
        H: square, up to 100 × 100, as nested lists or a NumPy array. An entry is a real or complex number, text as in
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
    return _build_model("hamiltonian", name, {"H": _read_matrix("H", H)}, quantities)


def _list_entries(value: Any) -> list[Any] | None:
    """The entries of a list, a CasADi vector or an array; None for other values."""
    if isinstance(value, ca.SX | ca.DM):
        return ca.vertsplit(ca.vec(value)) if value.is_vector() and not value.is_scalar() else None
    if isinstance(value, np.ndarray):
        return list(value) if value.ndim else None
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else None


def _read_matrix(key: str, value: Any) -> Matrix:
    """The rows of a matrix. The matrices of a controller may have any shape, the others must be square."""
    if isinstance(value, ca.SX | ca.DM):
        rows: list[Any] = [ca.horzsplit(row) for row in ca.vertsplit(value)]
    elif (entries := _list_entries(value)) is None or (isinstance(value, np.ndarray) and value.ndim != 2):
        description = f"an array of {value.ndim} dimensions" if isinstance(value, np.ndarray) else type(value).__name__
        raise Unfit(key, f"found {description}; accepted: a matrix as nested lists, a NumPy array, SX or DM")
    else:
        rows = [_list_entries(row) for row in entries]
    sizes, max_size = [None if row is None else len(row) for row in rows], _MAX_SIZE[key]
    size, accepted = len(rows), "as many rows as entries in each"
    if key in LOOP_KEYS:
        size, accepted = next(iter(sizes), 0) or 0, "rows of equal length"
    if not size or any(length != size for length in sizes):
        shape = " + ".join("?" if length is None else str(length) for length in sizes)
        raise Unfit(key, f"found rows of {shape or 'no'} entries; accepted: {accepted}")
    if max(size, len(rows)) > max_size:
        raise Unfit(key, f"is {len(rows)} × {size}; accepted: up to {max_size} × {max_size}")
    return rows


def _build_model(kind: str, name: Any, matrices: dict[str, Matrix], quantities: Any) -> Model:
    """The model of a system. Two equal systems give the same object."""
    key, of_H = next(iter(matrices)), are_complex(matrices)
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise Unfit("name", f"found {name!r}; accepted: a text of one line")
    if name.strip() in MODELS:
        raise Unfit("name", f"'{name.strip()}' is a built-in model; choose another name")
    if not isinstance(quantities or {}, Mapping):
        raise Unfit("quantities", f"found {type(quantities).__name__}; accepted: a mapping of names to expressions")
    matrices, quantity_nodes = parse_entries(
        matrices, {n: _read_node("quantities", n, x) for n, x in (quantities or {}).items()}, _unfit
    )
    if of_H:
        matrices = {
            key: [[getattr(x, part) for x in row] for row in rows]
            for n, rows in matrices.items()
            for key, part in ((n, "re"), (n + IMAGINARY, "im"))
        }
    entry_by_position = {
        (n, describe_position(n, i, j)): x
        for n, rows in matrices.items()
        for i, row in enumerate(rows, start=1)
        for j, x in enumerate(row, start=1)
    } | {("quantities", str(n)): x for n, x in quantity_nodes.items()}
    inputs = ca.symvar(ca.vertcat(ca.SX(0, 1), *(x for x in entry_by_position.values() if isinstance(x, ca.SX))))
    symbols = Counter(x.name() for x in inputs)
    entries = {position: _read_node(user_key(position[0]), position[1], x) for position, x in entry_by_position.items()}
    names = formula(entries[position] for position in sort_places(of_H, entries)).names
    if duplicates := [n for n, count in symbols.items() if count > 1]:
        raise Unfit(key, f"has two symbols named {min(duplicates)}; make one and use it everywhere")
    if not names:
        raise Unfit(key, "names no parameter, so there is nothing to design; write a name in an entry, such as 'k'")
    for n in names:
        if reason := name_fault(n, of_H):
            raise Unfit(key, f"has a symbol named {n!r}, which {reason}; choose another name")
    for n in quantity_nodes:
        if reason := "is the name of a parameter" if n in names else name_fault(n, of_H):
            raise Unfit("quantities", f"{n!r} {reason}; choose another name for the quantity")
    shapes = tuple((n, len(rows), len(rows[0])) for n, rows in matrices.items())
    entry_formula = formula(entries.values(), names)
    if fault := first_fault(entry_formula):
        index, reason = fault
        key, position_text = list(entry_by_position)[index]
        raise Unfit(user_key(key), f"{position_text}: {reason}")
    return _build_from_data(kind, name.strip(), shapes, tuple(quantity_nodes), entry_formula)


@lru_cache(maxsize=64)
def _build_from_data(
    kind: str,
    name: str,
    shapes: tuple[_Shape, ...],
    quantity_names: tuple[str, ...],
    entry_formula: Formula,
) -> Model:
    """A model from plain data. Each process has one object for each model.

    Args:
        shapes: shapes of the matrices whose entries are the first outputs of `entry_formula`.
        quantity_names: names of the quantities, which are the other outputs.
    """
    names = entry_formula.names
    entries = fold(entry_formula, {n: symbol(n) for n in names}, NODES)
    remaining_entries = iter(entries)
    blocks = close_loop(join_parts(_split(remaining_entries, shapes)))
    is_complex = any(n.endswith(IMAGINARY) for n, *_ in shapes)
    matrices = None if kind == "coefficients" and not is_complex else pencil(blocks)
    coefficients, degree = None, (len(matrices) - 1) * len(matrices[0]) if matrices else 0
    if not is_complex and (matrices is None or len(matrices[0]) <= _MAX_POLYNOMIAL_SIZE[shapes[0][0]]):
        coefficients = _find_polynomial(kind, shapes[0][0], blocks, names)
        degree = len(coefficients.outputs) - 1
    quantities = zip(quantity_names, remaining_entries, strict=True)
    parameters = tuple(Parameter(n, "1", "parameter", latex(n)) for n in names)
    model = Model(
        name=name,
        title=name,
        degree=degree,
        sets=(ParameterSet("stated", parameters, native=dict),),
        algebraic=dict,
        polynomial=None if coefficients is None else lambda **numbers: values(coefficients, numbers),
        quantities=tuple(Quantity(n, "1", "quantity", latex(n), _make_function(x, names)) for n, x in quantities),
        pencil=None if matrices is None else _matrices(matrices, names),
        origin=(_build_from_data, (kind, name, shapes, quantity_names, entry_formula)),
        statement=_statement(entry_formula, shapes, quantity_names),
        numbers=tuple(number_text(x) for x in entry_formula.constants if getattr(x, "denominator", 0) != 1),
    )
    if not is_complex:
        return model
    return replace(model, is_complex=True, words=WORDS, absent=ABSENT, conventions=CONVENTIONS)


def _find_polynomial(kind: str, key: str, blocks: dict[str, Matrix], names: Sequence[str]) -> Formula:
    """The coefficients of the characteristic polynomial, without leading ones that are 0 for all parameters."""
    all_coefficients = polynomial(kind, blocks)
    zero_count = _leading_zeros(formula(all_coefficients, names))
    zero_count = zero_count and _count_identical_zeros(kind, blocks, names, zero_count)
    if zero_count == len(all_coefficients) - 1:
        raise Unfit(key, "gives a polynomial without s, which has no root")
    return formula(all_coefficients[zero_count:], names)


def _make_function(x: Any, names: Sequence[str]) -> Callable[[AnyNumbers], Any]:
    output = formula([x], names)
    return lambda numbers: values(output, numbers)[0]


def _matrices(rows: Sequence[Matrix], names: Sequence[str]) -> Callable[[AnyNumbers], Matrices]:
    """A function from named numbers to matrices, for matrices of nodes or of pairs of nodes."""
    n, entries = len(rows[0]), [x for P in rows for row in P for x in row]
    parts = formula((y for x in entries for y in ((x.re, x.im) if isinstance(x, Pair) else (x,))), names)
    shapes = [(str(k), n, n) for k in range(len(rows))]

    def evaluate(numbers: AnyNumbers) -> Matrices:
        remaining = iter(values(parts, numbers))
        joined = [join(next(remaining), next(remaining)) if isinstance(x, Pair) else next(remaining) for x in entries]
        return tuple(_split(iter(joined), shapes).values())

    return evaluate


def _count_identical_zeros(kind: str, blocks: Mapping[str, Matrix], names: Sequence[str], max_count: int) -> int:
    """The number of coefficients before the first one that is not 0 for all parameters; at most `max_count`."""
    relevant_blocks = dict(blocks)
    # The leading coefficients do not depend on these matrices.
    for n in ("D", "K")[max(max_count - 1, 0) :] if "M" in relevant_blocks else ():
        relevant_blocks[n] = [[0] * len(relevant_blocks["M"]) for _ in relevant_blocks["M"]]
    coefficients = formula(polynomial(kind, relevant_blocks)[:max_count], names)
    field = Field(coefficients)
    try:
        row = fold(coefficients, field.inputs, field.kind)
        return next((k for k, c in enumerate(row) if not field.is_zero(c)), max_count)
    except (ZeroDivisionError, UnsupportedOperation):  # the formulas are too large to decide
        return 0


def _statement(entry_formula: Formula, shapes: tuple[_Shape, ...], quantity_names: Sequence[str]) -> dict[str, Any]:
    """Plain data that identify a model, with all digits of its numbers."""
    texts, long_parts = spell_formula(entry_formula)
    remaining_texts = iter(texts)
    matrices, quantities = _split(remaining_texts, shapes), dict(zip(quantity_names, remaining_texts, strict=True))
    for n in [n for n in matrices if n + IMAGINARY in matrices]:
        rows = zip(matrices[n], matrices.pop(n + IMAGINARY), strict=True)
        matrices[n] = [list(map(complex_text, *row)) for row in rows]
    return {"parameters": list(entry_formula.names), **matrices, "quantities": quantities, "shared": long_parts}


def _split(entries: Iterator[Any], shapes: Iterable[_Shape]) -> dict[str, Matrix]:
    """Key → matrix of the given shape; the entries fill the rows of the matrices in order."""
    return {n: [list(islice(entries, columns)) for _ in range(rows)] for n, rows, columns in shapes}


def _leading_zeros(coefficients: Formula) -> int:
    """Number of leading coefficients that may be 0 for all parameters, e.g. if M is singular.

    A coefficient is not one of them if it is not 0, to 60 digits, at one of 24 designs of many sizes and signs.
    """
    names, rng = coefficients.names, np.random.default_rng(0)
    zero_counts: list[int] = []
    with flint.ctx.workdps(DIGITS):
        for i in range(_SAMPLES):
            # A third of the designs has positive and negative numbers. The sizes are near 1 in the first half of the
            # designs, and from 1e-6 to 1e6 in the second half.
            signs = rng.choice((-1, 1) if i % 3 == 2 else (1,), len(names))
            design = signs * 2.0 ** (rng.uniform(-0.5, 0.5, len(names)) * (6 if i < _SAMPLES // 2 else 40))
            balls = [flint.arb(c) for c in fold(coefficients, dict(zip(names, design.tolist(), strict=True)), BALLS)]
            zeros = [c.is_finite() and c.contains(0) for c in balls[:-1]]
            first = zeros.index(False) if False in zeros else len(zeros)
            zero_counts += [first] if balls[first].is_finite() else []
            if 0 in zero_counts:
                break
    return min(zero_counts, default=0)


def _unfit(message: str, key: str, *name: str) -> NoReturn:
    raise Unfit(key, ": ".join([*name, message]))


def _read_node(key: str, position_text: Any, value: Any) -> Any:
    """An entry as a node; a text is returned unchanged.

    Raises:
        Unfit: if it is not a finite number or a scalar SX.
    """
    if isinstance(value, str | Node):
        return value
    if isinstance(value, ca.MX):
        raise Unfit(key, f"{position_text}: found MX; accepted: SX, with symbols from ca.SX.sym")
    if isinstance(value, ca.SX | ca.DM):
        if value.numel() != 1:
            raise Unfit(key, f"{position_text}: is a matrix; accepted: scalar expressions")
        inputs = ca.symvar(entry := ca.densify(ca.SX(value)))
        names = [x.name() for x in inputs]
        return nodes_from_casadi(ca.Function("entry", [ca.vertcat(ca.SX(0, 1), *inputs)], [entry]), names)[0]
    if not isinstance(value, Real) or isinstance(value, bool):
        raise Unfit(key, f"{position_text}: found {short(value)}; {_ACCEPTED_ENTRIES}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise Unfit(key, f"{position_text}: is {number}; {_ACCEPTED_NUMBERS}")
    return constant(Fraction(value) if isinstance(value, Rational) else number)
