"""Descriptions of structures in words."""

import re
from collections.abc import Sequence

from tmsopt.roots.patterns.components import NUMBERS, count_in_words, multiplicity_in_words

STRUCTURES = {
    "EP4": "four roots coincide (EP4)",
    "2EP2": "the roots meet two by two in two real ones (2EP2)",
    "EP2": "the two rightmost roots meet in a real one (EP2)",
    "pair": "one complex pair is rightmost (pair)",
    "real": "one real root is rightmost (real)",
    "undecided": "double precision cannot tell which roots meet (undecided)",
}
"""Special descriptions for structures of a quartic."""

_PART = re.compile(r"(?P<count>\d*)(?P<kind>C?EP)(?P<order>\d+)|(?P<pairs>\w+) pairs|(?P<simple>pair|real)")


def describe_structure(structure: str, degree: int = 4) -> str:
    """A structure in words, for a polynomial of a degree; an unknown structure is returned unchanged."""
    if structure in STRUCTURES and (degree == 4 or structure not in ("EP4", f"EP{degree}")):
        return STRUCTURES[structure]
    parts = [_PART.fullmatch(part) for part in structure.split("+")]
    if not all(parts):
        return structure
    only = parts[0] if len(parts) == 1 else None
    if only and only["kind"] == "EP" and not only["count"]:
        order = int(only["order"])
        return f"{select_in_words(order, degree, 'rightmost')} roots coincide ({structure})"
    if only and only["kind"] == "CEP" and not only["count"]:
        return f"{NUMBERS[int(only['order'])]} complex pairs coincide ({structure})"
    return f"{join_in_words([_describe_part(part) for part in parts if part])} share one decay rate ({structure})"


def select_in_words(order: int, degree: int, which: str) -> str:
    """A selection of roots in words: ``both`` or ``all three`` if there are no others, else ``the three rightmost``."""
    number = NUMBERS[order]
    return f"the {number} {which}".rstrip() if order != degree else "both" if order == 2 else f"all {number}"


def join_in_words(names: Sequence[str]) -> str:
    """A list in words: ``one, two and three``."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _describe_part(part: re.Match[str]) -> str:
    if part["simple"]:
        return {"pair": "a complex pair", "real": "a real root"}[part["simple"]]
    if part["pairs"]:
        return f"{part['pairs']} complex pairs"
    fold = multiplicity_in_words(int(part["order"]))
    return count_in_words(
        int(part["count"] or 1), f"real {fold} root" if part["kind"] == "EP" else f"{fold} complex pair"
    )
