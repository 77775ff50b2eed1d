"""Finds the number of eigenvectors of multiple roots, from ranks of the model's matrices.

A *meeting* is a multiple root: several roots meet there. If it has several eigenvectors, we say that the roots *cross*.
If it has one eigenvector, it is an exceptional point (EP).
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import flint
import numpy as np

from tmsopt.models.user_spectrum import user_roots
from tmsopt.problem.problem import Posed
from tmsopt.problem.verdict.stability import MultipleRoot
from tmsopt.records import Array, Complex, Numbers
from tmsopt.roots import Pattern, Root, jordan
from tmsopt.roots.jordan import equilibrate
from tmsopt.roots.patterns.structure import fit_unknowns

_RANK_TOLERANCE = 1e-10  # a relative singular value below this counts as 0
# Singular values below this may be 0 at a nearby design; those of a double root are at most about √1e-10.
_NEARLY_SINGULAR = 1e-3
_MAX_DISTANCE = 3e-5  # greatest distance of a crossing from the design, as a share of the box
_DIFFERENCE_STEP = 1e-6  # step of finite differences, as a share of the box
_MAX_NEWTON_STEPS = 6  # greatest number of Gauss–Newton steps
_ZERO_BLOCK = 1e-12  # a block of the matrix counts as 0 if it is below this share of the terms of the matrices
_SAME_ROOT = 1e-6  # relative distance within which two roots are the same
_MIN_UNIT = 1e-3  # least unit for scaling the matrices at a root, as a share of the largest root


def meetings(problem: Posed, parameters: Numbers, roots: Sequence[Root]) -> tuple[MultipleRoot, ...]:
    """The multiple roots among the roots of a design's polynomial, converted to roots of the user's system.

    The rightmost root comes first.
    """
    multiple_roots: list[MultipleRoot] = []
    is_complex = problem.model.carrier is not None
    for root in roots:
        if root.multiplicity > 1 and (root.im < 0 if is_complex else root.im >= 0):
            (user_root,) = user_roots(problem.model, [root])
            meeting = _find_eigenvectors(problem, parameters, root, user_root, roots)
            multiple_roots += [meeting] if is_complex or not root.im else [meeting, replace(meeting, im=-root.im)]
    return tuple(sorted(multiple_roots, key=lambda m: (-m.re, -m.im)))


def is_crossing(problem: Posed, pattern: Pattern, parameters: Numbers) -> bool:
    """Whether a located multiple root has several eigenvectors, so that it is no exceptional point."""
    return any(not m.exceptional for m in located_meetings(problem, pattern, parameters))


def located_meetings(problem: Posed, pattern: Pattern, parameters: Numbers) -> tuple[MultipleRoot, ...]:
    """The multiple roots of a pattern with ``EP`` in its name; none without matrices."""
    if problem.model.pencil is None or "EP" not in pattern.name:
        return ()
    return meetings(problem, parameters, _located_roots(problem, pattern, parameters))


def _located_roots(problem: Posed, pattern: Pattern, parameters: Numbers) -> list[Root]:
    """The multiple roots of the nearest polynomial of a pattern."""
    try:
        (unknowns, *_) = fit_unknowns(pattern, np.array([float(c) for c in problem.values(parameters).coefficients]))
    except ValueError:
        return []
    return [
        Root(float(z.real), float(z.imag) if abs(z.imag) > 0 else 0.0, count)
        for factor, count in pattern.distinct_factors(unknowns)
        if not ("resonance" in pattern.form and len(factor) > 2 and factor[1] == 0)
        for z in np.roots(np.array(factor, dtype=float))
        if count > 1
    ]


def all_meetings(
    problem: Posed, parameters: Numbers, roots: Sequence[Root], violated_names: Collection[str]
) -> tuple[MultipleRoot, ...]:
    """The multiple roots of a solution: first the roots of its pattern, unless it is violated, then the others."""
    root_meetings, pattern = meetings(problem, parameters, roots), problem.pattern
    is_violated = any(name in violated_names for name in problem.located)
    located = located_meetings(problem, pattern, parameters) if pattern is not None and not is_violated else ()
    pattern_meetings = [m for m in root_meetings if any(_is_near(m, other) for other in located)]
    further_meetings = [m for m in located if not any(_is_near(m, other) for other in root_meetings)]
    return (*pattern_meetings, *further_meetings, *(m for m in root_meetings if m not in pattern_meetings))


def _is_near(root: MultipleRoot, other: MultipleRoot) -> bool:
    a, b = _number(root), _number(other)
    return abs(a - b) <= _SAME_ROOT * (abs(a) + abs(b) or 1.0)


def _number(root: Root | MultipleRoot) -> complex:
    return complex(root.re, root.im)


def nearest_crossing(problem: Posed, pattern: Pattern, parameters: Numbers) -> dict[str, float]:
    """The parameters near a design at which its located roots cross, more accurate than from the coefficients."""
    roots = _located_roots(problem, pattern, parameters)
    root = max(roots, key=lambda r: r.multiplicity)
    crossing, _ = _find_crossing(problem, parameters, _number(root), root.multiplicity, _unit(root, roots))
    return {n: min(max(crossing[n], low), high) for n, (low, high) in problem.free.items()}


def _find_eigenvectors(
    problem: Posed, parameters: Numbers, root: Root, user_root: Root, roots: Sequence[Root]
) -> MultipleRoot:
    k, pencil = root.multiplicity, problem.model.pencil
    if pencil is None:
        return MultipleRoot(user_root.re, user_root.im, k, None, k)
    unit = _unit(root, roots)
    design, s = _find_crossing(problem, parameters, _number(root), k, unit)
    matrices = pencil(problem.parameter_set.native({n: flint.arb(x) for n, x in design.items()}))
    chains = jordan(matrices, flint.acb(s.real, s.imag), k, _RANK_TOLERANCE, unit)
    chain_lengths = chains.partial or (k - chains.geometric + 1,)
    return MultipleRoot(user_root.re, user_root.im, k, chains.geometric, longest=chain_lengths[0])


def _unit(root: Root, roots: Sequence[Root]) -> float:
    """The unit of a root for scaling the matrices."""
    return max(abs(_number(root)), _MIN_UNIT * max(abs(_number(r)) for r in roots)) or 1.0


def _find_crossing(problem: Posed, parameters: Numbers, s: complex, k: int, unit: float) -> tuple[Numbers, complex]:
    """The crossing near a design and its root; without a crossing nearby, the design and s.

    Coefficients determine a crossing with half of their digits only, so the design may be 1e-5 away from it. At the
    crossing, several of the smallest singular values of the matrix polynomial L(s) are 0. The block of L(s) between
    their singular vectors is therefore 0 too, which is a regular equation for the parameters.
    """
    free = [n for n, (low, high) in problem.free.items() if high > low]
    start = np.array([*(float(parameters[n]) for n in free), s.real, s.imag])
    widths = np.array([*(problem.free[n][1] - problem.free[n][0] for n in free), unit, unit])
    size, scale = equilibrate(_matrices(problem, parameters), unit)
    scale = scale / np.linalg.norm(size * scale, 2)  # a constant scale, so that it does not jump with the entries

    def design_at(x: Array) -> dict[str, float]:
        return {**parameters, **dict(zip(free, x.tolist(), strict=False))}

    def scaled_matrix(x: Array) -> Complex:
        matrix = np.polyval(_matrices(problem, design_at(x)), complex(*x[-2:]))
        return np.asarray(scale * matrix, dtype=complex)

    for count in range(k, 1, -1):  # number of singular values that become 0
        x = start
        for _ in range(_MAX_NEWTON_STEPS):
            left_vectors, values, right_vectors = np.linalg.svd(scaled_matrix(x))
            if count > len(values) or values[-count] > _NEARLY_SINGULAR:
                break
            if values[-count] <= _ZERO_BLOCK:
                return design_at(x), complex(*x[-2:])
            x = x + widths * _newton_step(scaled_matrix, x, widths, left_vectors[:, -count:], right_vectors[-count:])
            if (np.abs(x - start) > _MAX_DISTANCE * widths)[:-2].any():
                break
    return parameters, s


def _matrices(problem: Posed, parameters: Numbers) -> list[Array]:
    assert problem.model.pencil is not None
    matrices = problem.model.pencil(problem.parameter_set.native(dict(parameters)))
    return [np.array(P, dtype=float) for P in matrices]


def _newton_step(
    scaled_matrix: Callable[[Array], Complex], x: Array, widths: Array, left_vectors: Complex, right_vectors: Complex
) -> Array:
    """A Gauss–Newton step towards a zero block of L(s), in shares of the box and of the unit of the root."""

    def block(point: Array) -> Array:
        B = (left_vectors.conj().T @ scaled_matrix(point) @ right_vectors.conj().T).ravel()
        return np.concatenate([B.real, B.imag])

    base = block(x)
    columns = [(block(x + _DIFFERENCE_STEP * move) - base) / _DIFFERENCE_STEP for move in np.diag(widths)]
    return np.asarray(np.linalg.lstsq(np.array(columns).T, -base, rcond=1e-9)[0])
