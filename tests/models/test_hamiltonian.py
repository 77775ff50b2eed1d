"""Complex systems psi' = -i H psi: what H makes, what it refuses, and the carrier of its real form."""

import math
import pickle
import re
from importlib import import_module

import casadi as ca
import numpy as np
import pytest
from helpers.texts import faults

import tmsopt
from tmsopt.models import Unfit, from_hamiltonian

FIXED = {"w1": 0.0, "w2": 0.0, "g1": 1.0, "g2": 0.2}
DIMER = [["w1 - 1j*g1", "k"], ["k", "w2 - 1j*g2"]]


def carrier_of(problem):
    return import_module("tmsopt.problem.real_form").real_form(problem.posed).carrier


def frequencies(model, parameters):
    """Eigenfrequencies of a design as it is reported, each as often as it counts, by real part."""
    found = tmsopt.solve(tmsopt.Problem(model, fixed=parameters)).eigenfrequencies
    every = [complex(z.re, z.im) for z in found for _ in range(z.multiplicity)]
    return sorted(every, key=lambda z: (round(z.real, 9), z.imag))


def of_numpy(matrix):
    found = np.linalg.eigvals(np.array(matrix, dtype=complex))
    return sorted(map(complex, found), key=lambda z: (round(z.real, 9), z.imag))


@pytest.mark.parametrize("size", [1, 2, 4, 6])
def test_eigenfrequencies_are_those_of_the_matrix(size):
    """Beside LAPACK, for random complex matrices; 1e-9 of rounding in a polynomial of degree 12 with simple roots."""
    rng = np.random.default_rng(size)
    for _ in range(3):
        H = rng.normal(size=(size, size)) + 1j * rng.normal(size=(size, size))
        rows = [[f"x*({z.real!r} + {z.imag!r}*1j)" for z in row] for row in H.tolist()]
        found = frequencies(from_hamiltonian(rows), {"x": 1.0})
        assert np.allclose(found, of_numpy(H), rtol=0, atol=1e-9)


@pytest.mark.parametrize("carrier", [-3.0, 1e6])
def test_a_carrier_of_the_user_costs_no_digits(carrier):
    """Frequencies relative to it are those without it, but for the roundings of the sum: 1e-16 of the carrier."""
    model = from_hamiltonian(DIMER)
    own = {"g1": 0.25, "g2": 0.125, "k": 0.75}
    found = frequencies(model, {**own, "w1": carrier + 0.5, "w2": carrier - 0.25})
    alone = of_numpy([[0.5 - 0.25j, 0.75], [0.75, -0.25 - 0.125j]])
    assert np.allclose(np.array(found) - carrier, alone, rtol=0, atol=4e-16 * carrier + 1e-13)


def test_a_rotating_frame_has_no_false_meeting():
    """±a, and i b: the double without a carrier has there double roots that H has not."""
    model = from_hamiltonian(DIMER)
    opposite = {"w1": 0.5, "w2": -0.5, "g1": 0.0, "g2": 0.0, "k": 0.0}
    found = tmsopt.solve(tmsopt.Problem(model, fixed=opposite))
    assert found.structure == "two singles"
    assert [z.multiplicity for z in found.roots] == [1, 1]
    overdamped = tmsopt.solve(tmsopt.Problem(model, fixed={**FIXED, "k": 0.1}))
    assert (overdamped.structure, [z.multiplicity for z in overdamped.roots]) == ("single", [1, 1])
    gap = math.sqrt(0.4**2 - 0.1**2)
    assert [z.re for z in overdamped.roots] == pytest.approx([-0.6 + gap, -0.6 - gap], abs=1e-14)
    assert [z.im for z in overdamped.roots] == pytest.approx([0, 0], abs=1e-14)


@pytest.mark.parametrize("apart", [0.0, 1e-7, 1e-6])
def test_uncoupled_resonators_of_little_loss_do_not_meet(apart):
    """Losses below 1e-6 of the frequency: written as a real system they pass for one."""
    model = from_hamiltonian([["w1 - 1j*g1", 0], [0, "w2 - 1j*g2"]])
    found = tmsopt.solve(tmsopt.Problem(model, fixed={"w1": 1.0, "w2": 1.0 + apart, "g1": 1e-7, "g2": 3e-7}))
    assert found.structure == "single"
    assert [z.im for z in found.eigenfrequencies] == pytest.approx([-1e-7, -3e-7], rel=1e-9)


def test_uncoupled_resonators_with_the_same_loss_and_frequency_are_semisimple():
    model = from_hamiltonian([["w - 1j*g", "k"], ["k", "w - 1j*g"]])
    (found,) = tmsopt.diagnose(tmsopt.Problem(model, fixed={"w": 1.0, "g": 0.1, "k": 0.0}))
    assert (found.algebraic, found.geometric, found.kind) == (2, 2, "semisimple")
    assert found.eigenfrequency == pytest.approx(1 - 0.1j, abs=1e-14)


def test_the_carrier_is_no_part_of_the_problem():
    """Two problems written the same are equal, whatever model objects were made on the way."""
    free = {"k": (0.1, 2.0)}

    def stated():
        return tmsopt.Problem(from_hamiltonian(DIMER), fixed=FIXED, free=free, locate="EP2")

    one, other = stated(), stated()
    assert one == other
    assert one.model is other.model
    assert pickle.loads(pickle.dumps(one)) == one
    assert not {"a0", "a4"} & set(tmsopt.solve(one).quantities)  # of the double


def test_a_carrier_serves_its_ranges():
    """No root of the double comes as near to the real axis as the spread of the eigenfrequencies."""
    box = {"w1": (-1.0, 1.0), "g1": (0.0, 2.0), "k": (0.0, 3.0)}
    carrier = carrier_of(tmsopt.Problem(from_hamiltonian(DIMER), fixed={"w2": 0.0, "g2": 0.1}, free=box, minimize="k"))
    for w, g, k in np.random.default_rng(0).uniform(*np.array([*box.values()]).T, (50, 3)):
        assert min(z.real for z in of_numpy([[w - 1j * g, k], [k, -0.1j]])) + carrier > 3.0


def test_entries_of_every_kind_make_the_same():
    k, g, w = (ca.SX.sym(n) for n in "kgw")
    at = {"w": 0.5, "g": 0.25, "k": 0.75}
    matrix = [[0.5 - 0.25j, 0.75j], [0.75, 2 + 1j]]
    written = [["w - 1j*g", "1j*k"], ["k", "2 + 1j"]]
    for H in (
        written,
        [[(w, -g), (0, k)], [k, 2 + 1j]],
        [["w - g*1i", "k/-1j"], ["k*exp(0)", "(2j + 1j**2)*(-1j) + 3j*0"]],
    ):
        assert frequencies(from_hamiltonian(H), at) == pytest.approx(of_numpy(matrix), abs=1e-13)


def test_functions_of_complex_numbers():
    """Quotients, whole powers and exp, beside Python's own complex numbers; a 1 × 1 matrix is its entry."""
    for text in (
        "(x + 1j)**3",
        "(x + 2j)/(1 - x*1j)",
        "(x - 1j)**-2",
        "exp((0.3 + 2j)*x)",
        "sqrt(x)*1j - x**0.5",
        "2**x*1e1j",
    ):
        (omega,) = frequencies(from_hamiltonian([[text]]), {"x": 0.7})
        value = {"exp": np.exp, "sqrt": np.sqrt, "x": 0.7}
        expected = complex(eval(text, {"__builtins__": {}}, value))
        assert omega == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize(
    ("H", "words"),
    [
        ([["j*g"]], "write the imaginary unit as 1j"),
        ([["sin(1j*g)"]], "'sin(1j*g)' takes sin of a complex number"),
        ([["(g + 1j)**g"]], "'(g + 1j)**g' raises a complex number to a power; accepted: whole"),
        ([["g", 1]], "found rows of 2 entries"),
        ([["g*2j", 1], [0, "conj(g)"]], "calls 'conj'"),
        ([["g*"]], "does not parse"),
        ([[0.5]], "names no parameter"),
        ([["g", float("nan")], [0, 1j]], "row 1, column 2: is nan"),
        ([["g" if i == j else 0 for i in range(101)] for j in range(101)], "accepted: up to 100 × 100"),
        ([[(1, 2, 3)]], "found (1, 2, 3); accepted: a real and an imaginary part"),
    ],
)
def test_what_is_refused_is_told(H, words):
    with pytest.raises(Unfit) as refused:
        from_hamiltonian(H)
    assert refused.value.key == "H"
    assert words in str(refused.value)
    assert "_1j" not in str(refused.value)


@pytest.mark.parametrize(
    ("table", "words"),
    {
        'H = [["w"]]\nA = [["w"]]': "together with A; keep H, a complex system",
        'H = [["1j*w", 1]]': "found rows of 2 entries",
        'H = [["w - 2j*"]]': "'w - 2j*' does not parse",
        'H = "w"': "accepted: rows in brackets",
    }.items(),
)
def test_a_file_is_refused_at_its_line(tmp_path, table, words):
    found = faults(tmp_path, f"[model]\n{table}\n[parameters]\nw = 1\n")
    assert any(re.match(r"[23]: model\.[AH]", fault) and words in fault for fault in found)


@pytest.mark.parametrize("asked", ["damping_ratio", "angular_frequency"])
def test_what_has_no_meaning_in_a_rotating_frame_is_not_offered(asked):
    with pytest.raises(tmsopt.InputError, match="rotating frame"):
        tmsopt.Problem(from_hamiltonian(DIMER), fixed=FIXED, free={"k": (0.1, 2)}, maximize=asked)


@pytest.mark.parametrize("name", ["CEP2", "EP3", "capsize"])
def test_patterns_are_those_of_the_matrix(name):
    with pytest.raises(tmsopt.InputError, match="EP2 weave resonance"):
        tmsopt.Problem(from_hamiltonian(DIMER), fixed=FIXED, free={"k": (0.1, 2)}, locate=name)


@pytest.mark.parametrize("H", [[["x", 0], [0, 0]], [["x", "x"], [0, "x"]], [[0, 1], [0, "x"]]])
def test_zero_is_an_eigenfrequency_as_others_are(H):
    """Of a zero matrix every carrier is too large; intervals have a rounding even there."""
    found = tmsopt.solve(tmsopt.Problem(from_hamiltonian(H), fixed={"x": 0.0})).eigenfrequencies
    assert [(z.re, z.im, z.multiplicity) for z in found] == [(0.0, 0.0, 2)]


def test_the_realised_abscissa_is_that_of_the_stored_parameters():
    """A double eigenvalue of [[i g, 1], [1, −i g]] with g = 1 + 2⁻⁵⁰ has Im ω = √(g² − 1); doubles would err by 1e-8."""
    pair = from_hamiltonian([["1j*g", 1], [1, "-1j*g"]])
    g = 1 + 2.0**-50
    found = tmsopt.solve(tmsopt.Problem(pair, fixed={"g": g}))
    assert found.abscissa_realised == pytest.approx(math.sqrt((g - 1) * (g + 1)), rel=1e-12)


def test_a_defective_matrix_has_a_report():
    """At a fixed EP the eigenvalues have no spread; its carrier must still keep them from their conjugates."""
    found = tmsopt.solve(tmsopt.Problem(from_hamiltonian([["1j*g", 1], [1, "-1j*g"]]), fixed={"g": 1.0}))
    assert found.edges == ("weave",)
    assert "growing as t" in str(found)
