"""A complex system as the real one of twice the size, with a carrier that keeps roots from the conjugates of others."""

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
from tmsopt.records import Array

_ROOM = 16
"""A carrier is kept for other ranges while no root is farther from the axis than so many times the spread."""

_NOTHING = 2.0**-300  # a spread below is the rounding of intervals around 0, and its carrier no number in a polynomial
_ROUNDED = 1e-6  # of the largest frequency: a narrower spread is not worth the digits
_SAMPLE = 256  # designs by which frequencies are judged where intervals have no bound
_AT_LEAST = 0.9  # of the spread: distance of the roots from the axis
_WIDER = 2.0  # than what a sample shows
_SEEN, _LEAST_SEEN = 1.25, 1 / 64  # times the spread that designs of a sample have; of the spread that is certain
_CORNERS = 8  # parameters up to which the sample has all corners of the box
_PARTS = 32  # of its size that a carrier is a multiple of, so that near ranges have the same

WORDS = ("threshold", "zero frequency")

ABSENT = {
    "damping_ratio": (
        "of a complex H, which may be written in a rotating frame, frequencies have no zero; write abscissa, the least "
        "loss with a minus sign, or a [model.quantities] of your own such as a quality factor"
    ),
    "angular_frequency": (
        "of a complex H, which may be written in a rotating frame, frequencies have no zero; write a bound on the "
        "frequencies of H, its diagonal, in parameters"
    ),
}

CONVENTIONS = (
    "psi' = -i H psi; an eigenfrequency omega = i s decays at the rate -Im omega: loss is negative, gain positive.",
)


def complex_model(
    made: Model,
    carrier: float,
    bounds: Callable[[Mapping[str, Interval]], tuple[float, float]],
    carried: Callable[[float], Model],
    double: Callable[[Mapping[str, Any]], tuple[Matrix, ...]],
) -> Model:
    """The model of a complex H, of its double with a carrier.

    Args:
        bounds: ranges of parameters → middle and spread of the eigenfrequencies.
        carried: the model with another carrier.
        double: its pencil without one.
    """

    def within(box: Mapping[str, Interval]) -> Model:
        middle, spread = bounds(box)
        least, most = middle + carrier - spread, middle + carrier + spread
        if carrier and least >= _AT_LEAST * spread and most <= _ROOM * spread:
            return model
        return carried(carrier_for(middle, spread))

    model = replace(
        made, carrier=carrier, carried=within, double=double, words=WORDS, absent=ABSENT, conventions=CONVENTIONS
    )
    return model


def carrier_for(middle: float, spread: float) -> float:
    """What takes eigenfrequencies within a spread of a middle to twice the spread or more from 0, but not far more."""
    distance = 2.0 ** math.ceil(math.log2(2 * spread))
    step = distance / _PARTS
    return distance - step * round(middle / step)


def carriers(entries: Sequence[Node]) -> Callable[[Mapping[str, Interval]], tuple[float, float]]:
    """The middle and the spread of Re ω over ranges of parameters, the spread no less than any |Im ω|.

    The eigenvalues of H lie in its field of values: Re ω among those of (H + H*)/2, Im ω among those of (H − H*)/2i,
    each within Gershgorin's discs. By intervals; where these have no bound, as of 1/x, by a sample. As the discs may be
    far wider, and a wide carrier costs digits, a sample of designs says how wide the eigenfrequencies really are: roots
    meet conjugates of others only beyond twice that.
    """
    n = math.isqrt(len(entries) // 2)
    R, J = (np.array(part, dtype=object).reshape(n, n) for part in (entries[: n * n], entries[n * n :]))
    off = ~np.eye(n, dtype=bool)
    beside = [x for P in (R + R.T, J - J.T, J + J.T, R - R.T) for x in (P / 2)[off]]
    every = [*R.diagonal(), *J.diagonal(), *beside]
    matrix = formula(entries)
    names, asked = matrix.names, formula(every, matrix.names)

    def bounds(box: Mapping[str, Interval]) -> tuple[float, float]:
        found = np.array(_ranges(asked, [box[name] for name in names]))
        discs = np.split(np.abs(found[2 * n :]).max(axis=1), 4) if beside else [np.zeros(0)] * 4
        ends = []
        for diagonal, re, im in ((found[:n], *discs[:2]), (found[n : 2 * n], *discs[2:])):
            reach = np.hypot(re, im).reshape(n, -1).sum(axis=1)
            ends.append(((diagonal[:, 0] - reach).min(), (diagonal[:, 1] + reach).max()))
        (low, high), loss = ends[0], np.abs(ends[1]).max()
        spread = float(max((high - low) / 2, loss))
        own_box = [box[name] for name in names]
        seen = _frequencies(matrix, n, own_box) if any(lo < hi for lo, hi in own_box) else np.zeros(0)
        if seen.size:
            least, most = seen.real.min(), seen.real.max()
            own = _SEEN * max((most - least) / 2, np.abs(seen.imag).max())
            if own < spread:
                low, high, spread = least, most, float(max(own, _LEAST_SEEN * spread))
        spread = max(spread, _ROUNDED * max(abs(low), abs(high)))  # else equal entries have the spread of rounding
        return float(low + high) / 2, spread if spread > _NOTHING else 1.0

    return bounds


def _frequencies(matrix: Formula, n: int, box: Sequence[Interval]) -> Any:
    """Eigenvalues of H at designs of the box, corners among them where these are few; none where H does not exist."""
    share = _shares(len(box))
    if len(box) <= _CORNERS:
        share = np.concatenate([share, np.array(list(product((0.0, 1.0), repeat=len(box))))])
    own = _sampled(matrix, box, share)
    H = (own[: n * n] + 1j * own[n * n :]).T.reshape(-1, n, n)
    return np.linalg.eigvals(H) if np.isfinite(H).all() else np.zeros(0)


def _sampled(asked: Formula, box: Sequence[Interval], share: Array) -> Array:
    """A formula at designs of a box, a row for each output and a column for each design."""
    columns = {name: lo + (hi - lo) * at for name, (lo, hi), at in zip(asked.names, box, share.T, strict=True)}
    return np.array([np.broadcast_to(np.asarray(x, dtype=float), len(share)) for x in values(asked, columns)])


def _shares(size: int) -> Array:
    """Places in the unit cube, spread evenly."""
    share = np.modf(np.outer(np.arange(_SAMPLE), 1 / np.sqrt([2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41])))[0]
    return np.asarray(share[:, np.arange(size) % share.shape[1]])


def _ranges(asked: Formula, box: Sequence[Interval]) -> list[Interval]:
    try:
        found = ranges(asked, box)
        if all(math.isfinite(x) for ends in found for x in ends):
            return found
    except UnsupportedOperation:
        pass
    own = _sampled(asked, box, _shares(len(box)))
    own = np.where(np.isfinite(own), own, 0.0)
    low, high = own.min(axis=1), own.max(axis=1)
    size = (_WIDER - 1) * np.maximum(high - low, 0.0) / 2
    return list(zip((low - size).tolist(), (high + size).tolist(), strict=True))
