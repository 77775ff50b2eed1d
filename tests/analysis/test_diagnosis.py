"""Diagnosis of multiple roots: matrices with a known Jordan form, and roots that split as closed forms say.

The leading coefficient of a k-fold root that does not lose its derivative is c = −k! ∂p/∂θ / p⁽ᵏ⁾(s0), derived by hand
for each system here; where a law is said to hold, the roots themselves are found at 60 digits by mpmath.
"""

import json
from math import comb, factorial, sqrt

import flint
import numpy as np
import pytest
from helpers.oracles import ep4_of_heights, polynomial_60, roots_60
from helpers.skates import FIXED
from mpmath import mp

import tmsopt
from tmsopt.analysis import Response, diagnose_roots
from tmsopt.models import from_coefficients, from_hamiltonian, from_matrices, tms
from tmsopt.roots import Root, Structure, jordan, structure

# Jordan chains


def conjugated(blocks, rng):
    """S J S⁻¹ of whole numbers, J of Jordan blocks given as (eigenvalue, size), S with determinant 1."""
    n = sum(size for _, size in blocks)
    J = np.zeros((n, n), dtype=int)
    at = 0
    for value, size in blocks:
        J[at : at + size, at : at + size] = value * np.eye(size, dtype=int) + np.eye(size, k=1, dtype=int)
        at += size
    for _ in range(2 * n):
        i, j = rng.choice(n, 2, replace=False)
        sign = int(rng.choice([-1, 1]))
        J[i] += sign * J[j]  # and its inverse from the right
        J[:, j] -= sign * J[:, i]
    return J.tolist()


@pytest.mark.parametrize(
    ("chains", "others"),
    [
        ((1,), (1, 2)),
        ((3,), (1, 1)),
        ((1, 1), (2,)),
        ((2, 1), ()),
        ((2, 1), (1, 1, 2)),
        ((2, 2), (1,)),
        ((3, 2), (1,)),
        ((3, 1, 1), (2,)),
        ((4, 2), ()),
        ((1, 1, 1, 1), (2,)),
        ((6,), (3,)),
    ],
)
def test_chains_of_matrices_with_a_known_jordan_form(chains, others):
    """In any units of the states and of time, which scale rows, columns and the eigenvalue."""
    rng = np.random.default_rng(len(chains))
    for unit in (1.0, 2.0**-20):
        A = conjugated([(-2, c) for c in chains] + [(1 + k, c) for k, c in enumerate(others)], rng)
        states = 2.0 ** rng.integers(-12, 13, len(A))
        scaled = [[-unit * A[i][j] * states[i] / states[j] for j in range(len(A))] for i in range(len(A))]
        pencil = [[[float(i == j) for j in range(len(A))] for i in range(len(A))], scaled]
        found = jordan(
            [[[flint.arb(x) for x in row] for row in P] for P in pencil], flint.acb(-2 * unit), sum(chains), 1e-7
        )
        assert (found.geometric, found.partial) == (len(chains), chains)
        assert found.zero <= 1e-14
        assert found.nonzero >= 1e-9  # of transformations that may be this ill-conditioned


# Newton's polygon


# Systems


def diagnosis_of(model, **design):
    """The one multiple root of a design of a model's first parameter set."""
    return diagnosis_within(model, None, 1e-11, **design)


def diagnosis_within(model, free, tolerance=1e-12, **design):
    """The same for parameters with ranges; two eigenvalues of a complex matrix count as a double 0."""
    found = Structure("EP2", (Root(0.0, 0.0, 2),), 1e-18)
    if not model.is_complex:
        found = structure([float(c) for c in model.coefficients(design, model.sets[0])], tolerance)
    (diagnosis,) = diagnose_roots(model, model.sets[0], design, found, free)
    return diagnosis


def response(diagnosis, name):
    return next(r for r in diagnosis.responses if r.parameter == name)


def test_two_equal_oscillators_are_semisimple():
    """m s² + c s + k twice: two eigenvectors; k₁ moves one root by −k₁ ε/(2 m s + c), and leaves the other."""
    K = [["k1 + kappa", "-kappa"], ["-kappa", "k2 + kappa"]]
    model = from_matrices([["m", 0], [0, "m"]], [["c", 0], [0, "c"]], K)
    found = diagnosis_of(model, m=2.0, c=0.6, k1=7.0, k2=7.0, kappa=0.0)
    s0 = complex(found.re, found.im)
    assert s0 == pytest.approx((-0.6 + sqrt(56 - 0.36) * 1j) / 4, rel=1e-14)
    assert (found.kind, found.algebraic, found.geometric, found.partial) == ("semisimple", 2, 2, (1, 1))
    own = response(found, "k1")
    assert own.unmoved == 1
    assert str(own.laws[0].branches.exponent) == "1"
    assert own.laws[0].branches.constants[0] == pytest.approx(-7 / (4 * s0 + 0.6), rel=1e-12)
    coupled = response(found, "kappa")
    assert not coupled.relative
    assert coupled.unmoved == 1  # both masses together do not feel the spring between them
    assert coupled.laws[0].branches.constants[0] == pytest.approx(-2 / (4 * s0 + 0.6), rel=1e-12)


def test_a_slope_that_is_rounding_moves_nothing():
    """(s + 1)² = x (2y² − 1): at y = √½ in doubles the slope is 2e-16, and at y = √½ none."""
    found = diagnosis_of(from_coefficients([1, 2, "1 - x*(2*y*y - 1)"]), x=0.0, y=sqrt(0.5))
    assert 2 * sqrt(0.5) ** 2 != 1
    assert response(found, "x") == Response("x", False, (), 2)


def test_chains_two_and_one_of_a_threefold_root():
    found = diagnosis_of(from_matrices(A=[[-1, 1, 0], ["d", -1, 0], [0, 0, "f - 1"]]), d=0.0, f=0.0)
    assert (found.kind, found.algebraic, found.geometric, found.partial) == ("partly defective", 3, 2, (2, 1))
    assert [(r.parameter, r.unmoved, str(r.laws[0].branches.exponent)) for r in found.responses] == [
        ("d", 1, "1/2"),
        ("f", 2, "1"),
    ]


def test_a_bare_polynomial_has_one_chain_and_may_move_linearly():
    """(s + 1)² = x²: one chain of a companion matrix, and yet two roots ± x, for ∂p/∂x = 0."""
    found = diagnosis_of(from_coefficients([1, 2, "1 - x**2"]), x=0.0)
    assert (found.geometric, found.jordan, found.kind) == (1, None, "defective")
    law = found.responses[0].laws[0]
    assert str(law.branches.exponent) == "1"
    assert sorted(c.real for c in law.branches.constants) == pytest.approx([-1, 1], rel=1e-12)
    assert "no eigenvectors are known" in str(found)


def test_flutter_of_the_undamped_ziegler_pendulum():
    """2 s⁴ + (7 − 2P) s² + 1 with P = 7/2 − √2: s0⁴ = 1/2 and t² = P ε/4 (masses 2 and 1, springs and length 1)."""
    model = from_matrices(M=[[3, 1], [1, 1]], K=[["2 - P", "P - 1"], [-1, 1]])
    critical = 3.5 - sqrt(2)
    found = diagnosis_of(model, P=critical)
    assert (found.algebraic, found.geometric, found.kind) == (2, 1, "defective")
    assert complex(found.re, found.im) == pytest.approx(1j * 0.5**0.25, rel=1e-14)
    law = found.responses[0].laws[0].branches
    assert (str(law.exponent), law.constants[0]) == ("1/2", pytest.approx(critical / 4, rel=1e-12))


def test_the_law_holds_farther_on_one_side():
    """(s + 1)² = x + 2x²: t is off √x by √(1 + 2x) − 1, so by a tenth at x = 0.105 and at −0.095.

    Sampled are 0.1, which is between them, and 0.1^(5/4).
    """
    (law,) = diagnosis_of(from_coefficients([1, 2, "1 - x - 2*x**2"]), x=0.0).responses[0].laws
    assert (law.below, law.above) == (pytest.approx(10**-1.25), pytest.approx(0.1))


# Points that are met to rounding, or less


def test_a_crossing_that_is_met_to_less_than_its_digits_moves_linearly():
    """[[d, k], [k, −d]] has ω = ±√(d² + k²): a double root at d = k = 0 alone, which coefficients meet to their root."""
    free = {"d": (-1, 1), "k": (-1, 1)}
    diagnosis = diagnosis_within(from_hamiltonian([["d", "k"], ["k", "-d"]]), free, d=-6.5e-10, k=-3.1e-10)
    assert (diagnosis.kind, diagnosis.eigenfrequency) == ("semisimple", 0)
    for answer in diagnosis.responses:
        (law,) = answer.laws
        assert (answer.relative, str(law.branches.exponent), law.branches.roots) == (False, "1", 2)
        assert law.branches.prefactor == pytest.approx(1, rel=1e-12)


def test_equal_oscillators_that_are_met_to_their_sixth_digit_move_linearly():
    """k₂ moves one root by k ε/(2 √(k − c²/4)), and the other stays; the polynomial is 1e-13 from a double pair."""
    model = from_matrices([["m", 0], [0, 1]], [["c", 0], [0, "c"]], [["k1", 0], [0, "k2"]])
    diagnosis = diagnosis_within(model, {"k2": (1, 3)}, m=1.0, c=0.1, k1=2.0, k2=2.0000009)
    assert (diagnosis.kind, diagnosis.geometric, diagnosis.partial) == ("semisimple", 2, (1, 1))
    assert diagnosis.im == pytest.approx(sqrt(2 - 0.0025), rel=1e-14)
    (law,) = response(diagnosis, "k2").laws
    assert (str(law.branches.exponent), law.branches.roots, response(diagnosis, "k2").unmoved) == ("1", 1, 1)
    assert law.branches.prefactor == pytest.approx(1 / sqrt(2 - 0.0025), rel=1e-9)


def test_a_singular_exceptional_point_moves_linearly():
    """[[a + ib, 1], [0, 0]] has ω = a + ib and 0, one Jordan block at a = b = 0."""
    free = {"a": (-1, 1), "b": (-1, 1)}
    diagnosis = diagnosis_within(from_hamiltonian([["a + 1j*b", 1], [0, 0]]), free, a=5.2e-8, b=6e-30)
    assert (diagnosis.geometric, diagnosis.eigenfrequency) == (1, 0)
    for answer in diagnosis.responses:
        (law,) = answer.laws
        assert (answer.relative, str(law.branches.exponent), law.branches.prefactor) == (False, "1", pytest.approx(1))
        assert (answer.unmoved, answer.unresolved) == (1, 0)


def test_what_has_no_power_series_is_not_resolved():
    """(s + 1)² = √x + y: at x = 0 the slope in x is infinite."""
    found = diagnosis_of(from_coefficients([1, 2, "1 - sqrt(x) - y"]), x=0.0, y=0.0)
    assert response(found, "x") == Response("x", False, (), 0, 2)
    assert str(response(found, "y").laws[0].branches.exponent) == "1/2"
    assert "not resolved for x" in " ".join(str(found).split())


def test_orders_beyond_ten_count():
    """(s + 1)¹² + x¹¹ − y: by x the roots move as ε^(11/12), by y as ε^(1/12)."""
    binomials = [comb(12, k) for k in range(12)]
    found = diagnosis_of(from_coefficients([*binomials, "1 + x**11 - y"]), x=0.0, y=0.0)
    assert [str(response(found, n).laws[0].branches.exponent) for n in "xy"] == ["11/12", "1/12"]


def test_every_parameter_is_listed_with_its_law_by_how_far_it_moves_the_root():
    """(s + 1)² = a + 4b + c²: t² = 4ε moves farther than t² = ε, and t = ±ε least."""
    found = diagnosis_of(from_coefficients([1, 2, "1 - a - 4*b - c**2"]), a=0.0, b=0.0, c=0.0)
    assert [r.parameter for r in found.responses] == ["b", "a", "c"]
    line = " ".join(str(found).split())
    assert "of b moves it by 2 ε^(1/2)" in line
    assert "a (absolute) by 1 ε^(1/2)" in line
    assert "c (absolute) by 1 ε" in line


# The EP4 of the two-mass-skate bicycle


def ep4():
    """The closed form for χ_H = 1, rounded to doubles."""
    with mp.workdps(40):
        at = ep4_of_heights(mp.mpf("-0.4"), mp.mpf("-0.2"))
        return FIXED | {"Fr": float(at["Fr"]), "chi_B": float(at["chi_B"]), "lambda_s": float(mp.atan(at["T"]))}


@pytest.fixture(scope="module")
def bicycle():
    return diagnosis_of(tms, **ep4())


def changed(design, name, eps):
    with mp.workdps(80):
        return {**{n: mp.mpf(x) for n, x in design.items()}, name: mp.mpf(design[name]) * (1 + mp.mpf(eps))}


def test_the_bicycle_has_one_chain_of_four(bicycle):
    assert (bicycle.kind, bicycle.algebraic, bicycle.geometric, bicycle.partial) == ("defective", 4, 1, (4,))
    assert bicycle.re == pytest.approx(-(0.08 ** (-0.25)), rel=1e-15)
    assert bicycle.jordan.zero < 1e-15
    assert bicycle.jordan.nonzero > 1e-2


@pytest.mark.parametrize("name", ["Fr", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s"])
def test_the_leading_coefficient_is_that_of_the_closed_form(bicycle, name):
    """−4! θ ∂p/∂θ / p⁗ by differences of the 60-digit polynomial: the rounded design costs 1e-15, so 1e-13."""
    with mp.workdps(60):
        ahead, back = (polynomial_60(**changed(ep4(), name, eps)) for eps in (1e-12, -1e-12))
        slope = [(a - b) / mp.mpf(2e-12) for a, b in zip(ahead, back, strict=True)]
        p = polynomial_60(**changed(ep4(), name, 0))
        expected = -factorial(4) * mp.polyval(slope, mp.mpf(bicycle.re)) / (factorial(4) * p[0])
    (law,) = response(bicycle, name).laws
    assert str(law.branches.exponent) == "1/4"
    # but for the factor ν_H of the matrices, which vanishes from ratios only where p does: s0 is off by 1e-16
    assert law.branches.constants[0] == pytest.approx(float(expected), rel=1e-10)


@pytest.mark.parametrize("name", ["Fr", "zeta_H"])
def test_the_law_holds_as_far_as_said_and_no_further(bicycle, name):
    """Roots at 60 digits of the design that is stored, whose own rounding splits them far less than the change."""
    (law,) = response(bicycle, name).laws
    for sign, end in ((-1, law.below), (1, law.above)):
        assert off(bicycle, name, sign * end) <= 0.1
        assert off(bicycle, name, sign * end * 10**0.25) > 0.1
        assert off(bicycle, name, sign * end * 1e-3) < 0.05


def off(bicycle, name, eps):
    """The largest relative deviation of a root's shift from the law."""
    shifts = [complex(z) - bicycle.re for z in roots_60(polynomial_60(**changed(ep4(), name, eps)))]
    law = response(bicycle, name).laws[0].branches
    return max(min(abs(t - z) for z in shifts) / abs(t) for t in law.shifts(eps))


def test_the_mass_ratio_does_not_move_it(bicycle):
    """At χ_H = 1 the polynomial does not depend on μ."""
    assert response(bicycle, "mu") == Response("mu", True, (), 4)
    assert bicycle.responses[-1].parameter == "mu"


# From a solution


def test_a_solution_says_what_its_multiple_root_is():
    solution = tmsopt.solve("problems/ep4.toml")
    (found,) = tmsopt.diagnose(solution)
    assert (found.kind, found.partial) == ("defective", (4,))
    assert json.loads(json.dumps(found.to_json(), allow_nan=False))["responses"][0]["laws"][0]["exponent"] == "1/4"
    text = " ".join(str(found).split())
    assert text.startswith("4-fold root -1.8803015: defective, Jordan chain of length 4 (1 independent eigenvector")
    assert "ε^(1/4)" in text


def test_a_root_that_is_a_rounded_zero_has_its_ranks():
    """The stored trimer has all eigenfrequencies at 1e-14; H has rank 2 there, in closed form."""
    (diagnosis,) = tmsopt.diagnose(tmsopt.solve("problems/pt_trimer.toml"))
    assert diagnosis.jordan is not None
    assert (diagnosis.algebraic, diagnosis.geometric, diagnosis.partial) == (3, 1, (3,))


def test_how_an_EP4_of_large_matrices_splits():
    """i g S_z + S_x of spin 3/2, next to six other modes: s² = (g² − 1) m², so s⁴ has no term of order 1 in g − 1;
    a coupling e of the ends moves all four by t⁴ = c ε, from the characteristic polynomial of the block."""
    block = [["1.5j*g", "sqrt(3)/2", 0, "e"], ["sqrt(3)/2", "0.5j*g", 1, 0]]
    block += [[0, 1, "-0.5j*g", "sqrt(3)/2"], ["e", 0, "sqrt(3)/2", "-1.5j*g"]]
    rows = [[*row, *[0] * 6] for row in block] + [[0] * (4 + k) + [5 + k] + [0] * (5 - k) for k in range(6)]
    (found,) = tmsopt.diagnose(tmsopt.Problem(from_hamiltonian(rows), fixed={"g": 1.0, "e": 0.0}))
    responses = {r.parameter: r for r in found.responses}
    (law,) = responses["e"].laws
    # det(ω − H) = ω⁴ − 2 e t₁ t₂ t₃ + … with the couplings √3/2, 1, √3/2, and s⁴ = ω⁴
    assert law.branches.constants[0] == pytest.approx(1.5, rel=1e-9)
    assert (law.branches.roots, law.branches.denominator, responses["g"].laws) == (4, 4, ())
    assert responses["g"].unresolved == 4
