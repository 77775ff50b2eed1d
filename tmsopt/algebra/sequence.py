"""A quasi-random sequence. The module scipy.stats.qmc is not used, because its import takes longer than a solve."""

import numpy as np

from tmsopt.records import Array


def golden_steps(size: int) -> Array:
    """Steps of the sequence (offset + k · steps) mod 1 in the unit cube: powers 1/φ, 1/φ² … of a golden ratio."""
    ratio = 2.0
    for _ in range(60):  # converges to φ, where φ^(size+1) = φ + 1
        ratio = (1 + ratio) ** (1 / (size + 1))
    return np.asarray(ratio ** -np.arange(1.0, size + 1))
