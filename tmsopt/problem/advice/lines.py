"""Suggests what to write instead of a line that is not TOML."""

import re

_QUOTED = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'[^']*'")
_NUMBER = r"[+-]?\d[\d.]*(?:[eE][+-]?\d+)?"
_BRACKETS = {"[": "]", "{": "}"}
_MAX_LENGTH = (
    1000  # greatest number of characters; a longer line gets no suggestion, because the search takes quadratic time
)


def suggest_line(line: str) -> str:  # noqa: PLR0911 - one per case
    """The end of an error message that says what to write; empty without a suggestion."""
    if len(line) > _MAX_LENGTH:
        return ""
    unquoted = _QUOTED.sub('""', line).split("#")[0]  # a text inside quotes has no faults
    key, _, value = unquoted.partition("=")
    if unquoted.count('"') % 2 or unquoted.count("'") % 2:
        return "; a quote is missing"
    if comma := re.search(r"=\s*([+-]?\d+),(\d+)\s*([,}]|$)", unquoted):
        return f"; write a decimal point: {comma[1]}.{comma[2]}"
    if percent := re.search(rf"=\s*({_NUMBER})\s*%", unquoted):
        return f"; write {float(percent[1]) / 100:.12g} for {percent[1]} %"
    if re.search(rf"=\s*(?:{_NUMBER}\s*[+-]\s*)?{_NUMBER}[ij]\s*([,}}]|$)", unquoted):
        return "; parameters are real: write a complex number as two of them, kr + 1j*ki in H"
    if unit := re.search(rf"=\s*({_NUMBER}\s*[A-Za-z°µμ][\w°²/^*]*)\s*([,}}]|$)", unquoted):
        return f'; write a number with a unit in quotes: "{unit[1].strip()}"'
    for open_bracket, close_bracket in _BRACKETS.items():
        if unquoted.count(open_bracket) != unquoted.count(close_bracket):
            has_more_open = unquoted.count(open_bracket) > unquoted.count(close_bracket)
            return f"; a {close_bracket if has_more_open else open_bracket} is missing"
    if re.search(r"[\d\"]\s+\w+\s*=", value):
        return "; write a comma between the entries: { min = 1, max = 2 }"
    if text := re.match(r"\s*([A-Za-z_][^\[{\"']*?)\s*$", value):
        return f'; write a text in quotes: {key.strip()} = "{text[1]}"'
    if "=" not in unquoted and not unquoted.lstrip().startswith("["):
        return "; write name = value, or the name of a section in brackets, such as [parameters]"
    return ""
