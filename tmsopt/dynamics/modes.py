"""Roots followed over a parameter as named modes, from one meeting of roots to the next."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array, Complex

_LEAST, _SHORT = 3, 1e-4  # fewest points of a piece, and its least share of the range; rounding causes shorter ones
_APART = 0.5  # distance of two roots, relative to that of a third one, up to which the two meet alone


@dataclass(frozen=True)
class Mode:
    """A root, or the upper one of a pair, between two meetings of roots: `values` and `roots` have shape (n,)."""

    name: str
    values: Array
    roots: Complex


@dataclass(frozen=True)
class _Piece:
    """A range with a constant number of real roots: the real roots ascending, then the pairs."""

    values: Array
    roots: Complex
    real: int


def follow_modes(
    values: Array,
    found: Complex,
    design: float,
    crowds: Sequence[float],
    *,
    bicycle: bool,
    speed: bool,
) -> tuple[Mode, ...]:
    """Every root between meetings, with the name of its mode.

    A root keeps its name past meetings of other roots. For a bicycle, naming starts at one pair and two real roots, at
    the highest speed or at the design: the pair is weave, the left real root castering, the right one capsize. If two
    pairs have no such start, the rightmost one is weave. For other models, roots are numbered from the right at the
    design. A pair formed by two real roots is named after both. Where more than two roots meet, as at EP3 and EP4,
    naming starts anew.

    Args:
        values: values of the parameter, ascending, shape (n,).
        found: roots, shape (n, degree).
        design: value of the design.
        crowds: values where more than two roots meet.
    """
    parts = _split_pieces(values, found, crowds)
    if not parts:
        return ()
    usual = [k for k, part in enumerate(parts) if bicycle and part.roots.shape[1] == 3 and part.real == 2]
    here = min(range(len(parts)), key=lambda k: (np.abs(parts[k].values - design).min(), -len(parts[k].values)))
    first = here if not usual or (not speed and here in usual) else usual[-1]
    names = {first: _name_modes(parts[first], design, bicycle)}
    for order in (range(first, len(parts)), range(first, -1, -1)):
        for before, k in pairwise(order):
            passed = _pass_names(parts[before], names[before], parts[k], forward=k > before)
            mixed = bicycle and any("weave +" in name or "+ weave" in name for name in passed)
            names[k] = passed if passed and not mixed else _name_modes(parts[k], design, bicycle)
    return tuple(
        Mode(name, part.values, column)
        for k, part in enumerate(parts)
        for name, column in zip(names[k], part.roots.T, strict=True)
    )


def _split_pieces(values: Array, found: Complex, crowds: Sequence[float]) -> list[_Piece]:
    real = np.count_nonzero(found.imag == 0, axis=1)
    cuts = np.union1d(np.flatnonzero(np.diff(real)) + 1, np.searchsorted(values, crowds))
    parts = []
    for run in np.split(np.arange(len(values)), cuts):
        if len(run) < _LEAST or np.ptp(values[run]) < _SHORT * np.ptp(values):
            continue
        own, count = found[run], int(real[run[0]])
        reals = np.sort(own.real[own.imag == 0].reshape(len(run), count), axis=1)
        pairs = np.sort_complex(own[own.imag > 0].reshape(len(run), -1))
        for k in range(1, len(run)) if pairs.shape[1] > 1 else ():
            ahead = 2 * pairs[k - 1] - pairs[k - 2] if k > 1 else pairs[k - 1]
            pairs[k] = pairs[k][_match(ahead, pairs[k])]
        parts.append(_Piece(values[run], np.concatenate([reals, pairs], axis=1), count))
    return parts


def _match(a: Complex, b: Complex) -> NDArray[np.intp]:
    """Indices of b matched one to one to a, with the least sum of squared distances."""
    apart = np.abs(a[:, None] - b) ** 2
    if len(a) <= 2:  # always so for a bicycle
        order = np.arange(len(a))
        return order[::-1] if apart[order, order[::-1]].sum() < apart.trace() else order
    from scipy.optimize import linear_sum_assignment  # takes 0.2 s to import, and is rarely needed

    return np.asarray(linear_sum_assignment(apart)[1])


def _name_modes(part: _Piece, design: float, bicycle: bool) -> list[str]:
    """New names: words for a bicycle, otherwise numbers from the right at the value nearest to the design."""
    count, row = part.real, part.roots[np.abs(part.values - design).argmin()]
    pairs = len(row) - count
    if bicycle and (count, pairs) == (2, 1):
        return ["castering", "capsize", "weave"]
    if bicycle and (count, pairs) == (0, 2):
        last = part.roots.real.max(axis=0).argmax()
        return ["weave" if k == last else "second pair" for k in range(2)]
    rank = np.argsort(np.argsort(-row[count:].real)) + 1
    return [f"real {count - k}" for k in range(count)] + [f"pair {k}" for k in rank]


def _pass_names(old: _Piece, names: list[str], new: _Piece, forward: bool) -> list[str]:
    """Names passed on across a meeting of two roots; empty if more roots meet."""
    if abs(old.real - new.real) != 2:
        return []
    many, few = (old, new) if old.real > new.real else (new, old)
    r, p = (part.roots[-1 if (part is old) == forward else 0] for part in (many, few))
    i = int(np.diff(r[: many.real].real).argmin())
    j = few.real + int(p[few.real :].imag.argmin())
    others, rest = np.delete(np.arange(len(r)), [i, i + 1]), np.delete(np.arange(len(p)), j)
    apart = [np.abs(x - y).min(initial=np.inf) for x, y in ((r[others], r[i : i + 2].mean()), (p[rest], p[j].real))]
    if abs(r[i + 1] - r[i]) > _APART * apart[0] or 2 * p[j].imag > _APART * apart[1]:
        return []
    rest[few.real :] = rest[few.real :][_match(r[others[few.real :]], p[rest[few.real :]])]  # real ones stay in order
    if many is old:
        both = names[i] if names[i] == names[i + 1] else f"{names[i + 1]} + {names[i]}"
        found = {j: both} | {b: names[a] for a, b in zip(others, rest, strict=True)}
    else:
        upper, _, lower = names[j].partition(" + ")
        found = {i: lower or upper, i + 1: upper} | {a: names[b] for a, b in zip(others, rest, strict=True)}
    return [found[k] for k in range(len(found))]
