"""Where rows came from: host, platform and the versions of everything that a row's bits depend on."""

import platform
from collections.abc import Mapping
from datetime import UTC, datetime

from tmsopt.versions import installed, ipopt

PACKAGES = ("tmsopt", "casadi", "numpy", "scipy", "python-flint")


def versions() -> dict[str, str]:
    """Of tmsopt, Python, the libraries that solve, and IPOPT where its file tells; nothing is imported for it."""
    found = {"python": platform.python_version(), **installed(PACKAGES), "ipopt": ipopt()}
    return {name: version or "unknown" for name, version in found.items()}


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
