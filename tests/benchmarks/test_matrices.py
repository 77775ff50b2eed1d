"""The sixty matrices: their points are exceptional by eigenvalues in 80 digits, and the judge sees what is wrong."""

import ast
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

from benchmarks.reports.systems.matrices import Row
from benchmarks.suites import matrices, random_matrices

SYSTEMS = {s.name: s for s in matrices.systems()}
SOME = ["spin, 6", "gain and loss at the ends, 21", "gain and loss in halves, 4", "weak link, 20", "impurity, 20"]
SOME += [
    "pencil, 3",
    "gyroscopes, 10",
    "three masses, complex",
    "three masses, real",
    "brake, two dampers",
    "controller",
]


def point_of(name):
    """A system, and the parameters and the eigenvalue of its last point."""
    *parameters, eigenvalue = SYSTEMS[name].known[-1]
    return SYSTEMS[name], parameters, eigenvalue


def test_sixty_have_points_in_their_ranges_and_ten_have_none():
    assert len(SYSTEMS) == 70
    assert [bool(s.points) for s in SYSTEMS.values()] == [True] * 60 + [False] * 10
    assert all(s.known for s in SYSTEMS.values() if s.points)


@pytest.mark.parametrize("name", SOME)
def test_a_point_has_as_many_equal_eigenvalues_as_its_order_and_one_eigenvector(name):
    """A k-fold eigenvalue of 80 digits is computed to 80/k digits or better."""
    system, parameters, eigenvalue = point_of(name)
    verdict = matrices.judge(system, parameters, eigenvalue)
    assert max(verdict.errors) == 0
    assert verdict.backward < 1e-50
    assert verdict.second > 1e-3
    with mp.workdps(80):
        found = mp.eig(system.matrix(parameters), left=False, right=False)
        assert sum(abs(s - eigenvalue) < 1e-10 for s in found) == system.order


@pytest.mark.parametrize("name", SOME)
def test_a_point_that_is_not_exact_is_seen(name):
    """A change by 1e-10 in a parameter or the eigenvalue, of the point that is known or of the one that is judged."""
    system, parameters, eigenvalue = point_of(name)
    moved = [parameters[0] + mp.mpf("1e-10"), *parameters[1:]]
    for at, s in ((moved, eigenvalue), (parameters, eigenvalue + mp.mpf("1e-10"))):
        verdict = matrices.judge(system, at, s)
        assert max(verdict.errors) > matrices.ERROR
        assert verdict.backward > 1e-13
    wrong = replace(system, points=[[f"{p} + 1e-10", *rest] for p, *rest in system.points])
    assert max(matrices.judge(wrong, parameters, eigenvalue).errors) > matrices.ERROR


def test_two_eigenvectors_are_seen():
    """At g = 1 two equal dimers have a fourfold eigenvalue in two chains of two."""
    system = replace(SYSTEMS["two equal dimers"], points=[["1", "0"]])
    assert matrices.judge(system, [1], 0).backward == float("inf")
    assert matrices.judge(replace(system, locate="EP2"), [1 + 1e-9], 0).second < 1e-8


def test_a_simple_eigenvalue_of_a_diagonal_matrix_is_far_from_a_chain():
    """At z = 0 the matrix is diag(1, -1), and the second vector of the chain is 0."""
    assert matrices.judge(SYSTEMS["two square roots"], [0, 0], -1).backward == float("inf")
    assert matrices.judge(SYSTEMS["two square roots"], [1e-3, 0], -1).backward > 0.1


@pytest.mark.parametrize(
    ("name", "status", "error", "right"),
    [
        ("PT dimer", "optimal", 1e-15, True),
        ("PT dimer", "optimal", 1e-13, False),
        ("ring", "not_converged", float("inf"), True),
        ("ring", "optimal", float("inf"), False),
        ("ring", "Unfit: too large", float("inf"), False),
    ],
)
def test_what_is_right(name, status, error, right):
    assert Row(SYSTEMS[name], status, 1.0, error).right is right


def test_the_truth_is_independent():
    for module in ("matrices.py", "fresh/formulas.py"):
        text = Path(matrices.__file__).parent.joinpath(module).read_text(encoding="utf-8")
        imported = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Import | ast.ImportFrom)]
        assert not [n for n in imported if "tmsopt" in ast.unparse(n)]


@pytest.mark.parametrize("number", [0, 100, 170])
def test_a_pencil_has_its_double_eigenvalues_at_the_zeros_of_its_discriminant(number):
    pencil = random_matrices.make_pencil(number, 7)
    n = len(pencil.entries)
    assert len(pencil.zeros) == n * (n - 1)
    for z in pencil.zeros:
        H = [[eval(entry, {"x": z.real, "y": z.imag}) for entry in row] for row in pencil.entries]
        s = np.linalg.eigvals(H)
        assert min(abs(a - b) for a, b in combinations(s, 2)) < 1e-6


@pytest.mark.parametrize("number", [0, 1, 6, 7])
def test_a_crossing_has_two_eigenvectors_and_its_neighbours_have_one(number):
    (point,) = (system := random_matrices.make_crossing(number, 7)).known
    assert matrices.judge(system, point[:-1], point[-1]).second < 1e-13
    near = random_matrices.make_crossing(number, 7, random_matrices.GAP)
    for *parameters, eigenvalue in near.known:
        verdict = matrices.judge(near, parameters, eigenvalue)
        assert verdict.backward < 1e-13
        assert verdict.second > 1e-10
        distances = [parameters[k] - point[k] for k in (0, 1)]
        assert float(mp.hypot(*distances)) == pytest.approx(random_matrices.GAP, rel=1e-9)
