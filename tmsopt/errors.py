"""Bad input as data: every fault found, with its place, and one exception that carries them all."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from numbers import Integral, Real
from typing import Any


@dataclass(frozen=True)
class Fault:
    """One thing wrong with a problem.

    Attributes:
        message: what was found, what is accepted, and what to do.
        key: where, as a path of keys, e.g. ``("parameters", "Fr", "min")``.
        file, line: the file and line, where the problem came from a file.
    """

    message: str
    key: tuple[str, ...] = ()
    file: str = ""
    line: int = 0

    def at(self, file: str, line: int) -> "Fault":
        """The same fault, placed in a file."""
        return replace(self, file=file, line=line)

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        return ": ".join(part for part in (place, ".".join(map(str, self.key)), self.message) if part)


class InputError(ValueError):
    """A problem that is not well posed; `faults` lists everything found wrong with it."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(str(f) for f in self.faults))

    def __reduce__(self) -> tuple[type["InputError"], tuple[tuple[Fault, ...]]]:
        return InputError, (self.faults,)


def count_faults(name: str, value: Any, least: int, most: int | None = None) -> list[Fault]:
    """What is wrong with a whole number that a user gave."""
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if whole and value >= least and (most is None or value <= most):
        return []
    accepted = f"a whole number, {least} or more" if most is None else f"a whole number from {least} to {most}"
    return [Fault(f"found {short(value)}; accepted: {accepted}", (name,))]


def is_number(value: Any) -> bool:
    """Whether a user gave a finite real number."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def table_faults(name: str, value: Any, example: str) -> list[Fault]:
    """What is wrong with a table of names that a user gave."""
    if isinstance(value, Mapping) and all(isinstance(n, str) for n in value):
        return []
    return [Fault(f"found {short(value)}; accepted: names with their values, such as {example}", (name,))]


def list_faults(name: str, value: Any, example: str) -> list[Fault]:
    """What is wrong with a list that a user gave: a text is none."""
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return []
    return [Fault(f"found {short(value)}; accepted: a list, such as {example}", (name,))]


def call_faults(name: str, value: Any) -> list[Fault]:
    """What is wrong with what is to be called meanwhile, if anything is."""
    return [] if value is None or callable(value) else [Fault(f"found {short(value)}; accepted: a function", (name,))]


def suggest(name: Any, accepted: Iterable[str]) -> str:
    """A sentence that offers the nearest accepted name, if one is near, and lists all of them."""
    names, name = list(accepted), str(name)
    by_case = [n for n in names if n.lower() == name.lower()]
    near = by_case or get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean '{near[0]}'? " if near else ""
    return f"{hint}accepted: {' '.join(names)}"


def short(value: Any) -> str:
    """A value as found, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "…"


def needed(module: str, otherwise: str = "") -> Any:
    """A module that the extra ``data`` brings.

    Args:
        otherwise: what can be done without it.

    Raises:
        InputError: where it is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        advice = f", or {otherwise}" if otherwise else ""
        raise InputError([Fault(f'{module} is not installed; pip install "tmsopt[data]"{advice}')]) from error
