"""What was meant by an expression that does not read as one, written as it should be."""

import re
from collections.abc import Callable, Iterable

from tmsopt.models.names import AMBIGUOUS_NAMES
from tmsopt.models.tables import read_table

_NUMBER = r"(?<![\w.])(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)"
_WORDS = read_table("advice")
_UNITS = _WORDS["units"]

Repair = tuple[str, str | Callable[[re.Match[str]], str]]


def _converted(found: re.Match[str]) -> str:
    return f"{float(found[1]) * _UNITS[found[2]]:.12g}"


_REPAIRS: tuple[Repair, ...] = (
    *((re.escape(sign), meant) for sign, meant in _WORDS["signs"].items()),
    (r"(?<![<>=!])=(?!=)", "=="),
    (r"([<>])(?!=)", r"\1="),
    (r"(?<=\d),(?=\d)", "."),
    (_NUMBER + r"\s*%", lambda found: f"{float(found[1]) / 100:.12g}"),
    (_NUMBER + r"\s*(?:°|deg\b|degrees?\b)", r"\1*pi/180"),
    (_NUMBER + r"\s*rad\b", r"\1"),
    (_NUMBER + rf"\s*({'|'.join(_UNITS)})\b(?!\s*/)", _converted),
    (_NUMBER + r"\s*(?=(?!j\b)[A-Za-z(])", r"\1*"),
)
"""What others write → what is read here, one after the other."""

_WITH_UNIT = re.compile(_NUMBER + rf"\s*({'|'.join(_UNITS)}|deg|°)(?!\w)")


def call_advice(name: str, arguments: Iterable[str]) -> str:
    """The end of a sentence that says what to write for a function that there is not; empty likewise."""
    functions = _WORDS["functions"]
    meant = f"write {functions[name]}" if name in functions else AMBIGUOUS_NAMES["t"] if "t" in arguments else ""
    return f"; {meant}" if meant else ""


def advice(text: str, reads: Callable[[str], bool]) -> str:
    """The end of a sentence that says what to write for a text that is refused; empty where that is not known.

    Args:
        reads: whether a text parses.
    """
    if re.search(r"\d[jJ]\b", text):
        return (
            "; expressions are real: write real and imaginary parts as numbers of their own; a complex matrix goes in H"
        )
    if missing := text.count("(") - text.count(")"):
        return f"; a {'()'[missing > 0]} is missing"
    mended = text.strip()
    for sign, meant in _REPAIRS:
        mended = re.sub(sign, meant, mended)
    if mended == text.strip() or not mended.isascii() or "inf" in mended or not reads(mended):
        return ""
    units = " (numbers in expressions are in m, kg, s, rad and N)" if _WITH_UNIT.search(text) else ""
    return f"; write '{mended}'{units}"
