"""Rows of a study: every combination of given values, or a sample of ranges."""

import inspect
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.errors import Fault, InputError, count_faults, input_error, is_number, short, table_faults
from tmsopt.records import Array, Column

MAX_ROWS = 10_000_000
"""Largest number of rows of a study."""

MAX_NUMBERS = 40_000_000
"""Largest number of values in all columns together; they are held in memory."""

_EXACT_DIGITS = 15  # decimal digits that every double holds


@dataclass(frozen=True)
class Span:
    """A range from `low` to `high`. With `log` the range is logarithmic, and both ends must have the same sign.

    Example:
        >>> [round(x, 9) for x in tmsopt.Span(1, 100, log=True).points(3)]
        [1.0, 10.0, 100.0]

    More: docs/reference/study_file.md
    """

    low: float
    high: float
    log: bool = False

    def at(self, share: Array) -> Array:
        """The number at each share of the range: `low` at 0, `high` at 1."""
        low, high = float(self.low), float(self.high)
        numbers = low * (high / low) ** share if self.log else low + share * (high - low)
        return np.clip(numbers, min(low, high), max(low, high))

    def points(self, count: int) -> list[float]:
        """`count` numbers: the exact ends, and numbers between them that are rounded to 15 digits, such as 0.3."""
        numbers = (np.geomspace if self.log else np.linspace)(self.low, self.high, count).tolist()[1:-1]
        largest = max(abs(self.low), abs(self.high)) or 1.0
        places = (_EXACT_DIGITS - 1 - math.floor(math.log10(abs(value) if self.log else largest)) for value in numbers)
        return [float(self.low), *map(round, numbers, places), float(self.high)]


def grid(axes: Mapping[str, Sequence[float]]) -> dict[str, Column]:
    """Every combination of the axes' values; the last axis changes fastest, as in `itertools.product`.

    Raises:
        InputError: for too many rows, or an axis that is not a list of numbers.
    """
    arrays = list[Array]()
    for name, values in axes.items():
        numbers = column_of_numbers(values)
        if numbers is None or not numbers.size:
            message = f"found {short(values)}; accepted: a list of numbers, such as [0.1, 0.2]"
            raise input_error(message, name)
        arrays.append(numbers)
    check_size([len(numbers) for numbers in arrays])
    combinations = np.meshgrid(*arrays, indexing="ij")
    return {name: Column(column.ravel()) for name, column in zip(axes, combinations, strict=True)}


def latin_hypercube(ranges: Mapping[str, Any], rows: int, seed: int = 0) -> dict[str, Column]:
    """A Latin hypercube sample: each range is divided into `rows` equal parts, with one value in each part.

    Args:
        ranges: name → (minimum, maximum), or a `Span`.

    Raises:
        InputError: listing all faults.

    Example:
        >>> sample = tmsopt.latin_hypercube({"mu": (0, 1), "Fr": (1, 5)}, rows=4)
        >>> sorted(int(4 * x) for x in sample["mu"])  # one value in each quarter
        [0, 1, 2, 3]

    More: docs/reference/study_file.md
    """
    return _draw_sample("LatinHypercube", ranges, rows, seed)


def sobol(ranges: Mapping[str, Any], rows: int, seed: int = 0) -> dict[str, Column]:
    """The first `rows` points of a scrambled Sobol sequence; see `sobol_note`.

    Args:
        ranges: name → (minimum, maximum), or a `Span`.

    Raises:
        InputError: listing all faults.

    Example:
        >>> sample = tmsopt.sobol({"mu": tmsopt.Span(0.01, 1, log=True)}, rows=2)
        >>> sorted(x > 0.1 for x in sample["mu"])  # one value in each half of the logarithmic range
        [False, True]

    More: docs/reference/study_file.md
    """
    return _draw_sample("Sobol", ranges, rows, seed)


def sobol_note(rows: int) -> str:
    """A note if the number of rows is not a power of 2; else an empty text."""
    if rows & (rows - 1) == 0:
        return ""
    power = 2 ** round(math.log2(rows))
    return f"a Sobol sample is evenly balanced if the number of rows is a power of 2; {rows} is not, {power} is"


def compute_max_rows(column_count: int) -> int:
    """Largest number of rows of a study with this number of columns."""
    return min(MAX_ROWS, MAX_NUMBERS // max(1, column_count))


def check_size(sizes: Sequence[int]) -> None:
    """Check the size of a grid before it is built.

    Raises:
        InputError: if the grid has too many rows.
    """
    if math.prod(sizes) > (max_rows := compute_max_rows(len(sizes))):
        text = f"{' x '.join(map(str, sizes))} = {math.prod(sizes)} rows"
        raise input_error(f"found {text}; accepted: up to {max_rows}; take fewer points", "columns")


def span_faults(name: str, span: Span) -> Iterator[Fault]:
    """Faults of a range."""
    key = ("ranges", name)
    if not (is_number(span.low) and is_number(span.high)):
        yield Fault(f"found {short(span.low)} to {short(span.high)}; accepted: finite numbers", key)
        return
    low, high = float(span.low), float(span.high)
    if low > high:
        yield Fault(f"min = {low:.6g} is greater than max = {high:.6g}; swap them", key)
    elif span.log and not (low > 0 or high < 0):
        yield Fault(
            f"log = true from {low:.6g} to {high:.6g}; accepted: both ends positive, or both negative",
            key,
        )
    elif not math.isfinite(max(high / low, low / high) if span.log else high - low):
        yield Fault(f"the range from {low:.6g} to {high:.6g} is wider than a double can hold; make it narrower", key)


def column_of_numbers(values: Any) -> Array | None:
    """The user's values as an array of doubles; None if they are not a list of numbers."""
    try:
        array = np.asarray(None if isinstance(values, str | bytes | Mapping) else values)
        is_numeric = array.ndim == 1 and (array.dtype.kind in "fiu" or not array.size)
        return array.astype(np.float64) if is_numeric else None
    except (TypeError, ValueError, OverflowError):
        return None


def _read_spans(ranges: Mapping[str, Any], rows: int, seed: int) -> dict[str, Span]:
    if faults := table_faults("ranges", ranges, "{'mu': (0.1, 0.5)}"):
        raise InputError(faults)
    spans: dict[str, Span] = {}
    for name, limits in ranges.items():
        try:
            spans[name] = limits if isinstance(limits, Span) else Span(*limits)
            faults += span_faults(name, spans[name])
        except TypeError:
            accepted = "(minimum, maximum), or a tmsopt.Span"
            faults.append(Fault(f"found {short(limits)}; accepted: {accepted}", ("ranges", name)))
    if not ranges:
        faults.append(Fault("nothing varies; give a range", ("ranges",)))
    faults += [*count_faults("rows", rows, 1, compute_max_rows(len(ranges))), *count_faults("seed", seed, 0)]
    if faults:
        raise InputError(faults)
    return spans


def _draw_sample(sampler_name: str, ranges: Mapping[str, Any], rows: int, seed: int) -> dict[str, Column]:
    """Columns from a sampler of SciPy, whose argument for random numbers has another name since version 1.15."""
    from scipy.stats import qmc

    spans, sampler = _read_spans(ranges, rows, seed), getattr(qmc, sampler_name)
    argument = "rng" if "rng" in inspect.signature(sampler).parameters else "seed"
    size = 2 ** math.ceil(math.log2(rows)) if sampler_name == "Sobol" else rows
    shares = sampler(len(spans), **{argument: np.random.default_rng(seed)}).random(size)[:rows].T
    return {name: Column(span.at(share)) for (name, span), share in zip(spans.items(), shares, strict=True)}
