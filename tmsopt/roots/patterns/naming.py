"""Finds shapes and patterns of given roots with multiplicities, and their names."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from tmsopt.roots.patterns.components import count_in_words
from tmsopt.roots.patterns.composed import composition
from tmsopt.roots.patterns.pattern import Pattern
from tmsopt.roots.patterns.shape import Group, Shape, join_group_names
from tmsopt.roots.polynomial import Root, product


def find_shape(
    roots: Sequence[Root], include_left_roots: bool = True, tie_rightmost_roots: bool = True
) -> tuple[Shape, list[Any]]:
    """The shape of given roots and its unknowns: multiple roots, and two or more roots on the rightmost line.

    Args:
        include_left_roots: whether multiple roots to the left of the rightmost line belong to the shape.
        tie_rightmost_roots: whether two or more roots on the rightmost line must stay on one line.
    """
    upper_roots = [r for r in roots if r.im >= 0]
    abscissa = max(r.re for r in upper_roots)
    has_ties = tie_rightmost_roots and sum(r.re == abscissa for r in upper_roots) > 1
    root_groups = [
        (r, Group(r.multiplicity, r.im == 0, has_ties and r.re == abscissa))
        for r in upper_roots
        if (has_ties and r.re == abscissa) or (r.multiplicity > 1 and (include_left_roots or r.re == abscissa))
    ]
    free_roots = [r for r in upper_roots for _ in range(r.multiplicity) if r not in [q for q, _ in root_groups]]
    rest_factor = product(*([1, -r.re] if r.im == 0 else [1, -2 * r.re, r.re**2 + r.im**2] for r in free_roots))
    shape = Shape(tuple(g for _, g in root_groups), len(rest_factor) - 1)
    return shape, shape.initial_unknowns([complex(r.re, r.im) for r, _ in root_groups], rest_factor)


def find_patterns(roots: Sequence[Root]) -> list[Pattern]:
    """The patterns of given roots, the most specific first.

    A pattern with ties requires that the rightmost roots lie on one vertical line. The patterns are: all multiple
    roots, with ties; the multiple roots of the rightmost line, with ties; all multiple roots; the multiple roots of the
    rightmost line. With ties, the name of the line, such as ``EP2+pair``, is joined by ``beside`` to the names of
    other multiple roots. Without ties, the name is an ordinary one, such as ``EP3+CEP2``. Each pattern has one guess,
    the given roots.
    """
    options = ((True, True), (False, True), (True, False), (False, False))
    patterns = [_make_pattern(*find_shape(roots, *option)) for option in options]
    return list({p.name: p for p in patterns if p.name}.values())


def _make_pattern(shape: Shape, guess: Sequence[Any]) -> Pattern:
    tied_groups, untied_groups = ([g for g in shape.groups if g.is_tied is is_tied] for is_tied in (True, False))
    parts = ((tied_groups, " on one vertical line"), (untied_groups, ""))
    meanings = [_describe_groups(groups) + suffix for groups, suffix in parts if groups]
    return Pattern(
        name=" beside ".join(_name_groups(groups) for groups in (tied_groups, untied_groups) if groups),
        meaning=", and ".join(meanings) + (" and other roots" if shape.rest_degree else ""),
        unknowns=shape.unknowns,
        factors=shape.factors,
        guesses=lambda z: [[float(x) for x in guess]],
        nonnegative=shape.squared_heights,
        degree=shape.degree,
    )


def has_pattern(roots: Sequence[Root], name: str) -> bool:
    """Whether given roots contain the multiple roots of a pattern, or a limit case of these roots.

    For example, a 4-fold real root is the limit of a double complex pair that meets on the real axis.
    """
    real_multiplicities = [r.multiplicity for r in roots if r.im == 0]
    pair_multiplicities = [r.multiplicity for r in roots if r.im > 0]
    for kind, order, count in composition(name):
        for _ in range(count):
            if kind == "CEP" and max(pair_multiplicities, default=0) >= order:
                _use_roots(pair_multiplicities, order)
            elif kind in ("EP", "CEP") and max(real_multiplicities, default=0) >= order * (1 + (kind == "CEP")):
                _use_roots(real_multiplicities, order * (1 + (kind == "CEP")))
            else:
                return False
    return True


def _use_roots(multiplicities: list[int], order: int) -> None:
    """Subtract an order from the smallest multiplicity that is large enough."""
    k = multiplicities.index(min(m for m in multiplicities if m >= order))
    multiplicities[k] -= order


def _name_groups(groups: Sequence[Group]) -> str:
    """``EP3``, ``2EP2+CEP2``, ``EP2+two pairs+real``: real roots and the highest multiplicity come first."""
    counts = Counter((not g.is_real, -g.multiplicity) for g in groups if g.multiplicity > 1)
    names = [
        f"{count if count > 1 else ''}{'C' if pair else ''}EP{-order}"
        for (pair, order), count in sorted(counts.items())
    ]
    return join_group_names(names, groups)


def _describe_groups(groups: Sequence[Group]) -> str:
    """Groups in words: multiple real roots, multiple pairs, simple pairs, a simple real root."""
    counts = Counter(groups)
    words = []
    for group in sorted(
        counts, key=lambda g: (g.multiplicity == 1, g.is_real == (g.multiplicity == 1), -g.multiplicity)
    ):
        prefix = f"{group.multiplicity}-fold " if group.multiplicity > 1 else ""
        words.append(count_in_words(counts[group], f"{prefix}{'real root' if group.is_real else 'complex pair'}"))
    return " and ".join(words)
