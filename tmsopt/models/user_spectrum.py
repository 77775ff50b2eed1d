"""Names of patterns and structures for a model, and its roots as eigenfrequencies if it is complex."""

from collections.abc import Iterable, Sequence

from tmsopt.models.model import Model
from tmsopt.roots import Pattern, Root, pattern
from tmsopt.roots.patterns.complex_patterns import complex_pattern, complex_pattern_names, describe_complex_structure
from tmsopt.roots.patterns.composed import pattern_names
from tmsopt.roots.patterns.descriptions import describe_structure

AXIS_TOLERANCE = 1e-12
"""A real part below this share of the largest root counts as 0, because it may come from rounding."""


def pattern_of(model: Model, name: str) -> Pattern:
    """The pattern with a name, for the roots of a model; for a complex H, for the eigenfrequencies.

    Raises:
        ValueError: if the name is unknown, or the pattern needs more roots than the model has.
    """
    return pattern(name, model.degree) if not model.is_complex else complex_pattern(name, model.degree)


def patterns_of(model: Model) -> tuple[str, ...]:
    """Names of the patterns of a model that are not composed of other patterns."""
    return pattern_names(model.degree) if not model.is_complex else complex_pattern_names(model.degree)


def full_patterns(model: Model) -> tuple[str, ...]:
    """Names of the patterns in which all roots coincide in one root or one pair; empty for one root."""
    if model.is_complex:
        return (f"EP{model.degree}",) if model.degree > 1 else ()
    pairs = (f"CEP{model.degree // 2}",) if model.degree > 2 and model.degree % 2 == 0 else ()
    return (f"EP{model.degree}", *pairs) if model.degree > 1 else ()


def describe_user_structure(model: Model, structure: str, has_gain: bool = False) -> str:
    """A user's structure in words, which for a complex H depend on whether it has gain."""
    if not model.is_complex:
        return describe_structure(structure, model.degree)
    return describe_complex_structure(structure, model.degree, has_gain)


def eigenfrequencies(model: Model, roots: Iterable[Root]) -> tuple[Root, ...]:
    """ω = i s for the roots of a complex system; empty for a real system."""
    return tuple(Root(-r.im + 0.0, r.re, r.multiplicity) for r in roots) if model.is_complex else ()


def roots_on_axis(roots: Iterable[Root]) -> tuple[Root, ...]:
    """The user's roots on the imaginary axis, which are real eigenfrequencies of H."""
    all_roots = tuple(roots)
    return tuple(r for r in all_roots if abs(r.re) <= AXIS_TOLERANCE * _max_modulus(all_roots))


def distance_beyond_axis(model: Model, located: Sequence[str], roots: Sequence[Root]) -> float | None:
    """Distance of the rightmost root from the imaginary axis if it lies to the right of the axis, else 0.

    None if no pattern in `located` has roots on the axis.
    """
    if not roots or all(pattern_of(model, name).rest is None for name in located):
        return None
    rightmost = max(r.re for r in roots)
    return rightmost if rightmost > AXIS_TOLERANCE * _max_modulus(roots) else 0.0


def _max_modulus(roots: Iterable[Root]) -> float:
    return max((r.size for r in roots), default=0.0)
