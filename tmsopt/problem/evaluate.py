"""Evaluates expressions for many designs at once, in arrays of doubles.

Each set of expressions becomes one formula, which is evaluated on columns: an array of values for each parameter.
Columns with error bounds (`Bounded`) give values with error bounds.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.algebra.arrays import evaluate_on_arrays
from tmsopt.algebra.formula import Formula, formula, symbol
from tmsopt.errors import Fault, InputError
from tmsopt.models import Model, ParameterSet, Values
from tmsopt.models.expression import Expression, ExpressionError
from tmsopt.models.model import ROOTS
from tmsopt.models.stated.pairs import list_parts
from tmsopt.models.user_spectrum import AXIS_TOLERANCE
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, NO_RADIUS, regularise
from tmsopt.records import AnyNumbers, Complex
from tmsopt.roots import CLASSES, Conditioning, find_conditioning, find_motion, roots
from tmsopt.roots.chains import batch_eigenvalues

_MAX_ENTRIES = 2**18  # largest number of entries of the state matrices that are computed together: 4 MB for each array


@dataclass(frozen=True)
class ArrayFunction:
    """Expressions as a function of arrays of parameters.

    Attributes:
        formula: function of the parameters and root quantities with one output per expression.
        names: names of the expressions.
    """

    problem: Posed
    formula: Formula = field(repr=False)
    names: tuple[str, ...]

    def __call__(self, columns: AnyNumbers) -> dict[str, Any]:
        """Values of the expressions, left minus right for a comparison; nan if undefined.

        Args:
            columns: every parameter, and any known root quantities, as numbers or arrays that broadcast. Use shapes
                (1, n) and (m, 1) for the axes of a grid.

        Returns:
            Name → value, in the shape of the columns that the expression depends on.
        """
        missing_names = {n for n in self.formula.inputs if n not in columns}
        root_values = find_root_quantities(self.problem, columns, missing_names)[1] if missing_names else {}
        return dict(zip(self.names, evaluate_on_arrays(self.formula, {**columns, **root_values}), strict=True))


def evaluate(problem: Posed, expressions: Iterable[str | Expression], columns: AnyNumbers) -> list[Any]:
    """Values of expressions in the given order. The functions that compute them are cached."""
    return list(_cached_function(problem, tuple(expressions))(columns).values())


def array_function(problem: Posed, expressions: Mapping[str, str | Expression]) -> ArrayFunction:
    """Expressions in the vocabulary of a problem as a function of arrays of designs.

    Args:
        expressions: name → expression, as text or parsed; names of quantities, such as ``a0``, are expressions.

    Raises:
        InputError: for a text that is no expression of this problem.
    """
    nodes = nodes_of(problem, expressions)
    return ArrayFunction(problem, formula(nodes.values(), (*problem.parameter_set.names, *ROOTS)), tuple(nodes))


@lru_cache(maxsize=64)
def _cached_function(problem: Posed, expressions: tuple[str | Expression, ...]) -> ArrayFunction:
    return array_function(problem, {f"{k}": e for k, e in enumerate(expressions)})


def coefficients_of(problem: Posed, columns: AnyNumbers) -> list[Any]:
    """Coefficients of designs; each has the shape of the columns that it depends on."""
    return evaluate_on_arrays(coefficient_formula(problem.model, problem.parameter_set.name), columns)


def find_root_quantities(
    problem: Posed, columns: AnyNumbers, names: Collection[str] = ROOTS
) -> tuple[Any, dict[str, Any]]:
    """Whether designs have all their roots, and root quantities from numeric roots, as `roots_of` gives them.

    As in the recheck, all coefficients must be finite and the mass matrix nonsingular.
    """
    if problem.model.polynomial is None:
        s = compute_eigenvalues(problem.model, problem.parameter_set, columns)
        return np.isfinite(s).all(axis=-1), describe_eigenvalues(s, problem.model.is_complex)
    a = coefficients_of(problem, columns)
    return reduce(np.logical_and, map(np.isfinite, a), a[0] != 0), roots_of(a, names)


def evaluate_matrices(model: Model, parameter_set: ParameterSet, columns: AnyNumbers) -> NDArray[Any]:
    """Matrices P₀ … P_d of L(s) = Σ Pₖ s^(d−k) for many designs, shape (…, d + 1, n, n); complex for a complex H.

    Coefficients without matrices are matrices with one entry.

    Args:
        columns: every parameter of the set, as numbers or arrays that broadcast.
    """
    entries, matrix_shape = _matrix_formula(model, parameter_set.name)
    shape = np.broadcast_shapes(*map(np.shape, columns.values()))
    parts = np.empty((*shape, len(entries.outputs)))
    for k, x in enumerate(evaluate_on_arrays(entries, columns)):
        parts[..., k] = x
    numbers = parts[..., ::2] + 1j * parts[..., 1::2] if model.is_complex else parts[..., ::2]
    return numbers.reshape(*shape, *matrix_shape)


@lru_cache(maxsize=64)
def _matrix_formula(model: Model, set_name: str) -> tuple[Formula, tuple[int, int, int]]:
    """Real and imaginary part of each entry of the matrices as a formula, and the shape of the matrices."""
    parameter_set = model.parameter_set(set_name)
    symbols = {n: symbol(n) for n in parameter_set.names}
    if model.pencil is not None:
        matrices = model.pencil(parameter_set.native(symbols))
    else:
        matrices = tuple([[c]] for c in model.coefficients(symbols, parameter_set))
    n = len(matrices[0])
    return formula(list_parts(matrices), parameter_set.names), (len(matrices), n, n)


def find_eigenvalues(model: Model, parameter_set: ParameterSet, columns: AnyNumbers) -> Conditioning:
    """All eigenvalues of many designs with their sensitivities, shape (…, number of eigenvalues).

    Args:
        columns: as for `evaluate_matrices`.
    """
    shape, batches = _batches(model, parameter_set, columns)
    arrays = map(np.concatenate, zip(*(vars(find_conditioning(batch)).values() for batch in batches), strict=True))
    return Conditioning(*(x.reshape(*shape, x.shape[-1]) for x in arrays))


def compute_eigenvalues(model: Model, parameter_set: ParameterSet, columns: AnyNumbers) -> Complex:
    """All eigenvalues of many designs, shape (…, number of eigenvalues); nan where undefined.

    Args:
        columns: as for `evaluate_matrices`.
    """
    shape, batches = _batches(model, parameter_set, columns)
    s = np.concatenate([*map(batch_eigenvalues, batches)])
    return s.reshape(*shape, s.shape[-1])


def _batches(
    model: Model, parameter_set: ParameterSet, columns: AnyNumbers
) -> tuple[tuple[int, ...], Iterator[NDArray[Any]]]:
    """The shape of the columns, and the matrices of so many designs at a time that they fit the memory."""
    shape = np.broadcast_shapes(*map(np.shape, columns.values()))
    flat_columns = {n: np.broadcast_to(x, shape).reshape(-1) for n, x in columns.items()}
    _, (terms, n, _) = _matrix_formula(model, parameter_set.name)
    step = max(1, _MAX_ENTRIES // ((terms - 1) * n) ** 2)
    parts = ({m: x[k : k + step] for m, x in flat_columns.items()} for k in range(0, max(math.prod(shape), 1), step))
    return shape, (evaluate_matrices(model, parameter_set, part) for part in parts)


def describe_eigenvalues(s: Complex, is_complex: bool) -> dict[str, Any]:
    """Root quantities, class and number of real roots, as `Motion` and `Classes` define them, for eigenvalues.

    A real part of at most `AXIS_TOLERANCE` of the largest eigenvalue counts as 0 for the class.

    Args:
        s: shape (…, number of eigenvalues); nan where undefined.
        is_complex: whether the matrices are complex; then an eigenvalue has no partner, and 0 is no special frequency.
    """
    sizes, is_real = np.abs(s), (s.imag == 0) & (not is_complex)
    ratios = np.divide(-s.real, sizes, out=np.zeros(s.shape), where=sizes != 0)
    tolerance = AXIS_TOLERANCE * sizes.max(axis=-1, keepdims=True)
    names = {
        "heavily damped": (s.real < -tolerance).all(axis=-1) & is_real.all(axis=-1),
        "stable": (s.real < -tolerance).all(axis=-1),
        "capsize": (is_real & (s.real >= -tolerance)).any(axis=-1),
        "weave": np.isfinite(s).all(axis=-1),
    }
    return {
        "abscissa": s.real.max(axis=-1),
        "damping_ratio": np.where(is_complex, np.nan, ratios.min(axis=-1)),
        ANGULAR_FREQUENCY: np.abs(s.imag).max(axis=-1),
        "kind": np.select([*names.values()], [CLASSES.index(n) for n in names]),
        "real_roots": is_real.sum(axis=-1),
    }


@lru_cache(maxsize=64)
def coefficient_formula(model: Model, set_name: str) -> Formula:
    """The coefficients of a model as a formula in the parameters of a set."""
    all_outputs = model.formulas[set_name]
    return all_outputs.extract(all_outputs.outputs[len(model.sets[0].names) :])


def roots_of(coefficients: Collection[Any], names: Collection[str] = ROOTS) -> dict[str, Any]:
    """Root quantities from numeric roots, inaccurate near multiple roots; nan if a coefficient is not finite."""
    if not set(ROOTS) & set(names):
        return {}
    a = np.stack(np.broadcast_arrays(*coefficients), axis=-1)
    is_finite, a, quantities = np.isfinite(a).all(axis=-1), regularise(a), {}
    if ANGULAR_FREQUENCY in names:
        quantities[ANGULAR_FREQUENCY] = roots(a).imag.max(axis=-1)
    if {"abscissa", "damping_ratio"} & set(names):
        motion = find_motion(list(np.moveaxis(a, -1, 0)))
        quantities |= {"abscissa": motion.abscissa, "damping_ratio": motion.damping_ratio}
    return {n: np.where(is_finite, x, np.nan) for n, x in quantities.items()}


def nodes_of(problem: Posed, expressions: Mapping[str, str | Expression]) -> dict[str, Any]:
    """Expressions as nodes of a formula in parameters and root quantities; a comparison gives left minus right."""
    parameter_set = problem.parameter_set
    values = Values(problem.model, parameter_set, {n: symbol(n) for n in parameter_set.names}, extra=(NO_RADIUS,))
    values = values.with_known({n: symbol(n) for n in ROOTS})
    return {n: e(values) for n, e in parse_all(problem, expressions).items()}


def parse_all(problem: Posed, expressions: Mapping[str, str | Expression]) -> dict[str, Expression]:
    """Parse the expressions that are texts, in the vocabulary of a problem.

    Raises:
        InputError: listing every text that is no expression of this problem.
    """
    parsed_expressions: dict[str, Expression] = {}
    faults = []
    for name, expression in expressions.items():
        try:
            parsed_expressions[name] = expression if isinstance(expression, Expression) else problem.read(expression)
        except ExpressionError as error:
            faults.append(Fault(str(error), ("quantities", name)))
    if faults:
        raise InputError(faults)
    return parsed_expressions
