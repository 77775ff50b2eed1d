"""The closed-form laws against the paper's printed numbers, exact algebra and 60-digit arithmetic.

An EP4 or EP2 is judged by its coefficients, in exact arithmetic on the very floats the law returned, never by
recomputed roots: those scatter by 4e-4 around a four-fold root.
"""

import inspect
from fractions import Fraction
from math import comb

import numpy as np
import pytest
import sympy
from helpers import curves, oracles
from helpers.designs import wide_designs
from hypothesis import assume, given, settings, strategies as st
from mpmath import mp

from tmsopt import laws

ZB, ZH = -0.4, -0.2  # the heights of every design in the paper
EP4_TILT = np.arctan(15 / 4 - 75 / 32 * np.sqrt(2))  # Table 1

repeatable = settings(max_examples=60, deadline=None, derandomize=True)
depth = st.floats(-2.0, -0.05)
tangent = st.floats(0.05, 5.0)


@pytest.fixture(autouse=True, scope="module")
def _sixty_digits():
    """Arithmetic on what the oracles return keeps their digits."""
    with mp.workdps(60):
        yield


def designs(count, seed):
    """Random designs of both signs of lambda_s, half of them with chi_H near 1, as floats."""
    rng, found = np.random.default_rng(seed), wide_designs(seed, count)
    near = rng.uniform(size=count) < 0.5
    return {**found, "chi_H": np.where(near, rng.uniform(0.8, 1.2, count), found["chi_H"])}


def one(parameters, i):
    return {name: float(values[i]) for name, values in parameters.items()}


def exact(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, lambda_s):
    """Exact coefficients, with the double that NumPy takes for the tangent."""
    return oracles.polynomial_exact(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, np.tan(lambda_s))


EXPRESSIONS, SYMBOLS = oracles.symbolic_copo()
TERM_SIZES = [sympy.lambdify(list(SYMBOLS.values()), sum(map(abs, e.args))) for e in EXPRESSIONS]


def term_sizes(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T):
    """Sum of the absolute terms of each coefficient: what rounding of the parameters is relative to."""
    return [float(size(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T)) for size in TERM_SIZES]


def ep4_defect(design, mu, chi_H, zeta_B, zeta_H):
    """Largest |a_i - a0 C(4, i) (-omega0)^i| over the sizes of the terms in it, computed exactly."""
    values = (design.Fr, mu, design.chi_B, chi_H, zeta_B, zeta_H, design.tan_lambda_s)
    a, sizes = oracles.polynomial_exact(*values), term_sizes(*values)
    powers = [comb(4, i) * Fraction(-float(design.omega0)) ** i for i in range(5)]
    return max(abs(float(a[i] - a[0] * powers[i])) / (sizes[i] + sizes[0] * float(abs(powers[i]))) for i in range(5))


# The polynomial


def test_the_printed_coefficients_are_the_determinant():
    """`copo` against det(M s^2 + V s + P)/(mu nu_H cos) from the printed matrices, at 60 digits."""
    parameters = designs(100, seed=1)
    a = laws.copo(**parameters)
    for i in range(100):
        design = one(parameters, i)
        sizes = term_sizes(*list(design.values())[:-1], np.tan(design["lambda_s"]))
        for mine, true, size in zip(a[:, i], oracles.polynomial_60(**design), sizes, strict=True):
            # a dozen roundings; the tangent of a tilt below 72 degrees loses no more
            assert abs(float(mine - true)) <= 16 * np.finfo(float).eps * size


def test_matrices_give_copo():
    p = designs(50, seed=2)
    M, V, P = laws.matrices(**p)
    cos, sin = np.cos(p["lambda_s"]), np.sin(p["lambda_s"])
    common = p["mu"] * ((p["chi_H"] - 1) * cos - p["zeta_H"] * sin) * cos
    for s in (0.7, -1.3 + 0.4j):
        L = M * s**2 + V * s + P
        assert L.shape == (50, 2, 2)
        off = np.linalg.det(L) - np.polyval(laws.copo(**p), s) * common
        assert np.all(abs(off) < 1e-13 * np.linalg.norm(L, axis=(1, 2)) ** 2)


# Printed numbers; those with decimals are in the ledger of the paper


@pytest.mark.parametrize(
    ("value", "printed"),
    [
        (laws.w01(ZB, ZH), -np.sqrt(5) / 2**0.25),
        (laws.chib1(ZB, ZH), np.sqrt(2)),
        (laws.tls(ZB, ZH), 15 / 4 - 75 / 32 * np.sqrt(2)),
        (laws.frm(ZB, ZH, EP4_TILT), np.sqrt(30 * np.sqrt(2) + 120) / 8),
        (laws.frep4(ZB, ZH)[0], 3 * np.sqrt(110 * np.sqrt(2) - 120) / 8),
        (laws.epset(ZB, ZH, EP4_TILT), 3 * np.sqrt(110 * np.sqrt(2) - 120) / 8),
    ],
    ids=["omega0", "chi_B", "tan lambda_s", "Fr_c", "Fr_EP4", "EP4 on the EP set"],
)
def test_printed_radicals(value, printed):
    """Table 1, first row."""
    assert value == pytest.approx(printed, rel=1e-14)  # some ten roundings


def test_the_benchmark_equations_are_the_general_ones():
    """`e1`, `e2`, `e3` are a2 - 6 a0, a4 - a0, p(-1) with exact decimals: they differ by rounding only."""
    rng = np.random.default_rng(3)
    Fr, mu, lambda_s = rng.uniform(0, 4, 20), rng.uniform(0, 30, 20), rng.uniform(0, 1.2, 20)
    a = laws.copo(Fr, mu, 1.19, 1.02, ZB, ZH, lambda_s)
    for law, general in (
        (laws.e1(Fr, mu, lambda_s), a[2] - 6 * a[0]),
        (laws.e2(mu, lambda_s), a[4] - a[0]),
        (laws.e3(Fr, mu, lambda_s), np.polyval(a, -1)),
    ):
        assert np.allclose(law, general, rtol=0, atol=1e-14)
    assert np.allclose(laws.e1(Fr, mu, lambda_s), ZB * laws.a2(Fr, mu, 1.02, ZB, ZH, lambda_s, -1), atol=1e-14)


# Stability


def test_flus_is_where_the_60_digit_determinant_vanishes():
    """Every chi_H, both signs of lambda_s; where the square is negative there is no root to find."""
    parameters = designs(30, seed=4)
    del parameters["Fr"]
    squares = laws.flus(**parameters)
    inside = (squares > 1e-6) & (squares < 1e6)
    assert 7 < inside.sum() < 23
    for i in range(30):
        found = oracles.weave_Fr_60(**one(parameters, i))
        if inside[i]:
            assert laws.Fr_c(**one(parameters, i)) == pytest.approx(float(found), rel=1e-12)
        else:
            assert found is None


def test_stability_begins_at_Fr_c():
    """The paper's claim, decided by 60-digit roots 1e-8 of it below and above; both classes of design."""
    parameters = designs(4000, seed=5)
    above = laws.lscf_complete(**parameters)
    assert {-1.0, 1.0} == set(np.sign(parameters["lambda_s"][above]))
    for i in np.flatnonzero(above)[:16]:
        design = one(parameters, i)
        del design["Fr"]
        Fr = laws.Fr_c(**design)
        assert oracles.is_stable_60(oracles.polynomial_60(Fr * (1 + 1e-8), **design))
        assert not oracles.is_stable_60(oracles.polynomial_60(Fr * (1 - 1e-8), **design))


@pytest.fixture(scope="module")
def judged():
    """Random designs, and whether each is stable by the exact Routh table."""
    parameters = designs(3000, seed=6)
    routh = np.array([oracles.routh_exact(exact(**one(parameters, i))) for i in range(3000)])
    return parameters, routh


def test_the_complete_conditions_are_exact(judged):
    parameters, routh = judged
    assert routh.sum() > 60
    assert np.array_equal(laws.lscf_complete(**parameters), routh)


def test_the_printed_conditions_hold_for_positive_tilt_and_chi_H_from_1(judged):
    parameters, routh = judged
    regime = (parameters["lambda_s"] > 0) & (parameters["chi_H"] >= 1)
    assert routh[regime].sum() > 20
    assert np.array_equal(laws.lscf(**parameters).all(axis=0)[regime], routh[regime])


def test_the_printed_conditions_miss_a1_for_chi_H_below_1(judged):
    """Necessary, not sufficient: a third of the designs they admit are unstable. With a1 > 0 none is."""
    parameters, routh = judged
    regime = (parameters["lambda_s"] > 0) & (parameters["chi_H"] < 1)
    printed = laws.lscf(**parameters).all(axis=0)
    assert printed[regime & routh].all()
    wrong = regime & printed & ~routh
    assert wrong.sum() > 0.3 * (regime & printed).sum() > 5
    a1 = laws.copo(**parameters)[1]
    assert (a1[wrong] < 0).all()
    assert np.array_equal((printed & (a1 > 0))[regime], routh[regime])


def test_the_printed_conditions_mirrored_hold_for_negative_tilt(judged):
    """As printed they admit no design there; with the first four and a1 reversed, just the stable ones."""
    parameters, routh = judged
    regime = parameters["lambda_s"] < 0
    conditions = laws.lscf(**parameters)
    assert not conditions.all(axis=0)[regime].any()
    assert routh[regime].sum() > 20
    mirrored = ~conditions[:4].any(axis=0) & conditions[4] & (laws.copo(**parameters)[1] < 0)
    assert np.array_equal(mirrored[regime], routh[regime])


def test_flus_is_positive_where_a0_a1_a3_a4_agree_and_chi_H_is_positive(judged):
    parameters, _ = judged
    a = laws.copo(**parameters)
    agree = (np.abs(np.sign(a[[0, 1, 3, 4]]).sum(axis=0)) == 4) & (parameters["chi_H"] > 0)
    del (without := dict(parameters))["Fr"]
    assert agree.sum() > 100
    assert (laws.flus(**without)[agree] > 0).all()


def test_a_design_the_printed_conditions_wrongly_admit():
    """All rational: Fr_c = 1 exactly, Fr = 2, and a1 = -3/100."""
    design = {"Fr": 2.0, "mu": 5.0, "chi_B": 1.2, "chi_H": 0.9, "zeta_B": -0.5, "zeta_H": -0.4}
    assert laws.lscf(**design, lambda_s=np.arctan(0.5)).all()
    assert not laws.lscf_complete(**design, lambda_s=np.arctan(0.5))
    a = oracles.polynomial_exact(2, 5, "1.2", "0.9", "-0.5", "-0.4", "0.5")
    assert a[1] == Fraction(-3, 100)
    assert not oracles.routh_exact(a)
    at_1 = oracles.polynomial_exact(1, 5, "1.2", "0.9", "-0.5", "-0.4", "0.5")
    assert at_1[1] * at_1[2] * at_1[3] - at_1[0] * at_1[3] ** 2 - at_1[1] ** 2 * at_1[4] == 0


def test_w0_bounds_the_abscissa():
    """The product of the roots is a4/a0: no abscissa lies left of `w0`, nan where that is negative."""
    parameters = designs(100, seed=7)
    bound = laws.w0(*(parameters[name] for name in ("mu", "chi_H", "zeta_B", "zeta_H", "lambda_s")))
    for i in range(100):
        a = exact(**one(parameters, i))
        assert np.isnan(bound[i]) == (a[4] / a[0] < 0)
        if a[4] / a[0] > 0:
            assert bound[i] == pytest.approx(-(float(a[4] / a[0]) ** 0.25), rel=1e-12)
            assert max(root.real for root, _ in oracles.certified_roots(a)) >= bound[i]


# EP4, any chi_H


@repeatable
@given(omega0=st.floats(-5, -0.2), zeta_B=depth, zeta_H=depth, chi_H=st.floats(0.2, 3))
def test_ep4_is_a_fourfold_root_on_both_branches(omega0, zeta_B, zeta_H, chi_H):
    assume(abs(chi_H - 1) > 1e-6 and abs(zeta_B - zeta_H) > 1e-6)
    first, second = laws.ep4(omega0, zeta_B, zeta_H, chi_H)
    for design in (first, second):
        assert ep4_defect(design, design.mu, chi_H, zeta_B, zeta_H) < 1e-13
    assert first.Fr > 0
    assert second.mu < 0  # so the paper's uniqueness claim holds for every geometry
    if first.mu > 0:
        assert (chi_H - 1) * (zeta_H - zeta_B) * (omega0 - laws.w01(zeta_B, zeta_H)) > 0
        at_it = oracles.polynomial_exact(first.Fr, first.mu, first.chi_B, chi_H, zeta_B, zeta_H, first.tan_lambda_s)
        assert at_it[0] * Fraction(float(first.tan_lambda_s)) > 0  # one class per sign of lambda_s


@pytest.mark.parametrize(
    ("omega0", "zeta_B", "zeta_H", "chi_H", "tilt_sign"),
    [
        (-1, -0.4, -0.2, 1.02, 1),
        (-3, -0.4, -0.2, 0.9, 1),
        (-3, -0.2, -0.4, 1.02, -1),
        (-1, -0.2, -0.4, 0.9, -1),
    ],
)
def test_ep4_in_the_four_regimes(omega0, zeta_B, zeta_H, chi_H, tilt_sign):
    """chi_H on either side of 1, either sign of lambda_s: a stable bicycle with mu > 0 and just this EP4."""
    design, other = laws.ep4(omega0, zeta_B, zeta_H, chi_H)
    assert design.mu > 0 > other.mu
    assert np.sign(design.lambda_s) == tilt_sign
    assert design.lambda_s == pytest.approx(np.arctan(design.tan_lambda_s), rel=1e-15)
    geometry = {"chi_H": chi_H, "zeta_B": zeta_B, "zeta_H": zeta_H, "lambda_s": design.lambda_s}
    a = oracles.polynomial_60(design.Fr, design.mu, design.chi_B, **geometry)
    assert oracles.is_stable_60(a)
    monic = [float(c / a[0]) for c in a]
    assert monic == pytest.approx(np.poly([omega0] * 4), rel=1e-12)  # 1/a0 magnifies the rounding tenfold
    assert np.array_equal(laws.poly4(omega0), np.poly([omega0] * 4))
    assert laws.chib(omega0, chi_H, zeta_B, zeta_H) == design.chi_B
    assert laws.a1a3(design.Fr, design.chi_B, omega0=omega0, **geometry) == pytest.approx(0, abs=1e-14)
    assert laws.a2(design.Fr, design.mu, omega0=omega0, **geometry) == pytest.approx(0, abs=1e-13)
    assert laws.w0(design.mu, **geometry) == pytest.approx(omega0, rel=1e-12)


def test_ep4_has_no_value_where_no_EP4_or_no_mass_ratio_exists():
    for omega0, zeta_B, zeta_H, chi_H in ((-1, ZB, ZH, 1), (laws.w01(ZB, ZH), ZB, ZH, 1), (-1, ZB, ZB, 1.02)):
        for design in laws.ep4(omega0, zeta_B, zeta_H, chi_H):
            assert np.isnan([design.Fr, design.mu, design.tan_lambda_s]).all()
    # zeta_H > 0, a hanging front mass: y = -1/2 and chi_H = 1/2 give the square 81/16 - 18
    assert np.isnan(laws.ep4(-1, ZB, 0.5, 0.5)[0].Fr)


# EP4, chi_H = 1


@repeatable
@given(zeta_B=depth, zeta_H=depth, mu=st.floats(0.01, 30))
def test_compact_ep4_is_a_fourfold_root_for_any_mass_ratio(zeta_B, zeta_H, mu):
    assume(abs(zeta_B - zeta_H) > 1e-6)
    design = laws.ep4_chi_H_1(zeta_B, zeta_H)
    assert ep4_defect(design, mu, 1.0, zeta_B, zeta_H) < 1e-14
    assert np.isnan(design.mu)
    printed = (laws.w01, laws.chib1, laws.tls)
    assert design[:3] == pytest.approx([law(zeta_B, zeta_H) for law in printed], rel=1e-8, abs=1e-14)


@repeatable
@given(zeta_B=depth, zeta_H=depth)
def test_frep4_has_one_true_and_one_spurious_root(zeta_B, zeta_H):
    assume(abs(zeta_B / zeta_H - 1) > 1e-2)
    true, spurious = laws.frep4(zeta_B, zeta_H)
    design = laws.ep4_chi_H_1(zeta_B, zeta_H)
    assert true == pytest.approx(design.Fr, rel=1e-12)
    r = laws.chib1(zeta_B, zeta_H)
    assert spurious == pytest.approx(-((r - 1) ** 2) * abs(design.omega0) / (4 * (r + 1)), rel=1e-9)
    assert spurious < 0 < true
    # with it p is no fourth power: a1 has the wrong sign
    assert ep4_defect(design._replace(Fr=spurious), 0.1, 1.0, zeta_B, zeta_H) > 1e-4


def test_compact_ep4_needs_unequal_heights():
    design = laws.ep4_chi_H_1(ZB, ZB)
    assert np.isnan([design.Fr, design.tan_lambda_s]).all()


# The critical Froude number, chi_H = 1


@repeatable
@given(zeta_B=depth, zeta_H=depth, chi_B=st.floats(0.2, 5), T=tangent, mu=st.floats(0.01, 30))
def test_Frc1_is_flus(zeta_B, zeta_H, chi_B, T, mu):
    assume(abs(chi_B - 1) > 1e-3 and abs(zeta_B - zeta_H * chi_B) > 1e-3 and abs(zeta_B - zeta_H) > 1e-3)
    lambda_s = np.arctan(T)
    general = laws.flus(mu, chi_B, 1, zeta_B, zeta_H, lambda_s)
    assert laws.Frc1(chi_B, zeta_B, zeta_H, lambda_s) == pytest.approx(general, rel=1e-13)


@repeatable
@given(zeta_B=depth, ratio=st.floats(0.05, 0.95), T=tangent)
def test_frm_is_the_least_critical_Froude_number(zeta_B, ratio, T):
    zeta_H, lambda_s = zeta_B * ratio, np.arctan(T)
    least = laws.frm(zeta_B, zeta_H, lambda_s)
    best = laws.chibm(zeta_B, zeta_H)
    assert laws.Frc1(best, zeta_B, zeta_H, lambda_s) == pytest.approx(least**2, rel=1e-10)
    assert laws.Fr_c2_chi_H_1(zeta_B, zeta_H, lambda_s) == pytest.approx(least**2, rel=1e-10)
    # Frc1(chi) = Frc1(zeta_B/(zeta_H chi)): the minimiser is the fixed point, found sharper than any minimum
    mirrored = [laws.Frc1(best * q, zeta_B, zeta_H, lambda_s) for q in (ratio**0.25, ratio**-0.25)]
    assert mirrored[0] == pytest.approx(mirrored[1], rel=1e-11)
    inside = 1 + (1 / ratio - 1) * np.linspace(0.001, 0.999, 400)  # between the poles 1 and zeta_B/zeta_H
    assert (laws.Frc1(inside, zeta_B, zeta_H, lambda_s) >= least**2 * (1 - 1e-10)).all()
    assert laws.Frc1(1 / ratio + 0.1, zeta_B, zeta_H, lambda_s) < 0  # beyond, no speed is critical


# The EP set and the design principle, chi_H = 1


@repeatable
@given(zeta_B=depth, zeta_H=depth, excess=st.floats(1.1, 30))
def test_epset_is_a_squared_quadratic(zeta_B, zeta_H, excess):
    """p/a0 = (s^2 + b s + c)^2, stable; real roots below the EP4 tilt, complex above."""
    assume(abs(zeta_B / zeta_H - 1) > 1e-2)
    r, h = np.sqrt(zeta_B / zeta_H), np.sqrt(zeta_B * zeta_H)
    lambda_s = np.arctan(excess * (r - 1) / (r + 1) * r / (4 * h))
    Fr = laws.epset(zeta_B, zeta_H, lambda_s)
    a = oracles.polynomial_60(Fr, 0.1, laws.chib1(zeta_B, zeta_H), 1, zeta_B, zeta_H, lambda_s)
    a0, a1, a2, a3, a4 = a
    b = a1 / a0 / 2
    c = a3 / a1
    assert b > 0
    assert c > 0
    # heights, tilt and speed are rounded, and near the pole or r = 1 that is magnified
    loss = 1e-13 * (1 + 1 / (excess - 1)) / abs(r - 1)
    assert abs(a2 / a0 / (b**2 + 2 * c) - 1) < loss
    assert abs(a4 / a0 / c**2 - 1) < loss
    tilt_ratio = np.tan(lambda_s) / laws.tls(zeta_B, zeta_H)
    if abs(tilt_ratio - 1) > 1e-6:
        assert (b**2 > 4 * c) == (tilt_ratio < 1)


def test_epset_ends_at_its_pole():
    """No EP set below |tan| = (r - 1)/(r + 1) r/(4 h), and none for the wrong sign of lambda_s."""
    r, h = np.sqrt(2), np.sqrt(0.08)
    pole = (r - 1) / (r + 1) * r / (4 * h)
    assert np.isnan(laws.epset(ZB, ZH, np.arctan([0.999 * pole, 0.1, -0.4, -3]))).all()
    assert laws.epset(ZB, ZH, np.arctan(pole * (1 + 1e-6))) > 100


@pytest.mark.parametrize(("zeta_B", "zeta_H"), [(-0.4, -0.2), (-1.3, -0.3), (-0.2, -0.4)])
def test_dp_bounds_the_tilt_of_heavy_damping(zeta_B, zeta_H):
    """Below the bound some speed makes all roots real and negative, above none does; certified roots."""
    chi_B, bound = laws.dp(zeta_B, zeta_H)
    design = laws.ep4_chi_H_1(zeta_B, zeta_H)
    assert (chi_B, bound) == pytest.approx((design.chi_B, design.tan_lambda_s), rel=1e-13)

    def heavily_damped(tilt):
        speeds = design.Fr * np.linspace(0.5, 2, 41)
        end = laws.epset(zeta_B, zeta_H, np.arctan(tilt))  # near the EP4 the range of speeds is short and ends here
        speeds = np.append(speeds, [] if np.isnan(end) else end * (1 - np.geomspace(1e-6, 0.1, 30)))
        polynomials = (oracles.polynomial_exact(Fr, 1, chi_B, 1, zeta_B, zeta_H, tilt) for Fr in speeds)
        return any(curves.damped(a) for a in polynomials)

    assert heavily_damped(0.3 * bound)
    assert heavily_damped(0.95 * bound)
    assert not heavily_damped(1.01 * bound)
    assert not heavily_damped(-0.5 * bound)


# Duality


@repeatable
@given(
    Fr=st.floats(0.1, 6),
    chi_B=st.floats(0.2, 5),
    zeta_B=depth,
    zeta_H=depth,
    T=st.floats(-5, 5),
    mu=st.floats(0.1, 10),
)
def test_the_dual_has_the_same_spectrum(Fr, chi_B, zeta_B, zeta_H, T, mu):
    assume(abs(T) > 1e-3)
    design = {"Fr": Fr, "chi_B": chi_B, "zeta_B": zeta_B, "zeta_H": zeta_H, "lambda_s": np.arctan(T)}
    dual = laws.dual(**design)
    ours = oracles.polynomial_60(mu=mu, chi_H=1, **design)
    theirs = oracles.polynomial_60(mu=2 * mu, chi_H=1, **dual)
    sizes = term_sizes(Fr, mu, chi_B, 1, zeta_B, zeta_H, T)
    for a, b, size in zip(ours, theirs, sizes, strict=True):
        # the tilt is stored as an angle, whose rounding moves a tangent up to 125 by 1e-14 of itself
        assert abs(float(a - b * ours[0] / theirs[0])) < 1e-12 * size
    again = laws.dual(**dual)
    assert [again[name] for name in design] == pytest.approx(list(design.values()), rel=1e-12)


def test_the_dual_of_EP4_is_EP4():
    """It maps the lambda_s > 0 class onto the lambda_s < 0 class."""
    ours, theirs = laws.ep4_chi_H_1(ZB, ZH), laws.ep4_chi_H_1(ZH, ZB)
    dual = laws.dual(ours.Fr, ours.chi_B, ZB, ZH, ours.lambda_s)
    assert (dual["zeta_B"], dual["zeta_H"]) == (ZH, ZB)
    assert [dual["Fr"], dual["chi_B"], dual["lambda_s"]] == pytest.approx([theirs.Fr, theirs.chi_B, theirs.lambda_s])
    assert ours.lambda_s > 0 > theirs.lambda_s


# Arrays, numbers and names


def _calls():
    rng = np.random.default_rng(8)
    for name, law in vars(laws).items():
        if inspect.isfunction(law) and not name.startswith("_") and law.__module__ == laws.__name__:
            names = inspect.signature(law).parameters
            yield pytest.param(
                law,
                {
                    n: -v if n in ("zeta_B", "zeta_H", "omega0") else v
                    for n, v in zip(names, rng.uniform(0.3, 0.9, len(names)), strict=True)
                },
                id=name,
            )


def _leaves(answer):
    """The arrays or floats in an answer, whatever holds them."""
    if isinstance(answer, dict):
        answer = tuple(answer.values())
    return [leaf for part in answer for leaf in _leaves(part)] if isinstance(answer, tuple) else [answer]


@pytest.mark.parametrize(("law", "arguments"), list(_calls()))
def test_every_law_broadcasts(law, arguments):
    """An array for one argument gives, entry by entry, what the floats give; lists are taken too."""
    plain = _leaves(law(**arguments))
    for name, value in arguments.items():
        for leaf, part in zip(
            _leaves(law(**arguments | {name: np.array([[value] * 3, [1.1 * value] * 3])})), plain, strict=True
        ):
            if np.ndim(leaf) == np.ndim(part):  # an output this argument does not enter
                assert np.array_equal(leaf, part, equal_nan=True)
            elif law.__name__ == "matrices":
                assert np.array_equal(leaf[0], [part] * 3)
            else:
                assert leaf.shape == (*np.shape(part), 2, 3)
                assert np.array_equal(leaf[..., 0, 0], part, equal_nan=True)
    listed = law(**{name: [value] for name, value in arguments.items()})
    for leaf, part in zip(_leaves(listed), plain, strict=True):
        assert np.array_equal(np.squeeze(leaf), part, equal_nan=True)


def test_poles_are_silent():
    """Division by zero and roots of negative numbers answer inf and nan; any warning is an error here."""
    assert np.isinf(laws.Frc1(1, ZB, ZH, 0.3))
    assert not np.isfinite(laws.flus(0.1, 1.02, 1.02, ZB, ZH, 0.3))
    assert np.isnan(laws.Fr_c(0.1, 0.5, 1, ZB, ZH, 0.3))
    assert np.isnan(laws.frm(ZH, ZB, 0.3))
    assert np.isnan(laws.w0(30, 1.02, ZB, ZH, 0.3))
    assert np.isnan(laws.w01(ZB, -ZH))
    assert not laws.lscf(1, 0.1, 0.5, 1, ZB, ZH, 0.3)[4]
