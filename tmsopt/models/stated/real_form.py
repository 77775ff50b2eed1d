"""A complex system as a real one of twice the size; a carrier separates its roots from the conjugates of others."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, Node, UnsupportedOperation, formula
from tmsopt.algebra.intervals import Interval, ranges
from tmsopt.algebra.kinds import values
from tmsopt.models.model import Matrix, Model
from tmsopt.records import AnyNumbers, Array

_ROOM = 16
"""A carrier serves other ranges too, while no root is farther from the axis than this many times the spread."""

_NEGLIGIBLE = 2.0**-300  # a smaller spread is rounding of intervals around 0, and its carrier would underflow
_LEAST_SPREAD = 1e-6  # of the largest frequency: least spread; a smaller one is not worth its digits
_SAMPLE = 256  # designs of a sample
_LEAST_DISTANCE = 0.9  # of the spread: least distance of the roots from the axis
_WIDER = 2.0  # factor on ranges that a sample shows
_SAMPLE_FACTOR, _LEAST_PART = 1.25, 1 / 64  # factor on the spread in a sample; least part of the proven spread
_CORNERS = 8  # most parameters for a sample with all corners of the box
_PARTS = 32  # a carrier is a multiple of such a part of its size, so that similar ranges share it

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
    real: Model,
    carrier: float,
    bounds: Callable[[Mapping[str, Interval]], tuple[float, float]],
    with_carrier: Callable[[float], Model],
    double: Callable[[AnyNumbers], tuple[Matrix, ...]],
) -> Model:
    """The model of a complex H from the model of its real system.

    Args:
        real: the model of the real system with the carrier.
        bounds: ranges of parameters → middle and spread of the eigenfrequencies.
        with_carrier: carrier → the model of H.
        double: pencil of the real system without a carrier.
    """

    def choose_carrier(box: Mapping[str, Interval]) -> Model:
        middle, spread = bounds(box)
        least, most = middle + carrier - spread, middle + carrier + spread
        if carrier and least >= _LEAST_DISTANCE * spread and most <= _ROOM * spread:
            return model
        return with_carrier(carrier_for(middle, spread))

    model = replace(
        real,
        carrier=carrier,
        carried=choose_carrier,
        double=double,
        words=WORDS,
        absent=ABSENT,
        conventions=CONVENTIONS,
    )
    return model


def carrier_for(middle: float, spread: float) -> float:
    """The carrier that moves eigenfrequencies within `spread` of `middle` to about twice the spread from 0, or more."""
    distance = 2.0 ** math.ceil(math.log2(2 * spread))
    step = distance / _PARTS
    return distance - step * round(middle / step)


def frequency_bounds(entries: Sequence[Node]) -> Callable[[Mapping[str, Interval]], tuple[float, float]]:
    """A function from parameter ranges to the middle and the spread of Re ω; the spread is at least max |Im ω|.

    Re ω and Im ω lie in the ranges of the eigenvalues of (H + H*)/2 and (H − H*)/2i, which Gershgorin's discs bound, by
    intervals or, where these have no bound as for 1/x, by a sample. The discs may be far too wide, and a large carrier
    costs digits, so a sample shows the actual spread. Roots meet conjugates of others only beyond twice that.
    """
    n = math.isqrt(len(entries) // 2)
    R, J = (np.array(part, dtype=object).reshape(n, n) for part in (entries[: n * n], entries[n * n :]))
    off = ~np.eye(n, dtype=bool)
    off_diagonal = [x for P in (R + R.T, J - J.T, J + J.T, R - R.T) for x in (P / 2)[off]]
    every = [*R.diagonal(), *J.diagonal(), *off_diagonal]
    matrix = formula(entries)
    names, bounded = matrix.names, formula(every, matrix.names)

    def bounds(box: Mapping[str, Interval]) -> tuple[float, float]:
        own_box = [box[name] for name in names]
        found = np.array(_ranges(bounded, own_box))
        discs = np.split(np.abs(found[2 * n :]).max(axis=1), 4) if off_diagonal else [np.zeros(0)] * 4
        ends = []
        for diagonal, re, im in ((found[:n], *discs[:2]), (found[n : 2 * n], *discs[2:])):
            reach = np.hypot(re, im).reshape(n, -1).sum(axis=1)
            ends.append(((diagonal[:, 0] - reach).min(), (diagonal[:, 1] + reach).max()))
        (low, high), loss = ends[0], np.abs(ends[1]).max()
        spread = float(max((high - low) / 2, loss))
        sample = _frequencies(matrix, n, own_box) if any(lo < hi for lo, hi in own_box) else np.zeros(0)
        if sample.size:
            least, most = sample.real.min(), sample.real.max()
            own = _SAMPLE_FACTOR * max((most - least) / 2, np.abs(sample.imag).max())
            if own < spread:
                low, high, spread = least, most, float(max(own, _LEAST_PART * spread))
        spread = max(spread, _LEAST_SPREAD * max(abs(low), abs(high)))  # the spread of equal entries would be rounding
        return float(low + high) / 2, spread if spread > _NEGLIGIBLE else 1.0

    return bounds


def _frequencies(matrix: Formula, n: int, box: Sequence[Interval]) -> Any:
    """Eigenvalues of H at a sample of the box, with its corners if they are few; empty if H is not finite there."""
    share = _unit_points(len(box))
    if len(box) <= _CORNERS:
        share = np.concatenate([share, np.array(list(product((0.0, 1.0), repeat=len(box))))])
    own = _evaluate(matrix, box, share)
    H = (own[: n * n] + 1j * own[n * n :]).T.reshape(-1, n, n)
    return np.linalg.eigvals(H) if np.isfinite(H).all() else np.zeros(0)


def _evaluate(asked: Formula, box: Sequence[Interval], share: Array) -> Array:
    """Values of a formula at designs of a box: a row for each output, a column for each design."""
    columns = {name: lo + (hi - lo) * at for name, (lo, hi), at in zip(asked.names, box, share.T, strict=True)}
    return np.array([np.broadcast_to(np.asarray(x, dtype=float), len(share)) for x in values(asked, columns)])


def _unit_points(size: int) -> Array:
    """Evenly spread points of the unit cube."""
    share = np.modf(np.outer(np.arange(_SAMPLE), 1 / np.sqrt([2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41])))[0]
    return np.asarray(share[:, np.arange(size) % share.shape[1]])


def _ranges(asked: Formula, box: Sequence[Interval]) -> list[Interval]:
    try:
        found = ranges(asked, box)
        if all(math.isfinite(x) for ends in found for x in ends):
            return found
    except UnsupportedOperation:
        pass
    own = _evaluate(asked, box, _unit_points(len(box)))
    own = np.where(np.isfinite(own), own, 0.0)
    low, high = own.min(axis=1), own.max(axis=1)
    size = (_WIDER - 1) * np.maximum(high - low, 0.0) / 2
    return list(zip((low - size).tolist(), (high + size).tolist(), strict=True))
