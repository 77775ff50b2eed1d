"""A complex system as a real system of twice the size.

A carrier, a real constant, is added to all eigenfrequencies, so that no root meets the conjugate of another root.
"""

from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

import numpy as np

from tmsopt.algebra.formula import formula, symbol
from tmsopt.algebra.kinds import values
from tmsopt.models.model import Matrices, Matrix, Model
from tmsopt.models.stated.pairs import Pair, pair
from tmsopt.records import AnyNumbers
from tmsopt.roots.polynomial import characteristic_polynomial, product

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
