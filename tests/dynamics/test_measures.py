"""Peaks, overshoots, settling times, white noise and shapes of modes against closed forms and brute force."""

import csv
import json
import math
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner
from helpers.places import PROBLEMS
from mpmath import mp
from scipy.integrate import quad
from scipy.linalg import eig

import tmsopt
from tmsopt.cli import command_group as main
from tmsopt.dynamics import simulate_noise, stationary_covariance
from tmsopt.models import canonical, from_matrices, whipple

BENCHMARK = PROBLEMS / "whipple_benchmark.toml"


def column(motion, name):
    return np.array(motion[name])


@cache
def ep4():
    return tmsopt.solve(PROBLEMS / "ep4.toml")


def spring(damping):
    """q″ + 2 ζ q′ + q = 0."""
    return tmsopt.Problem(from_matrices(M=[[1]], D=[["2*zeta"]], K=[[1]]), fixed={"zeta": damping})


# Measures


@pytest.mark.parametrize("damping", [0.05, 0.3, 0.7])
def test_the_overshoot_of_an_oscillator_is_that_of_every_textbook(damping):
    """Released from 1: e^(−πζ/√(1−ζ²)); it settles when |q| falls below 0.02 for the last time."""
    (found,) = tmsopt.simulate(spring(damping), start={"q1": 1}).measures
    root = math.sqrt(1 - damping**2)
    assert (found.peak, found.at) == (1.0, 0.0)
    assert found.overshoot == pytest.approx(math.exp(-math.pi * damping / root), rel=1e-12)

    def q(t):
        return mp.exp(-damping * t) * (mp.cos(root * t) + damping / root * mp.sin(root * t))

    turns = [k * math.pi / root for k in range(400)]
    last = max(t for t in turns if abs(q(t)) > 0.02)
    sign = mp.sign(q(last))
    settling = mp.findroot(lambda t: sign * q(t) - 0.02, (last, last + math.pi / root), solver="anderson", tol=1e-25)
    assert found.settling == pytest.approx(float(settling), rel=1e-11)


def test_a_critically_damped_push_peaks_at_1_over_e():
    """EP2: q = t e^(−t), which settles where t e^(−t) = 0.02/e, by Lambert's W."""
    motion = tmsopt.simulate(spring(1.0), start={"q1dot": 1})
    (found,) = motion.measures
    assert (found.peak, found.at) == pytest.approx((math.exp(-1), 1.0), rel=1e-7)  # flat: a time has half the digits
    assert found.peak == pytest.approx(math.exp(-1), rel=1e-14)
    assert found.overshoot == 0
    assert found.settling == pytest.approx(float(-mp.lambertw(-0.02 / mp.e, -1).real), rel=1e-11)
    assert motion["t"][-1] == pytest.approx(1.2 * found.settling, rel=0.1)
    assert column(motion, "q1") == pytest.approx(column(motion, "t") * np.exp(-column(motion, "t")), abs=1e-14)


def test_measures_do_not_know_the_step_nor_how_long_is_shown():
    whole = tmsopt.simulate(BENCHMARK, lean=5, push=1)
    for asked in ({"seconds": 0.5}, {"points": 3}, {"points": 77, "seconds": 9.0}):
        assert tmsopt.simulate(BENCHMARK, lean=5, push=1, **asked).measures == whole.measures  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(6))
def test_measures_of_random_systems_are_those_of_brute_force(seed):
    """50 001 points by eigenvectors: no sample beats the peak, none is outside 2 % after the settling time."""
    rng = np.random.default_rng(seed)
    n = 4
    A = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-1, 1, size=(n, 1))
    A -= (np.linalg.eigvals(A).real.max() + 10.0 ** rng.uniform(-1, 0.5)) * np.eye(n)
    start = rng.normal(size=n)
    rows = [["a" if i == j == 0 else float(x) for j, x in enumerate(row)] for i, row in enumerate(A)]
    problem = tmsopt.Problem(from_matrices(A=rows), fixed={"a": float(A[0, 0])})
    motion = tmsopt.simulate(problem, start={f"x{k + 1}": x for k, x in enumerate(start.tolist())})
    end = 2 * max(m.settling for m in motion.measures)
    times = np.linspace(0, end, 50_001)
    values, vectors = np.linalg.eig(A)
    path = (vectors * np.linalg.solve(vectors, start)) @ np.exp(np.outer(values, times))
    for m, q in zip(motion.measures, path.real, strict=True):
        top = np.abs(q).max()
        assert top * (1 - 1e-9) <= abs(m.peak) <= top * 1.001
        back = (-np.sign(m.peak) * q)[times >= m.at].max(initial=0) / top
        assert m.overshoot == pytest.approx(back, abs=1e-3)
        assert np.abs(q[times > m.settling]).max() <= 0.02 * abs(m.peak) * (1 + 1e-9)
        assert np.abs(q[times <= m.settling][-2:]).max() >= 0.019 * abs(m.peak)


def test_a_root_far_to_the_left_hides_no_peak():
    """q″ + 1001 q′ + 1000 q = 0 pushed: the peak is at log(1000)/999, long before the first point of the table."""
    fast = tmsopt.Problem(from_matrices(M=[[1]], D=[["c"]], K=[[1000]]), fixed={"c": 1001.0})
    (found,) = tmsopt.simulate(fast, start={"q1dot": 1}, points=5).measures
    at = math.log(1000) / 999
    assert found.at == pytest.approx(at, rel=1e-6)
    assert found.peak == pytest.approx((math.exp(-at) - math.exp(-1000 * at)) / 999, rel=1e-12)


@pytest.mark.parametrize("damping", [1e-4, 50.0, 1e3])
def test_slow_decay_is_followed_to_its_end(damping):
    """Of an overdamped one the slow root alone is left, e^(s t)/(1 − s/f): s = −ζ + √(ζ² − 1), f the fast one."""
    (found,) = tmsopt.simulate(spring(damping), start={"q1": 1}).measures
    if damping < 1:  # within half a period of its envelope
        assert found.settling == pytest.approx(math.log(50) / damping, abs=math.pi)
        return
    slow = -1 / (damping + math.sqrt(damping**2 - 1))
    amplitude = 1 / (1 - slow * slow)  # f s = 1
    assert found.settling == pytest.approx(math.log(50 * amplitude) / -slow, rel=1e-8)  # rounding is relative to f


def test_what_dies_out_too_slowly_is_said():
    motion = tmsopt.simulate(spring(1e-9), start={"q1": 1})
    assert motion.stable
    assert math.isnan(motion.measures[0].settling)
    assert "stable, but the motion decays too slowly for a settling time" in str(motion)
    assert len(tmsopt.plots.draw_motion(motion).patches) == 0


# White noise


def test_an_oscillator_in_noise_has_the_variance_of_the_closed_form():
    """q″ + c q′ + k q = σ ẇ: var q = σ²/(2 c k), var q′ = σ²/(2 c), uncorrelated."""
    c, k, sigma = 0.3, 2.0, 1.7
    A, force = np.array([[0, 1], [-k, -c]]), np.array([0, sigma])
    assert stationary_covariance(A, force) == pytest.approx(
        np.diag([sigma**2 / (2 * c * k), sigma**2 / (2 * c)]), abs=1e-13
    )
    count = 20_000  # each 20 decay times apart, so that they are independent: the step is exact, however long
    path = simulate_noise(A, np.zeros(2), force, 20 * 2 / c, count, seed=1)[1:]
    off = 5 * math.sqrt(2 / count)  # five standard deviations of a variance
    assert path.var(axis=0) == pytest.approx([sigma**2 / (2 * c * k), sigma**2 / (2 * c)], rel=off)


def test_the_benchmark_in_noise_has_the_variance_of_its_frequency_response():
    """(1/2π) ∫ |H(iω)|² dω σ², H from the matrices of Meijaard et al.; nothing of tmsopt's motion in it."""
    motion = tmsopt.simulate(BENCHMARK, noise=0.2, seed=3)
    p = motion.parameters
    M, C1, K0, K2 = (np.array(m, dtype=float) for m in canonical(p))

    def response(w, row):
        L = -(w**2) * M + 1j * w * p["v"] * C1 + p["g"] * K0 + p["v"] ** 2 * K2
        return float(abs(np.linalg.solve(L, [0, 1])[row]) ** 2)

    for row, name in enumerate(("phi", "delta")):
        parts = [quad(response, a, b, (row,), limit=400)[0] for a, b in ((0, 3), (3, 5), (5, 50), (50, np.inf))]
        assert motion.deviations[name] == pytest.approx(0.2 * math.sqrt(sum(parts) / math.pi), rel=1e-6)
    again, other = (tmsopt.simulate(BENCHMARK, noise=0.2, seed=s)["phi"] for s in (3, 4))
    assert again == motion["phi"] != other
    assert all(math.isnan(m.settling) for m in motion.measures)


def test_noise_and_a_push_add_up():
    """The equations are linear."""
    asked = {"seconds": 4, "points": 101}
    both = tmsopt.simulate(BENCHMARK, lean=5, noise=1.0, **asked)
    parts = [tmsopt.simulate(BENCHMARK, **one, **asked) for one in ({"lean": 5}, {"noise": 1.0})]
    for name in both.columns:
        if name not in ("t", "x"):
            assert column(both, name) == pytest.approx(sum(column(m, name) for m in parts), abs=1e-11)


# Shapes of modes


def test_modes_are_eigenvectors_where_roots_are_simple():
    motion = tmsopt.simulate(BENCHMARK)
    p = motion.parameters
    M, C1, K0, K2 = (np.array(m, dtype=float) for m in canonical(p))
    zero, one = np.zeros((2, 2)), np.eye(2)
    values, vectors = eig(
        np.block([[zero, one], [-p["g"] * K0 - p["v"] ** 2 * K2, -p["v"] * C1]]), np.block([[one, zero], [zero, M]])
    )
    assert len(motion.modes) == 3
    for mode in motion.modes:
        k = int(np.abs(values - complex(mode.re, mode.im)).argmin())
        ratio = vectors[1, k] / vectors[0, k]
        assert mode.steer_per_lean == pytest.approx(abs(ratio), rel=1e-9)
        assert mode.phases["delta"] == pytest.approx(np.degrees(np.angle(ratio)), abs=1e-7)
        assert (mode.multiplicity, mode.geometric, mode.partial) == (1, 1, (1,))


@pytest.mark.parametrize("file", ["ep4.toml", "optimised_benchmark.toml", "whipple_ep4.toml"])
def test_four_modes_merge_in_one_at_an_ep4(file):
    """At the real root: (M s² + D s + K) (1, κ) = 0, κ = −L₁₁/L₁₂ from the first row alone."""
    motion = tmsopt.simulate(PROBLEMS / file)
    (mode,) = motion.modes
    model, of = motion.problem.model, motion.problem.posed.parameter_set
    assert model.pencil is not None
    assert of.rate is None or of.rate(motion.parameters) == 1
    M, D, K = (np.array(m, dtype=float) for m in model.pencil(of.native(motion.parameters)))
    L = mode.re**2 * M + mode.re * D + K
    ratio = -L[0, 0] / L[0, 1]
    assert mode.steer_per_lean == pytest.approx(abs(ratio), rel=1e-6)
    assert mode.phases["delta"] == (0 if ratio > 0 else 180)
    assert (mode.multiplicity, mode.geometric, mode.partial, mode.im) == (4, 1, (4,), 0)
    assert "EP4: four modes merge in one shape, a Jordan chain of 4" in str(motion)


def test_modes_that_only_cross_keep_their_shapes():
    twins = from_matrices(M=[[1, 0], [0, 1]], D=[["c", 0], [0, "c"]], K=[[4, 0], [0, 4]])
    motion = tmsopt.simulate(tmsopt.Problem(twins, fixed={"c": 0.5}))
    assert [(m.multiplicity, m.geometric, m.partial) for m in motion.modes] == [(2, 2, (1, 1))] * 2
    shapes = np.array([[m.amplitudes["q1"], m.amplitudes["q2"]] for m in motion.modes])
    assert abs(np.linalg.det(shapes)) > 0.1
    assert "two roots coincide and keep two mode shapes" in str(motion)


# The command


def run(*words):
    done = CliRunner().invoke(main, list(words))
    return done.exit_code, done.stdout, done.stderr


def test_the_command_writes_what_the_function_gives(tmp_path):
    table, picture = tmp_path / "motion.csv", tmp_path / "motion.png"
    table.write_text("older")  # which is replaced as a whole, as by other commands
    words = f"simulate {BENCHMARK} --lean 5 --push 10 --seconds 3 --csv {table} --plot {picture}".split()
    status, out, err = run(*words)
    assert (status, err) == (0, f"wrote {table}\nwrote {picture}\n")
    motion = tmsopt.simulate(BENCHMARK, lean=5, push=10, seconds=3)
    assert out == f"{motion}\n"
    assert table.read_bytes().startswith(b"t,phi,delta,phidot,deltadot\r\n")
    rows = [[float(x) for x in row.values()] for row in csv.DictReader(table.read_text().splitlines())]
    assert rows == [list(row) for row in zip(*(motion[n] for n in motion.names), strict=True)]
    assert (rows[0][1], rows[-1][0]) == (math.radians(5), 3.0)
    assert picture.read_bytes().startswith(b"\x89PNG")
    run(*words, "--path")
    assert table.read_text().splitlines()[0] == "t,phi,delta,phidot,deltadot,psi,y_rear,y_front,x"


def test_the_command_answers_in_json():
    status, out, _ = run("simulate", str(BENCHMARK), "--lean", "5", "--seconds", "3", "--points", "4", "--json")
    data = json.loads(out)
    assert (status, data["schema"], data["model"], data["stable"]) == (0, 1, "whipple", True)
    assert data["columns"]["t"] == [0, 1, 2, 3]
    assert data["columns"]["phi"][0] == math.radians(5)
    assert data["disturbance"] == {"start": {"phi": math.radians(5)}, "push": 0, "lean_push": 0, "default": False}
    assert set(data["modes"][0]) == {
        "re",
        "im",
        "multiplicity",
        "geometric",
        "partial",
        "amplitudes",
        "phases",
        "steer_per_lean",
    }


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        ("{p}/ep4.toml --start Fr=1", 2, "unknown state 'Fr'"),
        ("{p}/ep4.toml --start phi", 2, "--start: found 'phi'; accepted: NAME=VALUE, such as phidot=0.1"),
        ("{p}/ep4.toml --start phi=x", 2, "--start.phi: found 'x'; accepted: a number"),
        ("{p}/ep4.toml --csv motion.txt", 2, "--csv: found 'motion.txt'; accepted: a file name ending in csv"),
        ("{p}/ep4.toml --path", 2, "--path: changes what --csv writes; add --csv FILE"),
        ("{p}/ziegler.toml --push 1", 2, "push: a stated system has no lean and no steer"),
        ("{p}/none.toml", 2, "no such file"),
    ],
)
def test_bad_words_are_told(words, status, said):
    code, out, err = run("simulate", *words.format(p=PROBLEMS).split())
    assert (code, out) == (status, "")
    assert said in err


def test_all_that_cannot_be_asked_is_told_at_once():
    with pytest.raises(tmsopt.InputError) as error:
        tmsopt.simulate(BENCHMARK, lean=[1], start=[1], seconds=-1)  # type: ignore[arg-type]
    assert [fault.key for fault in error.value.faults] == [("lean",), ("start",), ("seconds",)]


def test_without_a_design_there_is_no_motion(tmp_path):
    file = tmp_path / "none.toml"
    file.write_text((PROBLEMS / "ep4.toml").read_text() + '[constraints]\ndecay = "abscissa <= -100"\n')
    code, out, err = run("simulate", str(file))
    assert (code, out) == (3, "")
    assert err.endswith("infeasible; there is no design to examine\n")


def test_the_default_and_units_are_said():
    text = str(tmsopt.simulate(ep4()))
    assert "from lean phi = 1 deg (the default disturbance)" in text
    assert "√(w/g)" in text
    pushed = str(tmsopt.simulate(ep4(), push=0.001, noise=0.1, seed=5))
    assert "an impulse of steer torque of 0.001 m_B g w √(w/g)" in pushed
    assert "white noise of steer torque of 0.1 m_B g w (w/g)^(1/4) (seed 5)" in pushed
    fast = tmsopt.simulate(tmsopt.Problem(whipple, fixed={**tmsopt.load(BENCHMARK).fixed, "v": 2.0}), lean=1)
    assert "not stable: the motion does not settle" in str(fast)
    assert all(math.isnan(m.settling) for m in fast.measures)
