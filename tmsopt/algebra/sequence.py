"""A quasi-random sequence; scipy.stats.qmc has others, but importing it takes longer than solving."""

import numpy as np

from tmsopt.records import Array


def golden_steps(size: int) -> Array:
    """Steps of the sequence (offset + k · steps) mod 1 in the unit cube: powers of the generalised golden ratio."""
    ratio = 2.0
    for _ in range(60):  # fixed point of φ^(d+1) = φ + 1
        ratio = (1 + ratio) ** (1 / (size + 1))
    return np.asarray(ratio ** -np.arange(1.0, size + 1))
