"""Faults of the input with their places, and the exception that carries all of them."""

import math
import re
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from itertools import islice
from numbers import Integral, Real
from typing import Any

LISTED = 50
"""Most faults that one message lists; it counts the others."""

_LONGEST = 4000  # most characters of a message; a longer one loses its middle
_PATH = 1000  # most characters of a path in a message
_WIDTH = 60  # most characters of a value in a message
_NAME = 80  # longest name that is compared with others: the time grows with its square
_NAMES = 200  # most accepted names that a message lists
_NOT_ASCII = re.compile("[^ -~]")
_UNPRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters, line and direction marks, and unpaired surrogates."""


@dataclass(frozen=True)
class Fault:
    """One thing wrong with a problem.

    Attributes:
        message: the value found, the values accepted, and what to do.
        key: path of keys to the fault, e.g. ``("parameters", "Fr", "min")``.
        file, line: place of the fault, if the problem came from a file.

    Example:
        >>> str(tmsopt.Fault("found -1; accepted: > 0", ("parameters", "Fr"), "robot.toml", 7))
        'robot.toml:7: parameters.Fr: found -1; accepted: > 0'

    More: docs/reference/problem_file.md
    """

    message: str
    key: tuple[str, ...] = ()
    file: str = ""
    line: int = 0

    def at(self, file: str, line: int) -> "Fault":
        """The same fault at a line of a file."""
        return replace(self, file=file, line=line)

    def __str__(self) -> str:
        place = _cut(self.file, _PATH) + (f":{self.line}" if self.line else "")
        key, message = _cut(".".join(map(str, self.key)), 2 * _WIDTH), _cut(self.message, _LONGEST)
        return escape_unprintable(": ".join(part for part in (place, key, message) if part))


class InputError(ValueError):
    """The input is not valid. `faults` has every fault found; the message shows the first 50.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", 1])
        >>> try:
        ...     tmsopt.Problem(swing, free={"c": (3, 1)}, minimize="speed")
        ... except tmsopt.InputError as error:
        ...     print([".".join(fault.key) for fault in error.faults])
        ['parameters.c', 'objective.minimize']

    More: docs/reference/problem_file.md
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        more = len(self.faults) - LISTED
        super().__init__("\n".join([*map(str, self.faults[:LISTED]), *([f"and {more} more"] if more > 0 else [])]))

    def __reduce__(self) -> tuple[type["InputError"], tuple[tuple[Fault, ...]]]:
        return InputError, (self.faults,)


def input_error(message: str, *key: str) -> InputError:
    """An `InputError` with one fault."""
    return InputError([Fault(message, key)])


MOST_STARTS = 10**9  # of a search; iterators count to sys.maxsize at most
MOST_POINTS = 10_000  # of a front; each is an optimisation


def count_faults(name: str, value: Any, least: int, most: int | None = None) -> list[Fault]:
    """Faults of a value that must be a whole number in a range."""
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)
    if is_whole and value >= least and (most is None or value <= most):
        return []
    accepted = f"a whole number, {least} or more" if most is None else f"a whole number from {least} to {most}"
    return [Fault(f"found {short(value)}; accepted: {accepted}", (name,))]


def is_number(value: Any) -> bool:
    """True if a value is a finite real number."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False


def table_faults(name: str, value: Any, example: str) -> list[Fault]:
    """Faults of a value that must be a mapping from names."""
    if isinstance(value, Mapping) and all(isinstance(n, str) for n in value):
        return []
    return [Fault(f"found {short(value)}; accepted: names with their values, such as {example}", (name,))]


def list_faults(name: str, value: Any, example: str) -> list[Fault]:
    """Faults of a value that must be a list; a text is not one."""
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return []
    return [Fault(f"found {short(value)}; accepted: a list, such as {example}", (name,))]


def call_faults(name: str, value: Any) -> list[Fault]:
    """Faults of a callback; None is accepted."""
    return [] if value is None or callable(value) else [Fault(f"found {short(value)}; accepted: a function", (name,))]


def text_faults(text: Any, *key: str) -> list[Fault]:
    """Faults of a value that must be a text of one line."""
    if not isinstance(text, str):
        return [Fault(f"found {short(text)}; accepted: a text", key)]
    if (found := _UNPRINTABLE.search(text)) is None:
        return []
    message = f"found the control character {escape_unprintable(found[0])} in {short(text)}"
    return [Fault(f"{message}; accepted: a text of one line", key)]


def escape_unprintable(text: str) -> str:
    """The text with escapes in place of characters that cannot be printed, such as line breaks."""
    return _NOT_ASCII.sub(lambda found: found[0] if found[0].isprintable() else repr(found[0])[1:-1], text)


def suggest(name: Any, accepted: Iterable[str]) -> str:
    """A phrase with the nearest accepted name, if one is near, and a list of all."""
    names, name = list(accepted), str(name)
    by_case = [n for n in names if n.lower() == name.lower()]
    near = by_case or nearest(name, names)
    hint = f"did you mean '{near[0]}'? " if near else ""
    more = f" and {len(names) - _NAMES} more" if len(names) > _NAMES else ""
    return f"{hint}accepted: {' '.join(names[:_NAMES])}{more}"


def nearest(name: str, names: Iterable[str], cutoff: float = 0.5, most: int = 1) -> list[str]:
    """The names nearest in spelling, at most so many; empty if none is near or `name` has more than 80 characters."""
    return [] if len(name) > _NAME else get_close_matches(name, islice(names, _NAMES), n=most, cutoff=cutoff)


def limit_advice(advise: Callable[..., str]) -> Callable[..., str]:
    """Advice for the first 50 faults, which a message lists; slow advice on the others would not be shown."""
    calls = iter(range(LISTED))
    return lambda *about: advise(*about) if next(calls, None) is not None else "accepted: as above"


def short(value: Any) -> str:
    """A value as text of up to 60 characters, control characters as escapes."""
    return _cut(escape_unprintable(_SHORT.repr(value)), _WIDTH)


def _cut(text: str, most: int) -> str:
    """The text, cut to `most` characters: in the middle, or at the end if `most` is small."""
    if len(text) <= most:
        return text
    return f"{text[: most - 3]}…" if most <= _WIDTH else f"{text[: most // 2]} … {text[-most // 2 :]}"


class _Short(reprlib.Repr):
    """`repr` of a value, cut early: a file may hold numbers and lists of any size and depth."""

    def repr_int(self, x: int, level: int) -> str:
        if x.bit_length() > 4 * _WIDTH:
            return f"a whole number of about {round(x.bit_length() * math.log10(2))} digits"
        return repr(x)


_SHORT = _Short()
vars(_SHORT).update(maxlevel=3, maxlist=15, maxtuple=15, maxdict=15, maxstring=_WIDTH, maxother=_WIDTH, fillvalue="…")


def import_optional(module: str, otherwise: str = "") -> Any:
    """Import a module of the extra ``data``.

    Args:
        otherwise: what the user can do without it.

    Raises:
        InputError: if the module is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        advice = f", or {otherwise}" if otherwise else ""
        raise InputError([Fault(f'{module} is not installed; pip install "tmsopt[data]"{advice}')]) from error
