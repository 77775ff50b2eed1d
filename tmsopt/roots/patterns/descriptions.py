"""Structures of the rightmost line in words."""

import re

STRUCTURES = {
    "EP4": "four roots meet in one (EP4)",
    "EP3": "the three rightmost roots meet in one (EP3)",
    "2EP2": "the roots meet two by two in two real ones (2EP2)",
    "CEP2": "two complex pairs meet in one (CEP2)",
    "EP2": "the two rightmost roots meet in a real one (EP2)",
    "EP2+pair": "a real double root and a complex pair have one decay rate (EP2+pair)",
    "pair+real": "a complex pair and a real root have one decay rate (pair+real)",
    "two pairs": "two complex pairs have one decay rate (two pairs)",
    "pair": "one complex pair is rightmost (pair)",
    "real": "one real root is rightmost (real)",
    "undecided": "double precision cannot tell which roots meet (undecided)",
}
"""Each structure of a quartic."""

_NUMBERS = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"]
_TIMES = {2: "double", 3: "triple"}
_PART = re.compile(r"(?P<count>\d*)(?P<kind>C?EP)(?P<order>\d+)|(?P<pairs>\w+) pairs|(?P<simple>pair|real)")


def in_words(structure: str, degree: int = 4) -> str:
    """A structure in words, for a polynomial of a degree; one that is unknown as it is."""
    if structure in STRUCTURES and (degree == 4 or structure not in ("EP4", f"EP{degree}")):
        return STRUCTURES[structure]
    parts = [_PART.fullmatch(part) for part in structure.split("+")]
    if not all(parts):
        return structure
    alone = parts[0] if len(parts) == 1 else None
    if alone and alone["kind"] == "EP" and not alone["count"]:
        order = int(alone["order"])
        every = "both" if order == 2 else f"all {_NUMBERS[order]}"
        which = every if order == degree else f"the {_NUMBERS[order]} rightmost"
        return f"{which} roots meet in one ({structure})"
    if alone and alone["kind"] == "CEP" and not alone["count"]:
        return f"{_NUMBERS[int(alone['order'])]} complex pairs meet in one ({structure})"
    named = [_named(part) for part in parts if part]
    listed = named[0] if len(named) == 1 else f"{', '.join(named[:-1])} and {named[-1]}"
    return f"{listed} have one decay rate ({structure})"


def _named(part: re.Match[str]) -> str:
    if part["simple"]:
        return {"pair": "a complex pair", "real": "a real root"}[part["simple"]]
    if part["pairs"]:
        return f"{part['pairs']} complex pairs"
    order, count = int(part["order"]), int(part["count"] or 1)
    times = _TIMES.get(order, f"{order}-fold")
    what = f"real {times} root" if part["kind"] == "EP" else f"{times} complex pair"
    return f"a {what}" if count == 1 else f"{_NUMBERS[count]} {what}s"
