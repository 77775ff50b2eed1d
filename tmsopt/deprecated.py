"""Options of earlier versions that are still accepted and do nothing."""

import warnings
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

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
