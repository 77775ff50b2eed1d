"""The structure of the eigenvalues of a matrix polynomial, without its characteristic polynomial."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from tmsopt.records import Complex
from tmsopt.roots.chains import SchurForm, linearise, make_cluster, scale_time, schur_form
from tmsopt.roots.patterns.complex_patterns import complex_name
from tmsopt.roots.patterns.shape import Group
from tmsopt.roots.patterns.structure import Structure, name_line
from tmsopt.roots.polynomial import Root, rightmost_first

Tree = list[tuple[float, int, int]]
"""Edges, each with its length and the numbers of its ends."""

_ERRORS = 2.0  # a power sum may exceed the effect of the tolerance by this factor, from rounding
_MARGIN = 10.0  # the eigenvalues of a k-fold root within the tolerance lie within this factor of tolerance^(1/k)


def spectrum(matrices: Complex, tolerance: float, is_complex: bool) -> Structure:
    """Structure of the eigenvalues of a matrix polynomial with a regular leading matrix.

    Eigenvalues count as one multiple eigenvalue if a relative change of the matrices by about `tolerance` makes them
    equal. The power sums of their distances from their mean tell it, in the Schur form of their invariant subspace.

    Args:
        matrices: in descending powers, shape (d + 1, n, n).
        is_complex: whether the matrices are complex; else complex eigenvalues come in pairs.

    Raises:
        LinAlgError: if the leading matrix is singular, or the matrices are not finite.

    Example:
        >>> block = np.array([np.eye(2), [[1.0, -1.0], [0.0, 1.0]]])  # s + 1 twice, with one eigenvector
        >>> tmsopt.roots.spectrum(block.astype(complex), 1e-11, is_complex=False).name
        'EP2'

    More: docs/explanation/jordan_chains.md
    """
    matrices, unit = scale_time(matrices)
    M = linearise(matrices)
    form = schur_form(M, is_complex)
    eigenvalues = form.eigenvalues
    size = float(np.linalg.norm(M, 2)) or 1.0
    found = [*_split(form, _connect(eigenvalues), [*range(len(eigenvalues))], tolerance, size)]
    zero = 4 * np.finfo(float).eps * size
    roots = [Root(_drop(z.real, zero), _drop(z.imag, zero if is_complex else tolerance * size), k) for z, k in found]
    if not is_complex:  # the two of a pair differ by their rounding only
        upper = [root for root in roots if root.im >= 0]
        roots = [
            r for root in upper for r in ((root, Root(root.re, -root.im, root.multiplicity)) if root.im else (root,))
        ]
    roots = [Root(unit * r.re, unit * r.im, r.multiplicity) for r in roots]
    abscissa = max(root.re for root in roots)
    line = [root for root in roots if root.re >= abscissa - tolerance * size * unit]
    groups = [Group(root.multiplicity, root.im == 0 and not is_complex) for root in line if is_complex or root.im >= 0]
    name = name_line(groups)
    return Structure(complex_name(name) if is_complex else name, rightmost_first(roots), 0.0)


def _drop(x: float, zero: float) -> float:
    return float(x) if abs(x) > zero else 0.0


def _split(
    form: SchurForm, tree: Tree, members: list[int], tolerance: float, size: float
) -> Iterator[tuple[complex, int]]:
    """The means of the largest groups of eigenvalues that coincide within the tolerance, each with its number.

    Args:
        tree: the edges between the members, the longest first.
    """
    group, k = form.eigenvalues[members], len(members)
    if k == 1:
        yield complex(group[0]), 1
        return
    distances, change = group - group.mean(), tolerance * size
    sums = (np.sum(distances**j) for j in range(2, k + 1))
    if np.abs(distances).max() <= _MARGIN * size * tolerance ** (1 / k) and _vanish(sums, change, size):
        cluster = make_cluster(form, group)
        if _vanish(cluster.power_sums, change, float(np.linalg.norm(cluster.block))):
            yield cluster.mean, k
            return
    (_, start, _), *rest = tree
    part = {start}
    while reached := {b if a in part else a for _, a, b in rest if (a in part) != (b in part)}:
        part |= reached
    for is_in_part in (True, False):
        own = [m for m in members if (m in part) is is_in_part]
        edges = [edge for edge in rest if (edge[1] in part) is is_in_part]
        yield from _split(form, edges, own, tolerance, size)


def _vanish(power_sums: Iterable[Any], change: float, length: float) -> bool:
    """Whether a change of the matrix of this size makes the eigenvalues of a group equal.

    Args:
        power_sums: of the distances from the mean, for the powers 2, 3 …
        length: size of the Schur block of the group minus its mean.
    """
    powers = enumerate(power_sums, start=2)
    return all(abs(x) <= _ERRORS * j * change * max(length, change) ** (j - 1) for j, x in powers)


def _connect(points: Complex) -> Tree:
    """The shortest tree that connects points in the plane, by Prim's algorithm; the longest edges first."""
    distances = np.abs(points[:, None] - points)
    nearest, source, edges = distances[0].copy(), np.zeros(len(points), dtype=int), list[tuple[float, int, int]]()
    nearest[0] = np.inf
    for _ in range(len(points) - 1):
        new = int(nearest.argmin())
        edges.append((float(nearest[new]), int(source[new]), new))
        closer = distances[new] < nearest
        nearest[closer], source[closer] = distances[new][closer], new
        nearest[[new, 0, *(b for *_, b in edges)]] = np.inf
    return sorted(edges, reverse=True)
