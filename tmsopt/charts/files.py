"""Charts that fit into memory as one file: a NumPy archive, or netCDF."""

import json
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.charts.survey import Grid
from tmsopt.design.problem import Problem
from tmsopt.disk import netcdf_errors, whole
from tmsopt.errors import Fault, InputError, needed
from tmsopt.roots import CLASSES


def save_layers(problem: Problem, grid: Grid, layers: Mapping[str, NDArray[Any]], path: Path) -> None:
    """Write axes and layers by name, with what they are about, as the ending of the file says.

    Raises:
        InputError: for netCDF where xarray or a library for it is not installed.
        OSError: when the file cannot be written.
    """
    about: dict[str, Any] = {
        "title": problem.title, "model": problem.model.name,
        **({} if problem.model.statement is None else {"statement": dict(problem.model.statement)}),
        "dimensions": [_axis(n, layers) for n in grid.axes[::-1]], "classes": list(CLASSES),
        "fixed": dict(problem.fixed),
    }  # fmt: skip
    if path.suffix.lower() == ".nc":
        check_netcdf()
        made = dataset(problem, grid, layers)
        with whole(path) as place, netcdf_errors():
            made.to_netcdf(place)
        return
    axes = {_axis(n, layers): values for n, values in zip(grid.axes, grid.values, strict=True)}
    arrays: dict[str, Any] = {**axes, **layers}
    with whole(path) as place, place.open("wb") as stream:
        np.savez_compressed(stream, about=np.array(json.dumps(about)), **arrays)


def check_netcdf() -> None:
    """Refuse netCDF where it could not be written.

    Raises:
        InputError: where xarray or a library for netCDF is not installed.
    """
    if find_spec("xarray") is None or all(find_spec(n) is None for n in ("netCDF4", "h5netcdf")):
        message = 'netCDF needs xarray and netCDF4; run pip install "tmsopt[data]", or give a name ending in npz'
        raise InputError([Fault(message, ("--output",))])


def dataset(problem: Problem, grid: Grid, layers: Mapping[str, NDArray[Any]]) -> Any:
    """Axes and layers as a dataset of xarray, with their units and meanings.

    Raises:
        InputError: where xarray is not installed.
    """
    xarray = needed("xarray")
    of = problem.parameter_set
    axes = {
        _axis(n, layers): (_axis(n, layers), v, {"long_name": of[n].meaning, "units": of[n].unit})
        for n, v in zip(grid.axes, grid.values, strict=True)
    }
    classes = {"flag_values": np.arange(len(CLASSES), dtype=np.int8), "flag_meanings": _words(CLASSES)}
    dimensions = [_axis(n, layers) for n in grid.axes[::-1]]
    variables = {
        n: (dimensions, a.view(np.int8) if a.dtype == bool else a, classes if n == "kind" else {})
        for n, a in layers.items()
    }
    about = {"title": problem.title, "model": problem.model.name, "fixed": json.dumps(dict(problem.fixed))}
    return xarray.Dataset(variables, axes, about)


def _axis(name: str, layers: Mapping[str, Any]) -> str:
    """What the values along an axis are called: the parameter, or ``parameter.kind`` beside a layer of that name."""
    return f"parameter.{name}" if name in layers else name


def _words(names: tuple[str, ...]) -> str:
    """Names as the climate and forecast conventions want them, blanks between words only."""
    return " ".join(n.replace(" ", "_") for n in names)
