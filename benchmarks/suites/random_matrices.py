"""Random pencils whose EP2 are the zeros of a discriminant, random diabolic points, and EPs next to such points.

In: a number and a seed. Out: the entries of a matrix, and the points as they follow from the entries alone: from a
Sylvester determinant in balls, or from the construction. Nothing here uses tmsopt.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import flint
import numpy as np

from benchmarks.suites.matrices import Rows, System

SIZES = (2,) * 90 + (3,) * 70 + (4,) * 25 + (5,) * 10 + (6,) * 5
"""Sizes of 200 pencils; one of size 6 takes as long as thirty of size 2."""

BOX = (-1000.0, 1000.0)
"""Range of x and y of a pencil."""

GAP = 1e-6
"""Distance of two EPs from the diabolic point that a perturbation splits into them."""

_DECIMALS = 1000  # the random numbers are whole multiples of 1/1000
_UNIT = 1e9  # and the entries with a gap are whole multiples of 1e-9, which doubles add without an error
_BITS = 3000  # of the discriminant
_ZERO_BITS = 100  # of its zeros
_SIGMA = np.array([[[0, 1], [1, 0]], [[1, 0], [0, -1]]])
_TURNS = ((0.6, 0.8), (-0.8, 0.6), (0.8, -0.6), (0.0, 1.0))


@dataclass(frozen=True)
class Pencil:
    """H₀ + (x + i y) H₁.

    Attributes:
        entries: as texts.
        zeros: x + i y of all EP2 in the plane.
    """

    entries: Rows
    zeros: tuple[complex, ...]


def make_pencil(number: int, seed: int) -> Pencil:
    """A pencil with random entries, and the zeros of its discriminant."""
    n = SIZES[number]
    H0, H1 = _draw(np.random.default_rng([seed, number]), 2, n)
    with flint.ctx.workprec(_BITS):
        places = [flint.acb(k) for k in range(n * (n - 1) + 1)]
        values = [_discriminant((H0 + k * H1).tolist()) for k in range(len(places))]
        zeros = flint.acb_poly.interpolate(places, values).roots(flint.arb(2) ** -_ZERO_BITS)
        found = tuple(complex(float(z.real.mid()), float(z.imag.mid())) for z in zeros)
    return Pencil(_write(np.array([H0, H1]), _DECIMALS, "x + 1j*y"), found)


def _discriminant(rows: Sequence[Sequence[complex]]) -> flint.acb:
    """The resultant of the characteristic polynomial and its derivative."""
    polynomial = flint.acb_mat(rows).charpoly()
    one, other = ([*p][::-1] for p in (polynomial, polynomial.derivative()))
    pairs = [(p, k) for p, q in ((one, other), (other, one)) for k in range(len(q) - 1)]
    return flint.acb_mat([[0] * k + p + [0] * (len(pairs) - k - len(p)) for p, k in pairs]).det()


def make_crossing(number: int, seed: int, gap: float = 0.0) -> System:
    """S (B ⊕ C) S⁻¹ whose eigenvalue c is double at a known diabolic point, or in two EPs next to it.

    Without a gap, B is c at the point, and all derivatives by x and y are random. With a gap, B is
    c + (u + i gap cos t) σ₁ + (v + i gap sin t) σ₃, where u and v are x and y from the point, and nothing couples B
    and C. The EPs are then at (u, v) = ±gap (−sin t, cos t). At the point, the eigenvalues of C are at least 8 away
    from c. If the number is even, S is whole with the determinant 1, so that the entries are exact; else it is unitary.
    """
    rng = np.random.default_rng([seed, number])
    n, (cosine, sine) = int(rng.integers(2, 5)), _TURNS[number // 2 % 4]
    parts = _draw(rng, 3, n) * (_UNIT / _DECIMALS)
    c = complex(parts[0, 0, 0])
    parts[0] = np.triu(parts[0], 1) + np.diag(c + 4 * _UNIT * np.arange(n))
    parts[0, :2], parts[0, 0, 0], parts[0, 1, 1] = 0, c, c
    points = [["0", "0"]]
    if gap:
        parts = np.triu(parts)
        parts[1:, :2] = 0
        parts[1:, :2, :2] = _UNIT * _SIGMA
        parts[0, :2, :2] += np.rint(gap * _UNIT * (cosine * _SIGMA[0] + sine * _SIGMA[1])) * 1j
        points = [[f"({-sign * sine})*{gap}", f"({sign * cosine})*{gap}"] for sign in (1, -1)]
    below, above = np.eye(n) + np.tril(rng.integers(-1, 2, (2, n, n)), -1)
    S = below @ above.T if number % 2 == 0 else np.linalg.qr(rng.normal(size=(n, n, 2)) @ [1, 1j])[0]
    inverse = np.rint(np.linalg.inv(S)) if number % 2 == 0 else S.conj().T
    entries = _write(S @ parts @ inverse, _UNIT, "x - 0.375", "y + 0.625")
    known = [[f"0.375 + {u}", f"-0.625 + {v}", repr(c / _UNIT)] for u, v in points]
    ranges = {"x": (0.25, 0.5), "y": (-0.75, -0.5)}
    return System(f"crossing {number}", "constructed", ranges, "EP2", known, {"H": entries})


def _draw(rng: np.random.Generator, count: int, n: int) -> Any:
    """Normal complex numbers, as whole multiples of 1/1000."""
    return np.rint(_DECIMALS * rng.normal(size=(count, n, n, 2))) @ [1, 1j]


def _write(parts: Any, unit: float, *factors: str) -> Rows:
    """The entries of (parts[0] + parts[1] factors[0] + …)/unit."""
    numbers = (np.ascontiguousarray(parts).view(float) / unit).view(complex).tolist()
    return [
        [" + ".join([repr(a), *(f"{b!r}*({f})" for b, f in zip(others, factors, strict=True))]) for a, *others in row]
        for row in (zip(*rows, strict=True) for rows in zip(*numbers, strict=True))
    ]
