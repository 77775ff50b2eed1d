"""Follows roots over a parameter, and names them as modes. A mode ends where two roots meet."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array, Complex

_MIN_POINTS = 3  # smallest number of points of a `_Piece`; smaller pieces are rounding errors
_MIN_SHARE = 1e-4  # smallest length of a `_Piece`, as a share of the range of values
_ISOLATED_RATIO = 0.5
"""Two roots meet without a third if their distance is at most this share of the distance to the third root."""


@dataclass(frozen=True)
class Mode:
    """A root, or the upper one of a pair, between two meetings of roots: `values` and `roots` have shape (n,)."""

    name: str
    values: Array
    roots: Complex


@dataclass(frozen=True)
class _Piece:
    """A range of values with a constant number of real roots. Columns of `roots`: real roots, ascending, then pairs."""

    values: Array
    roots: Complex
    real_count: int


def follow_modes(
    values: Array,
    roots: Complex,
    design: float,
    multiple_meetings: Sequence[float],
    *,
    is_bicycle: bool,
    over_speed: bool,
    is_complex: bool = False,
) -> tuple[Mode, ...]:
    """Every root between meetings, with the name of its mode.

    A root keeps its name where other roots meet. For a bicycle, the naming starts from a piece with one pair and
    two real roots: the piece of the design or, if the parameter is the speed, the piece with the highest speeds.
    The pair is weave, the left real root castering, the right real root capsize. If there is no such piece, the
    rightmost pair is weave. For other models, roots are numbered from right to left at the design. A pair that forms
    from two real roots has both names. Where more than two roots meet, as at EP3 and EP4, new names begin.

    Args:
        values: values of the parameter, ascending, shape (n,).
        roots: shape (n, degree).
        design: value of the parameter at the design.
        multiple_meetings: values where more than two roots meet.
        is_bicycle: whether modes have the names of a bicycle.
        over_speed: whether the parameter is the speed.
        is_complex: whether every root is a mode of its own, as for complex matrices.
    """
    pieces = _split_pieces(values, roots, multiple_meetings, is_complex)
    if not pieces:
        return ()
    typical_pieces = [
        k for k, piece in enumerate(pieces) if is_bicycle and piece.roots.shape[1] == 3 and piece.real_count == 2
    ]
    design_piece = min(
        range(len(pieces)), key=lambda k: (np.abs(pieces[k].values - design).min(), -len(pieces[k].values))
    )
    first_piece = (
        design_piece
        if not typical_pieces or (not over_speed and design_piece in typical_pieces)
        else typical_pieces[-1]
    )
    names = {first_piece: _name_modes(pieces[first_piece], design, is_bicycle)}
    for indices in (range(first_piece, len(pieces)), range(first_piece, -1, -1)):
        for previous, k in pairwise(indices):
            new_names = _pass_names(pieces[previous], names[previous], pieces[k], forward=k > previous)
            is_mixed = is_bicycle and any("weave +" in name or "+ weave" in name for name in new_names)
            names[k] = new_names if new_names and not is_mixed else _name_modes(pieces[k], design, is_bicycle)
    return tuple(
        Mode(name, piece.values, column)
        for k, piece in enumerate(pieces)
        for name, column in zip(names[k], piece.roots.T, strict=True)
    )


def _split_pieces(values: Array, roots: Complex, multiple_meetings: Sequence[float], is_complex: bool) -> list[_Piece]:
    is_real, is_upper = (roots.imag == 0) & (not is_complex), (roots.imag > 0) | is_complex
    real_counts = np.count_nonzero(is_real, axis=1)
    cuts = np.union1d(np.flatnonzero(np.diff(real_counts)) + 1, np.searchsorted(values, multiple_meetings))
    pieces = []
    for rows in np.split(np.arange(len(values)), cuts):
        if len(rows) < _MIN_POINTS or np.ptp(values[rows]) < _MIN_SHARE * np.ptp(values):
            continue
        piece_roots, count = roots[rows], int(real_counts[rows[0]])
        reals = np.sort(piece_roots.real[is_real[rows]].reshape(len(rows), count), axis=1)
        pairs = np.sort_complex(piece_roots[is_upper[rows]].reshape(len(rows), -1))
        for k in range(1, len(rows)) if pairs.shape[1] > 1 else ():
            predicted = 2 * pairs[k - 1] - pairs[k - 2] if k > 1 else pairs[k - 1]
            pairs[k] = pairs[k][_match_roots(predicted, pairs[k])]
        pieces.append(_Piece(values[rows], np.concatenate([reals, pairs], axis=1), count))
    return pieces


def _match_roots(a: Complex, b: Complex) -> NDArray[np.intp]:
    """Indices that assign one root of `b` to each root of `a`, with the least sum of squared distances."""
    squares = np.abs(a[:, None] - b) ** 2
    if len(a) <= 2:  # always so for a bicycle
        order = np.arange(len(a))
        return order[::-1] if squares[order, order[::-1]].sum() < squares.trace() else order
    from scipy.optimize import linear_sum_assignment  # takes 0.2 s to import, and is rarely needed

    return linear_sum_assignment(squares)[1]


def _name_modes(piece: _Piece, design: float, is_bicycle: bool) -> list[str]:
    """Names of the modes of a bicycle, or numbers from right to left at the value nearest to the design."""
    count, row = piece.real_count, piece.roots[np.abs(piece.values - design).argmin()]
    pairs = len(row) - count
    if is_bicycle and (count, pairs) == (2, 1):
        return ["castering", "capsize", "weave"]
    if is_bicycle and (count, pairs) == (0, 2):
        rightmost = piece.roots.real.max(axis=0).argmax()
        return ["weave" if k == rightmost else "second pair" for k in range(2)]
    rank = np.argsort(np.argsort(-row[count:].real)) + 1
    return [f"real {count - k}" for k in range(count)] + [f"pair {k}" for k in rank]


def _pass_names(old_piece: _Piece, names: list[str], new_piece: _Piece, forward: bool) -> list[str]:
    """Names of the next piece from the names of the previous one; empty unless exactly two roots meet between them."""
    if abs(old_piece.real_count - new_piece.real_count) != 2:
        return []
    few_reals, many_reals = sorted((old_piece, new_piece), key=lambda piece: piece.real_count)
    # roots next to the meeting: r on the side where the two are real, p on the side where they are a pair
    r, p = (piece.roots[-1 if (piece is old_piece) == forward else 0] for piece in (many_reals, few_reals))
    i = int(np.diff(r[: many_reals.real_count].real).argmin())  # real roots i and i + 1 form the pair j
    j = few_reals.real_count + int(p[few_reals.real_count :].imag.argmin())
    other_reals, other_roots = np.delete(np.arange(len(r)), [i, i + 1]), np.delete(np.arange(len(p)), j)
    distances = [
        np.abs(x - y).min(initial=np.inf)
        for x, y in ((r[other_reals], r[i : i + 2].mean()), (p[other_roots], p[j].real))
    ]
    if abs(r[i + 1] - r[i]) > _ISOLATED_RATIO * distances[0] or 2 * p[j].imag > _ISOLATED_RATIO * distances[1]:
        return []
    # the real roots stay in order; only pairs are matched
    other_roots[few_reals.real_count :] = other_roots[few_reals.real_count :][
        _match_roots(r[other_reals[few_reals.real_count :]], p[other_roots[few_reals.real_count :]])
    ]
    if many_reals is old_piece:
        pair_name = names[i] if names[i] == names[i + 1] else f"{names[i + 1]} + {names[i]}"
        new_names = {j: pair_name} | {b: names[a] for a, b in zip(other_reals, other_roots, strict=True)}
    else:
        upper, _, lower = names[j].partition(" + ")
        new_names = {i: lower or upper, i + 1: upper} | {
            a: names[b] for a, b in zip(other_reals, other_roots, strict=True)
        }
    return [new_names[k] for k in range(len(new_names))]
