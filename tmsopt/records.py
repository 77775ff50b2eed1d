"""Base classes of results, read-only containers, and the conversion of records to plain data."""

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
"""Arrays of real numbers, of complex numbers, and of True and False."""

Numbers = Mapping[str, float]
"""Name → number, such as the parameters of a design."""

AnyNumbers = Mapping[str, Any]
"""Name → number of any kind: a float, an array, a ball, an expression."""


class Printable(Protocol):
    """A result that can print and draw itself. It imports `tmsopt.documents` at first use."""

    def report(self, full: bool = False) -> str:
        """The text that the command line prints; if `full`, it has all sections."""
        return str(call_documents("report", self, full))

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the result into `ax`, or into new Axes, which are shown in a notebook or by ``plt.show()``.

        Raises:
            InputError: if results of this kind have no figure.
        """
        axes: Axes = call_documents("plot", self, ax)
        return axes

    def __str__(self) -> str:
        return self.report()

    def __repr__(self) -> str:
        return str(call_documents("headline", self))

    def _repr_html_(self) -> str:
        return str(call_documents("to_notebook", self))


class Tabular(Printable, Protocol):
    """A result that is also a table."""

    def records(self) -> Iterable[Mapping[str, Any]]:
        """One record for each row."""
        ...

    def to_frame(self) -> "DataFrame":
        """The table as a pandas DataFrame.

        Raises:
            InputError: if pandas is not installed.
        """
        return frame(self.records())


def call_documents(name: str, *arguments: Any, **options: Any) -> Any:
    """Call a function of `tmsopt.documents` by name; results cannot import this package, because it imports them."""
    return getattr(import_module("tmsopt.documents"), name)(*arguments, **options)


def frame(rows: Iterable[Mapping[str, Any]] | Mapping[str, Any]) -> "DataFrame":
    """Rows, or a mapping from names to columns, as a pandas DataFrame.

    Raises:
        InputError: if pandas is not installed.
    """
    table: DataFrame = import_optional("pandas").DataFrame(rows if isinstance(rows, Mapping) else list(rows))
    return table


class Table(Mapping[str, V]):
    """A read-only, hashable mapping that keeps its order."""

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
    """A read-only sequence of floats, compared by value."""

    __slots__ = ("_values",)

    def __init__(self, values: ArrayLike) -> None:
        self._values = np.array(values, dtype=np.float64)
        self._values.flags.writeable = False

    @overload
    def __getitem__(self, index: int) -> float: ...

    @overload
    def __getitem__(self, index: slice) -> "Column": ...

    def __getitem__(self, index: int | slice) -> "float | Column":
        return Column(self._values[index]) if isinstance(index, slice) else float(self._values[index])

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
        first_values = ", ".join(f"{value:.6g}" for value in self._values[:4].tolist())
        return f"Column({first_values}{', …' if len(self) > 4 else ''}; {len(self)})"


def plain(record: Any, names: str = "", digits: int | None = None) -> dict[str, Any]:
    """A record or a mapping as data for ``json.dumps``.

    nan and infinity become None, complex numbers become tables of re and im; `to_json` converts inner records.

    Args:
        names: names of the attributes to convert, separated by blanks; by default all fields.
        digits: number of significant digits; by default all.
    """
    if isinstance(record, Mapping):
        return {str(name): _plain(value, digits) for name, value in record.items()}
    attributes = names.split() or [f.name for f in fields(record)]
    return {name: _plain(getattr(record, name), digits) for name in attributes}


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
