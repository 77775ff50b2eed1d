"""Faults of the input with their places, and the exception that contains all of them."""

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
"""Largest number of faults that one message lists; it only counts the others."""

_MAX_MESSAGE = 4000  # characters of a message; the middle of a longer message is left out
_MAX_PATH = 1000  # characters of a path in a message
_MAX_VALUE = 60  # characters of a value in a message
_MAX_NAME = 80  # characters of a name that is compared with others; the time grows with the square of the length
_MAX_NAMES = 200  # accepted names that a message lists
_NOT_ASCII = re.compile("[^ -~]")
_UNPRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters, line and direction marks, and unpaired surrogates."""


@dataclass(frozen=True)
class Fault:
    """One error in the input.

    Attributes:
        message: the value found, the accepted values, and what to do.
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
        place = _cut(self.file, _MAX_PATH) + (f":{self.line}" if self.line else "")
        key, message = _cut(".".join(map(str, self.key)), 2 * _MAX_VALUE), _cut(self.message, _MAX_MESSAGE)
        return escape_unprintable(": ".join(part for part in (place, key, message) if part))


class InputError(ValueError):
    """The input is not valid. `faults` contains every fault; the message shows the first 50.

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
        unlisted = len(self.faults) - LISTED
        remainder = [f"and {unlisted} more"] if unlisted > 0 else []
        super().__init__("\n".join([*map(str, self.faults[:LISTED]), *remainder]))

    def __reduce__(self) -> tuple[type["InputError"], tuple[tuple[Fault, ...]]]:
        return InputError, (self.faults,)


def input_error(message: str, *key: str) -> InputError:
    """An `InputError` with one fault."""
    return InputError([Fault(message, key)])


MOST_STARTS = 10**9  # largest number of starts of a search; iterators count only up to sys.maxsize
MOST_POINTS = 10_000  # largest number of points of a front; each point is an optimisation


def count_faults(name: str, value: Any, least: int, most: int | None = None) -> list[Fault]:
    """Faults of a value that must be a whole number in a range."""
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)
    if is_whole and value >= least and (most is None or value <= most):
        return []
    accepted = f"a whole number, {least} or more" if most is None else f"a whole number from {least} to {most}"
    return [Fault(f"found {short(value)}; accepted: {accepted}", (name,))]


def is_number(value: Any) -> bool:
    """Whether a value is a finite real number."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False


def table_faults(name: str, value: Any, example: str) -> list[Fault]:
    """Faults of a value that must be a mapping whose keys are names."""
    if isinstance(value, Mapping) and all(isinstance(n, str) for n in value):
        return []
    return [Fault(f"found {short(value)}; accepted: names with their values, such as {example}", (name,))]


def list_faults(name: str, value: Any, example: str) -> list[Fault]:
    """Faults of a value that must be a list; a text is not a list."""
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
    if (match := _UNPRINTABLE.search(text)) is None:
        return []
    message = f"found the control character {escape_unprintable(match[0])} in {short(text)}"
    return [Fault(f"{message}; accepted: a text of one line", key)]


def escape_unprintable(text: str) -> str:
    """The text, in which escapes replace characters that cannot be printed, such as line breaks."""
    return _NOT_ASCII.sub(lambda match: match[0] if match[0].isprintable() else repr(match[0])[1:-1], text)


def suggest(name: Any, accepted: Iterable[str]) -> str:
    """A phrase with the most similar accepted name, if there is one, and a list of all accepted names."""
    names, name = list(accepted), str(name)
    equal_names = [n for n in names if n.lower() == name.lower()]
    near = equal_names or nearest(name, names)
    hint = f"did you mean '{near[0]}'? " if near else ""
    remainder = f" and {len(names) - _MAX_NAMES} more" if len(names) > _MAX_NAMES else ""
    return f"{hint}accepted: {' '.join(names[:_MAX_NAMES])}{remainder}"


def nearest(name: str, names: Iterable[str], cutoff: float = 0.5, most: int = 1) -> list[str]:
    """Up to `most` names with a similar spelling; empty if there is none, or if `name` has more than 80 characters."""
    return [] if len(name) > _MAX_NAME else get_close_matches(name, islice(names, _MAX_NAMES), n=most, cutoff=cutoff)


def limit_advice(advise: Callable[..., str]) -> Callable[..., str]:
    """A function that calls `advise` only 50 times, because a message lists only 50 faults and advice is slow."""
    calls = iter(range(LISTED))
    return lambda *arguments: advise(*arguments) if next(calls, None) is not None else "accepted: as above"


def short(value: Any) -> str:
    """A value as a text of up to 60 characters, in which escapes replace control characters."""
    return _cut(escape_unprintable(_SHORT_REPR.repr(value)), _MAX_VALUE)


def _cut(text: str, most: int) -> str:
    """The text, shortened to `most` characters: in the middle, or at the end if `most` is small."""
    if len(text) <= most:
        return text
    return f"{text[: most - 3]}…" if most <= _MAX_VALUE else f"{text[: most // 2]} … {text[-most // 2 :]}"


class _Short(reprlib.Repr):
    """A short `repr` of a value; it stops early, because a file may have numbers and lists of any size and depth."""

    def repr_int(self, x: int, level: int) -> str:
        if x.bit_length() > 4 * _MAX_VALUE:
            return f"a whole number of about {round(x.bit_length() * math.log10(2))} digits"
        return repr(x)

    def repr_dict(self, x: dict[Any, Any], level: int) -> str:
        """The items in their order; `reprlib` would sort them."""
        items = [f"{key!r}: {self.repr1(value, level - 1)}" for key, value in islice(x.items(), self.maxdict)]
        return f"{{{', '.join([*items, *['…'] * (len(x) > self.maxdict)])}}}" if level > 0 else "{…}"


_SHORT_REPR = _Short()
vars(_SHORT_REPR).update(
    maxlevel=3, maxlist=15, maxtuple=15, maxdict=15, maxstring=_MAX_VALUE, maxother=_MAX_VALUE, fillvalue="…"
)


def import_optional(module: str, otherwise: str = "") -> Any:
    """Import a module of the extra ``data``.

    Args:
        otherwise: what the user can do without the module.

    Raises:
        InputError: if the module is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        advice = f", or {otherwise}" if otherwise else ""
        raise InputError([Fault(f'{module} is not installed; pip install "tmsopt[data]"{advice}')]) from error
