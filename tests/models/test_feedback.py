"""A controller on both bicycles, against state matrices from the equations as printed, in fractions."""

import math
from fractions import Fraction

import flint
import numpy as np
import pytest
from helpers.bicycles import BENCHMARK, appendix, bicycles
from helpers.oracles import matrices

import tmsopt
from tmsopt.models import controlled, from_si, tms, whipple

STATES = ("phi", "delta", "phidot", "deltadot")
STEER = tuple(f"k_{x}" for x in STATES)
LEAN = tuple(f"lean_{x}" for x in STATES)
SLOPES = tuple(f"{n}_v" for n in (*STEER, *LEAN))
GAINS = {
    "steer": STEER,
    "one": ("k_phidot",),
    "lean": LEAN,
    "both": (*STEER, *LEAN),
    "slopes": (*STEER, *LEAN, *SLOPES),
    "slope alone": ("k_phidot_v",),
    "lag": (*STEER, "lag"),
    "lag of both": ("k_phi", "lean_phidot", "lag"),
    "everything": (*STEER, *LEAN, *SLOPES, "lag"),
}
SKATES = ("w", "v", "g", "m_B", "x_B", "z_B", "m_H", "x_H", "z_H")
SINE, COSINE = Fraction(3, 5), Fraction(4, 5)


def rounded(values):
    return {n: Fraction(float(x)).limit_denominator(1000) for n, x in values.items()}


def gains_of(names, seed):
    rng = np.random.default_rng(seed)
    return rounded({n: rng.uniform(0.02, 0.5) if n == "lag" else rng.uniform(-60, 60) for n in names})


def exact_arrays(rows):
    return (np.array(m, dtype=object) for m in rows)


def wheeled(p):
    """M, D, K in SI by the appendix."""
    M, C1, K0, K2 = exact_arrays(appendix(p, SINE, COSINE))
    v, g = p["v"], p["g"]
    return M, v * C1, g * K0 + v * v * K2


def skating(p):
    """M, D, K in SI by the paper's matrices: these are per m_B w², and linear in Fr and Fr² = v²/(g w)."""
    w, v, g, m = p["w"], p["v"], p["g"], p["m_B"]
    ratios = (p["m_H"] / m, p["x_B"] / w, p["x_H"] / w, p["z_B"] / w, p["z_H"] / w, COSINE, SINE)
    M, V, P, _ = exact_arrays(matrices(Fraction(1), *ratios))
    _, _, rest, _ = exact_arrays(matrices(Fraction(0), *ratios))
    return m * w * w * M, m * w * v * V, m * g * w * rest + m * v * v * (P - rest)


def state_matrix(M, D, K, gains, v):
    """x′ = A x of φ, δ, φ′, δ′ and, with a lag, of the torques: M q″ + D q′ + K q = T, lag T′ + T = −G (q, q′)."""

    def gain(torque, x):
        return gains.get(f"{torque}_{x}", 0) + gains.get(f"{torque}_{x}_v", 0) * v

    G = np.array([[gain(torque, x) for x in STATES] for torque in ("lean", "k")], dtype=object)
    (a, b), (c, d) = M
    inverse = np.array([[d, -b], [-c, a]], dtype=object) / Fraction(a * d - b * c)
    lag = gains.get("lag")
    driven = [row for row in (0, 1) if lag and (row == 1 or any(n.startswith("lean") for n in gains))]
    A = np.zeros((4 + len(driven),) * 2, dtype=object)
    A[0, 2] = A[1, 3] = 1
    A[2:4, :4] = -inverse @ (np.hstack([K, D]) + (0 if lag else G))
    A[2:4, 4:] = inverse[:, driven]
    for n, row in enumerate(driven, start=4):
        A[n, :4], A[n, n] = -G[row] / lag, -1 / lag
    return A


def characteristic(A):
    """1, c1 … cn, exactly."""
    rows = [[flint.fmpq(x.numerator, x.denominator) for x in map(Fraction, row)] for row in A]
    return [Fraction(int(c.p), int(c.q)) for c in reversed(list(flint.fmpq_mat(rows).charpoly()))]


def balls(values):
    """λ_s is the angle whose tangent is 3/4."""
    found = {n: flint.arb(flint.fmpq(x.numerator, x.denominator)) for n, x in values.items()}
    return {**found, "lambda_s": (flint.arb(3) / 4).atan()}


def agree(got, exact):
    """Balls, of which every one has the exact coefficient, and hardly anything else."""
    assert len(got) == len(exact)
    for ball, c in zip(got, exact, strict=True):
        ratio = ball / got[0]
        expected = flint.arb(flint.fmpq(c.numerator, c.denominator))
        assert ratio.overlaps(expected)
        assert float(ratio.rad()) <= 1e-45 * max(1.0, abs(float(expected)))


@pytest.fixture(autouse=True)
def digits():
    with flint.ctx.workprec(230):  # 69 digits, some ten of which the products lose
        yield


# The equations


def robots(model, kind):
    """Parameters and gains in fractions, the model with the gains, and all its numbers as balls."""
    for seed, bicycle in enumerate(bicycles(8, seed=11)):
        p = rounded(bicycle if model is whipple else {n: bicycle[n] for n in SKATES})
        gains = gains_of(GAINS[kind], seed)
        yield p, gains, controlled(model, gains), balls({**p, **dict.fromkeys(STEER, Fraction(0)), **gains})


@pytest.mark.parametrize("kind", GAINS)
def test_wheels_by_the_appendix(kind):
    for p, gains, model, given in robots(whipple, kind):
        agree(model.coefficients(given), characteristic(state_matrix(*wheeled(p), gains, p["v"])))


@pytest.mark.parametrize("kind", GAINS)
def test_skates_in_si_by_the_paper(kind):
    """Roots are per √(g/w) there: the k-th coefficient has k of these."""
    for p, gains, model, given in robots(tms, kind):
        rate = (given["g"] / given["w"]).sqrt()
        got = model.coefficients(given, model.parameter_set("SI"))
        exact = characteristic(state_matrix(*skating(p), gains, p["v"]))
        agree([c * rate**k for k, c in enumerate(got)], exact)


@pytest.mark.parametrize("kind", GAINS)
def test_skates_without_dimensions_are_those_in_si(kind):
    """Torques per m_B g w, times per √(w/g), a slope per Fr = v/√(g w)."""
    for _, _, model, given in robots(tms, kind):
        rate, speed = (given["g"] / given["w"]).sqrt(), (given["g"] * given["w"]).sqrt()
        own = {"tau": given["lag"] * rate} if "lag" in given else {}
        for n in given:
            if n.startswith(("k_", "lean_")):
                value = given[n] / (given["m_B"] * given["g"] * given["w"])
                value = value * (rate if "dot" in n else 1) * (speed if n.endswith("_v") else 1)
                own[f"kappa_{n.removeprefix('k_')}"] = value
        got = model.coefficients({**from_si(given), **own})
        one = model.coefficients(given, model.parameter_set("SI"))
        assert all((a / got[0]).overlaps(b / one[0]) for a, b in zip(got, one, strict=True))
        assert set(model.sets[0].names) == {*from_si(given), *own}


# Poles where one wants them


def test_balance_assist_has_its_four_poles_in_one_place():
    """With k_phi at its limit, −100: all four roots at −4.9503638, by the polynomial of the printed matrices."""
    design = tmsopt.solve("problems/balance_assist.toml")
    k = {n: Fraction(design.parameters[n]) for n in STEER}
    tilt = math.pi / 10
    p = {**BENCHMARK, "v": 1.7}
    M, C1, K0, K2 = exact_arrays(appendix(p, math.sin(tilt), math.cos(tilt)))
    found = np.poly(state_matrix(M, 1.7 * C1, p["g"] * K0 + 1.7**2 * K2, k, 1.7).astype(float))
    assert design.structure == "EP4"
    assert k["k_phi"] == pytest.approx(-100, abs=1e-9)
    assert design.abscissa == pytest.approx(-4.9503638, abs=5e-8)
    assert found == pytest.approx(np.poly([design.abscissa] * 4), rel=1e-9)


# What it is as data


def test_gains_that_it_has_are_not_added_again():
    robot = controlled(tms, GAINS["everything"])
    assert robot is controlled(robot, GAINS["everything"])
    assert controlled(tms, ("Fr", "w")) is tms


def test_torques_in_words():
    """1° of lean is π/180 rad; a push p on the handlebar gives rates M⁻¹ (0, p), here from the appendix."""
    k = {"k_phi": -100.0, "k_phidot": -30.0, "k_delta": 20.0, "k_deltadot": 3.0, "k_phi_v": 4.0, "k_phidot_v": 2.0}
    v = 2.0
    M = np.array(appendix(BENCHMARK, math.sin(math.pi / 10), math.cos(math.pi / 10))[0])
    rates = np.linalg.solve(M, [0, 1])
    torque = abs(-(k["k_phidot"] + 2.0 * v) * rates[0] - 3.0 * rates[1])
    problem = tmsopt.Problem(whipple, fixed={**BENCHMARK, "v": v, **k})
    found = tmsopt.solve(problem).quantities
    assert found["torque_per_degree"] == pytest.approx(92 * math.pi / 180, rel=1e-14)
    assert found["push_torque"] == pytest.approx(torque, rel=1e-12)
