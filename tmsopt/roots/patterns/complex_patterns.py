"""Patterns and structures of a complex matrix H, of which those of the real system of twice the size are made.

Every eigenvalue of H stands for a complex pair of roots of that system, so an EPn of H is a CEPn there. That holds
where no root meets the conjugate of another, for which H has a carrier.
"""

import re
from dataclasses import replace
from functools import cache

from tmsopt.roots.patterns.components import parse_components, several, times
from tmsopt.roots.patterns.composed import pattern
from tmsopt.roots.patterns.descriptions import all_or, listed
from tmsopt.roots.patterns.pattern import Pattern

_MEANING = {"weave": "a real eigenfrequency", "resonance": "a real double eigenfrequency"}
_REAL = "is a pattern of a real system"


def complex_pattern_names(size: int) -> tuple[str, ...]:
    """Names of the patterns of a matrix of a size that are not made up of others."""
    several = [f"2EP{k}" for k in range(size // 2, 1, -1)]
    return (*(f"EP{k}" for k in range(size, 1, -1)), *several, "weave", *(["resonance"] if size > 1 else []))


@cache
def complex_pattern(name: str, size: int) -> Pattern:
    """The pattern of a name such as ``EP3`` or ``EP2+EP2``, for the eigenvalues of complex matrices of a size.

    Its factors are those of the real polynomial of twice the degree: `Pattern.form` names them, ``CEP3``.

    Raises:
        ValueError: for a name that is none, or a pattern of more eigenvalues than there are.
    """
    written = "".join(name.split())
    for part in parse_components(written):
        if part.kind == "CEP":
            raise ValueError(f"'{name}' {_REAL}; of a complex H write EP{part.order}")
        if part.kind == "capsize":
            raise ValueError(f"'{name}' {_REAL}; of a complex H write weave, a real eigenfrequency")
    taken = sum(part.roots for part in parse_components(written) if part.kind == "EP")
    if taken > size:
        raise ValueError(f"'{name}' takes {taken} eigenfrequencies, and H has {size}")
    made = pattern(written.replace("EP", "CEP"), 2 * size)
    words = (_meaning(part.kind, part.order, part.count) for part in parse_components(written))
    return replace(made, name=complex_name(made.name), meaning=" and ".join(words), marks={}, doubles=made.name)


def _meaning(kind: str, order: int, count: int) -> str:
    return several(count, f"{times(order)} eigenfrequency") if kind == "EP" else _MEANING[kind]


def complex_name(name: str) -> str:
    """A pattern or structure of the double in the words of H: ``CEP2+two pairs`` as ``EP2+two singles``."""
    return re.sub(r"\bpair", "single", name.replace("CEP", "EP"))


def as_complex_pattern(shown: Pattern) -> Pattern:
    """A pattern that the roots of a double show, as one of H."""
    words = shown.meaning.replace(" on one vertical line", " with one decay rate")
    words = words.replace("complex double", "double complex")
    words = re.sub(r"(complex )?pair(s?)", lambda m: "eigenfrequencies" if m[2] else "eigenfrequency", words)
    return replace(shown, name=complex_name(shown.name), meaning=words, marks={}, doubles=shown.form)


def real_form_name(name: str) -> str:
    """The same the other way round."""
    return re.sub(r"\bsingle", "pair", name.replace("EP", "CEP"))


def describe_complex_structure(structure: str, size: int, gain: bool = False) -> str:
    """A structure of the least damped eigenfrequencies, or of most gain, in words; one that is unknown as it is."""
    if structure == "undecided":
        return "double precision cannot tell which eigenfrequencies meet (undecided)"
    if structure == "single":
        return f"one eigenfrequency {'has the most gain' if gain else 'is least damped'} (single)"
    if match := re.fullmatch(r"EP(\d+)", structure):
        order = int(match[1])
        most = " of most gain" if gain and order != size else ""
        which = all_or(order, size, "" if gain else "least damped")
        return f"{which} eigenfrequencies{most} meet in one ({structure})"
    every = listed([_part(part) for part in structure.split("+")])
    return f"{every} have one {'gain' if gain else 'decay rate'} ({structure})"


def _part(part: str) -> str:
    if match := re.fullmatch(r"EP(\d+)", part):
        return _meaning("EP", int(match[1]), 1)
    return "a simple eigenfrequency" if part == "single" else part.replace("singles", "simple eigenfrequencies")
