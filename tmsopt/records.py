"""What records are made of, what results show of themselves, and records as plain data."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.errors import import_optional

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

V = TypeVar("V")

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Truth = NDArray[np.bool_]

Numbers = Mapping[str, float]
"""Name → number: a design by its parameters, weights, amounts."""


class Printable(Protocol):
    """What every result shows of itself. Who writes it stands floors above, and is found when first asked."""

    def report(self, full: bool = False) -> str:
        """The text that the command line prints; with all the rest where it is `full`."""
        return str(_documents().report(self, full))

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw it, into the given Axes or into new ones, which a notebook and ``plt.show()`` show.

        Raises:
            InputError: where there is no picture of it.
        """
        axes: Axes = _documents().plot(self, ax)
        return axes

    def __str__(self) -> str:
        return self.report()

    def __repr__(self) -> str:
        return str(_documents().headline(self))

    def _repr_html_(self) -> str:
        return str(_documents().fragment(self))


class Tabular(Printable, Protocol):
    """A result that is a table as well."""

    def records(self) -> Iterable[Mapping[str, Any]]:
        """One record per row."""
        ...

    def to_frame(self) -> "DataFrame":
        """The table in pandas.

        Raises:
            InputError: where pandas is not installed.
        """
        return frame(self.records())


def call_documents(name: str, *given: Any, **options: Any) -> Any:
    """Call a function of `tmsopt.documents` for a method of a result, which knows nothing of what stands above it."""
    return getattr(_documents(), name)(*given, **options)


def frame(rows: Iterable[Mapping[str, Any]] | Mapping[str, Any]) -> "DataFrame":
    """Rows, or columns by name, as a table of pandas.

    Raises:
        InputError: where pandas is not installed.
    """
    made: DataFrame = import_optional("pandas").DataFrame(rows if isinstance(rows, Mapping) else list(rows))
    return made


def _documents() -> Any:
    return import_module("tmsopt.documents")


class Table(Mapping[str, V]):
    """Names with values, in a fixed order, read-only."""

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[str, V] | None = None) -> None:
        self._items = dict(items or {})

    def __getitem__(self, name: str) -> V:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        return repr(self._items)


class Column(Sequence[float]):
    """Numbers in order, read-only; equal where every number is."""

    __slots__ = ("_values",)

    def __init__(self, values: ArrayLike) -> None:
        self._values = np.array(values, dtype=np.float64)
        self._values.flags.writeable = False

    @overload
    def __getitem__(self, where: int) -> float: ...

    @overload
    def __getitem__(self, where: slice) -> "Column": ...

    def __getitem__(self, where: int | slice) -> "float | Column":
        return Column(self._values[where]) if isinstance(where, slice) else float(self._values[where])

    def __len__(self) -> int:
        return len(self._values)

    def __iter__(self) -> Iterator[float]:
        return iter(self._values.tolist())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Column) and np.array_equal(self._values, other._values)

    def __hash__(self) -> int:
        return hash(self._values.tobytes())

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[np.float64]:
        return self._values if dtype in (None, np.float64) and not copy else np.array(self._values, dtype)

    def __reduce__(self) -> tuple[type["Column"], tuple[NDArray[np.float64]]]:
        return Column, (self._values,)

    def __repr__(self) -> str:
        shown = ", ".join(f"{value:.6g}" for value in self._values[:4].tolist())
        return f"Column({shown}{', …' if len(self) > 4 else ''}; {len(self)})"


def plain(record: Any, names: str = "", digits: int | None = None) -> dict[str, Any]:
    """A record or a table as data for ``json.dumps``: numbers that do not exist are None, a complex one has re and im.

    Records inside are written as their own `to_json` says, where they have one.

    Args:
        names: which attributes, in this order; by default every field.
        digits: significant digits of the numbers; by default all.
    """
    if isinstance(record, Mapping):
        return {str(name): _plain(value, digits) for name, value in record.items()}
    chosen = names.split() or [f.name for f in fields(record)]
    return {name: _plain(getattr(record, name), digits) for name in chosen}


def _plain(value: Any, digits: int | None) -> Any:
    match value:
        case None | bool() | int() | str():
            return value
        case float():
            rounded = 0.0 + (float(value) if digits is None else float(f"{value:.{digits}g}"))  # no −0
            return rounded if math.isfinite(rounded) else None
        case complex():
            return {"re": _plain(value.real, digits), "im": _plain(value.imag, digits)}
        case np.ndarray() | np.generic():
            return _plain(value.tolist(), digits)
        case Sequence():
            return [_plain(item, digits) for item in value]
    return value.to_json() if hasattr(value, "to_json") else plain(value, digits=digits)
