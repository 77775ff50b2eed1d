"""Versions of tmsopt, Python and the libraries, read without importing them."""

import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path

SCHEMA = 1
"""Version of the JSON schema of every command."""

REQUIRED = (
    "casadi",
    "numpy",
    "scipy",
    "matplotlib",
    "textalloc",
    "python-flint",
    "pydantic",
    "pint",
    "click",
    "rich",
    "lazy-loader",
    "threadpoolctl",
    "loky",
    "filelock",
)
OPTIONAL = ("pyscipopt", "distributed", "pandas", "pyarrow", "xarray", "netCDF4")
"""Distributions that tmsopt requires, and those of its extras certify, cluster and data."""


def environment() -> dict[str, object]:
    """Python, system and library versions, on which results may depend, as plain data; None if not installed."""
    return {
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "system": platform.platform(),
        "machine": platform.machine(),
        "packages": {**installed_versions((*REQUIRED, *OPTIONAL)), "ipopt": ipopt_version()},
    }


def installed_versions(names: Iterable[str]) -> dict[str, str | None]:
    """The version of each distribution; None if not installed, as for a checkout that is only on the path."""
    return {name: _version(name) for name in names}


def ipopt_version() -> str | None:
    """The IPOPT version, from the file name of the library in the CasADi wheel; no function of CasADi returns it."""
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
