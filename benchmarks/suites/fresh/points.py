"""Exceptional points at 50 digits: Newton's method on p and its derivatives, and whether the matrix is defective."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np

from benchmarks.suites.fresh.formulas import DIGITS, FLOATS, MANY_DIGITS, exact
from benchmarks.suites.fresh.problem import (
    Problem,
    assign,
    eigenvalues,
    matrix_exactly,
    polynomial,
    roots_exactly,
    state_matrix,
)

NOT_SEMISIMPLE = 1e-10
"""Second least singular value of matrix − s, relative, above which one eigenvector is all there is."""

SAMPLES = 4001
"""Of a scan along one parameter."""


@dataclass(frozen=True)
class Point:
    """Parameters and root at many digits, and whether the root is defective."""

    parameters: Mapping[str, Any]
    root: Any
    defective: bool


def order(problem: Problem) -> int:
    """How many roots meet."""
    return int(problem.objective[-1])


def _values(problem: Problem, x: Any) -> dict[str, Any]:
    return assign(problem, dict(zip(problem.free, x, strict=True)), {}, MANY_DIGITS)


def polish(problem: Problem, start: Mapping[str, Any]) -> Point | None:
    """The point of the pattern nearest to where it is looked for; None where Newton's method does not end at one."""
    k, free = order(problem), list(problem.free)
    is_real = problem.system.kind != "H" and problem.objective.startswith("EP")
    with mpmath.workdps(DIGITS):
        x = [exact(start[name]) for name in free]
        try:
            roots = roots_exactly(polynomial(problem.system, _values(problem, x)))
            s = min(roots, key=lambda s: sorted(abs(s - r) for r in roots)[k - 1])
            close = sorted(roots, key=lambda r: abs(r - s))[:k]
            s = sum(close) / k
            unknown = [*x, mpmath.re(s), *([] if is_real else [mpmath.im(s)])]

            def rows(z: list[Any]) -> list[Any]:
                root = z[len(free)] + (0 if is_real else 1j * z[len(free) + 1])
                coefficients = polynomial(problem.system, _values(problem, z[: len(free)]))
                found: list[Any] = []
                for _ in range(k):
                    value = mpmath.polyval(coefficients, root)
                    found += [mpmath.re(value)] if is_real else [mpmath.re(value), mpmath.im(value)]
                    n = len(coefficients) - 1
                    coefficients = [c * (n - i) for i, c in enumerate(coefficients[:-1])]
                return found

            step = mpmath.mpf("1e-35")
            for _ in range(60):
                here = rows(unknown)
                columns = [
                    [
                        (a - b) / step
                        for a, b in zip(rows([*unknown[:i], u + step, *unknown[i + 1 :]]), here, strict=True)
                    ]
                    for i, u in enumerate(unknown)
                ]
                move = mpmath.lu_solve(mpmath.matrix(columns).T, -mpmath.matrix(here))
                unknown = [u + m for u, m in zip(unknown, move, strict=True)]
                if max(abs(m) for m in move) < mpmath.mpf("1e-55"):
                    break
            else:
                return None
            if max(abs(r) for r in rows(unknown)) > mpmath.mpf("1e-45"):
                return None
        except (ZeroDivisionError, ValueError, mpmath.libmp.NoConvergence):
            return None
        root = unknown[len(free)] + (0 if is_real else 1j * unknown[len(free) + 1])
        found = dict(zip(free, unknown, strict=False))
        return Point(found, root, is_defective(problem, found, root))


def is_defective(problem: Problem, parameters: Mapping[str, Any], root: Any) -> bool:
    """Whether one eigenvector belongs to a root that is multiple."""
    with mpmath.workdps(DIGITS):
        matrix = matrix_exactly(problem.system, _values(problem, [parameters[n] for n in problem.free]))
        moved = (matrix - root * mpmath.eye(matrix.rows)).apply(mpmath.mpc)
        sizes = sorted(abs(v) for v in mpmath.svd_c(moved, compute_uv=False))
        return bool(sizes[1] > NOT_SEMISIMPLE * max(1, sizes[-1]))


def scan(problem: Problem) -> list[Point]:
    """Points along one parameter where two real roots meet or part."""
    (low, high), (name,) = problem.box[0], problem.free
    x = np.linspace(low, high, SAMPLES)
    roots = eigenvalues(state_matrix(problem.system, assign(problem, {name: x}, {}, FLOATS), len(x)))
    counts = (np.abs(roots.imag) < 1e-12).sum(axis=1)
    found: list[Point] = []
    for (a, m), (b, n) in pairwise(zip(x, counts, strict=True)):
        point = polish(problem, {name: (a + b) / 2}) if m != n else None
        if point and point.defective and low < point.parameters[name] < high:
            found += [point] if all(abs(point.parameters[name] - q.parameters[name]) > 1e-12 for q in found) else []
    return found


def known_points(problem: Problem) -> list[dict[str, float]]:
    """Points inside the box: by construction, polished, and by the scan."""
    points = [p for start in problem.points if (p := polish(problem, start)) and p.defective]
    if problem.defective and len(problem.free) == 1:
        points += scan(problem)
    return [{n: float(v) for n, v in p.parameters.items()} for p in points]
