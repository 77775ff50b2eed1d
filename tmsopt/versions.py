"""Versions of tmsopt, Python and the libraries, read without importing them."""

import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path

SCHEMA = 1
"""Version of the JSON schema of every command."""

REQUIRED_PACKAGES = (
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
"""Distributions that tmsopt requires."""

OPTIONAL_PACKAGES = ("pyscipopt", "distributed", "pandas", "pyarrow", "xarray", "netCDF4")
"""Distributions of the extras certify, cluster and data."""


def environment() -> dict[str, object]:
    """Versions of Python, the system and the libraries as plain data; None for a library that is not installed."""
    return {
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "system": platform.platform(),
        "machine": platform.machine(),
        "packages": {**installed_versions((*REQUIRED_PACKAGES, *OPTIONAL_PACKAGES)), "ipopt": ipopt_version()},
    }


def installed_versions(names: Iterable[str]) -> dict[str, str | None]:
    """Name → version of each distribution; None if it is not installed, like a checkout that is only on the path."""
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
