"""Finds the eigenvectors of multiple roots, by ranks of the model's matrices."""

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

_RANK = 1e-10  # relative singular value that counts as 0
_CLOSE = 1e-3  # singular values that may vanish near the design; those of a double root are at most about √1e-10
_REACH = 3e-5  # greatest distance of a crossing from the design, as a share of the box
_STEP, _STEPS = 1e-6, 6  # difference step as a share of the box; number of Gauss–Newton steps
_VANISHED = 1e-12  # a block this small, relative to the terms of the matrices, vanishes
_NEAR = 1e-6  # relative distance within which two roots are the same
_UNIT = 1e-3  # least unit for scaling the matrices at a root, as a share of the largest root


def meetings(problem: Posed, parameters: Numbers, roots: Sequence[Root]) -> tuple[MultipleRoot, ...]:
    """The multiple roots among the roots of a design's polynomial, rightmost first, as users read them."""
    found: list[MultipleRoot] = []
    of_H = problem.model.carrier is not None
    for root in roots:
        if root.multiplicity > 1 and (root.im < 0 if of_H else root.im >= 0):
            (user_root,) = user_roots(problem.model, [root])
            meeting = _find_eigenvectors(problem, parameters, root, user_root, roots)
            found += [meeting] if of_H or not root.im else [meeting, replace(meeting, im=-root.im)]
    return tuple(sorted(found, key=lambda m: (-m.re, -m.im)))


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


def every_meeting(
    problem: Posed, parameters: Numbers, roots: Sequence[Root], violated: Collection[str]
) -> tuple[MultipleRoot, ...]:
    """The multiple roots of a solution: first those of its pattern, unless it is violated, then the others."""
    shown, pattern = meetings(problem, parameters, roots), problem.pattern
    lost = any(name in violated for name in problem.located)
    located = located_meetings(problem, pattern, parameters) if pattern is not None and not lost else ()
    ours = [m for m in shown if any(_is_near(m, other) for other in located)]
    rest = [m for m in located if not any(_is_near(m, other) for other in shown)]
    return (*ours, *rest, *(m for m in shown if m not in ours))


def _is_near(one: MultipleRoot, other: MultipleRoot) -> bool:
    a, b = _number(one), _number(other)
    return abs(a - b) <= _NEAR * (abs(a) + abs(b) or 1.0)


def _number(root: Root | MultipleRoot) -> complex:
    return complex(root.re, root.im)


def nearest_crossing(problem: Posed, pattern: Pattern, parameters: Numbers) -> dict[str, float]:
    """The parameters near a design where its located roots cross, more accurate than from coefficients."""
    roots = _located_roots(problem, pattern, parameters)
    root = max(roots, key=lambda r: r.multiplicity)
    found, _ = _find_crossing(problem, parameters, _number(root), root.multiplicity, _unit(root, roots))
    return {n: min(max(found[n], low), high) for n, (low, high) in problem.free.items()}


def _find_eigenvectors(
    problem: Posed, parameters: Numbers, root: Root, user_root: Root, roots: Sequence[Root]
) -> MultipleRoot:
    k, pencil = root.multiplicity, problem.model.pencil
    if pencil is None:
        return MultipleRoot(user_root.re, user_root.im, k, None, k)
    unit = _unit(root, roots)
    at, s = _find_crossing(problem, parameters, _number(root), k, unit)
    matrices = pencil(problem.parameter_set.native({n: flint.arb(x) for n, x in at.items()}))
    found = jordan(matrices, flint.acb(s.real, s.imag), k, _RANK, unit)
    partial = found.partial or (k - found.geometric + 1,)
    return MultipleRoot(user_root.re, user_root.im, k, found.geometric, partial[0])


def _unit(root: Root, roots: Sequence[Root]) -> float:
    """The unit of a root for scaling the matrices."""
    return max(abs(_number(root)), _UNIT * max(abs(_number(r)) for r in roots)) or 1.0


def _find_crossing(problem: Posed, parameters: Numbers, s: complex, k: int, unit: float) -> tuple[Numbers, complex]:
    """The crossing near a design and its root; the design itself if there is none nearby.

    Coefficients determine a crossing to half of their digits only, so the design may be 1e-5 away from it. At the
    crossing the block of L(s) of the least singular values vanishes, which is a regular equation in the parameters.
    """
    free = [n for n, (low, high) in problem.free.items() if high > low]
    start = np.array([*(float(parameters[n]) for n in free), s.real, s.imag])
    widths = np.array([*(problem.free[n][1] - problem.free[n][0] for n in free), unit, unit])
    size, scale = equilibrate(_matrices(problem, parameters), unit)
    scale = scale / np.linalg.norm(size * scale, 2)  # constant, so that it does not jump with the entries

    def design_at(x: Array) -> dict[str, float]:
        return {**parameters, **dict(zip(free, x.tolist(), strict=False))}

    def scaled_matrix(x: Array) -> Complex:
        found = np.polyval(_matrices(problem, design_at(x)), complex(*x[-2:]))
        return np.asarray(scale * found, dtype=complex)

    for count in range(k, 1, -1):
        x = start
        for _ in range(_STEPS):
            left, values, right = np.linalg.svd(scaled_matrix(x))
            if count > len(values) or values[-count] > _CLOSE:
                break
            if values[-count] <= _VANISHED:
                return design_at(x), complex(*x[-2:])
            x = x + widths * _newton_step(scaled_matrix, x, widths, left[:, -count:], right[-count:])
            if (np.abs(x - start) > _REACH * widths)[:-2].any():
                break
    return parameters, s


def _matrices(problem: Posed, parameters: Numbers) -> list[Array]:
    assert problem.model.pencil is not None
    found = problem.model.pencil(problem.parameter_set.native(dict(parameters)))
    return [np.array(P, dtype=float) for P in found]


def _newton_step(
    scaled_matrix: Callable[[Array], Complex], x: Array, widths: Array, left: Complex, right: Complex
) -> Array:
    """A Gauss–Newton step towards a vanishing block of L, in shares of the box and of the unit of the root."""

    def block(at: Array) -> Array:
        B = (left.conj().T @ scaled_matrix(at) @ right.conj().T).ravel()
        return np.concatenate([B.real, B.imag])

    base = block(x)
    columns = [(block(x + _STEP * move) - base) / _STEP for move in np.diag(widths)]
    return np.asarray(np.linalg.lstsq(np.array(columns).T, -base, rcond=1e-9)[0])
