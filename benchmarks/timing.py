"""Times taken side by side, and how they grow."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np


def best(works: Mapping[str, Callable[[], Any]], repeats: int) -> dict[str, float]:
    """Least seconds of each work over some rounds; all take turns, so that what slows one down slows all of them."""
    seconds = dict.fromkeys(works, math.inf)
    for _ in range(repeats):
        for name, work in works.items():
            seconds[name] = min(seconds[name], clocked(work))
    return seconds


def clocked(work: Callable[[], Any]) -> float:
    """Seconds of one run."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """p of the least-squares fit seconds ~ size^p; nan for fewer than two sizes."""
    known = [(n, s) for n, s in zip(sizes, seconds, strict=True) if math.isfinite(s)]
    if len(known) < 2:
        return math.nan
    n, s = np.log(np.array(known)).T
    return float(np.polyfit(n, s, 1)[0])


def duration(seconds: float) -> str:
    """With its unit, to two or three digits."""
    if not math.isfinite(seconds):
        return "–"
    scale, unit = next(((f, u) for f, u in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")) if seconds >= f), (1e-9, "ns"))
    number = seconds / scale
    return f"{number:.0f} {unit}" if number >= 100 else f"{number:.3g} {unit}"


def times(ratio: float) -> str:
    """A ratio, to two digits."""
    return "–" if not math.isfinite(ratio) else f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"
