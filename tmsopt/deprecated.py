"""What earlier versions had: options that do nothing any more, attributes that stand elsewhere."""

import warnings
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def ignore_option(name: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A decorator: the function takes one keyword more, warns that it is no longer needed, and leaves it out."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def call(*arguments: P.args, **options: P.kwargs) -> R:
            if options.pop(name, None) is not None:
                warnings.warn(no_longer_needed(f"{name}="), DeprecationWarning, stacklevel=2)
            return function(*arguments, **options)

        return call

    return decorate


def no_longer_needed(option: str) -> str:
    """What a user reads who gives such an option."""
    return f"{option} is no longer needed: NumPy computes every chart; leave it out"


OF_POSED = frozenset(
    (
        "asked_of_roots",
        "asks",
        "asks_radius",
        "cases",
        "conditions",
        "exactly",
        "heading",
        "located",
        "nominal",
        "objective",
        "objectives",
        "ordered",
        "parameter_set",
        "pattern",
        "read",
        "sense",
        "sign",
        "typed",
        "values",
        "vocabulary",
    )
)
"""Attributes of a `Problem` in 1.1 that are those of its `posed`."""


def read_from_posed(problem: Any, name: str) -> Any:
    """An attribute of a problem that is one of its `posed`.

    Raises:
        AttributeError: for any other.
    """
    if name not in OF_POSED:
        raise AttributeError(f"'{type(problem).__name__}' object has no attribute '{name}'", name=name, obj=problem)
    warnings.warn(f"Problem.{name} is moved: write problem.posed.{name}", DeprecationWarning, stacklevel=3)
    return getattr(problem.posed, name)
