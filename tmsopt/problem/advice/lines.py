"""Suggests what to write instead of a line that is not TOML."""

import re

_QUOTED = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'[^']*'")
_NUMBER = r"[+-]?\d[\d.]*(?:[eE][+-]?\d+)?"
_PAIRS = {"[": "]", "{": "}"}
_LONGEST = 1000  # characters of a line, since matching takes quadratic time


def suggest_line(line: str) -> str:  # noqa: PLR0911 - one per case
    """The end of an error message that says what to write; empty without a suggestion."""
    if len(line) > _LONGEST:
        return ""
    bare = _QUOTED.sub('""', line).split("#")[0]  # nothing inside quotes is at fault
    key, _, value = bare.partition("=")
    if bare.count('"') % 2 or bare.count("'") % 2:
        return "; a quote is missing"
    if comma := re.search(r"=\s*([+-]?\d+),(\d+)\s*([,}]|$)", bare):
        return f"; write a decimal point: {comma[1]}.{comma[2]}"
    if share := re.search(rf"=\s*({_NUMBER})\s*%", bare):
        return f"; write {float(share[1]) / 100:.12g} for {share[1]} %"
    if re.search(rf"=\s*(?:{_NUMBER}\s*[+-]\s*)?{_NUMBER}[ij]\s*([,}}]|$)", bare):
        return "; parameters are real: write a complex number as two of them, kr + 1j*ki in H"
    if unit := re.search(rf"=\s*({_NUMBER}\s*[A-Za-z°µμ][\w°²/^*]*)\s*([,}}]|$)", bare):
        return f'; write a number with a unit in quotes: "{unit[1].strip()}"'
    for opening, closing in _PAIRS.items():
        if bare.count(opening) != bare.count(closing):
            return f"; a {closing if bare.count(opening) > bare.count(closing) else opening} is missing"
    if re.search(r"[\d\"]\s+\w+\s*=", value):
        return "; write a comma between the entries: { min = 1, max = 2 }"
    if text := re.match(r"\s*([A-Za-z_][^\[{\"']*?)\s*$", value):
        return f'; write a text in quotes: {key.strip()} = "{text[1]}"'
    if "=" not in bare and not bare.lstrip().startswith("["):
        return "; write name = value, or the name of a section in brackets, such as [parameters]"
    return ""
