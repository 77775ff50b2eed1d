"""Finds the number of eigenvectors of multiple roots, from ranks of the model's matrices.

A *meeting* is a multiple root: several roots meet there. If it has several eigenvectors, we say that the roots *cross*.
If it has one eigenvector, it is an exceptional point (EP).
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import flint
import numpy as np

from tmsopt.chains.family import family_of
from tmsopt.chains.points import gather_roots, measure_point, targets_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.verdict.stability import MultipleRoot
from tmsopt.records import Numbers
from tmsopt.roots import Pattern, Root, jordan
from tmsopt.roots.chains import expand
from tmsopt.roots.jordan import equilibrate

_RANK_TOLERANCE = 1e-10  # a relative singular value below this counts as 0
# Singular values below this may be 0 at a nearby design; those of a double root are at most about √1e-10.
_NEARLY_SINGULAR = 1e-3
_MAX_DISTANCE = 3e-5  # greatest distance of a crossing from the design, as a share of the box
_MAX_NEWTON_STEPS = 6  # greatest number of Gauss–Newton steps
_ZERO_BLOCK = 1e-12  # a block of the matrix counts as 0 if it is below this share of the terms of the matrices
_SAME_ROOT = 1e-6  # relative distance within which two roots are the same
_MIN_UNIT = 1e-3  # least unit for scaling the matrices at a root, as a share of the largest root


def meetings(problem: Posed, parameters: Numbers, roots: Sequence[Root]) -> tuple[MultipleRoot, ...]:
    """The multiple roots among the roots of a design, the rightmost first."""
    multiple_roots: list[MultipleRoot] = []
    is_complex = problem.model.is_complex
    for root in roots:
        if root.multiplicity > 1 and (is_complex or root.im >= 0):
            meeting = _find_eigenvectors(problem, parameters, root, roots)
            multiple_roots += [meeting] if is_complex or not root.im else [meeting, replace(meeting, im=-root.im)]
    return tuple(sorted(multiple_roots, key=lambda m: (-m.re, -m.im)))


def is_crossing(problem: Posed, pattern: Pattern, parameters: Numbers) -> bool:
    """Whether a located multiple root has several eigenvectors, so that it is no exceptional point."""
    return any(not m.exceptional for m in located_meetings(problem, pattern, parameters))


def mismatch(problem: Posed, pattern: Pattern, parameters: Numbers) -> float:
    """Least relative change of the matrices of a design that gives it a pattern with its Jordan chains.

    inf if an eigenvalue has several eigenvectors.
    """
    family, targets = family_of(problem, parameters), targets_of(pattern.name, problem.model.is_complex)
    point = measure_point(family, targets, np.array([float(parameters[n]) for n in problem.free]))
    return point.backward_error if point is not None and point.is_defective else np.inf


def has_regular_lead(problem: Posed, parameters: Numbers) -> bool:
    """Whether the matrix of the highest power of s is regular, as Jordan chains need it."""
    leading = family_of(problem, parameters).matrices(np.array([float(parameters[n]) for n in problem.free]))[0]
    return bool(np.isfinite(leading).all() and np.linalg.matrix_rank(leading) == len(leading))


def located_meetings(problem: Posed, pattern: Pattern, parameters: Numbers) -> tuple[MultipleRoot, ...]:
    """The multiple roots of a pattern; none without matrices."""
    if problem.model.pencil is None:
        return ()
    return meetings(problem, parameters, _located_roots(problem, pattern, parameters))


def _located_roots(problem: Posed, pattern: Pattern, parameters: Numbers) -> list[Root]:
    """The means of the eigenvalues that come nearest to the multiple roots of a pattern."""
    family = family_of(problem, parameters).at(np.array([float(parameters[n]) for n in problem.free]))
    targets = targets_of(pattern.name, problem.model.is_complex)
    means = gather_roots(family, targets)
    if means is None:
        return []
    return [
        Root(float(s.real), float(s.imag), target.order)
        for s, target in zip(means, targets, strict=True)
        if target.order > 1
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


def nearest_crossing(
    problem: Posed, pattern: Pattern, parameters: Numbers, reach: float = _MAX_DISTANCE
) -> dict[str, float]:
    """The parameters near a design at which its located roots cross; without a crossing nearby, those of the design.

    Args:
        reach: greatest distance of the crossing, as a share of the box.
    """
    roots = _located_roots(problem, pattern, parameters)
    if not roots:
        return {n: float(parameters[n]) for n in problem.free}
    root = max(roots, key=lambda r: r.multiplicity)
    multiplicity = root.multiplicity
    unit = _unit(problem, parameters, root, roots)
    crossing, _ = _find_crossing(problem, parameters, _number(root), multiplicity, unit, reach)
    return {n: min(max(crossing[n], low), high) for n, (low, high) in problem.free.items()}


def _find_eigenvectors(problem: Posed, parameters: Numbers, root: Root, roots: Sequence[Root]) -> MultipleRoot:
    k, pencil = root.multiplicity, problem.model.pencil
    if pencil is None:
        return MultipleRoot(root.re, root.im, k, None, k)
    unit = _unit(problem, parameters, root, roots)
    design, s = _find_crossing(problem, parameters, _number(root), k, unit)
    matrices = pencil(problem.parameter_set.native({n: flint.arb(x) for n, x in design.items()}))
    chains = jordan(matrices, flint.acb(s.real, s.imag), k, _RANK_TOLERANCE, unit)
    chain_lengths = chains.partial or (k - chains.geometric + 1,)
    return MultipleRoot(root.re, root.im, k, chains.geometric, longest=chain_lengths[0])


def _unit(problem: Posed, parameters: Numbers, root: Root, roots: Sequence[Root]) -> float:
    """The unit of a root for scaling the matrices."""
    largest = max(family_of(problem, parameters).typical_size, *(abs(_number(r)) for r in roots))
    # A complex H may be written in a rotating frame, so that the size of an eigenfrequency has no meaning.
    return (largest if problem.model.is_complex else max(abs(_number(root)), _MIN_UNIT * largest)) or 1.0


def _find_crossing(
    problem: Posed, parameters: Numbers, s: complex, k: int, unit: float, reach: float = _MAX_DISTANCE
) -> tuple[Numbers, complex]:
    """The crossing near a design and its root; without a crossing nearby, the design and s.

    Coefficients determine a crossing with half of their digits only, so the design may be 1e-5 away from it. At the
    crossing, several of the smallest singular values of the matrix polynomial L(s) are 0. The block of L(s) between
    their singular vectors is therefore 0 too, which is a regular equation for the parameters.
    """
    family = family_of(problem, parameters)
    start = np.array([float(parameters[n]) for n in family.names])
    size, scale = equilibrate(list(family.matrices(start)), unit)
    scale = scale / np.linalg.norm(size * scale, 2)  # a constant scale, so that it does not jump with the entries
    for count in range(k, 1, -1):  # number of singular values that become 0
        p, z = start, s
        for _ in range(_MAX_NEWTON_STEPS):
            matrices, slopes = family.expand(p)
            value, slope = (scale * P for P in expand(matrices, z, 2))
            left, values, right = np.linalg.svd(value)
            if count > len(values) or values[-count] > max(_NEARLY_SINGULAR, reach):
                break
            if values[-count] <= _ZERO_BLOCK:
                p = np.where(np.abs(p) <= np.finfo(float).eps * family.widths, 0.0, p)
                return {**parameters, **dict(zip(family.names, p.tolist(), strict=True))}, z
            U, V = left[:, -count:].conj().T, right[-count:].conj().T
            changes = [
                scale * expand(change, z, 1)[0] * width for change, width in zip(slopes, family.widths, strict=True)
            ]
            columns = np.array([(U @ D @ V).ravel() for D in (value, *changes, slope * unit, 1j * slope * unit)])
            residual, *rows = np.concatenate([columns.real, columns.imag], axis=1)
            step = np.linalg.lstsq(np.array(rows).T, -residual, rcond=1e-9)[0]
            p, z = p + family.widths * step[:-2], z + unit * complex(*step[-2:])
            if (np.abs(p - start) > reach * family.widths).any():
                break
    return parameters, s
