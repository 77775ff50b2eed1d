"""Charts as one file, a NumPy archive or netCDF, and as a dataset of xarray."""

import json
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.charts.survey import Grid
from tmsopt.errors import import_optional, input_error
from tmsopt.files import netcdf_errors, write_atomic
from tmsopt.problem.problem import Posed
from tmsopt.roots import CLASSES

Layers = Mapping[str, NDArray[Any]]


def save_layers(problem: Posed, grid: Grid, layers: Layers, path: Path) -> None:
    """Write axes and layers by name, with what they are about, as the ending of the file says.

    Raises:
        InputError: for netCDF where xarray or a library for it is not installed.
        OSError: when the file cannot be written.
    """
    if path.suffix.lower() == ".nc":
        check_netcdf()
        made = make_dataset(problem, grid, layers)
        with write_atomic(path) as place, netcdf_errors():
            made.to_netcdf(place)
        return
    axes = _axes(grid, layers)
    about: dict[str, Any] = {"title": problem.title, "model": problem.model.name, "fixed": dict(problem.fixed)}
    about |= {"dimensions": axes[::-1], "classes": CLASSES}
    if problem.model.statement is not None:
        about["statement"] = dict(problem.model.statement)
    arrays: dict[str, Any] = {**dict(zip(axes, grid.values, strict=True)), **layers}
    with write_atomic(path) as place, place.open("wb") as stream:
        np.savez_compressed(stream, about=np.array(json.dumps(about)), **arrays)


def check_netcdf() -> None:
    """Refuse netCDF where it could not be written.

    Raises:
        InputError: where xarray or a library for netCDF is not installed.
    """
    if find_spec("xarray") is None or all(find_spec(n) is None for n in ("netCDF4", "h5netcdf")):
        message = 'netCDF needs xarray and netCDF4; run pip install "tmsopt[data]", or give a name ending in npz'
        raise input_error(message, "--output")


def make_dataset(problem: Posed, grid: Grid, layers: Layers) -> Any:
    """Axes and layers as a dataset of xarray, with their units and meanings.

    Raises:
        InputError: where xarray is not installed.
    """
    xarray, axes, of = import_optional("xarray"), _axes(grid, layers), problem.parameter_set
    # Names as the climate and forecast conventions want them, blanks between words only.
    words = " ".join(n.replace(" ", "_") for n in CLASSES)
    classes = {"flag_values": np.arange(len(CLASSES), dtype=np.int8), "flag_meanings": words}
    variables = {
        n: (axes[::-1], a.view(np.int8) if a.dtype == bool else a, classes if n == "kind" else {})
        for n, a in layers.items()
    }
    coordinates = {
        axis: (axis, values, {"long_name": of[n].meaning, "units": of[n].unit})
        for n, axis, values in zip(grid.axes, axes, grid.values, strict=True)
    }
    about = {"title": problem.title, "model": problem.model.name, "fixed": json.dumps(dict(problem.fixed))}
    return xarray.Dataset(variables, coordinates, about)


def _axes(grid: Grid, layers: Layers) -> list[str]:
    """Names of the values along the axes: the parameter's, or ``parameter.kind`` next to a layer of that name."""
    return [f"parameter.{n}" if n in layers else n for n in grid.axes]
