"""What is installed here: versions of tmsopt, of Python and of the libraries, told without importing any of them."""

import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path

SCHEMA = 1
"""Version of the JSON of every command."""

NEEDED = (
    "casadi",
    "numpy",
    "scipy",
    "matplotlib",
    "textalloc",
    "python-flint",
    "pydantic",
    "pint",
    "click",
    "lazy-loader",
    "threadpoolctl",
    "loky",
    "filelock",
)
EXTRA = ("pyscipopt", "distributed", "pandas", "pyarrow", "xarray", "netCDF4")
"""Distributions that tmsopt needs, and those of its extras certify, cluster and data."""


def environment() -> dict[str, object]:
    """What an answer may depend on, as plain data: Python, system and libraries; None for what is not there."""
    return {
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "system": platform.platform(),
        "machine": platform.machine(),
        "packages": {**installed_versions((*NEEDED, *EXTRA)), "ipopt": ipopt_version()},
    }


def installed_versions(names: Iterable[str]) -> dict[str, str | None]:
    """The version of each distribution; None where it is not installed, as of a checkout that is only on the path."""
    return {name: _version(name) for name in names}


def ipopt_version() -> str | None:
    """The version in the name of the library that the CasADi wheel brings; it tells nowhere else without a solve."""
    try:
        folder = Path(str(distribution("casadi").locate_file("casadi")))
    except PackageNotFoundError:
        return None
    names = [library.name.removeprefix("libipopt.so.") for library in folder.glob("libipopt.so.*")]
    return max(names, key=len, default=None)


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
