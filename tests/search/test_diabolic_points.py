"""`locate = "EP…"` of systems given by matrices: crossings that keep their eigenvectors are no exceptional points."""

import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_coefficients, from_hamiltonian, from_matrices

DIABOLIC = from_hamiltonian([["d", "k"], ["k", "-d"]])
"""Real symmetric: never defective."""
BOX = {"d": (-1.0, 1.0), "k": (-1.0, 1.0)}


def test_a_diabolic_point_is_not_found():
    found = tmsopt.solve(tmsopt.Problem(DIABOLIC, free=BOX, locate="EP2"), throw=False)
    data, report = found.to_json(), str(found)
    assert (found.status, data["defective"], data["geometric_multiplicity"]) == ("not_converged", False, 2)
    assert "none found" in report
    assert "diabolic point (semisimple), not an EP" in report
    assert found.parameters["d"] == pytest.approx(0, abs=1e-12)
    proof = tmsopt.prove(found)
    assert not proof.proved
    assert "not an EP" in proof.reason


def test_the_search_goes_on_for_a_defective_one():
    """A = [[d, k], [−k, −d]] is nilpotent where d² = k², and 0 at the middle of the box, to which it is nearest."""
    model = from_matrices(A=[["d", "k"], ["-k", "-d"]])
    found = tmsopt.solve(tmsopt.Problem(model, free=BOX, locate="EP2"))
    d, k = found.parameters["d"], found.parameters["k"]
    assert abs(d) == pytest.approx(abs(k))
    assert abs(d) > 0.01
    assert np.linalg.cond(np.linalg.eig([[d, k], [-k, -d]])[1]) > 1e7
    assert found.to_json()["geometric_multiplicity"] == 1


def test_all_designs_count_crossings_apart():
    every = tmsopt.solve_all(tmsopt.Problem(DIABOLIC, free=BOX, locate="EP2"), seconds=0)
    assert not every.solutions
    assert every.coverage is not None
    assert every.coverage.crossings == every.coverage.starts
    assert "diabolic point" in str(every)


@pytest.mark.parametrize(("coupling", "proved"), [("0", False), ("1", True)])
def test_prove_counts_eigenvectors(coupling, proved):
    """Twice −0.7, with and without a Jordan chain, in fractions."""
    model = from_matrices(A=[["a", coupling], [0, "a"]])
    proof = tmsopt.prove(tmsopt.Problem(model, fixed={"a": -0.7}))
    assert (proof.proved, proof.geometric_multiplicity) == (proved, 1 if proved else 2)
    assert proof.defective.holds is proved


def test_prove_shows_a_minor_in_balls():
    """s⁴ + 3 s² + 2 + p²: flutter begins at p = 1/2, with one eigenvector."""
    model = from_matrices([[1, 0], [0, 1]], None, [[1, "p"], ["-p", 2]])
    proof = tmsopt.prove(tmsopt.Problem(model, free={"p": (0.1, 1.0)}, locate="CEP2"))
    assert proof.proved
    assert (proof.geometric_multiplicity, proof.defective.holds) == (1, True)


def test_blocks_of_two_are_no_ep4():
    """Two equal oscillators, critically damped: −1 four times, with two eigenvectors."""
    model = from_matrices([[1, 0], [0, 1]], [["c", 0], [0, "c"]], [[1, 0], [0, 1]])
    problem = tmsopt.Problem(model, free={"c": (0.1, 4.0)}, minimize="abscissa")
    found = tmsopt.solve(problem, throw=False)  # IPOPT's Jacobian is singular there: it may end unconverged
    assert found.parameters["c"] == pytest.approx(2, abs=1e-6)
    assert "not an EP" in str(found)


def test_coefficients_cannot_tell():
    swing = from_coefficients([1, "c", 1])
    found = tmsopt.solve(tmsopt.Problem(swing, free={"c": (0.0, 3.0)}, locate="EP2"))
    assert found.to_json()["defective"] is None
    assert "coefficients cannot tell" in str(found)


def test_an_optimum_at_a_singular_mass_matrix_is_none():
    """(m s + 1)(s + 2 − m): the abscissa m − 2 is least at m = 0, where a root is at infinity."""
    model = from_coefficients(["m", "1 + m*(2 - m)", "2 - m"])
    found = tmsopt.solve(tmsopt.Problem(model, free={"m": (0.0, 0.4)}, minimize="abscissa"), throw=False)
    assert found.status == "not_converged"
    assert "no best design exists" in str(found)
    held = tmsopt.solve(tmsopt.Problem(model, free={"m": (0.01, 0.4)}, minimize="abscissa"))
    assert held.abscissa == pytest.approx(-1.99, abs=1e-8)
