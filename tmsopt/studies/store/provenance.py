"""Where rows came from: host, platform and the versions of everything that a row's bits depend on."""

import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path

PACKAGES = ("tmsopt", "casadi", "numpy", "scipy", "python-flint")


def versions() -> dict[str, str]:
    """Of tmsopt, Python, the libraries that solve, and IPOPT where its file tells; nothing is imported for it."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found | {"ipopt": _ipopt()}


def host() -> str:
    """This machine's name."""
    return platform.node()


def now() -> str:
    """The time in UTC, ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def changed(then: Mapping[str, str], today: Mapping[str, str]) -> tuple[str, ...]:
    """One line for each version that differs."""
    return tuple(
        f"{name}: {then.get(name, 'unknown')} in the store, {today.get(name, 'unknown')} now"
        for name in dict.fromkeys([*then, *today])
        if then.get(name, "unknown") != today.get(name, "unknown")
    )


def _ipopt() -> str:
    """The version in the name of the library that the CasADi wheel brings; it tells nowhere else without a solve."""
    try:
        folder = Path(str(distribution("casadi").locate_file("casadi")))
    except PackageNotFoundError:
        return "unknown"
    names = [library.name.removeprefix("libipopt.so.") for library in folder.glob("libipopt.so.*")]
    return max(names, key=len, default="unknown")
