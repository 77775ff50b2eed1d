"""Options without effect, and names of earlier versions."""

import warnings
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def ignore_option(name: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function: it accepts one more keyword, ignores it, and warns that it is no longer needed."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def call(*arguments: P.args, **options: P.kwargs) -> R:
            if options.pop(name, None) is not None:
                warnings.warn(no_longer_needed(f"{name}="), DeprecationWarning, stacklevel=2)
            return function(*arguments, **options)

        return call

    return decorate


def rename_attribute(old: str, new: str) -> Any:
    """A property with the name of an earlier version. It warns, and returns the attribute with the new name."""

    def read(owner: Any) -> Any:
        message = f"{type(owner).__name__}.{old} is now {type(owner).__name__}.{new}"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return getattr(owner, new)

    return property(read)


class ReportModule:
    """`tmsopt.report` of 1.1. Each of its functions returns the report of the last result among its arguments."""

    def __getattr__(self, name: str) -> Callable[..., str]:
        if name.startswith("_"):
            raise AttributeError(name)
        warnings.warn(f"tmsopt.report.{name} is gone: call .report() of the result", DeprecationWarning, stacklevel=2)
        return lambda *arguments, full=False, **_: str(
            [x for x in arguments if hasattr(x, "report")][-1].report(full=full)
        )


def no_longer_needed(option: str) -> str:
    """The warning about an option without effect."""
    return f"{option} is no longer needed: NumPy computes every chart; leave it out"


MOVED_TO_POSED = (
    "asked_of_roots asks asks_radius cases conditions exactly heading located nominal objective objectives ordered "
    "parameter_set pattern read sense sign typed values vocabulary"
)
"""Attributes of a `Problem` in 1.1 that have moved to `Problem.posed`."""


def read_from_posed(problem: Any, name: str) -> Any:
    """An attribute that has moved from a problem to `Problem.posed`, with a warning.

    Raises:
        AttributeError: if no attribute of this name has moved.
    """
    if name not in MOVED_TO_POSED.split():
        raise AttributeError(f"'{type(problem).__name__}' object has no attribute '{name}'", name=name, obj=problem)
    warnings.warn(f"Problem.{name} has moved; write problem.posed.{name}", DeprecationWarning, stacklevel=3)
    return getattr(problem.posed, name)
