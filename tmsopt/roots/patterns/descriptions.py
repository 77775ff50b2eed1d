"""Structures of the rightmost line in words."""

import re
from collections.abc import Sequence

from tmsopt.roots.patterns.components import NUMBERS, several, times

STRUCTURES = {
    "EP4": "four roots meet in one (EP4)",
    "2EP2": "the roots meet two by two in two real ones (2EP2)",
    "EP2": "the two rightmost roots meet in a real one (EP2)",
    "pair": "one complex pair is rightmost (pair)",
    "real": "one real root is rightmost (real)",
    "undecided": "double precision cannot tell which roots meet (undecided)",
}
"""Structures of a quartic with words of their own."""

_PART = re.compile(r"(?P<count>\d*)(?P<kind>C?EP)(?P<order>\d+)|(?P<pairs>\w+) pairs|(?P<simple>pair|real)")


def describe_structure(structure: str, degree: int = 4) -> str:
    """A structure in words, for a polynomial of a degree; one that is unknown as it is."""
    if structure in STRUCTURES and (degree == 4 or structure not in ("EP4", f"EP{degree}")):
        return STRUCTURES[structure]
    parts = [_PART.fullmatch(part) for part in structure.split("+")]
    if not all(parts):
        return structure
    alone = parts[0] if len(parts) == 1 else None
    if alone and alone["kind"] == "EP" and not alone["count"]:
        order = int(alone["order"])
        return f"{all_or(order, degree, 'rightmost')} roots meet in one ({structure})"
    if alone and alone["kind"] == "CEP" and not alone["count"]:
        return f"{NUMBERS[int(alone['order'])]} complex pairs meet in one ({structure})"
    return f"{listed([_named(part) for part in parts if part])} have one decay rate ({structure})"


def all_or(order: int, degree: int, which: str) -> str:
    """Both or all of so many roots; the two, three … of some kind where there are others."""
    number = NUMBERS[order]
    return f"the {number} {which}".rstrip() if order != degree else "both" if order == 2 else f"all {number}"


def listed(names: Sequence[str]) -> str:
    """One, two and three."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _named(part: re.Match[str]) -> str:
    if part["simple"]:
        return {"pair": "a complex pair", "real": "a real root"}[part["simple"]]
    if part["pairs"]:
        return f"{part['pairs']} complex pairs"
    fold = times(int(part["order"]))
    return several(int(part["count"] or 1), f"real {fold} root" if part["kind"] == "EP" else f"{fold} complex pair")
