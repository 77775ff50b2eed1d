"""A complex system as a real system of twice the size.

A carrier, a real constant, is added to all eigenfrequencies, so that no root meets the conjugate of another root.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, Node, UnsupportedOperation, formula
from tmsopt.algebra.intervals import Interval, ranges
from tmsopt.algebra.kinds import values
from tmsopt.models.model import Model
from tmsopt.records import Array

# The spread is the largest distance of Re ω from the middle of all Re ω, and at least the largest |Im ω|.

_MAX_DISTANCE = 16  # a carrier is used for other ranges, too, if no root is farther from the axis than so many spreads
_MIN_DISTANCE = 0.9  # least distance of the roots from the axis, in spreads
_NEGLIGIBLE = 2.0**-300  # a smaller spread comes from rounding, and its carrier would underflow
_MIN_SPREAD = 1e-6  # least spread, relative to the largest frequency; a smaller one would not save digits
_SAMPLE_SIZE = 256  # designs of a sample of the ranges
_WIDENING = 2.0  # a range of values in a sample is widened by this factor
_SPREAD_FACTOR = 1.25  # the spread in a sample is multiplied by this factor
_MIN_SHARE = 1 / 64  # least spread from a sample, relative to the proven spread
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


def complex_model(
    real_model: Model,
    carrier: float,
    bounds: Callable[[Mapping[str, Interval]], tuple[float, float]],
    with_carrier: Callable[[float], Model],
) -> Model:
    """The model of a complex H from the model of its real system.

    Args:
        real: the model of the real system with the carrier.
        bounds: function from ranges of parameters to the middle and the spread of the eigenfrequencies.
        with_carrier: function from a carrier to the model of H with this carrier.
    """

    def choose_carrier(box: Mapping[str, Interval]) -> Model:
        middle, spread = bounds(box)
        lowest, highest = middle + carrier - spread, middle + carrier + spread
        if carrier and lowest >= _MIN_DISTANCE * spread and highest <= _MAX_DISTANCE * spread:
            return model
        return with_carrier(carrier_for(middle, spread))

    model = replace(
        real_model,
        is_complex=True,
        carrier=carrier,
        carried=choose_carrier,
        words=WORDS,
        absent=ABSENT,
        conventions=CONVENTIONS,
    )
    return model


def carrier_for(middle: float, spread: float) -> float:
    """The carrier for eigenfrequencies within `spread` of `middle`; their middle moves to 2 to 4 times the spread."""
    distance = 2.0 ** math.ceil(math.log2(2 * spread))
    step = distance / _STEPS
    return distance - step * round(middle / step)


def frequency_bounds(entries: Sequence[Node]) -> Callable[[Mapping[str, Interval]], tuple[float, float]]:
    """A function from parameter ranges to the middle and the spread of Re ω; the spread is at least max |Im ω|.

    Re ω and Im ω lie in the ranges of the eigenvalues of (H + H*)/2 and (H − H*)/2i. Gershgorin's discs bound these
    eigenvalues. Intervals bound the entries, or a sample if intervals give no bound, as for 1/x. The discs may be far
    too wide, and a large carrier costs digits, so the eigenvalues at a sample of designs show the actual spread. This
    is safe: a root meets the conjugate of another root only if the true spread is more than twice as large.
    """
    n = math.isqrt(len(entries) // 2)
    R, J = (np.array(part, dtype=object).reshape(n, n) for part in (entries[: n * n], entries[n * n :]))
    is_off_diagonal = ~np.eye(n, dtype=bool)
    off_diagonal = [x for P in (R + R.T, J - J.T, J + J.T, R - R.T) for x in (P / 2)[is_off_diagonal]]
    matrix = formula(entries)
    disc_parts = formula([*R.diagonal(), *J.diagonal(), *off_diagonal], matrix.names)

    def bounds(box: Mapping[str, Interval]) -> tuple[float, float]:
        intervals = [box[name] for name in matrix.names]
        part_ranges = np.array(_bound_outputs(disc_parts, intervals))
        sizes = np.split(np.abs(part_ranges[2 * n :]).max(axis=1), 4) if off_diagonal else [np.zeros(0)] * 4
        ends = []
        for diagonal, re, im in ((part_ranges[:n], *sizes[:2]), (part_ranges[n : 2 * n], *sizes[2:])):
            radius = np.hypot(re, im).reshape(n, -1).sum(axis=1)
            ends.append(((diagonal[:, 0] - radius).min(), (diagonal[:, 1] + radius).max()))
        (low, high), loss = ends[0], np.abs(ends[1]).max()
        spread = float(max((high - low) / 2, loss))
        sample = _sample_frequencies(matrix, n, intervals) if any(lo < hi for lo, hi in intervals) else np.zeros(0)
        if sample.size:
            sample_low, sample_high = sample.real.min(), sample.real.max()
            sample_spread = _SPREAD_FACTOR * max((sample_high - sample_low) / 2, np.abs(sample.imag).max())
            if sample_spread < spread:
                low, high, spread = sample_low, sample_high, float(max(sample_spread, _MIN_SHARE * spread))
        spread = max(spread, _MIN_SPREAD * max(abs(low), abs(high)))  # equal entries have a spread from rounding only
        return float(low + high) / 2, spread if spread > _NEGLIGIBLE else 1.0

    return bounds


def _sample_frequencies(matrix: Formula, n: int, box: Sequence[Interval]) -> Any:
    """Eigenvalues of H at designs in a box, with its corners if they are few; empty if H is not finite there."""
    points = _unit_points(len(box))
    if len(box) <= _MAX_CORNER_PARAMETERS:
        points = np.concatenate([points, np.array(list(product((0.0, 1.0), repeat=len(box))))])
    entries = _evaluate(matrix, box, points)
    H = (entries[: n * n] + 1j * entries[n * n :]).T.reshape(-1, n, n)
    return np.linalg.eigvals(H) if np.isfinite(H).all() else np.zeros(0)


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


def _bound_outputs(outputs: Formula, box: Sequence[Interval]) -> list[Interval]:
    """Ranges of the outputs of a formula over a box, by intervals, or else by a sample."""
    try:
        proven_ranges = ranges(outputs, box)
        if all(math.isfinite(x) for ends in proven_ranges for x in ends):
            return proven_ranges
    except UnsupportedOperation:
        pass
    sample = _evaluate(outputs, box, _unit_points(len(box)))
    sample = np.where(np.isfinite(sample), sample, 0.0)
    low, high = sample.min(axis=1), sample.max(axis=1)
    margin = (_WIDENING - 1) * np.maximum(high - low, 0.0) / 2
    return list(zip((low - margin).tolist(), (high + margin).tolist(), strict=True))
