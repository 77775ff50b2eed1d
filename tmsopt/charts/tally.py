"""Counts over the designs of a chart: shares of the classes, the best design."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.roots import CLASSES


@dataclass(frozen=True)
class Tally:
    """Counts over some of the designs.

    Attributes:
        designs: number of designs.
        classes: number in each class; empty without the layer ``kind``.
        satisfied: number that satisfy every inequality; None without that layer.
        least: least abscissa of these; nan if there is none.
        place: its index in the flat arrays, the first of equals; -1 if there is none.
        fallbacks: number of designs whose roots came from companion eigenvalues.
    """

    designs: int = 0
    classes: tuple[int, ...] = ()
    satisfied: int | None = None
    least: float = math.nan
    place: int = -1
    fallbacks: int = 0

    @property
    def shares(self) -> dict[str, float]:
        """Share of the designs in each class; empty without the layer ``kind``."""
        return {n: count / self.designs for n, count in zip(CLASSES, self.classes, strict=False)}


def count_tile(layers: Mapping[str, NDArray[Any]], first: int, fallbacks: int = 0) -> Tally:
    """Count over a tile whose first design has the index `first`."""
    kind, satisfied, abscissa = (layers.get(n) for n in ("kind", "satisfied", "abscissa"))
    least, place = math.nan, -1
    if abscissa is not None:
        allowed = np.where(np.isfinite(abscissa) & (True if satisfied is None else satisfied), abscissa, np.inf)
        best = int(allowed.argmin())
        if allowed.flat[best] < np.inf:
            least, place = float(allowed.flat[best]), first + best
    return Tally(
        next(iter(layers.values())).size,
        () if kind is None else tuple(np.bincount(kind.ravel(), minlength=len(CLASSES)).tolist()),
        None if satisfied is None else int(np.count_nonzero(satisfied)),
        least,
        place,
        fallbacks,
    )


def add_tallies(tallies: Iterable[Tally]) -> Tally:
    """Add the counts of several tiles, in any order."""
    every = [*tallies]
    best = min((t for t in every if t.place >= 0), key=lambda t: (t.least, t.place), default=Tally())
    satisfied = [t.satisfied for t in every if t.satisfied is not None]
    return Tally(
        sum(t.designs for t in every),
        tuple(map(sum, zip(*(t.classes for t in every), strict=True))),
        sum(satisfied) if satisfied else None,
        best.least,
        best.place,
        sum(t.fallbacks for t in every),
    )
