"""Motion against integrators, closed forms at 50 digits and invariants: none of them knows a matrix exponential."""

import math
import pickle
from functools import cache

import numpy as np
import pytest
from helpers.oracles import ep4_of_heights
from helpers.places import PROBLEMS
from mpmath import mp
from scipy.integrate import solve_ivp

import tmsopt
from tmsopt.dynamics import system_of
from tmsopt.models import canonical, from_matrices, matrices, tms, whipple

BENCHMARK, EP4 = PROBLEMS / "whipple_benchmark.toml", PROBLEMS / "ep4.toml"
STATES = ("phi", "delta", "phidot", "deltadot")


def column(motion, name):
    return np.array(motion[name])


@cache
def ep4():
    return tmsopt.solve(EP4)


def table(motion, names):
    return np.array([motion[name] for name in names])


def integrated(right, start, times):
    """By an explicit Runge–Kutta method of order 8, to 1e-13."""
    found = solve_ivp(
        lambda t, x: right(x), (0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-13, atol=1e-14, max_step=0.01
    )
    return np.asarray(found.y)


def rolling(p):
    """x′ of a Whipple bicycle: lean, steer, rates, yaw, rear contact aside; equations 5.3 and B of Meijaard et al."""
    M, C1, K0, K2 = (np.array(m, dtype=float) for m in canonical(p))
    v, g, c, w, cosine = p["v"], p["g"], p["c"], p["w"], math.cos(p["lambda_s"])

    def right(x):
        q, r = x[:2], x[2:4]
        turn = (v * q[1] + c * r[1]) * cosine / w
        return np.r_[r, -np.linalg.solve(M, v * C1 @ r + (g * K0 + v**2 * K2) @ q), turn, v * x[4]]

    return right


# The motion


def test_the_benchmark_moves_as_an_integrator_says():
    """Whole: angles, rates, yaw and both contacts, after a lean, a steer and both pushes."""
    motion = tmsopt.simulate(BENCHMARK, lean=5, steer="-2 deg", push=0.3, lean_push=4.0, seconds=6, points=301)
    p = motion.parameters
    M = np.array(canonical(p)[0], dtype=float)
    start = np.r_[math.radians(5), -math.radians(2), np.linalg.solve(M, [4.0, 0.3]), 0, 0]
    found = integrated(rolling(p), start, column(motion, "t"))
    assert table(motion, (*STATES, "psi", "y_rear")) == pytest.approx(found, abs=1e-10)
    front = found[5] + p["w"] * found[4] - p["c"] * math.cos(p["lambda_s"]) * found[1]
    assert column(motion, "y_front") == pytest.approx(front, abs=1e-10)
    assert column(motion, "x") == pytest.approx(p["v"] * column(motion, "t"), rel=1e-15)


def test_a_dimensionless_bicycle_moves_as_one_of_one_metre_and_one_kilogram():
    """With w = g = m_B = 1 a second is √(w/g)."""
    p = {"Fr": 1.1, "mu": 0.3, "chi_B": 1.3, "chi_H": 1.02, "zeta_B": -0.4, "zeta_H": -0.2, "lambda_s": 0.2}
    si = dict(zip(("v", "m_H", "x_B", "x_H", "z_B", "z_H", "lambda_s"), p.values(), strict=True))
    asked = {"lean": 3, "push": 0.001, "seconds": 8, "points": 201}
    plain, same = (
        tmsopt.simulate(tmsopt.Problem(tms, fixed=of), **asked) for of in (p, {**si, "w": 1.0, "g": 1.0, "m_B": 1.0})
    )
    assert table(plain, (*STATES, "psi", "y_rear")) == pytest.approx(table(same, (*STATES, "psi", "y_rear")), abs=1e-10)


def as_whipple(p):
    """Two masses on skates as a Whipple bicycle without wheels and trail."""
    return {n: p[n] for n in ("w", "v", "g", "lambda_s", "m_B", "x_B", "z_B", "m_H", "x_H", "z_H")}


def ideal_ep4():
    """A and the fourfold root of EP4 at χ_H = 1, ζ_B = −0.4, ζ_H = −0.2 from the closed form, at the digits of mp."""
    heights = mp.mpf("-0.4"), mp.mpf("-0.2")
    chi_B, T, Fr, root = ep4_of_heights(*heights).values()
    cosine = 1 / mp.sqrt(1 + T**2)
    M, V, P = (mp.matrix(m) for m in matrices(Fr, mp.mpf("0.1"), chi_B, 1, *heights, T * cosine, cosine))
    A = mp.zeros(4)
    for i in range(2):
        A[i, i + 2] = 1
    A[2:4, 0:2], A[2:4, 2:4] = -mp.inverse(M) * P, -mp.inverse(M) * V
    return A, root


@pytest.mark.parametrize("start", [(1.0, 0.0, 0.0, 0.0), (0.0, 0.1, 0.0, -0.5)])
def test_at_an_ep4_it_moves_with_the_third_power_of_time(start):
    """x(t) = e^(rt) Σ t^k N^k x(0)/k!, N = A − r, at 50 digits for the ideal design; the motion is that of the rounded one.

    Rounding moves the roots by 4e-4 and e^(At) by about 1e-15 times the growth of its derivative.
    """
    motion = tmsopt.simulate(ep4(), start=dict(zip(STATES, start, strict=True)), seconds=8, points=81)
    with mp.workdps(50):
        A, root = ideal_ep4()
        N, x = A - root * mp.eye(4), mp.matrix(list(start))
        terms = [N**k * x / mp.factorial(k) for k in range(4)]
        assert max(abs(e) for e in terms[3]) > 0.01  # t³ is there
        for k, t in enumerate(motion["t"]):
            ideal = mp.exp(root * t) * sum((mp.mpf(t) ** j * terms[j] for j in range(1, 4)), terms[0])
            assert [motion[name][k] for name in STATES] == pytest.approx([float(e) for e in ideal], abs=1e-10)


def test_a_system_without_dampers_keeps_its_energy():
    M, K = np.array([[1.5, 0, 0], [0, 2, 0.5], [0, 0.5, 1]]), np.array([[3, -1, 0], [-1, 2, -1], [0, -1, 4]])
    chain = from_matrices(M=[["m", 0, 0], *M.tolist()[1:]], K=K.tolist())
    motion = tmsopt.simulate(tmsopt.Problem(chain, fixed={"m": 1.5}), start={"q1": 1, "q3dot": -2}, seconds=400)
    q, r = table(motion, ("q1", "q2", "q3")), table(motion, ("q1dot", "q2dot", "q3dot"))
    energy = np.einsum("it,ij,jt->t", r, M, r) + np.einsum("it,ij,jt->t", q, K, q)
    assert energy == pytest.approx(3 + 4, rel=1e-12)
    assert (motion.stable, [math.isnan(m.settling) for m in motion.measures]) == (False, [True] * 3)


@pytest.mark.slow
def test_a_response_is_a_simulation_and_is_pickled():
    design = ep4()
    one, other = design.response(lean=5, seconds=3), tmsopt.simulate(design, lean=5, seconds=3)
    assert one.columns == other.columns == tmsopt.simulate(EP4, lean=5, seconds=3).columns
    assert pickle.loads(pickle.dumps(one)).columns == one.columns


# Controllers


GAINS = np.array([-60.0, 18.0, -9.0, 2.5])
"""The torque on the steer is −G (φ, δ, φ̇, δ̇), at once or by a motor with a lag: τ T′ = −T − G x."""

LAG = 0.05


def steered(lag):
    return dict(zip((f"k_{name}" for name in STATES), GAINS, strict=True)) | ({"lag": lag} if lag else {})


@pytest.mark.parametrize("lag", [None, LAG])
def test_a_controller_steers_and_its_torque_is_told(lag):
    """Against an integrator in which the torque acts on the passive bicycle."""
    p = {**tmsopt.load(BENCHMARK).fixed, "v": 3.0}
    robot = tmsopt.Problem(whipple, fixed=p | steered(lag))
    motion = tmsopt.simulate(robot, lean=4, push=0.2, seconds=2, points=101)
    passive, M = rolling(p), np.array(canonical(p)[0], dtype=float)

    def right(x):
        torque = -GAINS @ x[:4] if lag is None else x[6]
        moved = passive(x[:6])
        moved[2:4] += np.linalg.solve(M, [0, torque])
        return np.r_[moved, [] if lag is None else [(-x[6] - GAINS @ x[:4]) / lag]]

    start = np.r_[math.radians(4), 0, np.linalg.solve(M, [0, 0.2]), 0, 0, [] if lag is None else [0.0]]
    found = integrated(right, start, column(motion, "t"))
    assert table(motion, (*STATES, "psi", "y_rear")) == pytest.approx(found[:6], abs=1e-10)
    torque = -GAINS @ found[:4] if lag is None else found[6]
    assert column(motion, "T_delta") == pytest.approx(torque, abs=1e-9)
    assert "T_phi" not in motion.columns
    assert motion.names == ("t", *STATES)
    assert "T_delta" in {m.name for m in motion.measures}
    assert "steer torque" in str(motion)
    assert len(tmsopt.plots.motion_figure(motion).axes) == 3


@pytest.mark.parametrize("gains", [{}, steered(None), steered(LAG)], ids=["none", "at once", "a motor"])
def test_two_masses_in_si_move_as_whipple_without_wheels(gains):
    """Every unit at once, of the torque too: the one is computed without dimensions, the other in SI."""
    p = {**tmsopt.load(PROBLEMS / "benchmark.toml").fixed, "v": 3.5}
    wheels = tmsopt.Problem(whipple, fixed=as_whipple(p) | gains)
    asked = {"lean": 2, "push": 0.05, "lean_push": -0.2, "seconds": 0.4, "points": 41}
    skates, same = (tmsopt.simulate(q, **asked) for q in (tmsopt.Problem(tms, fixed=p | gains), wheels))
    assert list(skates.columns) == list(same.columns)
    for name in same.columns:
        scale = np.abs(same[name]).max()
        assert column(skates, name) / scale == pytest.approx(column(same, name) / scale, abs=1e-10), name
    assert skates.units == same.units
    assert not gains or skates.units["T_delta"] == "N m"
    for a, b in zip(skates.modes, same.modes, strict=True):
        assert (a.re, a.im, a.steer_per_lean) == pytest.approx((b.re, b.im, b.steer_per_lean), rel=1e-9)


# What cannot be


def test_a_singular_mass_has_no_motion():
    stuck = from_matrices(M=[[1, 0], [0, "m"]], K=[[1, 0], [0, 1]])
    with pytest.raises(tmsopt.InputError, match="mass matrix of this design is singular"):
        tmsopt.simulate(tmsopt.Problem(stuck, fixed={"m": 0.0}))
    with pytest.raises(tmsopt.InputError, match=r"coefficients.*matrices under \[model\]"):
        tmsopt.simulate(tmsopt.Problem(tmsopt.models.from_coefficients([1, "c", 1]), fixed={"c": 1.0}))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"lean": "steep"}, "lean: found 'steep'"),
        ({"push": "10"}, "push: found '10'; accepted: a number"),
        ({"lean": math.nan}, "lean: found nan"),
        ({"noise": -1.0}, "noise: found -1; accepted: 0 or more"),
        ({"start": {"q1": 1.0}}, "unknown state 'q1'; accepted: phi delta phidot deltadot"),
        ({"start": {"phi": "x"}}, "start.phi: found 'x'; accepted: a number"),
        ({"start": 3}, "start: found 3; accepted: names with their values"),
        ({"lean": 1, "start": {"phi": 0.1}}, "start.phi: is given twice"),
        ({"seconds": 0}, "seconds: found 0; accepted: a number above 0"),
        ({"points": 1}, "points: found 1; accepted: a whole number from 2"),
        ({"seed": -1}, "seed: found -1; accepted: a whole number, 0 or more"),
    ],
)
def test_what_cannot_be_asked_is_said(asked, said):
    with pytest.raises(tmsopt.InputError) as raised:
        tmsopt.simulate(BENCHMARK, **asked)
    assert said in str(raised.value)


def test_a_stated_system_starts_by_the_names_of_its_states():
    spring = tmsopt.Problem(from_matrices(M=[[1]], D=[["c"]], K=[[1]]), fixed={"c": 0.2})
    with pytest.raises(tmsopt.InputError, match=r"push: a stated system has no lean and no steer.* q1dot=1"):
        tmsopt.simulate(spring, push=1)
    assert list(tmsopt.simulate(spring).columns) == ["t", "q1", "q1dot"]
    flow = from_matrices(A=[["a", 1], [0, -2]])
    assert list(tmsopt.simulate(tmsopt.Problem(flow, fixed={"a": -1.0})).columns) == ["t", "x1", "x2"]
    assert system_of(spring.posed, {"c": 0.2}).A.tolist() == [[0, 1], [-1, -0.2]]


def test_growth_beyond_all_numbers_is_refused():
    falling = tmsopt.Problem(from_matrices(M=[[1]], K=[["k"]]), fixed={"k": -4.0})
    with pytest.raises(tmsopt.InputError, match=r"seconds: found 1000 .*accepted: up to 300"):
        tmsopt.simulate(falling, seconds=1000)
    motion = tmsopt.simulate(falling)
    assert (motion.stable, motion.to_json()["measures"]["q1"]["settling"]) == (False, None)
    assert column(motion, "q1") == pytest.approx(np.cosh(2 * column(motion, "t")), rel=1e-12)


def test_a_mass_alone_rolls_on():
    """Both roots 0, one chain: q = q′(0) t."""
    alone = tmsopt.Problem(from_matrices(M=[["m"]], K=[[0]]), fixed={"m": 3.0})
    motion = tmsopt.simulate(alone, start={"q1dot": 2}, seconds=7)
    assert column(motion, "q1") == pytest.approx(2 * column(motion, "t"), rel=1e-14)
    assert [(m.multiplicity, m.partial) for m in motion.modes] == [(2, (2,))]
    (found,) = tmsopt.diagnose(alone)
    assert [(r.parameter, r.unmoved, r.laws) for r in found.responses] == [("m", 2, ())]


def test_what_dies_out_too_slowly_to_be_followed_has_no_settling_time():
    """x1 = e^(−300 t) cos(900 t) + 0.05 e^(−0.001 t) sin t: within 2 % from 0.01 on, and beyond again at t = 0.41."""
    A = [[-300, 900, 15 - 0.05 * 0.001, 0.05], [-900, -300, 45, 0], [0, 0, "-p", 1], [0, 0, -1, "-p"]]
    motion = tmsopt.simulate(tmsopt.Problem(from_matrices(A=A), fixed={"p": 0.001}), start={"x1": 1, "x4": 1})
    assert motion.stable
    assert math.isnan(motion.measures[0].settling)
    at = [float(t) for t in motion["t"]]
    whole = [math.exp(-300 * t) * math.cos(900 * t) + 0.05 * math.exp(-0.001 * t) * math.sin(t) for t in at]
    assert column(motion, "x1") == pytest.approx(whole, abs=1e-12)


def test_a_root_that_is_rounding_gives_no_settling_time():
    """2 × 56.56 = 10.1 × 11.2, but for 1.6e-14 in doubles: what comes to rest elsewhere would settle after 1e14 s."""
    resting = from_matrices(A=[["p", -56.56], [2, -11.2]])
    measures = tmsopt.simulate(tmsopt.Problem(resting, fixed={"p": 10.1}), start={"x1": 1}).measures
    assert all(math.isnan(found.settling) for found in measures)
