"""Bad input as data: every fault found, with its place, and one exception that carries them all."""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from itertools import islice
from numbers import Integral, Real
from typing import Any

LISTED = 50
"""Faults that a message lists; the rest is counted."""

_LONGEST = 4000  # characters of a message; the middle of a longer one is left out
_PATH = 1000  # characters of a file's name
_WIDTH = 60  # of a value in a message
_NAME = 80  # characters of a name for which a near one is looked for, which takes time by the square of them
_NAMES = 200  # that are listed as accepted
_NOT_ASCII = re.compile("[^ -~]")
_UNSHOWABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""What a terminal obeys, what breaks a line or turns its order round, and halves of characters."""


@dataclass(frozen=True)
class Fault:
    """One thing wrong with a problem.

    Attributes:
        message: what was found, what is accepted, and what to do.
        key: where, as a path of keys, e.g. ``("parameters", "Fr", "min")``.
        file, line: the file and line, where the problem came from a file.

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
        """The same fault, placed in a file."""
        return replace(self, file=file, line=line)

    def __str__(self) -> str:
        place = _cut(self.file, _PATH) + (f":{self.line}" if self.line else "")
        key, message = _cut(".".join(map(str, self.key)), 2 * _WIDTH), _cut(self.message, _LONGEST)
        return escape_unprintable(": ".join(part for part in (place, key, message) if part))


class InputError(ValueError):
    """A problem that is not well posed; `faults` has everything found wrong with it, the message the first `LISTED`.

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
    """The error for one thing wrong."""
    return InputError([Fault(message, key)])


MOST_STARTS = 10**9  # of a search; what counts them takes no more than sys.maxsize
MOST_POINTS = 10_000  # of a front, a problem to be solved for each


def count_faults(name: str, value: Any, least: int, most: int | None = None) -> list[Fault]:
    """What is wrong with a whole number that a user gave."""
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if whole and value >= least and (most is None or value <= most):
        return []
    accepted = f"a whole number, {least} or more" if most is None else f"a whole number from {least} to {most}"
    return [Fault(f"found {short(value)}; accepted: {accepted}", (name,))]


def is_number(value: Any) -> bool:
    """Whether a user gave a finite real number."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False


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


def text_faults(text: Any, *key: str) -> list[Fault]:
    """What is wrong with a text that reports and tables show on one line."""
    if not isinstance(text, str):
        return [Fault(f"found {short(text)}; accepted: a text", key)]
    return [Fault(f"{wrong}; accepted: a text of one line", key)] if (wrong := unshowable(text)) else []


def unshowable(text: str, but: str = "") -> str:
    """The first character of a text that is not shown, such as an escape sequence's, in words; empty for none.

    Args:
        but: characters that may stand in it.
    """
    found = next((c[0] for c in _UNSHOWABLE.finditer(text) if c[0] not in but), None)
    return f"found the control character {escape_unprintable(found)} in {short(text)}" if found else ""


def escape_unprintable(text: str) -> str:
    """A text as it may stand on a terminal: what has no picture there, such as line breaks, as escapes."""
    return _NOT_ASCII.sub(lambda found: found[0] if found[0].isprintable() else repr(found[0])[1:-1], text)


def suggest(name: Any, accepted: Iterable[str]) -> str:
    """A sentence that offers the nearest accepted name, if one is near, and lists all of them."""
    names, name = list(accepted), str(name)
    by_case = [n for n in names if n.lower() == name.lower()]
    near = by_case or nearest(name, names)
    hint = f"did you mean '{near[0]}'? " if near else ""
    more = f" and {len(names) - _NAMES} more" if len(names) > _NAMES else ""
    return f"{hint}accepted: {' '.join(names[:_NAMES])}{more}"


def nearest(name: str, names: Iterable[str], cutoff: float = 0.5) -> list[str]:
    """The name that is nearest by spelling, if one is; none for a name of more than 80 characters."""
    return [] if len(name) > _NAME else get_close_matches(name, islice(names, _NAMES), n=1, cutoff=cutoff)


def limit_advice(advise: Callable[..., str]) -> Callable[..., str]:
    """Advice for as many faults as are listed: what takes time is not looked for where it is only counted."""
    left = iter(range(LISTED))
    return lambda *about: advise(*about) if next(left, None) is not None else "accepted: as above"


def short(value: Any) -> str:
    """A value as found, cut where it is long, control characters as escapes."""
    return _cut(escape_unprintable(_text(value, _WIDTH)), _WIDTH)


def _cut(text: str, most: int) -> str:
    """The text; the middle of a long one is left out, of one to be short the end."""
    if len(text) <= most:
        return text
    return f"{text[: most - 3]}…" if most <= _WIDTH else f"{text[: most // 2]} … {text[-most // 2 :]}"


def _text(value: Any, room: int) -> str:
    """What `repr` says, little more of it than is shown: a file may hold numbers and lists of any size and depth."""
    if type(value) in (list, tuple, dict) and value:
        entries = value.items() if isinstance(value, dict) else ((None, x) for x in value)
        said = [
            _text(x, room // 4) if k is None else f"{_text(k, 0)}: {_text(x, room // 4)}"
            for k, x in islice(entries, room)
        ]
        inner = ", ".join([*said, "…"] if len(value) > room else said)
        if isinstance(value, dict):
            return f"{{{inner}}}"
        return f"[{inner}]" if isinstance(value, list) else f"({inner}{',' * (len(value) == 1)})"
    if isinstance(value, str | bytes):
        return repr(value[: _WIDTH + 1])
    if isinstance(value, int) and value.bit_length() > 4 * _WIDTH:
        return f"a whole number of about {round(value.bit_length() * math.log10(2))} digits"
    return repr(value)


def import_optional(module: str, otherwise: str = "") -> Any:
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
