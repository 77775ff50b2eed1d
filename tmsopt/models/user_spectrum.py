"""What the polynomial of a model shows, in the words of its user: of a complex H in those of H, not of its double.

The polynomial of a complex H is that of the real system of twice the size with a carrier: roots s = −i (ω + carrier)
and their conjugates. Told are s = −i ω, each with its multiplicity.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from tmsopt.models.model import Model, ParameterSet
from tmsopt.roots import Pattern, Root, Structure, pattern
from tmsopt.roots.patterns.composed import pattern_names
from tmsopt.roots.patterns.descriptions import in_words
from tmsopt.roots.patterns.doubled import (
    complex_in_words,
    complex_name,
    complex_pattern,
    complex_pattern_names,
    doubled_name,
)

ON_AXIS = 1e-12
"""Of the largest root of the polynomial: so far right of the imaginary axis is on it, as far as rounding tells."""

_NOTHING = 1e-14  # likewise: some roundings


def pattern_of(model: Model, name: str) -> Pattern:
    """The pattern of a name for the polynomials of a model; of a complex H one of its eigenfrequencies.

    Raises:
        ValueError: for a name that is none, or a pattern of more roots than there are.
    """
    return pattern(name, model.degree) if model.carrier is None else complex_pattern(name, model.degree // 2)


def patterns_of(model: Model) -> tuple[str, ...]:
    """Names of the patterns of a model that are not made up of others."""
    return pattern_names(model.degree) if model.carrier is None else complex_pattern_names(model.degree // 2)


def full_patterns(model: Model) -> tuple[str, ...]:
    """Names of the patterns in which one root, or one pair, is all roots; none of a single root."""
    if model.carrier is not None:
        return (f"EP{model.degree // 2}",) if model.degree > 2 else ()
    pairs = (f"CEP{model.degree // 2}",) if model.degree > 2 and model.degree % 2 == 0 else ()
    return (f"EP{model.degree}", *pairs) if model.degree > 1 else ()


def public_names(model: Model, of: ParameterSet) -> tuple[str, ...]:
    """`Model.quantity_names` without coefficients that have a carrier in them, which say nothing of H."""
    hidden = () if model.carrier is None else model.coefficient_names()
    return tuple(n for n in model.quantity_names(of) if n not in hidden)


def user_structure_name(model: Model, name: str) -> str:
    """The name of a pattern or structure of the polynomial as the user reads it."""
    return name if model.carrier is None else complex_name(name)


def user_roots(model: Model, roots: Iterable[Any]) -> tuple[Any, ...]:
    """Roots of the polynomial as the user reads them: numbers or balls with ``re``, ``im`` and multiplicity."""
    if model.carrier is None:
        return tuple(roots)
    return tuple(replace(r, im=r.im + model.carrier) for r in roots if r.im < 0)


def user_root_array(model: Model, roots: Any) -> Any:
    """Likewise an array of complex numbers with all roots along its last axis, in the order of their real parts."""
    if model.carrier is None:
        return roots
    import numpy as np

    order = np.argsort(np.where(roots.imag < 0, 0, 1), axis=-1, kind="stable")[..., : model.degree // 2]
    return np.take_along_axis(roots, order, axis=-1) + 1j * model.carrier


def user_structure(model: Model, found: Structure) -> Structure:
    """A structure of the polynomial as the user reads it."""
    return replace(found, name=user_structure_name(model, found.name), roots=user_roots(model, found.roots))


def polynomial_structure(model: Model, name: str, roots: Sequence[Root]) -> Structure:
    """The structure of the polynomial that a user reads so; the inverse of `user_structure`."""
    if model.carrier is None:
        return Structure(name, tuple(roots), 0.0)
    lower = [replace(r, im=r.im - model.carrier) for r in roots]
    return Structure(doubled_name(name), tuple(w for r in lower for w in (replace(r, im=-r.im), r)), 0.0)


def describe_structure(model: Model, structure: str, gain: bool = False) -> str:
    """A structure, as it is told, in words; of a complex H by its gain where it has any."""
    if model.carrier is None:
        return in_words(structure, model.degree)
    return complex_in_words(structure, model.degree // 2, gain)


def eigenfrequencies(model: Model, roots: Iterable[Root]) -> tuple[Root, ...]:
    """ω = i s of roots as they are told; of a real system none."""
    each = () if model.carrier is None else remove_rounding(model, roots)
    return tuple(Root(-r.im + 0.0, r.re, r.multiplicity) for r in each)


def remove_rounding(model: Model, roots: Iterable[Root]) -> tuple[Root, ...]:
    """Roots as they are told, with parts that are 0 but for a carrier's rounding as 0."""
    each = tuple(roots)
    nothing = 0.0 if model.carrier is None else _NOTHING * _size(model, each)
    own = ([x if abs(x) > nothing else 0.0 for x in (r.re, r.im)] for r in each)
    return tuple(Root(re, im, r.multiplicity) for (re, im), r in zip(own, each, strict=True))


def roots_on_axis(model: Model, roots: Iterable[Root]) -> tuple[Root, ...]:
    """Those of roots, as they are told, that are on the imaginary axis: the real ones of the eigenfrequencies of H."""
    each = tuple(roots)
    return tuple(r for r in each if abs(r.re) <= ON_AXIS * _size(model, each))


def beyond_axis(model: Model, located: Sequence[str], roots: Sequence[Root]) -> float | None:
    """How far right of the imaginary axis a root is where located patterns tie others to it; 0 on the very edge.

    None where no pattern ties a root to the axis.
    """
    if not roots or all(pattern_of(model, name).rest is None for name in located):
        return None
    rightmost = max(r.re for r in roots)
    return rightmost if rightmost > ON_AXIS * _size(model, roots) else 0.0


def _size(model: Model, roots: Iterable[Root]) -> float:
    return max((math.hypot(r.re, r.im - (model.carrier or 0.0)) for r in roots), default=0.0)
