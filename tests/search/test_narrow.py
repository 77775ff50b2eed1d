"""Basins that few starts see: a triple root beside zero in a wide box, and a well a thousandth of it wide."""

import numpy as np
import pytest

import tmsopt
from benchmarks.suites import hard_problem
from benchmarks.suites.narrow_optima import hidden, references

TRIPLE = """[model]
M = [[1, 0], [0, 1]]
D = [[0.687, 0.667], [1.2108, "0.507 + k_deltadot"]]
K = [[1.088, -0.058], ["0.895 + k_phi", -0.03792]]
[parameters]
k_phi = { min = -33.5, max = 40.8 }
k_deltadot = { min = -22.5, max = 49.7 }
[objective]
minimize = "abscissa"
"""
WELL = """[model]
coefficients = [1, "2 + x*x/4000 + 3*exp(-x*x*10000)", 9]
[parameters]
x = { min = -60, max = 40 }
[objective]
minimize = "abscissa"
"""


def triple_abscissa(k_phi, k_deltadot):
    """By NumPy's eigenvalues, which scatter beside a triple root and are no better than it is."""
    D = np.array([[0.687, 0.667], [1.2108, 0.507 + k_deltadot]])
    K = np.array([[1.088, -0.058], [0.895 + k_phi, -0.03792]])
    return float(np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -D]])).real.max())


@pytest.mark.parametrize("seed", range(2))
def test_a_triple_root_beside_zero_is_not_overlooked(seed, tmp_path):
    """Three starts agree at −0.2279, far from it."""
    path = tmp_path / "triple.toml"
    path.write_text(TRIPLE, encoding="utf-8")
    known = triple_abscissa(0.06957112229, 0.19888527776)  # by differential evolution
    assert known < -0.34
    found = tmsopt.solve(path, seed=seed)
    assert found.value <= known + 1e-6
    assert triple_abscissa(found.parameters["k_phi"], found.parameters["k_deltadot"]) == pytest.approx(
        found.value, abs=1e-3
    )


@pytest.mark.parametrize("seed", range(2))
def test_a_well_of_exponentials_beside_zero_is_found(seed, tmp_path):
    """s² + b s + 9 has the abscissa −b/2 for b < 6: −5/2 at x = 0, where b is 5; elsewhere b is 2.9 at most."""
    path = tmp_path / "well.toml"
    path.write_text(WELL, encoding="utf-8")
    assert tmsopt.solve(path, seed=seed).value == pytest.approx(-2.5, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("number", [78, 179])  # a root at 0 beside a double pair; a start that its run leaves
def test_an_optimum_is_not_lost_after_it_was_met(number, tmp_path):
    """The best of 60,000 designs, polished by SciPy on the eigenvalues, is no better."""
    path = tmp_path / "hidden.toml"
    path.write_text(hidden(number).text, encoding="utf-8")
    found = tmsopt.solve(path, stability=0.0)
    sign = found.problem.posed.sign
    assert sign * found.value <= sign * references()[number].value + 1e-7


@pytest.mark.slow
def test_ends_that_claim_more_do_not_hide_the_one_that_is_what_it_claims():
    """A damping ratio is to be 0.0557, which two of three optima only claim; a root of the third is 0."""
    found = tmsopt.solve(hard_problem(175, 3))
    roots = np.roots([float(a) for a in found.problem.posed.values(found.parameters).coefficients])
    swinging = roots[np.abs(roots.imag) > 1e-3]
    assert -swinging.real / np.abs(swinging) == pytest.approx(0.0557, abs=1e-8)
    assert np.all(roots.real <= 1e-9)
