"""What a user of a complex H is told."""

import numpy as np
import pytest
from helpers.texts import faults

import tmsopt
from tmsopt.models import Unfit, from_hamiltonian

HEAD = '[model]\nH = [["d - 1j*g", "k"], ["k", "-1j*l"]]\n[parameters]\nd = 0\nl = 0.7\ng = { min = 0, max = 2 }\n'


@pytest.mark.parametrize("k", ['"0.5+0.2j"', "0.5j", '"0.5j"', "0.5+0.2j"])
def test_parameters_are_real(tmp_path, k):
    (said,) = faults(tmp_path, f"{HEAD}k = {k}\n[objective]\nlocate = 'EP2'\n")
    assert said.startswith("7:")
    assert "parameters are real" in said
    assert "kr + 1j*ki" in said
    assert "with a unit" not in said


def test_a_threshold_is_weave_in_data(tmp_path):
    (said,) = faults(tmp_path, f"{HEAD}k = 0.5\n[objective]\nlocate = 'threshold'\n")
    assert "'threshold' is called weave in problem files; write weave" in said


def test_a_bare_j_is_told_where_it_is_alone(tmp_path):
    said = faults(tmp_path, '[model]\nH = [["1j*g", "k"], ["j*k", "-1j"]]\n[parameters]\ng = 1\nk = 1\n')
    assert ["row 2, column 1: 'j' would be a parameter" in text for text in said if "would be" in text] == [True]


def test_numbers_alone_make_no_model():
    with pytest.raises(Unfit, match="names no parameter"):
        from_hamiltonian(np.array([[1 - 1j, 1], [1, 2]]))


@pytest.mark.parametrize(
    ("g", "holds", "words"),
    [
        (1.0, True, "all eigenfrequencies are below the real axis"),
        (-1.0, False, "an eigenfrequency is above the real axis"),
    ],
)
def test_a_proof_speaks_of_eigenfrequencies(g, holds, words):
    """−i g and −3i, uncoupled."""
    design = tmsopt.solve(tmsopt.Problem(from_hamiltonian([["-1j*g", 0], [0, "-3j"]]), fixed={"g": g}))
    stable = tmsopt.prove(design).stable
    assert stable.holds is holds
    assert words in stable.words
    assert "imaginary" not in stable.words


def test_coefficients_of_the_real_system_are_no_names_of_h(tmp_path):
    """Their carrier is chosen for the ranges of a problem, so that a limit on them would say nothing of H."""
    (said,) = faults(tmp_path, f'{HEAD}k = 0.5\n[objective]\nlocate = "EP2"\n[constraints]\nc = "a1 <= 2"\n')
    assert "a1" in said
    assert "a2" not in said
    problem = tmsopt.Problem(from_hamiltonian([["d - 1j*g", 1], [1, "-1j"]]), fixed={"d": 0.0, "g": 1.0})
    (of,) = tmsopt.describe(problem).sets
    assert not {"a0", "a4"} & {w.name for w in of.quantities}
    assert next(w.meaning for w in of.quantities if w.name == "abscissa").startswith("largest Im omega")
