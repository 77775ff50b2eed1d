"""Patterns and structures of a complex matrix H, converted to and from the real system of twice the size.

An eigenvalue of H corresponds to a complex pair of roots of the real system, so an EPn of H is a CEPn of the real
system, if no root meets the conjugate of another root (see `tmsopt.problem.real_form`).
"""

import re
from dataclasses import replace
from functools import cache

from tmsopt.roots.patterns.components import count_in_words, multiplicities, multiplicity_in_words, parse_components
from tmsopt.roots.patterns.composed import pattern
from tmsopt.roots.patterns.descriptions import join_in_words, select_in_words
from tmsopt.roots.patterns.pattern import Pattern

_MEANING = {"weave": "a real eigenfrequency", "resonance": "a real double eigenfrequency"}
_IS_REAL_PATTERN = "is a pattern of a real system"


def complex_pattern_names(size: int) -> tuple[str, ...]:
    """Names of the patterns of a `size` × `size` matrix that are not composed of other patterns."""
    double_names = [f"2EP{k}" for k in multiplicities(size // 2)]
    return (*(f"EP{k}" for k in multiplicities(size)), *double_names, "weave", *(["resonance"] if size > 1 else []))


@cache
def complex_pattern(name: str, size: int) -> Pattern:
    """The pattern with a name such as ``EP3`` or ``EP2+EP2``, for the eigenvalues of a complex `size` × `size` matrix.

    Its factors are factors of the real polynomial of twice the degree. The pattern of this polynomial has the name
    `Pattern.form`, such as ``CEP3``.

    Raises:
        ValueError: for an unknown name, or a pattern with more eigenvalues than the matrix has.
    """
    compact = "".join(name.split())
    components = parse_components(compact)
    for component in components:
        if component.kind == "CEP":
            raise ValueError(f"'{name}' {_IS_REAL_PATTERN}; for a complex H write EP{component.order}")
        if component.kind == "capsize":
            raise ValueError(f"'{name}' {_IS_REAL_PATTERN}; for a complex H write weave, a real eigenfrequency")
    count = sum(c.root_count for c in components if c.kind == "EP")
    if count > size:
        raise ValueError(f"'{name}' takes {count} eigenfrequencies, and H has {size}")
    real_pattern = pattern(compact.replace("EP", "CEP"), 2 * size)
    words = " and ".join(_describe(c.kind, c.order, c.count) for c in components)
    return replace(as_complex_pattern(real_pattern), meaning=words)


def _describe(kind: str, order: int, count: int) -> str:
    return count_in_words(count, f"{multiplicity_in_words(order)} eigenfrequency") if kind == "EP" else _MEANING[kind]


def complex_name(name: str) -> str:
    """Name for H of a pattern or structure of the real system: ``EP2+two singles`` for ``CEP2+two pairs``."""
    return re.sub(r"\bpair", "single", name.replace("CEP", "EP"))


def as_complex_pattern(real_pattern: Pattern) -> Pattern:
    """A pattern of the real system as a pattern of H."""
    words = real_pattern.meaning.replace(" on one vertical line", " that share one decay rate")
    words = words.replace("complex double", "double complex")
    words = re.sub(r"(complex )?pair(s?)", lambda m: "eigenfrequencies" if m[2] else "eigenfrequency", words)
    return replace(
        real_pattern, name=complex_name(real_pattern.name), meaning=words, marks={}, real_name=real_pattern.form
    )


def real_form_name(name: str) -> str:
    """Name for the real system of a pattern or structure of H, the inverse of `complex_name`."""
    return re.sub(r"\bsingle", "pair", name.replace("EP", "CEP"))


def describe_complex_structure(structure: str, size: int, has_gain: bool = False) -> str:
    """A structure of eigenfrequencies of H in words; an unknown structure is returned unchanged.

    Args:
        has_gain: whether these eigenfrequencies have the most gain; else they have the least damping.
    """
    if structure == "undecided":
        return "double precision cannot tell which eigenfrequencies meet (undecided)"
    if structure == "single":
        return f"one eigenfrequency {'has the most gain' if has_gain else 'is least damped'} (single)"
    if match := re.fullmatch(r"EP(\d+)", structure):
        order = int(match[1])
        suffix = " of most gain" if has_gain and order != size else ""
        selection = select_in_words(order, size, "" if has_gain else "least damped")
        return f"{selection} eigenfrequencies{suffix} coincide ({structure})"
    words = join_in_words([_describe_part(part) for part in structure.split("+")])
    return f"{words} have one {'gain' if has_gain else 'decay rate'} ({structure})"


def _describe_part(part: str) -> str:
    if match := re.fullmatch(r"EP(\d+)", part):
        return _describe("EP", int(match[1]), 1)
    return "a simple eigenfrequency" if part == "single" else part.replace("singles", "simple eigenfrequencies")
