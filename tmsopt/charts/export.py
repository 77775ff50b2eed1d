"""Export of charts as a NumPy archive, a netCDF file or a dataset of xarray."""

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
    """Write axes and layers, with a description; the ending of the file name selects the format.

    Raises:
        InputError: for netCDF if xarray or a netCDF library is missing.
        OSError: if the file cannot be written.
    """
    if path.suffix.lower() == ".nc":
        check_netcdf()
        dataset = make_dataset(problem, grid, layers)
        with write_atomic(path) as temporary_path, netcdf_errors():
            dataset.to_netcdf(temporary_path)
        return
    axes = _name_axes(grid, layers)
    about = {"title": problem.title, "model": problem.model.name, "fixed": dict(problem.fixed)}
    about |= {"dimensions": axes[::-1], "classes": CLASSES}
    if problem.model.statement is not None:
        about["statement"] = dict(problem.model.statement)
    arrays: dict[str, Any] = dict(zip(axes, grid.values, strict=True)) | dict(layers)
    with write_atomic(path) as temporary_path, temporary_path.open("wb") as stream:
        np.savez_compressed(stream, about=np.array(json.dumps(about)), **arrays)


def check_netcdf() -> None:
    """Check that netCDF can be written.

    Raises:
        InputError: if xarray or a netCDF library is missing.
    """
    if find_spec("xarray") is None or all(find_spec(n) is None for n in ("netCDF4", "h5netcdf")):
        message = 'netCDF needs xarray and netCDF4; run pip install "tmsopt[data]", or give a name that ends in .npz'
        raise input_error(message, "--output")


def make_dataset(problem: Posed, grid: Grid, layers: Layers) -> Any:
    """Axes and layers as an xarray dataset with units and meanings.

    Raises:
        InputError: if xarray is not installed.
    """
    xarray, axes, parameters = import_optional("xarray"), _name_axes(grid, layers), problem.parameter_set
    # The climate and forecast conventions separate flag meanings by blanks.
    meanings = " ".join(n.replace(" ", "_") for n in CLASSES)
    class_attributes = {"flag_values": np.arange(len(CLASSES), dtype=np.int8), "flag_meanings": meanings}
    variables = {
        n: (axes[::-1], a.view(np.int8) if a.dtype == bool else a, class_attributes if n == "kind" else {})
        for n, a in layers.items()
    }
    coordinates = {
        axis: (axis, values, {"long_name": parameters[n].meaning, "units": parameters[n].unit})
        for n, axis, values in zip(grid.axes, axes, grid.values, strict=True)
    }
    about = {"title": problem.title, "model": problem.model.name, "fixed": json.dumps(dict(problem.fixed))}
    return xarray.Dataset(variables, coordinates, about)


def _name_axes(grid: Grid, layers: Layers) -> list[str]:
    """Names of the axes: the name of the parameter, or ``parameter.NAME`` if a layer has the same name."""
    return [f"parameter.{n}" if n in layers else n for n in grid.axes]
