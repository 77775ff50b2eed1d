"""What roots show, with their multiplicities: a shape, and the pattern that it is."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from tmsopt.roots.patterns.components import several
from tmsopt.roots.patterns.composed import composition
from tmsopt.roots.patterns.pattern import Pattern
from tmsopt.roots.patterns.shape import Group, Shape, with_simple
from tmsopt.roots.polynomial import Root, product


def shown(roots: Sequence[Root], everywhere: bool = True, ties: bool = True) -> tuple[Shape, list[Any]]:
    """The shape that roots show: multiple ones, and those on the rightmost line if several; with its unknowns.

    Args:
        everywhere: whether multiple roots that are not on the rightmost line count too.
        ties: whether it counts that roots are on one line.
    """
    upper = [r for r in roots if r.im >= 0]
    right = max(r.re for r in upper)
    several = ties and sum(r.re == right for r in upper) > 1
    line = [several and r.re == right for r in upper]
    grouped = [
        (r, Group(r.multiplicity, r.im == 0, tied))
        for r, tied in zip(upper, line, strict=True)
        if tied or (r.multiplicity > 1 and (everywhere or r.re == right))
    ]
    free = [r for r in upper for _ in range(r.multiplicity) if r not in [q for q, _ in grouped]]
    rest = product(*([1, -r.re] if r.im == 0 else [1, -2 * r.re, r.re**2 + r.im**2] for r in free))
    shape = Shape(tuple(g for _, g in grouped), len(rest) - 1)
    return shape, shape.start([complex(r.re, r.im) for r, _ in grouped], rest)


def find_patterns(roots: Sequence[Root]) -> list[Pattern]:
    """The patterns that roots show, what says most first: all multiple roots and ties of the rightmost line, those on
    this line alone, all multiple roots alone.

    A name is that of the rightmost line, such as ``EP2+pair``, ``beside`` those of other multiple roots; of multiple
    roots alone it is that of the pattern that they make, such as ``EP3+CEP2``. Each starts from the roots.
    """
    every = [_pattern(*shown(roots, *which)) for which in ((True, True), (False, True), (True, False), (False, False))]
    return list({p.name: p for p in every if p.name}.values())


def _pattern(shape: Shape, start: Sequence[Any]) -> Pattern:
    tied, others = ([g for g in shape.groups if g.tied is on] for on in (True, False))
    meanings = [_words(groups) + where for groups, where in ((tied, " on one vertical line"), (others, "")) if groups]
    return Pattern(
        name=" beside ".join(_name(groups) for groups in (tied, others) if groups),
        meaning=", and ".join(meanings) + (" beside other roots" if shape.rest else ""),
        unknowns=shape.unknowns,
        factors=shape.factors,
        guesses=lambda z: [[float(x) for x in start]],
        nonnegative=shape.gaps,
        degree=shape.degree,
    )


def has_pattern(roots: Sequence[Root], name: str) -> bool:
    """Whether roots with these multiplicities have the multiple roots of a pattern, where those may coincide.

    A 4-fold real root is a double complex pair that meets on the axis, too.
    """
    real = [r.multiplicity for r in roots if r.im == 0]
    pairs = [r.multiplicity for r in roots if r.im > 0]
    for kind, order, count in composition(name):
        for _ in range(count):
            if kind == "CEP" and max(pairs, default=0) >= order:
                _take(pairs, order)
            elif kind in ("EP", "CEP") and max(real, default=0) >= order * (1 + (kind == "CEP")):
                _take(real, order * (1 + (kind == "CEP")))
            else:
                return False
    return True


def _take(left: list[int], order: int) -> None:
    """Use up so many roots of the least multiple one that has them."""
    k = left.index(min(m for m in left if m >= order))
    left[k] -= order


def _name(groups: Sequence[Group]) -> str:
    """``EP3``, ``2EP2+CEP2``, ``EP2+two pairs+real``: real roots first, the highest multiplicity first."""
    counted = Counter((not g.real, -g.multiplicity) for g in groups if g.multiplicity > 1)
    names = [
        f"{count if count > 1 else ''}{'C' if pair else ''}EP{-order}"
        for (pair, order), count in sorted(counted.items())
    ]
    return with_simple(names, groups)


def _words(groups: Sequence[Group]) -> str:
    """In the order of the name: multiple real roots, multiple pairs, simple pairs, a simple real root."""
    counted = Counter(groups)
    words = []
    for group in sorted(counted, key=lambda g: (g.multiplicity == 1, g.real == (g.multiplicity == 1), -g.multiplicity)):
        fold = f"{group.multiplicity}-fold " if group.multiplicity > 1 else ""
        words.append(several(counted[group], f"{fold}{'real root' if group.real else 'complex pair'}"))
    return " and ".join(words)
