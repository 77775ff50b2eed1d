"""Eigenvalues along loops, against closed forms: exchanges, geometric phases, winding numbers, points inside."""

import cmath
import math

import numpy as np
import pytest
from helpers.places import PROBLEMS

import tmsopt
from tmsopt.models import from_coefficients, from_hamiltonian, from_matrices
from tmsopt.spectra import encircle

DIMER, TRIMER, PAIR = (PROBLEMS / f"{name}.toml" for name in ("loss_only_dimer", "pt_trimer", "coupled_pair"))

CEP2 = {"c2": -1.1, "k": 0.18 + 3 * math.sqrt(435) / 100}
"""One of the four points of the pair, from its polynomial as the square of another one; see its file."""


def plane(model, *names, low=-4.0, high=4.0, **fixed):
    return tmsopt.Problem(model, fixed=fixed, free=dict.fromkeys(names, (low, high)))


def cubic():
    """Eigenvalues w with w³ − 3 w + z = 0 and z = x + i y: EP2s at z = 2 (w = 1) and z = −2 (w = −1)."""
    return plane(from_hamiltonian([[0, 1, 0], [0, 0, 1], ["-x - 1j*y", 3, 0]]), "x", "y")


def phases(loop):
    return [complex(c.phase, c.phase_imaginary) for c in loop.cycles]


def test_an_ep2_exchanges_two_eigenfrequencies_and_two_turns_give_pi():
    """-0.6i ± √((d − 0.8i)²/4 + k²) + d/2: an EP2 at d = 0, k = 0.4, where the square root turns counterclockwise."""
    loop = encircle(DIMER, 0.1)
    assert loop.plane == ("d", "k")
    assert loop.permutation == (1, 0)
    assert [(c.members, c.turns) for c in loop.cycles] == [((0, 1), 2)]
    assert phases(loop) == [pytest.approx(math.pi, abs=1e-12)]
    assert (loop.winding, loop.is_complete) == (1, True)
    (point,) = loop.inside
    assert point.parameters == pytest.approx({"d": 0, "k": 0.4}, abs=1e-12)
    assert point.eigenvalue == pytest.approx(-0.6j, abs=1e-12)
    assert (point.name, point.order, point.winding) == ("EP2", 2, 1)


def test_eigenvalues_along_the_loop_are_those_of_the_matrix():
    loop = encircle(DIMER, 0.3)
    d, k = 0.3 * np.cos(loop.angles), 0.4 + 0.3 * np.sin(loop.angles)
    product = (loop.eigenvalues - (d / 2 - 0.6j)[:, None]).prod(axis=1)
    assert np.abs(product + (d - 0.8j) ** 2 / 4 + k**2).max() < 1e-13
    assert np.abs(np.diff(loop.eigenvalues, axis=0)).max() < 0.1
    assert loop.eigenvalues[0, 0].real < loop.eigenvalues[0, 1].real
    assert loop.eigenvalues[-1] == pytest.approx(loop.eigenvalues[0, [1, 0]], abs=1e-12)


def test_the_other_orientation_of_the_plane_changes_the_sign_of_the_winding_number():
    loop = encircle(DIMER, 0.1, plane=("k", "d"))
    assert (loop.permutation, loop.winding) == ((1, 0), -1)
    assert phases(loop) == [pytest.approx(math.pi, abs=1e-12)]


def test_an_ep3_is_a_cycle_of_three():
    """w³ = k² z near the point with z = d1 + i (gain − √2): the discriminant has a double zero there."""
    loop = encircle(TRIMER, 0.1, plane=("d1", "gain"))
    assert len(loop.cycles) == 1
    assert loop.cycles[0].turns == 3
    assert phases(loop) == [pytest.approx(0, abs=1e-11)]
    assert (loop.winding, loop.is_complete) == (2, True)
    assert [(p.order, p.winding) for p in loop.inside] == [(3, 2)]
    assert loop.inside[0].parameters == pytest.approx({"d1": 0, "gain": math.sqrt(2)}, abs=1e-9)


def test_a_loop_around_nothing_changes_nothing():
    loop = encircle(DIMER, 0.1, centre={"k": 1.0})
    assert loop.permutation == (0, 1)
    assert phases(loop) == [pytest.approx(0, abs=1e-12)] * 2
    assert (loop.winding, loop.inside, loop.phase) == (0, (), None)


@pytest.mark.parametrize(
    ("centre", "radius", "turns", "winding", "count"),
    [
        (0, 3, [3], 2, 2),
        (0, 1, [1, 1, 1], 0, 0),
        (2, 1, [1, 2], 1, 1),
        (-2, 1, [1, 2], 1, 1),
        (0, 1.99, [1, 1, 1], 0, 0),
    ],
)
def test_two_transpositions_are_multiplied(centre, radius, turns, winding, count):
    loop = encircle(cubic(), radius, centre={"x": centre})
    assert sorted(c.turns for c in loop.cycles) == turns
    assert (loop.winding, loop.is_complete) == (winding, True)
    assert sorted(round(p.parameters["x"] / 2, 9) for p in loop.inside) == [
        x for x in (-1, 1) if abs(2 * x - centre) < radius
    ]
    assert len(loop.inside) == count
    assert all(p.eigenvalue == pytest.approx(p.parameters["x"] / 2, abs=1e-9) for p in loop.inside)


def test_far_outside_each_eigenvalue_becomes_the_next_one_counterclockwise():
    """w³ ≈ −z for a large z."""
    loop = encircle(cubic(), 4.0, centre={"x": 0.0})
    counterclockwise = np.argsort(np.angle(loop.eigenvalues[0]) % (2 * math.pi - 0.01)).tolist()
    assert [loop.permutation[k] for k in counterclockwise] == [*counterclockwise[1:], counterclockwise[0]]


def test_two_ep2_of_opposite_sign_cancel():
    """In the dimer with d = 0, at k = 0.4 and k = −0.4."""
    problem = tmsopt.Problem(
        tmsopt.load(DIMER).model, fixed={"g1": 1.0, "g2": 0.2, "eps": 0.0}, free={"d": (-1, 1), "k": (-1, 1)}
    )
    loop = encircle(problem, 0.7)
    assert (loop.permutation, loop.winding, loop.is_complete) == ((0, 1), 0, True)
    assert sorted((round(p.parameters["k"], 9), p.winding) for p in loop.inside) == [(-0.4, -1), (0.4, 1)]


def test_a_diabolic_point_gives_pi_after_one_turn():
    loop = encircle(plane(from_hamiltonian([["x", "y"], ["y", "-x"]]), "x", "y"), 1.0)
    assert (loop.permutation, loop.winding, loop.inside) == ((0, 1), 0, ())
    assert phases(loop) == [pytest.approx(math.pi, abs=1e-12)] * 2


@pytest.mark.parametrize("height", [1.0, 0.3, 1.0 + 0.5j, 0.2 - 0.4j])
def test_berry_phase_of_a_spin(height):
    """±π (1 − z/√(z² + r²)), half the solid angle of the loop (Berry 1984), continued to complex z."""
    z, r = height, 0.5
    H = [["x", f"y - 1j*({z.real} + 1j*({z.imag}))"], [f"y + 1j*({z.real} + 1j*({z.imag}))", "-x"]]
    found = phases(encircle(plane(from_hamiltonian(H), "x", "y"), r))
    expected = math.pi * (1 - z / cmath.sqrt(z * z + r * r))
    assert min(max(abs(found[0] - sign * expected), abs(found[1] + sign * expected)) for sign in (1, -1)) < 1e-7


def test_a_pair_of_oscillators():
    """Two complex pairs coincide at CEP2."""
    loop = encircle(PAIR, 0.05, centre=CEP2)
    assert loop.permutation == (1, 0)
    assert all(loop.eigenvalues[0].imag > 0)
    assert abs(loop.winding) == 1
    (point,) = loop.inside
    assert (point.name, point.order, point.winding) == ("CEP2", 2, loop.winding)
    assert point.parameters == pytest.approx(CEP2, abs=1e-9)


def test_symmetric_matrices_with_constant_damping_give_pi():
    """M, D and K symmetric, M and D constant: the phase of an eigenvector with x' (2 s M + D) x = 1 is 0 or π."""
    problem = plane(tmsopt.load(PAIR).model, "w", "k", c1=0.1, c2=CEP2["c2"])
    loop = encircle(problem, 0.1, centre={"w": 1.3, "k": CEP2["k"]})
    assert loop.permutation == (1, 0)
    assert phases(loop) == [pytest.approx(math.pi, abs=1e-9)]


@pytest.mark.parametrize(
    ("model", "value"),
    [
        (from_matrices(A=[[0, "x + 1j*y"], [1, 0]]), 0),
        (from_matrices(M=[[1]], D=[["2j"]], K=[["x + 1j*y - 1"]]), 1),
    ],
)
def test_complex_matrices_have_eigenfrequencies(model, value):
    """s² = z and (s + i)² = −z for z = x + i y; ω = i s."""
    loop = encircle(plane(model, "x", "y"), 1.0)
    assert (loop.permutation, loop.winding, loop.is_complete) == ((1, 0), 1, True)
    assert phases(loop) == [pytest.approx(math.pi, abs=1e-9)]
    assert loop.inside[0].eigenvalue == pytest.approx(value, abs=1e-9)


def test_a_large_chain():
    """40 modes, the first two of which are separate: an EP2 at d = 0, k = 0.4, as in the dimer."""
    H = [[0.0] * 40 for _ in range(40)]
    for i in range(2, 40):
        H[i][i] = 5 + 0.1 * i
        if i < 39:
            H[i][i + 1] = H[i + 1][i] = 0.3
    H[0][0], H[1][1], H[0][1], H[1][0] = "d - 1j", "-0.2j", "k", "k"
    loop = encircle(plane(from_hamiltonian(H), "d", "k"), 0.1, centre={"d": 0.0, "k": 0.4}, starts=2)
    assert [c.members for c in loop.cycles if c.turns > 1] == [(0, 1)]
    assert (loop.phase, loop.winding, loop.is_complete) == (pytest.approx(math.pi, abs=1e-9), 1, True)
    assert loop.inside[0].eigenvalue == pytest.approx(-0.6j, abs=1e-7)


def test_eigenvalues_that_coincide_on_the_loop_are_reported_with_their_place():
    with pytest.raises(
        tmsopt.InputError, match=r"radius: two eigenvalues coincide on the circle, at d = \S+, k = 0\.4"
    ):
        encircle(DIMER, 0.1, centre={"d": 0.0, "k": 0.3})
    with pytest.raises(tmsopt.InputError, match="real double roots form curves"):  # s² + c s + k with c² = 4 k
        encircle(plane(from_matrices(A=[[0, 1], ["-k", "-c"]]), "c", "k"), 0.5, centre={"c": 2.0, "k": 1.0})


@pytest.mark.parametrize(
    "H", [[["x + 1j*y", 0], [0, "x + 1j*y"]], [["x", 0], [0, "(x + abs(x))/2 + 1j*y - 1j*abs(y)"]]]
)
def test_eigenvalues_that_coincide_along_an_arc_end_the_work(H):
    """Everywhere, or where x and y are positive."""
    with pytest.raises(tmsopt.InputError, match="two eigenvalues coincide"):
        encircle(plane(from_hamiltonian(H), "x", "y"), 1.0)


def test_a_curve_of_real_double_roots_inside_has_no_winding_number():
    """A = [[x, 1 − x² − y²], [1, −x]] has s² = 1 − y²: no; with s² = x² + y² − 1 the circle x² + y² = 1 is inside."""
    loop = encircle(plane(from_matrices(A=[[0, "x**2 + y**2 - 1"], [1, 0]]), "x", "y"), 2.0)
    assert (loop.permutation, loop.winding) == ((0, 1), 0)
    (point,) = loop.inside
    assert (point.name, point.winding) == ("EP2", None)
    assert math.hypot(*point.parameters.values()) == pytest.approx(1, abs=1e-9)


def test_a_small_loop_and_few_points_are_enough():
    """Also where the loop passes a point at a distance of 1e-5 radii."""
    for radius in (1e-5, 1e-8):
        assert encircle(DIMER, radius, points=8, starts=0).permutation == (1, 0)
    assert encircle(cubic(), 1.99998, centre={"x": 0.0}, points=8).permutation == (0, 1, 2)
    assert encircle(cubic(), 2.00002, centre={"x": 0.0}, points=8).winding == 2


def test_other_free_parameters_keep_their_values():
    loop = encircle(TRIMER, 0.1, plane=("d1", "gain"), centre={"gain": 1.0, "loss": 1.5})
    assert (loop.parameters["gain"], loop.parameters["loss"]) == (1.0, 1.5)
    assert abs(loop.parameters["d1"]) < 1e-9


def test_a_solution_is_the_centre_and_json_has_the_numbers():
    solution = tmsopt.solve(DIMER)
    loop = encircle(solution)
    assert loop.parameters == solution.parameters
    data = loop.to_json()
    assert data["permutation"] == [1, 0]
    assert data["phase"] == pytest.approx(math.pi)
    assert [(c["members"], c["turns"]) for c in data["cycles"]] == [([0, 1], 2)]
    assert data["inside"][0]["omega"] == pytest.approx([0, -0.6])
    assert (data["inside"][0]["order"], data["winding"], data["complete"]) == (2, 1, True)
    assert encircle(PAIR, centre=CEP2).to_json()["inside"][0]["root"][0] == pytest.approx(0.25)


WRONG = [
    (lambda: encircle(tmsopt.Problem(from_hamiltonian([["x", 1], [1, "2j"]]), free={"x": (0, 1)})), "found 1"),
    (lambda: encircle(plane(from_coefficients([1, "c", "k"]), "c", "k")), "accepted: matrices"),
    (lambda: encircle(DIMER, 0), "radius: found 0; accepted: a positive number"),
    (lambda: encircle(DIMER, 1e-12), "radius: found 1e-12; accepted: 4e-09 or more"),
    (lambda: encircle(DIMER, plane="dk"), "plane: found 'dk'; accepted: two of d k"),
    (lambda: encircle(DIMER, plane=("d", "d")), "plane: found"),
    (lambda: encircle(DIMER, plane=("d", 3)), "plane: found"),
    (lambda: encircle(DIMER, plane=7), "plane: found 7"),
    (lambda: encircle(DIMER, centre={"g1": 2.0}), "centre: found .*accepted: finite numbers for some of d k"),
    (lambda: encircle(DIMER, centre={"k": math.nan}), "centre: found"),
    (lambda: encircle(DIMER, centre=3), "centre: found 3"),
    (lambda: encircle(DIMER, points=3), "points: found 3; accepted: a whole number from 8"),
    (lambda: encircle(DIMER, starts=-1), "starts: found -1"),
    (lambda: encircle(DIMER, progress=3), "progress: found 3"),
    (
        lambda: encircle(plane(from_hamiltonian([["1/x", 1], [1, "1j*y"]]), "x", "y"), 1.0, centre={"x": 1.0}),
        "not defined",
    ),
]


@pytest.mark.parametrize(("call", "said"), WRONG, ids=[said for _, said in WRONG])
def test_wrong_arguments_are_answered_in_words(call, said):
    with pytest.raises(tmsopt.InputError, match=said):
        call()


def test_a_pattern_that_is_not_found_raises_not_solved():
    problem = tmsopt.Problem(from_matrices(A=[[-1, "d"], ["k", -2]]), free={"d": (2, 3), "k": (2, 3)}, locate="EP2")
    with pytest.raises(tmsopt.NotSolved):
        encircle(problem)
