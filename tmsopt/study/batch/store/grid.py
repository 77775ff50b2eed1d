"""Whether the rows of a study fill a grid of the values that vary."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array
from tmsopt.study.batch.store.columns import PREFIXES, Column


def levels(columns: Mapping[str, Column]) -> dict[str, Array]:
    """Header → ascending values along that axis, where every combination of them is one row; else empty.

    What has one value in all rows is no axis.
    """
    varied = {name: c for name, c in columns.items() if name.startswith(PREFIXES["varied"])}
    if not varied or not all(c.present.all() and np.isfinite(c.values).all() for c in varied.values()):
        return {}
    found = {name: np.unique(c.values) for name, c in varied.items()}
    axes = {name: values for name, values in found.items() if len(values) > 1}
    count = len(next(iter(varied.values())).values)
    if not axes or np.prod([float(len(v)) for v in axes.values()]) != count:
        return {}
    return axes if len(np.unique(places(columns, axes))) == count else {}


def places(columns: Mapping[str, Column], axes: Mapping[str, Array]) -> NDArray[np.int64]:
    """Where each row stands in the grid, flattened with the last axis fastest."""
    indices = tuple(np.searchsorted(values, columns[name].values) for name, values in axes.items())
    return np.asarray(np.ravel_multi_index(indices, tuple(len(v) for v in axes.values())), dtype=np.int64)
