"""Descriptions of structures in words."""

import re
from collections.abc import Sequence

from tmsopt.roots.patterns.components import NUMBER_WORDS, count_in_words, multiplicity_in_words

STRUCTURES = {
    "EP4": "four roots coincide (EP4)",
    "2EP2": "the roots meet two by two in two real ones (2EP2)",
    "EP2": "the two rightmost roots meet in a real one (EP2)",
    "pair": "one complex pair is rightmost (pair)",
    "real": "one real root is rightmost (real)",
    "undecided": "double precision cannot tell which roots meet (undecided)",
}
"""Structure of a quartic → its description, if it differs from the general one."""

_PART = re.compile(r"(?P<count>\d*)(?P<kind>C?EP)(?P<order>\d+)|(?P<pairs>\w+) pairs|(?P<simple>pair|real)")


def describe_structure(structure: str, degree: int = 4) -> str:
    """A structure in words, for a polynomial of a degree; an unknown structure is returned unchanged."""
    if structure in STRUCTURES and (degree == 4 or structure not in ("EP4", f"EP{degree}")):
        return STRUCTURES[structure]
    parts = [_PART.fullmatch(part) for part in structure.split("+")]
    if not all(parts):
        return structure
    single_part = parts[0] if len(parts) == 1 else None
    if single_part and single_part["kind"] == "EP" and not single_part["count"]:
        order = int(single_part["order"])
        return f"{select_in_words(order, degree, 'rightmost')} roots coincide ({structure})"
    if single_part and single_part["kind"] == "CEP" and not single_part["count"]:
        return f"{NUMBER_WORDS[int(single_part['order'])]} complex pairs coincide ({structure})"
    return f"{join_in_words([_describe_part(part) for part in parts if part])} share one decay rate ({structure})"


def select_in_words(order: int, degree: int, selection: str) -> str:
    """A selection of roots in words: ``both`` or ``all three`` if it has all roots, else ``the three rightmost``."""
    number = NUMBER_WORDS[order]
    return f"the {number} {selection}".rstrip() if order != degree else "both" if order == 2 else f"all {number}"


def join_in_words(names: Sequence[str]) -> str:
    """A list in words: ``one, two and three``."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _describe_part(part: re.Match[str]) -> str:
    if part["simple"]:
        return {"pair": "a complex pair", "real": "a real root"}[part["simple"]]
    if part["pairs"]:
        return f"{part['pairs']} complex pairs"
    multiplicity = multiplicity_in_words(int(part["order"]))
    noun = f"real {multiplicity} root" if part["kind"] == "EP" else f"{multiplicity} complex pair"
    return count_in_words(int(part["count"] or 1), noun)
