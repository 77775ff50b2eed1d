"""Corrections of expressions that do not parse."""

import re
from collections.abc import Callable, Iterable

from tmsopt.models.names import AMBIGUOUS_NAMES
from tmsopt.models.tables import read_table

_NUMBER = r"(?<![\w.])(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)"
_WORDS = read_table("advice")
_UNITS = _WORDS["units"]

Repair = tuple[str, str | Callable[[re.Match[str]], str]]


_REPAIRS: tuple[Repair, ...] = (
    *((re.escape(sign), replacement) for sign, replacement in _WORDS["signs"].items()),
    (r"(?<![<>=!])=(?!=)", "=="),
    (r"([<>])(?!=)", r"\1="),
    (r"(?<=\d),(?=\d)", "."),
    (_NUMBER + r"\s*%", lambda match: f"{float(match[1]) / 100:.12g}"),
    (_NUMBER + r"\s*(?:°|deg\b|degrees?\b)", r"\1*pi/180"),
    (_NUMBER + r"\s*rad\b", r"\1"),
    (_NUMBER + rf"\s*({'|'.join(_UNITS)})\b(?!\s*/)", lambda match: f"{float(match[1]) * _UNITS[match[2]]:.12g}"),
    (_NUMBER + r"\s*(?=(?!j\b)[A-Za-z(])", r"\1*"),
)
"""(Pattern of another notation, its replacement), in the order in which they are applied."""

_WITH_UNIT = re.compile(_NUMBER + rf"\s*({'|'.join(_UNITS)}|deg|°)(?!\w)")


def call_advice(name: str, arguments: Iterable[str]) -> str:
    """The end of a message about an unknown function: what to write instead; empty if there is no advice."""
    functions = _WORDS["functions"]
    advised = f"write {functions[name]}" if name in functions else AMBIGUOUS_NAMES["t"] if "t" in arguments else ""
    return f"; {advised}" if advised else ""


def advice(text: str, can_parse: Callable[[str], bool]) -> str:
    """The end of a message about a text that does not parse: what to write instead; empty if there is no advice.

    Args:
        can_parse: function that returns whether a text parses.
    """
    if re.search(r"\d[jJ]\b", text):
        only = "only matrices and coefficients may be complex"
        return f"; expressions are real: write real and imaginary part as two numbers; {only}"
    if missing_count := text.count("(") - text.count(")"):
        return f"; a {'()'[missing_count > 0]} is missing"
    repaired_text = text.strip()
    for pattern, replacement in _REPAIRS:
        repaired_text = re.sub(pattern, replacement, repaired_text)
    if (
        repaired_text == text.strip()
        or not repaired_text.isascii()
        or "inf" in repaired_text
        or not can_parse(repaired_text)
    ):
        return ""
    units = " (numbers in expressions are in m, kg, s, rad and N)" if _WITH_UNIT.search(text) else ""
    return f"; write '{repaired_text}'{units}"
