"""Converts roots and structures of the internal polynomial to the eigenfrequencies of the user's system.

For a complex H, the internal polynomial belongs to a real system of twice the size with a carrier: a real constant that
is added to all eigenfrequencies ω. Its roots are s = −i (ω + carrier) and their conjugates. The user sees s = −i ω with
the multiplicities of H.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from tmsopt.models.model import Model, ParameterSet
from tmsopt.roots import Pattern, Root, Structure, pattern
from tmsopt.roots.patterns.complex_patterns import (
    complex_name,
    complex_pattern,
    complex_pattern_names,
    describe_complex_structure,
    real_form_name,
)
from tmsopt.roots.patterns.composed import pattern_names
from tmsopt.roots.patterns.descriptions import describe_structure

AXIS_TOLERANCE = 1e-12
"""A real part below this share of the largest root counts as 0, because it may come from rounding."""

_ROUNDING = 1e-14  # a few rounding errors, as a share of the largest root


def pattern_of(model: Model, name: str) -> Pattern:
    """The pattern with a name, for the roots of a model; for a complex H, for the eigenfrequencies.

    Raises:
        ValueError: if the name is unknown, or the pattern needs more roots than the model has.
    """
    return pattern(name, model.degree) if not model.is_complex else complex_pattern(name, model.size)


def patterns_of(model: Model) -> tuple[str, ...]:
    """Names of the patterns of a model that are not composed of other patterns."""
    return pattern_names(model.degree) if not model.is_complex else complex_pattern_names(model.size)


def full_patterns(model: Model) -> tuple[str, ...]:
    """Names of the patterns in which all roots coincide in one root or one pair; empty for one root."""
    if model.is_complex:
        return (f"EP{model.size}",) if model.degree > 2 else ()
    pairs = (f"CEP{model.degree // 2}",) if model.degree > 2 and model.degree % 2 == 0 else ()
    return (f"EP{model.degree}", *pairs) if model.degree > 1 else ()


def public_names(model: Model, parameter_set: ParameterSet) -> tuple[str, ...]:
    """`Model.quantity_names`, without the coefficients of a complex H, which depend on the carrier."""
    hidden = model.coefficient_names() if model.is_complex else ()
    return tuple(n for n in model.quantity_names(parameter_set) if n not in hidden)


def user_structure_name(model: Model, name: str) -> str:
    """The user's name of a pattern or structure of the polynomial."""
    return name if not model.is_doubled else complex_name(name)


def user_roots(model: Model, roots: Iterable[Any]) -> tuple[Any, ...]:
    """The user's roots for roots of the polynomial: numbers or balls with ``re``, ``im`` and multiplicity."""
    if not model.is_doubled:
        return tuple(roots)
    return tuple(replace(r, im=r.im + model.carrier) for r in roots if r.im < 0)


def user_root_array(model: Model, roots: Any) -> Any:
    """The user's roots for a complex array with all roots along its last axis, in the order of their real parts."""
    if not model.is_doubled:
        return roots
    import numpy as np

    order = np.argsort(np.where(roots.imag < 0, 0, 1), axis=-1, kind="stable")[..., : model.size]
    return np.take_along_axis(roots, order, axis=-1) + 1j * model.carrier


def user_structure(model: Model, structure: Structure) -> Structure:
    """The user's structure for a structure of the polynomial."""
    return replace(structure, name=user_structure_name(model, structure.name), roots=user_roots(model, structure.roots))


def polynomial_structure(model: Model, name: str, roots: Sequence[Root]) -> Structure:
    """The structure of the polynomial for a user's name and roots; the inverse of `user_structure`."""
    if not model.is_doubled:
        return Structure(name, tuple(roots), 0.0)
    lower = [replace(r, im=r.im - model.carrier) for r in roots]
    return Structure(real_form_name(name), tuple(w for r in lower for w in (replace(r, im=-r.im), r)), 0.0)


def describe_user_structure(model: Model, structure: str, has_gain: bool = False) -> str:
    """A user's structure in words, which for a complex H depend on whether it has gain."""
    if not model.is_complex:
        return describe_structure(structure, model.degree)
    return describe_complex_structure(structure, model.size, has_gain)


def eigenfrequencies(model: Model, roots: Iterable[Root]) -> tuple[Root, ...]:
    """ω = i s for the user's roots; empty for a real system."""
    rounded_roots = () if not model.is_complex else remove_rounding(model, roots)
    return tuple(Root(-r.im + 0.0, r.re, r.multiplicity) for r in rounded_roots)


def remove_rounding(model: Model, roots: Iterable[Root]) -> tuple[Root, ...]:
    """The user's roots, in which real and imaginary parts as small as the rounding error of the carrier are 0."""
    all_roots = tuple(roots)
    rounding = 0.0 if not model.is_complex else _ROUNDING * _max_modulus(model, all_roots)
    parts = ([x if abs(x) > rounding else 0.0 for x in (r.re, r.im)] for r in all_roots)
    return tuple(Root(re, im, r.multiplicity) for (re, im), r in zip(parts, all_roots, strict=True))


def roots_on_axis(model: Model, roots: Iterable[Root]) -> tuple[Root, ...]:
    """The user's roots on the imaginary axis, which are real eigenfrequencies of H."""
    all_roots = tuple(roots)
    return tuple(r for r in all_roots if abs(r.re) <= AXIS_TOLERANCE * _max_modulus(model, all_roots))


def distance_beyond_axis(model: Model, located: Sequence[str], roots: Sequence[Root]) -> float | None:
    """Distance of the rightmost root from the imaginary axis if it lies to the right of the axis, else 0.

    None if no pattern in `located` has roots on the axis.
    """
    if not roots or all(pattern_of(model, name).rest is None for name in located):
        return None
    rightmost = max(r.re for r in roots)
    return rightmost if rightmost > AXIS_TOLERANCE * _max_modulus(model, roots) else 0.0


def _max_modulus(model: Model, roots: Iterable[Root]) -> float:
    """Largest |s| of the roots of the polynomial; for a complex H it includes the carrier."""
    return max((math.hypot(r.re, r.im - model.carrier) for r in roots), default=0.0)
