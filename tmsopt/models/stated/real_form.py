"""A complex system as a real system of twice the size.

A carrier, a real constant, is added to all eigenfrequencies, so that no root meets the conjugate of another root.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from itertools import product as combinations
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, Node, constant, formula, symbol
from tmsopt.algebra.intervals import Interval
from tmsopt.algebra.kinds import values
from tmsopt.models.model import Matrices, Matrix, Model
from tmsopt.models.stated.pairs import Pair, list_parts, pair
from tmsopt.records import AnyNumbers, Array
from tmsopt.roots.polynomial import characteristic_polynomial, product

# The spread is the largest distance of Re ω from the middle of all Re ω, and at least the largest |Im ω|.

_NEGLIGIBLE = 2.0**-300  # a smaller spread comes from rounding, and its carrier would underflow
_MIN_SPREAD = 1e-6  # least spread, relative to the largest frequency; a smaller one would not save digits
_MIN_SHARE = 1 / 64  # least spread relative to A; the eigenvalues of a defective A have no spread, but a large rounding
_SAMPLE_SIZE = 256  # designs of a sample of the ranges
_SPREAD_FACTOR = 1.25  # the spread in a sample is multiplied by this factor
_MAX_CORNER_PARAMETERS = 8  # with more parameters, a sample does not contain the corners of the ranges
_STEPS = 32  # a carrier is a multiple of its size divided by this, so that similar ranges have the same carrier

WORDS = ("threshold", "zero frequency")

ABSENT = {
    "damping_ratio": (
        "frequencies of a complex H have no zero, because it may be written in a rotating frame; write abscissa, which "
        "is minus the least loss, or your own [model.quantities], such as a quality factor"
    ),
    "angular_frequency": (
        "frequencies of a complex H have no zero, because it may be written in a rotating frame; limit the parameters "
        "on the diagonal of H instead"
    ),
}

CONVENTIONS = (
    "psi' = -i H psi; an eigenfrequency omega = i s decays at the rate -Im omega: loss is negative, gain positive.",
)


def choose_carrier(model: Model, box: Mapping[str, Interval]) -> float:
    """The carrier for the eigenfrequencies of a complex system x′ = A x with native parameters in a box."""
    names = model.sets[0].names
    entries = [constant(x) for x in list_parts([_state_matrix(model)])]
    return carrier_for(*_bound_frequencies(entries, {n: box[n] for n in names}))


@lru_cache(maxsize=64)
def real_model(model: Model, carrier: float) -> Model:
    """The real system of twice the size of a complex system x′ = A x, with the carrier c.

    Its polynomial is |det(s − A + i c)|² for real s. The roots are those of A minus i c, and their conjugates.
    """
    names, A = model.sets[0].names, _state_matrix(model)
    n = len(A)
    A = [[x - Pair(0, Fraction(carrier)) if i == j else x for j, x in enumerate(row)] for i, row in enumerate(A)]
    coefficients = [pair(x) for x in characteristic_polynomial(A)]
    re, im = [x.re for x in coefficients], [x.im for x in coefficients]
    polynomial = formula([a + b for a, b in zip(product(re, re), product(im, im), strict=True)], names)
    rows = [[(-x.re, x.im) for x in row] for row in A]
    doubled = [[*(a for a, _ in row), *(b for _, b in row)] for row in rows]
    doubled += [[*(-b for _, b in row), *(a for a, _ in row)] for row in rows]
    matrices = formula([x for row in doubled for x in row], names)

    def pencil(numbers: AnyNumbers) -> Matrices:
        entries = values(matrices, numbers)
        return np.eye(2 * n, dtype=int).tolist(), [entries[k : k + 2 * n] for k in range(0, len(entries), 2 * n)]

    return replace(
        model,
        degree=2 * n,
        polynomial=lambda **numbers: values(polynomial, numbers),
        pencil=pencil,
        origin=(real_model, (model, carrier)),
        statement=None,
        is_complex=False,
    )


def _state_matrix(model: Model) -> Matrix:
    """A of x′ = A x, as pairs of nodes of the native parameters."""
    assert model.pencil is not None
    _, rows = model.pencil({n: symbol(n) for n in model.sets[0].names})
    return [[-pair(x) for x in row] for row in rows]


def carrier_for(middle: float, spread: float) -> float:
    """The carrier for eigenfrequencies within `spread` of `middle`; their middle moves to 2 to 4 times the spread."""
    distance = 2.0 ** math.ceil(math.log2(2 * spread))
    step = distance / _STEPS
    return distance - step * round(middle / step)


def _bound_frequencies(entries: Sequence[Node], box: Mapping[str, Interval]) -> tuple[float, float]:
    """The middle and the spread of Re ω = −Im s at designs spread over a box; the spread is at least max |Im ω|.

    Args:
        entries: real and imaginary part of each entry of A.
    """
    sample = _sample_matrices(formula(entries, box), math.isqrt(len(entries) // 2), [*box.values()])
    if not len(sample):
        return 0.0, 1.0
    omega = 1j * np.linalg.eigvals(sample)
    low, high = float(omega.real.min()), float(omega.real.max())
    spread = _SPREAD_FACTOR * max((high - low) / 2, float(np.abs(omega.imag).max()))
    means = omega.mean(axis=-1)[:, None, None] * np.eye(sample.shape[-1])
    size = float(np.linalg.norm(1j * sample - means, axis=(-2, -1)).max())
    spread = max(spread, _MIN_SHARE * size, _MIN_SPREAD * max(abs(low), abs(high)))
    return (low + high) / 2, spread if spread > _NEGLIGIBLE else 1.0


def _sample_matrices(matrix: Formula, n: int, box: Sequence[Interval]) -> Any:
    """A at designs in a box, with its corners if they are few, without those where it is not finite."""
    points = _unit_points(len(box))
    if len(box) <= _MAX_CORNER_PARAMETERS:
        points = np.concatenate([points, np.array(list(combinations((0.0, 1.0), repeat=len(box))))])
    entries = _evaluate(matrix, box, points)
    A = (entries[::2] + 1j * entries[1::2]).T.reshape(-1, n, n)
    return A[np.isfinite(A).all(axis=(1, 2))]


def _evaluate(outputs: Formula, box: Sequence[Interval], points: Array) -> Array:
    """Values of a formula at designs of a box: a row for each output, a column for each design.

    Args:
        points: a row for each design, with coordinates from 0 to 1 in the box.
    """
    columns = {name: lo + (hi - lo) * x for name, (lo, hi), x in zip(outputs.names, box, points.T, strict=True)}
    return np.array([np.broadcast_to(np.asarray(x, dtype=float), len(points)) for x in values(outputs, columns)])


def _unit_points(size: int) -> Array:
    """Evenly spread points of the unit cube."""
    steps = 1 / np.sqrt([2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41])
    points = np.modf(np.outer(np.arange(_SAMPLE_SIZE), steps))[0]
    return np.asarray(points[:, np.arange(size) % len(steps)])
