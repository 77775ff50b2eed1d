"""Faults of the input with their positions, and the exception that contains all faults."""

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

MAX_LISTED = 50
"""Largest number of faults that one message lists; further faults are only counted."""

_MAX_MESSAGE = 4000  # largest number of characters of a message; the middle of a longer message is left out
_MAX_PATH = 1000  # largest number of characters of a path in a message
_MAX_VALUE = 60  # largest number of characters of a value in a message
_MAX_NAME = 80  # largest length of a name that is compared with others; the time grows with the square of the length
_MAX_NAMES = 200  # largest number of accepted names that a message lists
_NOT_ASCII = re.compile("[^ -~]")
_UNPRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters, line and direction marks, and unpaired surrogates."""


@dataclass(frozen=True)
class Fault:
    """One error in the input.

    Attributes:
        message: the value found, the accepted values, and advice.
        key: keys of the tables around the fault, and its own key, such as ``("parameters", "Fr", "min")``.
        file, line: position of the fault, if the problem came from a file.

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
        position = _cut(self.file, _MAX_PATH) + (f":{self.line}" if self.line else "")
        key, message = _cut(".".join(map(str, self.key)), 2 * _MAX_VALUE), _cut(self.message, _MAX_MESSAGE)
        return escape_unprintable(": ".join(part for part in (position, key, message) if part))


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
        unlisted = len(self.faults) - MAX_LISTED
        remainder = [f"and {unlisted} more"] if unlisted > 0 else []
        super().__init__("\n".join([*map(str, self.faults[:MAX_LISTED]), *remainder]))

    def __reduce__(self) -> tuple[type["InputError"], tuple[tuple[Fault, ...]]]:
        return InputError, (self.faults,)


def input_error(message: str, *key: str) -> InputError:
    """An `InputError` with one fault."""
    return InputError([Fault(message, key)])


MOST_STARTS = 10**9  # largest number of starts of a search; iterators count only up to sys.maxsize
MOST_POINTS = 10_000  # largest number of points of a front; each point is an optimisation


def count_faults(name: str, value: Any, minimum: int, maximum: int | None = None) -> list[Fault]:
    """Faults of a value that must be a whole number in a range."""
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)
    if is_whole and value >= minimum and (maximum is None or value <= maximum):
        return []
    accepted = f"a whole number, {minimum} or more"
    if maximum is not None:
        accepted = f"a whole number from {minimum} to {maximum}"
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


def callback_faults(name: str, value: Any) -> list[Fault]:
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
    """The text with escapes in place of characters that cannot be printed, such as line breaks."""
    return _NOT_ASCII.sub(lambda match: match[0] if match[0].isprintable() else repr(match[0])[1:-1], text)


def suggest(name: Any, accepted: Iterable[str]) -> str:
    """A phrase with the most similar accepted name, if there is one, and a list of all accepted names."""
    names, name = list(accepted), str(name)
    equal_names = [n for n in names if n.lower() == name.lower()]
    similar = equal_names or find_similar(name, names)
    hint = f"did you mean '{similar[0]}'? " if similar else ""
    remainder = f" and {len(names) - _MAX_NAMES} more" if len(names) > _MAX_NAMES else ""
    return f"{hint}accepted: {' '.join(names[:_MAX_NAMES])}{remainder}"


def find_similar(name: str, names: Iterable[str], cutoff: float = 0.5, max_count: int = 1) -> list[str]:
    """Up to `max_count` names with a similar spelling; empty if there are none, or `name` has over 80 characters."""
    return (
        [] if len(name) > _MAX_NAME else get_close_matches(name, islice(names, _MAX_NAMES), n=max_count, cutoff=cutoff)
    )


def limit_advice(advise: Callable[..., str]) -> Callable[..., str]:
    """A function that calls `advise` at most 50 times, because a message lists only 50 faults and advice is slow."""
    calls = iter(range(MAX_LISTED))
    return lambda *arguments: advise(*arguments) if next(calls, None) is not None else "accepted: as above"


def short(value: Any) -> str:
    """A value as a text of up to 60 characters, with escapes in place of control characters."""
    return _cut(escape_unprintable(_SHORT_REPR.repr(value)), _MAX_VALUE)


def _cut(text: str, max_length: int) -> str:
    """The text, shortened to `max_length` characters: in the middle, or at the end if `max_length` is small."""
    if len(text) <= max_length:
        return text
    half = max_length // 2
    return f"{text[: max_length - 3]}…" if max_length <= _MAX_VALUE else f"{text[:half]} … {text[-half:]}"


class _ShortRepr(reprlib.Repr):
    """Makes a short `repr`, which stops early, because a file may have numbers and lists of any size and depth."""

    def repr_int(self, x: int, level: int) -> str:
        if x.bit_length() > 4 * _MAX_VALUE:
            return f"a whole number of about {round(x.bit_length() * math.log10(2))} digits"
        return repr(x)

    def repr_dict(self, x: dict[Any, Any], level: int) -> str:
        """The items in their order; `reprlib` would sort them."""
        items = [f"{key!r}: {self.repr1(value, level - 1)}" for key, value in islice(x.items(), self.maxdict)]
        return f"{{{', '.join([*items, *['…'] * (len(x) > self.maxdict)])}}}" if level > 0 else "{…}"


_SHORT_REPR = _ShortRepr()
vars(_SHORT_REPR).update(
    maxlevel=3, maxlist=15, maxtuple=15, maxdict=15, maxstring=_MAX_VALUE, maxother=_MAX_VALUE, fillvalue="…"
)


def import_optional(module: str, alternative: str = "") -> Any:
    """Import a module of the extra ``data``.

    Args:
        alternative: what the user can do without the module, for the message.

    Raises:
        InputError: if the module is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        advice = f", or {alternative}" if alternative else ""
        raise InputError([Fault(f'{module} is not installed; pip install "tmsopt[data]"{advice}')]) from error
