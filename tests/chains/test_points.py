"""Exceptional points of matrices by Jordan chains: where they are in closed form, and where there are none."""

import math
from dataclasses import replace
from importlib import import_module

import flint
import numpy as np
import pytest

import tmsopt
from tmsopt.algebra import ProofFailed
from tmsopt.chains import family_of, find_discriminant, find_point, measure_point, targets_of
from tmsopt.models import from_coefficients, from_hamiltonian, from_matrices
from tmsopt.problem import find_symmetry

chain_equations = import_module("tmsopt.global_search.chain_equations")

EXACT = 1e-14  # some roundings


def spin(n):
    """S_x + i g S_z: all n eigenfrequencies are ±m √(1 − g²), 0 at g = 1."""
    S = (n - 1) / 2
    H = [[0] * n for _ in range(n)]
    for i in range(n):
        m = S - i
        H[i][i] = f"1j*g*{m}"
        if i + 1 < n:
            H[i][i + 1] = H[i + 1][i] = f"sqrt({round(S * (S + 1) - m * (m - 1))})/2"
    return H


def point_of(H, free, locate, fixed=None, start=0.5):
    problem = tmsopt.Problem(from_hamiltonian(H), fixed=fixed or {}, free=free, locate=locate).posed
    family, targets = family_of(problem), targets_of(locate, is_complex=True)
    low, high = family.box.T
    return find_point(family, targets, low + start * (high - low)), family, targets


@pytest.mark.parametrize("n", [2, 3, 4, 10, 20])
@pytest.mark.parametrize("start", [0.1, 0.8])
def test_all_eigenvalues_of_a_spin_meet(n, start):
    point, *_ = point_of(spin(n), {"g": (0.2, 2.0)}, f"EP{n}", start=start)
    assert point is not None
    assert point.is_found
    assert abs(point.p[0] - 1) <= EXACT
    assert point.chains[0].order == n


@pytest.mark.parametrize(
    ("H", "free", "locate"),
    [
        ([["d", "k"], ["k", "-d"]], {"d": (-1, 1), "k": (-1, 1)}, "EP2"),  # Hermitian
        ([["a + 1j*b", 0], [0, "0.3 - 0.1j"]], {"a": (-1, 1), "b": (-1, 1)}, "EP2"),  # uncoupled
        ([["1j*g", 1, 0], [1, "-1j*g", 0], [0, 0, "d"]], {"g": (0.2, 2), "d": (-1, 1)}, "EP3"),  # EP2 beside a mode
        ([["1j*g", 1, 0, 0], [1, "-1j*g", 0, 0], [0, 0, "1j*g", 1], [0, 0, 1, "-1j*g"]], {"g": (0.2, 2)}, "EP4"),
        ([[[0, 1, 0, 0, 0, "r"][j - i] for j in range(6)] for i in range(6)], {"r": (0.2, 2)}, "EP2"),  # normal
    ],
)
def test_where_eigenvectors_do_not_meet_there_is_none(H, free, locate):
    found = tmsopt.solve(tmsopt.Problem(from_hamiltonian(H), free=free, locate=locate), throw=False)
    assert found.status != "optimal"


def test_eigenvalues_that_are_always_equal_are_not_brought_together():
    """A PT dimer has its EP2 at g = 1; three modes without coupling have the eigenfrequency 0 for all g."""
    H = [["1j*g", 1, 0, 0, 0], [1, "-1j*g", 0, 0, 0], *([[0] * 5] * 3)]
    point, *_ = point_of(H, {"g": (0.2, 3)}, "EP2", start=0.9)
    assert point is not None
    assert abs(point.p[0] - 1) <= EXACT


@pytest.mark.parametrize("start", [0.37, 0.8])
def test_the_eigenvalues_that_cross_are_not_mistaken_for_those_that_become_defective(start):
    """Twenty masses in a row between springs: mode k has its critical damping at c = 2 √(1 + 4 sin²(kπ/42)).

    Overdamped eigenvalues of two modes cross. They are nearer to each other, but keep their eigenvectors.
    """
    n = 20
    M = np.eye(n).tolist()
    D = [["c" if i == j else 0 for j in range(n)] for i in range(n)]
    K = (3 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)).tolist()
    posed = tmsopt.Problem(from_matrices(M=M, D=D, K=K), free={"c": (0.5, 6)}, locate="EP2").posed
    point = find_point(family_of(posed), targets_of("EP2", is_complex=False), np.array([0.5 + 5.5 * start]))
    critical = 2 * np.sqrt(1 + 4 * np.sin(np.arange(1, n + 1) * np.pi / (2 * n + 2)) ** 2)
    assert point is not None
    assert point.is_found
    assert np.abs(critical - point.p[0]).min() <= 4 * EXACT
    assert point.steps[0] <= 5


def test_an_ep3_is_not_two_ep2():
    """The equations of both chains hold at the EP3 of a trimer, √2; the fourth eigenvalue stays at 5."""
    H = [["d1 + 1j*a", 1, 0, 0], [1, 0, 1, 0], [0, 1, "d3 - 1j*b", 0], [0, 0, 0, 5]]
    free = {"a": (1.3, 1.5), "b": (1.3, 1.5), "d1": (-0.2, 0.2), "d3": (-0.2, 0.2)}
    problem = tmsopt.Problem(from_hamiltonian(H), free=free, locate="EP2+EP2")
    assert not tmsopt.solve_all(problem, seconds=0, starts=12).solutions


def test_dependent_vectors_are_no_chain():
    """At a simple eigenvalue with x₁ = 0 the values F₀ = 0 and F₁ = −1 are no small change of the matrix away."""
    _, family, targets = point_of([["x", 0], [0, "0.3 - 0.1j"]], {"x": (-1, 1)}, "EP2")
    point = measure_point(family, targets, np.array([0.0]))
    assert point is None or not point.is_found


@pytest.mark.parametrize(
    ("system", "free", "locate", "expected"),
    [
        (from_matrices([[1]], [["c"]], [[4]]), {"c": (0.5, 9)}, "EP2", {"c": 4.0}),
        (from_matrices([[1, 0], [0, 1]], None, [[1, "p"], ["-p", 2]]), {"p": (0.1, 1.0)}, "CEP2", {"p": 0.5}),
        (from_coefficients([1, "2j*b", -4]), {"b": (0.5, 5)}, "EP2", {"b": 2.0}),  # (s + 2i)² = s² + 4 i s − 4
        (from_matrices(A=[["1j*g", 1], [-1, "-1j*g"]]), {"g": (-3.0, 3.0)}, "EP2", None),  # −g² − 1 never vanishes
        (from_matrices([[1]], [["2j*b"]], [[-4]]), {"b": (0.5, 5)}, "EP2", {"b": 2.0}),
    ],
)
def test_systems_of_every_kind(system, free, locate, expected):
    found = tmsopt.solve(tmsopt.Problem(system, free=free, locate=locate), throw=False)
    assert (found.status == "optimal") is (expected is not None)
    for name, x in (expected or {}).items():
        assert abs(found.parameters[name] - x) <= EXACT * abs(x)


PT = [["1j*g", "k"], ["k", "-1j*g"]]


@pytest.mark.parametrize(
    ("H", "order", "fixed", "expected"),
    [
        (PT, 2, {"k": 1.0}, (2, 1)),
        ([["w - 1j*g", "k"], ["k", "w"]], 2, {"k": 1.0, "w": 5.0}, (2, 1)),
        ([["0.1 + 1j*g", "k"], ["k", "-1j*g"]], 2, {"k": 1.0}, (2, 0)),
        (spin(3), 3, {}, (4, 3)),
        (spin(5), 5, {}, (8, 6)),
    ],
)
def test_conditions_that_hold_by_symmetry(H, order, fixed, expected):
    """Counted by hand: 2 (k − 1), half of them for a real polynomial, every second coefficient if it is even or odd."""
    problem = tmsopt.Problem(from_hamiltonian(H), fixed=fixed, free={"g": (0.1, 3.0)}, locate=f"EP{order}").posed
    freedom = tmsopt.problem.degrees_of_freedom(problem)
    assert problem.pattern is not None
    assert (problem.pattern.codimension, freedom.by_symmetry) == expected


def test_a_hermitian_matrix_has_no_point_and_says_so():
    problem = tmsopt.Problem(
        from_hamiltonian([["d", "k + 1j*d"], ["k - 1j*d", 1]]), free={"d": (-1, 1), "k": (-1, 1)}, locate="EP2"
    )
    assert find_symmetry(problem.posed).is_hermitian
    assert "Hermitian" in " ".join(tmsopt.solve(problem, throw=False, starts=2).notes)


@pytest.mark.parametrize(
    ("model", "free", "locate", "value"),
    [
        (from_hamiltonian([["2*exp(1j*q)", 1], [1, "2*exp(-1j*q)"]]), {"q": (0.1, 1.4)}, "EP2", math.pi / 6),
        (
            from_matrices(M=[[1, 0], [0, 1]], D=[["0.1", 0], [0, "-0.1"]], K=[[1, "e"], ["e", 1]]),
            {"e": (0.01, 0.5)},
            "CEP2",
            0.1 * 0.9975**0.5,
        ),
        (from_matrices(M=[[1, 0], [0, 1]], D=[[0, "g"], ["-g", 0]], K=[[-1, 0], [0, -4]]), {"g": (2, 4)}, "CEP2", 3),
    ],
    ids=["phases, 2 sin q = 1", "balanced gain and loss", "gyroscopes, (s² + 2)²"],
)
def test_one_of_two_conditions_holds_by_symmetry(model, free, locate, value):
    found = tmsopt.solve(tmsopt.Problem(model, free=free, locate=locate))
    assert found.parameters[next(iter(free))] == pytest.approx(value, abs=EXACT)
    assert found.conditions == {"real": 2, "by_symmetry": 1}
    assert tmsopt.prove(found).proved


@pytest.mark.parametrize(("H", "order", "g"), [(PT, 2, 1.0), pytest.param(spin(3), 3, 1.0, marks=pytest.mark.slow)])
def test_one_parameter_is_enough_and_proved(H, order, g):
    fixed = {"k": 1.0} if H is PT else {}
    problem = tmsopt.Problem(from_hamiltonian(H), fixed=fixed, free={"g": (0.1, 3.0)}, locate=f"EP{order}")
    found = tmsopt.solve(problem)
    proof = tmsopt.prove(found)
    assert proof.proved, proof.reason
    assert proof.geometric_multiplicity == 1
    assert abs(float(proof.parameters["g"].value) - g) <= EXACT


def test_a_fixed_number_that_breaks_the_symmetry_is_no_proof():
    """With a loss 1e-17 above the gain no real g gives a double eigenfrequency, though it rounds to one that does."""
    uneven = from_hamiltonian([["1j*g", "k"], ["k", "-1j*g*r"]])
    found = tmsopt.solve(tmsopt.Problem(uneven, fixed={"k": 1.0, "r": 1.0}, free={"g": (0.1, 3.0)}, locate="EP2"))
    assert tmsopt.prove(found, exact={"r": "1"}).proved
    assert not tmsopt.prove(found, exact={"r": "1.00000000000000001"}).proved


def test_the_part_of_an_equation_that_symmetry_leaves_must_not_vanish():
    gyroscopic = from_matrices(M=[[1, 0], [0, 1]], D=[[0, "g"], ["-g", 0]], K=[[-1, 0], [0, -4]])
    problem = tmsopt.Problem(gyroscopic, free={"g": (2.0, 4.0)}, locate="CEP2").posed
    found = tmsopt.solve(problem)
    system = chain_equations.build_chain_equations(problem, problem.pattern, found.parameters)
    start = {n: flint.arb(x) for n, x in found.parameters.items()} | next(system.start_values())
    system.check(start)
    (phase,) = system.phases
    with pytest.raises(ProofFailed, match="phase"):
        replace(system, phases=(1j * phase,)).check(start)


def test_all_points_of_a_pt_dimer_and_its_curve():
    dimer = from_hamiltonian(PT)
    every = tmsopt.solve_all(tmsopt.Problem(dimer, fixed={"k": 1.0}, free={"g": (-3, 3)}, locate="EP2"))
    assert every.complete
    assert sorted(s.parameters["g"] for s in every.solutions) == pytest.approx([-1, 1], abs=EXACT)
    (branch,) = tmsopt.trace(tmsopt.Problem(dimer, free={"g": (0.1, 3), "k": (0.1, 3)}, locate="EP2")).branches
    assert np.abs(branch.parameters["g"] - branch.parameters["k"]).max() <= 1e-12
    assert branch.eigenfrequency is not None
    assert np.abs(branch.eigenfrequency["omega_re"]).max() <= 1e-12


def test_irrational_constants_are_proved_with_all_numbers():
    """At g = k = √2 the double eigenfrequency is 0; a ball around 0 has a square."""
    dimer = tmsopt.Problem(from_hamiltonian(PT), fixed={"k": "sqrt(2)"}, free={"g": (0.1, 3)}, locate="EP2")
    proof = tmsopt.prove(dimer)
    assert proof.proved
    assert proof.abscissa is not None
    assert abs(float(proof.abscissa.value)) < 1e-30
    assert [root.multiplicity for root in proof.eigenfrequencies] == [2]


def pencil(n, seed, low):
    rng = np.random.default_rng(seed)
    parts = rng.integers(-200, 201, (2, 2, n, n))
    H0, H1 = (a + 1j * b for a, b in parts)
    entries = [
        [f"({a} + (x + 1j*y)*({b}))/100" for a, b in zip(*rows, strict=True)] for rows in zip(H0, H1, strict=True)
    ]
    free = {"x": (low, 2.0), "y": (low, 2.0)}
    return tmsopt.Problem(from_hamiltonian(entries), free=free, locate="EP2"), H0, H1


@pytest.mark.parametrize(("n", "low"), [(2, -2.0), (3, -2.0), (3, 0.0), (4, -2.0)])
def test_all_points_of_a_pencil(n, low):
    """The zeros of the discriminant, by balls: a resultant at n (n − 1) + 1 points, independent of the eigenvalues."""
    problem, H0, H1 = pencil(n, seed=n, low=low)
    discriminant = find_discriminant(problem.posed)
    assert discriminant is not None
    assert discriminant.degree == len(discriminant.zeros) == n * (n - 1)
    every = tmsopt.solve_all(problem)
    assert every.complete
    assert all(every.proved)
    assert every.completeness is not None
    assert every.completeness.total == n * (n - 1)
    inside = [z for z in discriminant.zeros if all(low < x < 2 for x in z)]
    assert len(every.solutions) == len(inside)
    for solution in every.solutions:
        z = complex(solution.parameters["x"], solution.parameters["y"])
        p = flint.acb_mat([[flint.acb(a + z * b) for a, b in zip(*r, strict=True)] for r in zip(H0, H1, strict=True)])
        with flint.ctx.workdps(60):
            polynomial = p.charpoly()
            slopes = [polynomial.derivative()(root) for root in polynomial.roots()]
        size = float(np.linalg.norm(H0 + z * H1, 2)) ** (n - 1)
        assert min(float(abs(x).mid()) for x in slopes) <= 1e-6 * size  # the root of the roundings of z


def test_a_family_that_is_not_analytic_has_no_count():
    problem = tmsopt.Problem(from_hamiltonian([["x", 1], ["1j*y", 0]]), free={"x": (-1, 1), "y": (-1, 1)}, locate="EP2")
    assert find_discriminant(problem.posed) is None


def test_a_long_chain_is_located_and_proved():
    """Of Hatano and Nelson, with a complex energy at one end; the eigenvalues are those of NumPy."""
    n = 30
    H = [[0] * n for _ in range(n)]
    for i in range(n - 1):
        H[i][i + 1], H[i + 1][i] = "1.1", "0.9"
    H[0][0] = "x + 1j*y"
    problem = tmsopt.Problem(from_hamiltonian(H), free={"x": (-3, 3), "y": (0.1, 3)}, locate="EP2")
    found = tmsopt.solve(problem)
    matrix = np.array([[complex(str(e).replace("x + 1j*y", "0")) for e in row] for row in H])
    matrix[0, 0] = complex(found.parameters["x"], found.parameters["y"])
    s = np.linalg.eigvals(matrix)
    gaps = np.abs(s[:, None] - s)[~np.eye(n, dtype=bool)]
    assert gaps.min() < 1e-6  # one pair meets, to the root of the roundings
    assert np.sort(gaps)[2] > 1e-3
    assert tmsopt.prove(found).proved


def test_an_exceptional_point_beside_a_diabolic_one_is_told_apart():
    """[[i g, k], [k, −i g]] has an EP2 at g = k however small k is, and a diabolic point at g = k = 0."""
    problem = tmsopt.Problem(from_hamiltonian(PT), fixed={"k": 1e-6}, free={"g": (-1.0, 1.0)}, locate="EP2")
    found = tmsopt.solve(problem)
    assert abs(abs(found.parameters["g"]) - 1e-6) <= 1e-20
    assert found.to_json()["geometric_multiplicity"] == 1
    assert math.isclose(found.abscissa, 0.0, abs_tol=1e-12)


@pytest.mark.parametrize("start", [(-0.3, 0.2), (0.4, 0.35)])
def test_an_exceptional_point_next_to_a_diabolic_one(start):
    """(u + i g c) σ₁ + (v + i g s) σ₃ has its EP2 at ±g (−s, c), a distance g from a diabolic point for g = 0."""
    g, c, s = 1e-6, 0.6, 0.8
    B = [[f"v + {g * s!r}j", f"u + {g * c!r}j"], [f"u + {g * c!r}j", f"-v - {g * s!r}j"]]
    S, inverse = [[1, 0], [7, 1]], [[1, 0], [-7, 1]]  # a similarity, because normal matrices are easier
    H = [
        [" + ".join(f"({S[i][k] * inverse[m][j]})*({B[k][m]})" for k in (0, 1) for m in (0, 1)) for j in (0, 1)]
        for i in (0, 1)
    ]
    problem = tmsopt.Problem(from_hamiltonian(H), free={"u": (-0.5, 0.5), "v": (-0.5, 0.5)}, locate="EP2").posed
    point = find_point(family_of(problem), targets_of("EP2", is_complex=True), np.array(start))
    assert point.is_found
    assert np.abs(point.p) == pytest.approx((g * s, g * c), rel=1e-6)
    assert point.p[0] * point.p[1] < 0


@pytest.mark.parametrize(
    ("H", "order", "g"),
    [
        ([["1j*g", 1, 0], [1, 0, 1], [0, 1, "-1j*g"]], 3, 2**0.5),  # ω (ω² + g² − 2)
        (spin(4), 4, 1.0),
    ],
)
def test_where_a_symmetry_makes_the_order_higher_the_point_has_the_higher_order(H, order, g):
    """There is no EP2: all eigenfrequencies coincide at once. Computed ones are off by 1e-5 and 3e-4 there."""
    found = tmsopt.solve(tmsopt.Problem(from_hamiltonian(H), free={"g": (0.0, 2.0)}, locate="EP2"))
    assert found.parameters["g"] == pytest.approx(g, abs=EXACT)
    assert found.structure == f"EP{order}"


def test_a_singular_mass_leaves_the_polynomial():
    """(s² + c s + 1)(s + 1) = 0.3² has a double root at c = 2.274895, s = −1.407904."""
    model = from_matrices(M=[[1, 0], [0, 0]], D=[["c", 0], [0, 1]], K=[[1, 0.3], [0.3, 1]])
    found = tmsopt.solve(tmsopt.Problem(model, free={"c": (0, 5)}, locate="EP2"))
    c = found.parameters["c"]
    roots = np.roots(np.polysub(np.polymul([1, c, 1], [1, 1]), [0.09]))  # (s² + c s + 1)(s + 1) − 0.3²
    assert sorted(np.abs(np.diff(np.sort_complex(roots))))[0] <= 1e-6
    assert tmsopt.prove(found).proved


def test_an_ep2_in_small_units_is_defective():
    dimer = from_hamiltonian([["1e-9j*g", 1e-9], [1e-9, "-1e-9j*g"]])
    (diagnosis,) = tmsopt.diagnose(tmsopt.solve(tmsopt.Problem(dimer, free={"g": (0.1, 3.0)}, locate="EP2")))
    assert (diagnosis.geometric, diagnosis.kind) == (1, "defective")


def test_a_part_alone_makes_no_symmetry():
    """S = diag(0, 0, 1) has S H̄ = H S, but is singular: the conjugate eigenfrequencies are others."""
    H = [["1 + 1j*g", 0, 0], [0, "2 - 1j*g", 0], [0, 0, -3]]
    problem = tmsopt.Problem(from_hamiltonian(H), free={"g": (0.1, 3)}, locate="EP2")
    assert not find_symmetry(problem.posed).is_real
