"""The Carvallo–Whipple bicycle: the published benchmark, the limit to skates, its speeds, files and problems."""

import json
import math
import re
import runpy
from fractions import Fraction

import casadi as ca
import flint
import mpmath
import numpy as np
import pytest
from helpers.bicycles import BENCHMARK, MATRICES, appendix, bicycles
from helpers.oracles import ep4_of_heights
from mpmath import mp

import tmsopt
from tmsopt import laws
from tmsopt.dynamics import find_crossings
from tmsopt.models import MODELS, Values, canonical, copo, problem_text, spin, whipple
from tmsopt.roots import exact_roots, quadratic_pencil

SI = whipple.sets[0]
NONE = {p.name: 0.0 for p in SI.parameters if p.default == 0}
EIGENVALUES = {
    0: (-3.13164324790656, 3.13164324790656, -5.53094371765393, 5.53094371765393),
    1: (-3.13423125066578, 3.52696170990070 + 0.8077402751993j, -7.11008014637442),
    2: (-3.07158645641514, 2.68234517512745 + 1.68066296590675j, -8.67387984831735),
    3: (-2.63366137253667, 1.70675605663975 + 2.31582447384325j, -10.35101467245920),
    4: (-1.42944427361326, 0.41325331521125 + 3.07910818603206j, -12.15861426576450),
    5: (-0.32286642900409, -0.77534188219585 + 4.46486771378823j, -14.07838969279820),
    6: (-0.00406690076970, -1.52644486584142 + 5.87673060598709j, -16.08537123098030),
    7: (0.10268170574766, -2.13875644258362 + 7.19525913329805j, -18.15788466125262),
    8: (0.14327879765713, -2.69348683581097 + 8.46037971396931j, -20.27940894394569),
    9: (0.15790184030917, -3.21675402252485 + 9.69377351531791j, -22.43788559040858),
    10: (0.16105338653172, -3.72016840437287 + 10.90681139476287j, -24.62459635017404),
}
"""Table 2 there: speed in m/s → capsize, weave (one of a pair) and castering eigenvalues."""


def polynomial_of(p, T):
    """Coefficients by the paper's matrices, in the numbers given, T = tan λ_s."""
    cosine = 1 / mpmath.sqrt(1 + T * T)
    M, C1, K0, K2 = appendix(p, T * cosine, cosine)
    v, g = p["v"], p["g"]
    D = [[v * x for x in row] for row in C1]
    K = [[g * x + v * v * y for x, y in zip(*rows, strict=True)] for rows in zip(K0, K2, strict=True)]
    return quadratic_pencil(M, D, K)


# The benchmark


def test_matrices_of_the_benchmark_to_all_printed_digits():
    for got, printed in zip(canonical(BENCHMARK), MATRICES, strict=True):
        np.testing.assert_allclose(got, printed, rtol=0, atol=1.5e-14)  # 14 decimals, and a rounding of 80


@pytest.mark.parametrize("speed", EIGENVALUES)
def test_eigenvalues_of_the_benchmark_to_12_digits(speed):
    """The printed decimals are more than a double holds of the larger ones; 12 digits of each are asked for."""
    printed = [*EIGENVALUES[speed], *(z.conjugate() for z in EIGENVALUES[speed] if isinstance(z, complex))]
    roots = [complex(r.re, r.im) for r in exact_roots(whipple.coefficients({**BENCHMARK, "v": float(speed)}))]
    assert len(roots) == len(printed) == 4
    for z in printed:
        assert min(abs(z - r) for r in roots) <= 1e-12 * max(1, abs(z))


def test_weave_capsize_and_double_root_of_the_benchmark():
    found = tmsopt.speeds(tmsopt.Problem(whipple, fixed=BENCHMARK))
    double, weave, capsize = found.found
    assert [c.kind for c in found.found] == ["EP2", "weave", "capsize"]
    assert double.at == pytest.approx(0.68428307889246, abs=2e-14)
    assert double.root.re == pytest.approx(3.78290405129320, abs=2e-14)
    assert weave.at == pytest.approx(4.29238253634111, abs=2e-14)
    assert weave.root.im == pytest.approx(3.43503384866144, abs=2e-14)
    assert capsize.at == pytest.approx(6.02426201538837, abs=2e-14)
    assert [c.changes for c in found.found] == [False, True, True]
    assert (found.stable, found.heavily_damped) == (((weave.at, capsize.at),), ())
    assert (found.weave, found.capsize, found.exceptional) == ((weave.at,), (capsize.at,), (double,))


# The equations


def test_matrices_are_those_of_the_appendix():
    """Two ways to sum the same bodies: equal but for rounding of the largest terms, some ten of them."""
    for p in bicycles(40):
        expected = appendix(p, math.sin(p["lambda_s"]), math.cos(p["lambda_s"]))
        for got, printed in zip(canonical(p), expected, strict=True):
            np.testing.assert_allclose(got, printed, rtol=1e-11, atol=1e-13 * np.abs(printed).max())


# The limit: no wheels, no trail


def test_without_wheels_and_trail_it_is_tms_identically():
    """In fractions: both polynomials, for w = m_B = g = 1, are equal up to μ (χ_H − 1 − ζ_H T); 200 points of ten bits.

    Two polynomials of degree below 8 in each of seven numbers cannot agree at as many random points by chance.
    """
    rng = np.random.default_rng(6)
    zero = dict.fromkeys((n for n in NONE if n not in ("I_Ryy", "I_Fyy")), Fraction(0)) | {"S_R": 0, "S_F": 0}
    for _ in range(200):
        Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T = (Fraction(int(n), 64) for n in rng.integers(-1000, 1000, 7))
        got = whipple.polynomial(
            **zero, w=1, g=1, v=Fr, T=T, m_B=1, x_B=chi_B, z_B=zeta_B, m_H=mu, x_H=chi_H, z_H=zeta_H
        )
        common = mu * (chi_H - 1 - zeta_H * T)
        assert got == [common * c for c in copo(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, T)]


def test_no_wheel_is_no_division():
    """S = I/r is 0 for a wheel that has no inertia, in every arithmetic, and nan for one that has but no radius."""
    for number in (float, flint.fmpq, flint.arb):
        assert spin(number(0), number(0)) == 0
        assert spin(number(3), number(2)) == number(3) / number(2)
    assert math.isnan(spin(0.1, 0.0))
    assert not spin(flint.arb(1), flint.arb(0)).is_finite()
    np.testing.assert_array_equal(spin(np.array([0.0, 0.12]), np.array([0.0, 0.3])), [0.0, 0.12 / 0.3])
    symbols = ca.SX.sym("I"), ca.SX.sym("r")
    function = ca.Function("S", symbols, [spin(*symbols), ca.jacobian(spin(*symbols), ca.vertcat(*symbols))])
    value, slopes = function(0, 0)
    assert float(value) == 0
    assert np.all(np.isfinite(np.array(slopes)))


def test_what_is_left_out_is_not_there():
    """The nearest edge of stability moves nothing that is 0 by default."""
    fixed = {
        "w": 1.0,
        "v": 7.0,
        "lambda_s": 0.4,
        "m_B": 10.0,
        "x_B": 1.4,
        "z_B": -0.4,
        "m_H": 1.0,
        "x_H": 1.02,
        "z_H": -0.2,
    }
    assert set(tmsopt.nearest(tmsopt.Problem(whipple, fixed=fixed), "weave").direction) == set(fixed)


# Quantities and speeds


def test_loads_are_the_moments():
    values = Values(whipple, SI, BENCHMARK)
    g, weights = 9.81, {"R": (2.0, 0.0), "B": (85.0, 0.3), "H": (4.0, 0.9), "F": (3.0, 1.02)}
    front = sum(m * x for m, x in weights.values()) * g / 1.02
    assert values["N_F"] == pytest.approx(front, rel=1e-14)
    assert values["N_F"] + values["N_R"] == pytest.approx(94 * g, rel=1e-14)
    assert values["mechanical_trail"] == pytest.approx(0.08 * math.cos(math.pi / 10), rel=1e-14)
    assert values["mass_margin"] == pytest.approx(np.linalg.eigvalsh(MATRICES[0])[0], rel=1e-11)


def test_speed_quantities_are_the_speeds_found():
    weaving = 0
    for p in bicycles(7, seed=7):
        found = tmsopt.speeds(p, problem=tmsopt.Problem(whipple, fixed=p))
        values = Values(whipple, SI, p)
        least = min(found.weave, default=math.nan)
        assert values["v_weave"] == pytest.approx(least, rel=1e-9, nan_ok=True)
        assert values["v_capsize"] == pytest.approx(min(found.capsize, default=math.nan), rel=1e-9, nan_ok=True)
        weaving += math.isfinite(least)
    assert 1 < weaving < 7


def test_no_speed_is_missed():
    """Along a fine grid, a change of stability or of the number of real roots stands at a speed that was found."""
    grid = np.linspace(0.01, 25, 801)
    for p in bicycles(5, seed=8):
        found = tmsopt.speeds(p, problem=tmsopt.Problem(whipple, fixed=p))
        roots = np.array(
            [np.roots(a) for a in np.stack(np.broadcast_arrays(*whipple.coefficients({**p, "v": grid})), axis=-1)]
        )
        real, right = np.abs(roots.imag) <= 1e-7 * np.abs(roots).max(axis=1)[:, None], roots.real.max(axis=1)
        for state in (right < 0, real.sum(axis=1)):
            for k in np.flatnonzero(state[1:] != state[:-1]):
                step = grid[1] - grid[0]
                assert any(grid[k] - step <= c.at <= grid[k + 1] + step for c in found.found)
        for low, high in found.stable:
            assert np.all(right[(grid > low) & (grid < high)] < 1e-9)


def test_speeds_of_skates_are_those_of_the_paper():
    problem = tmsopt.load("problems/benchmark.toml")
    found = tmsopt.speeds(problem)
    shape = {n: v for n, v in tmsopt.models.tms.sets[1].native(problem.fixed).items() if n != "Fr"}
    assert found.weave == pytest.approx([float(laws.Fr_c(**shape)) * math.sqrt(9.81)], rel=1e-13)
    assert found.stable == ((found.weave[0], math.inf),)
    ep4 = tmsopt.speeds(tmsopt.solve(tmsopt.load("problems/ep4.toml")))
    assert ep4.parameter == "Fr"
    assert (ep4.lower, ep4.upper) == (0.01, 10.0)


def test_crossings_of_small_polynomials():
    """s² + y s + 1 = 0: double roots at y = ±2, the axis at 0. s² + y: mirrored for every y, a double root 0 at 0."""
    one, y = [1], [0, 1]
    found = find_crossings([one, y, one], -5, 5)
    assert [(c.at, c.kind, c.root.re, c.root.im) for c in found.found] == [
        (-2, "EP2", 1, 0),
        (0, "weave", 0, 1),
        (2, "EP2", -1, 0),
    ]
    assert found.stable == ((0, 5),)
    assert found.heavily_damped == ((2, 5),)
    mirrored = find_crossings([one, [0], y], -1, math.inf)
    assert mirrored.always == ("weave",)
    assert {c.kind for c in mirrored.found} == {"capsize", "EP2"}
    # (s² + 2s + 5)² + y: complex pairs that meet; y s + 1: a root that comes back from infinity
    meeting = find_crossings([one, [4], [14], [20], [25, 1]], -1, 1)
    assert [(c.kind, c.root.re, c.root.im, c.root.multiplicity) for c in meeting.found] == [("CEP2", -1, 2, 2)]
    assert [(c.at, c.kind) for c in find_crossings([y, one], -1, 1).found] == [(0, "infinity")]


def test_crossings_left_of_another_root_change_no_stability():
    """(s² + y s + 1)(s − 3): the root 3 is right of all, and is double at y = −10/3; −3 mirrors it at y = 10/3."""
    found = find_crossings([[1], [-3, 1], [1, -3], [-3]], -5, 5)
    assert [(c.at, c.kind, c.rightmost, c.changes) for c in found.found] == [
        (-10 / 3, "EP2", True, False),
        (-2, "EP2", False, False),
        (0, "weave", False, False),
        (2, "EP2", False, False),
    ]
    assert found.stable == ()
    assert [c.rightmost for c in find_crossings([[1], [0, 1], [1]], -5, 5).found] == [True, True, True]


def test_what_speeds_refuses():
    fixed = tmsopt.Problem(whipple, fixed=BENCHMARK)
    with pytest.raises(tmsopt.InputError, match="not polynomials in lambda_s"):
        tmsopt.speeds(fixed, "lambda_s", between=(0.1, 0.5))
    with pytest.raises(tmsopt.InputError, match="unknown parameter"):
        tmsopt.speeds(fixed, "speed")
    weave = tmsopt.speeds(fixed, "c", between=(0.0, 0.3)).weave  # at 5 m/s, too much trail weaves
    at = np.roots(whipple.coefficients({**BENCHMARK, "c": weave[0]}))
    assert np.abs(at.real).min() < 1e-10


def test_a_wheel_without_radius_may_have_no_inertia():
    with pytest.raises(tmsopt.InputError, match="r_F may be 0 while I_Fyy is not"):
        tmsopt.Problem(whipple, fixed={**BENCHMARK, "r_F": 0.0})
    with pytest.raises(tmsopt.InputError, match="r_R may be 0"):
        tmsopt.Problem(whipple, fixed={n: v for n, v in BENCHMARK.items() if n != "r_R"}, free={"r_R": (0.0, 0.3)})


# Files of BicycleParameters

FILE = """\
# the benchmark, as BicycleParameters keeps it
w = 1.02+/-0.0
c = 0.08+/-0.0
lam = 0.314159265358979323846+/-0.0
g = 9.81+/-0.0
rR = 0.3+/-0.0
mR = 2.0+/-0.0
IRxx = 0.0603+/-0.0
IRyy = 0.12+/-0.0
xB = 0.3+/-0.01
zB = -0.9+/-0.0
mB = 84.0 +/- 3.0, 86.0 +/- 4.0   # two measurements
IBxx = 9.2+/-0.0
IByy = 11.0+/-0.0
IBzz = 2.8+/-0.0
IBxz = 2.4+/-0.0
xH = 0.9+/-0.0
zH = -0.7+/-0.0
mH = 4.0+/-0.0
IHxx = 0.05892+/-0.0
IHyy = 0.06+/-0.0
IHzz = 0.00708+/-0.0
IHxz = -0.00756+/-0.0
rF = 0.35+/-0.0
mF = 3.0+/-0.0
IFxx = 0.1405+/-0.0
IFyy = (2.80+/-0.10)e-01
"""


def test_text_file_of_bicycle_parameters(tmp_path):
    path = tmp_path / "BenchmarkBenchmark.txt"
    path.write_text(FILE)
    bicycle = tmsopt.read_bicycle(path)
    assert dict(bicycle.parameters) == {n: v for n, v in BENCHMARK.items() if n != "v"}
    assert dict(bicycle.uncertainties) == pytest.approx({"x_B": 0.01, "m_B": 2.5, "I_Fyy": 0.01})  # √(3² + 4²)/2
    assert dict(bicycle.others) == {"IByy": 11.0, "IHyy": 0.06}
    assert bicycle.tolerances(2, most=2) == pytest.approx({"x_B": 0.02, "I_Fyy": 0.02})
    for ending in ("txt", "yml"):
        copy = tmp_path / f"copy.{ending}"
        tmsopt.write_bicycle(bicycle, copy)
        again = tmsopt.read_bicycle(copy)
        assert (again.parameters, again.others) == (bicycle.parameters, bicycle.others)
        assert again.uncertainties == (bicycle.uncertainties if ending == "txt" else {})
    problem = tmp_path / "p.toml"
    problem.write_text('bicycle = "BenchmarkBenchmark.txt"\n[parameters]\nv = 4\nc = { min = 0.01, max = 0.1 }\n')
    loaded = tmsopt.load(problem)
    assert loaded.model is MODELS["whipple"]
    assert loaded.fixed == {n: v for n, v in {**BENCHMARK, "v": 4.0}.items() if n != "c"}
    problem.write_text(problem_text(bicycle, 4.6))
    assert tmsopt.load(problem).fixed == {**BENCHMARK, "v": 4.6}


def test_parts_and_other_geometry_are_kept_aside(tmp_path):
    """RigidBenchmark.txt has the handlebar (G) and the fork (S) of H too, others both diameters, the offsets, a push."""
    more = "mG = 3.35\nIGxz = 0.0049+/-3e-05\nxS = 0.892\nISyy = 0.093\nIRzz = 0.0603\nIFzz = 0.1405\nd3 = 0.03\nzcl = -0.9\n"
    path = tmp_path / "RigidBenchmark.txt"
    path.write_text(FILE + more)
    bicycle = tmsopt.read_bicycle(path)
    assert dict(bicycle.parameters) == {n: v for n, v in BENCHMARK.items() if n != "v"}
    assert (bicycle.others["mG"], bicycle.others["zcl"]) == (3.35, -0.9)
    path.write_text(FILE + "mK = 3\n")
    with pytest.raises(tmsopt.InputError, match=r"unknown name 'mK'.* accepted: w c lam [^G]*$"):
        tmsopt.read_bicycle(path)


def test_yaml_files_of_bicycle_parameters(tmp_path):
    """Both layouts that the program has had."""
    names = {n: "lam" if n == "lambda_s" else n.replace("_", "") for n in SI.names}
    numbers = "".join(f"{{}}{names[n]}: {v!r}  # measured\n" for n, v in BENCHMARK.items())
    head = (
        "parameterization: benchmark  # the symbols\nrider: True\ndescription: |\n        w: of the paper.\nvalues:\n"
    )
    for text in (head + numbers.replace("{}", "        "), "# a comment\n" + numbers.replace("{}", "")):
        path = tmp_path / "benchmark.yml"
        path.write_text(text)
        assert dict(tmsopt.read_bicycle(path).parameters) == BENCHMARK
    path.write_text("parameterization: principal\nvalues:\n  w: 1.0\n")
    with pytest.raises(tmsopt.InputError, match="found the parameterization 'principal'; accepted: Meijaard2007"):
        tmsopt.read_bicycle(path)


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("lam =", "lambda =", 4, "unknown name 'lambda'; did you mean 'lam'"),
        ("zB = -0.9+/-0.0", "zB = high", 11, "zB: found 'high'; accepted: a number"),
        ("c = 0.08+/-0.0\n", "", 0, "missing: c."),
        ("rF = 0.35", "rF = -0.35", 0, "rF = -0.35 is not physical"),
        ("w = 1.02+/-0.0", "hbb = 0.3", 2, "unknown name 'hbb'"),
    ],
)
def test_faults_of_a_parameter_file(tmp_path, old, new, line, words):
    path = tmp_path / "bad.txt"
    path.write_text(FILE.replace(old, new))
    with pytest.raises(tmsopt.InputError) as caught:
        tmsopt.read_bicycle(path)
    fault = next(f for f in caught.value.faults if words in str(f))
    assert fault.file == str(path)
    assert fault.line == line


def test_a_file_without_wheels_is_read(tmp_path):
    """As the one that the program has of two-mass skates."""
    path = tmp_path / "b.txt"
    path.write_text(re.sub(r"(?m)^((?:[rm]|I)[RF]\w* = ).*", r"\g<1>0.0", FILE))
    assert tmsopt.read_bicycle(path).parameters["r_F"] == 0


def test_writing_needs_a_known_ending_and_every_parameter(tmp_path):
    with pytest.raises(tmsopt.InputError, match="accepted: a file name ending in"):
        tmsopt.write_bicycle(BENCHMARK, tmp_path / "b.csv")
    with pytest.raises(tmsopt.InputError, match="missing parameter w"):
        tmsopt.write_bicycle({n: v for n, v in BENCHMARK.items() if n != "w"}, tmp_path / "b.txt")
    tmsopt.write_bicycle(BENCHMARK, tmp_path / "b.yml")
    assert dict(tmsopt.read_bicycle(tmp_path / "b.yml").parameters) == BENCHMARK


# The problems


def multiple_root(p, unknowns, start, multiplicity):
    """Unknown parameters and a root s with p = p′ = … = 0, at 40 digits, from the paper's own matrices."""
    with mp.workdps(40):
        numbers = {n: mp.mpf(repr(x)) for n, x in p.items()}

        def conditions(*x):
            own = {**numbers, **dict(zip(unknowns, x[:-1], strict=True))}
            a = polynomial_of(own, own.pop("lambda_s"))
            a = [c / a[0] for c in a]
            found = []
            for _ in range(multiplicity):
                found.append(mpmath.polyval(a, x[-1]))
                a = [c * (len(a) - 1 - k) for k, c in enumerate(a[:-1])]
            return found

        return [float(x) for x in mpmath.findroot(conditions, [mp.mpf(x) for x in start], tol=1e-50, maxsteps=60)]


def test_best_tilt_and_trail_of_the_benchmark_are_an_ep3():
    design = tmsopt.solve(tmsopt.load("problems/whipple_trail.toml"))
    assert design.structure == "EP3"
    start = (design.parameters["c"], math.tan(design.parameters["lambda_s"]), design.abscissa)
    c, T, s = multiple_root(BENCHMARK, ("c", "lambda_s"), [float(f"{x:.3g}") for x in start], 3)
    assert design.parameters["c"] == pytest.approx(c, abs=1e-11)
    assert math.tan(design.parameters["lambda_s"]) == pytest.approx(T, rel=1e-11)
    assert design.value == pytest.approx(s, rel=1e-10)
    assert tmsopt.prove(tmsopt.load("problems/whipple_trail.toml")).proved


def test_ep4_on_wheels_stands_on_both():
    problem = tmsopt.load("problems/whipple_ep4.toml")
    design = tmsopt.solve(problem)
    assert design.structure == "EP4"
    start = [*(float(f"{design.parameters[n]:.4g}") for n in ("v", "x_B")), 0.681, float(f"{design.value:.4g}")]
    v, x_B, T, s = multiple_root({**NONE, **problem.fixed}, ("v", "x_B", "lambda_s"), start, 4)
    assert design.parameters["v"] == pytest.approx(v, rel=1e-11)
    assert design.parameters["x_B"] == pytest.approx(x_B, rel=1e-11)
    assert math.tan(design.parameters["lambda_s"]) == pytest.approx(T, rel=1e-11)
    assert design.value == pytest.approx(s, rel=1e-11)
    weight = (10 * x_B + 1 + 1) / 13
    assert design.quantities["load_rear"] == pytest.approx(1 - weight, rel=1e-10)
    assert 1 - weight > 0.1


@pytest.fixture(scope="module")
def unfold():
    digits = flint.ctx.dps
    yield runpy.run_path("problems/whipple_unfold.py")
    flint.ctx.dps = digits


@pytest.mark.parametrize(("wheels", "trail"), [(1, 0), (0, 1)])
def test_ep4_unfolds_by_the_fourth_root(unfold, wheels, trail):
    """p(r + σ) = a0 σ⁴ + ε q: the four roots stand at (−ε q/a0)^(1/4), q by the paper's matrices at 60 digits."""
    with mp.workdps(60):
        g, step = mp.mpf("9.81"), mp.mpf(10) ** -30
        own = {"w": 1, "g": g, "m_B": 10, "z_B": mp.mpf("-0.4"), "m_H": 1, "x_H": 1, "z_H": mp.mpf("-0.2")}
        at = ep4_of_heights(own["z_B"], own["z_H"])
        r = at["r"] * mp.sqrt(g)
        p = dict.fromkeys(SI.names, mp.mpf(0)) | own | {"v": at["Fr"] * mp.sqrt(g), "x_B": at["chi_B"]}
        radius = mp.mpf("0.3") * step * wheels or mp.mpf(10) ** -50  # the appendix divides by it
        for k in "RF":
            p |= {f"r_{k}": radius, f"m_{k}": mp.mpf(1), f"I_{k}xx": radius**2 / 2, f"I_{k}yy": radius**2}
        a = polynomial_of({**p, "c": mp.mpf("0.05") * step * trail}, at["T"])
        q = float(mpmath.polyval(a, r) / a[0] / step)
    assert unfold["first_order"](wheels, trail)[0] == pytest.approx(q, rel=1e-9)
    for exponent in (16, 20):
        eps = flint.fmpq(1, 10**exponent)
        moved = unfold["displacements"](eps, wheels, trail)
        expected = np.roots([1, 0, 0, 0, q * 10.0**-exponent])
        # the next term is of the order of ε^(1/2)
        assert all(np.abs(moved - z).min() < 2e-3 * abs(z) for z in expected)


def test_the_trail_that_holds_ep4_leaves_by_the_third_root(unfold):
    """With p(r) held to first order: σ⁴ + ε q₁ σ = 0, so three roots at (−ε q₁)^(1/3)."""
    held = flint.fmpq(*float(unfold["held_trail"]()).as_integer_ratio())
    _, slope = unfold["first_order"](1, held)
    moved, expected = unfold["displacements"](flint.fmpq(1, 10**9), 1, held), np.roots([1, 0, 0, slope * 1e-9])
    assert all(np.abs(moved - z).min() < 0.05 * abs(z) for z in expected)
    assert np.abs(moved).min() < 0.1 * np.abs(expected).min()


def test_ep4_is_tuned_back_on_wheels(unfold):
    """From the skates' EP4, at a size of 1 %: the paper's matrices have a four-fold root there."""
    near = {n: float(unfold["skates"][n]) for n in ("v", "x_B", "lambda_s")}
    design = unfold["tuned"](0.01, near)
    p = {**NONE, **design.problem.fixed}
    start = [*(design.parameters[n] for n in ("v", "x_B")), math.tan(design.parameters["lambda_s"]), design.abscissa]
    found = multiple_root(p, ("v", "x_B", "lambda_s"), [float(f"{x:.4g}") for x in start], 4)
    assert start == pytest.approx(found, rel=1e-9)
    assert design.parameters["v"] == pytest.approx(near["v"], rel=0.1)


# The command


def test_speeds_command(run):
    benchmark = "problems/whipple_benchmark.toml"
    code, out, _ = run("speeds", benchmark)
    assert code == 0
    assert "stable: from 4.2923825 to 6.024262 m/s" in out
    data = json.loads(run("speeds", benchmark, "--json")[1])
    assert [c["kind"] for c in data["found"]] == ["EP2", "weave", "capsize"]
    assert data["stable"] == [[pytest.approx(4.29238253634111), pytest.approx(6.02426201538837)]]
    assert run("speeds", benchmark, "--parameter", "lambda_s", "--between", "0,1")[0] == 2
    assert run("speeds", "problems/chart.toml")[0] == 2


def test_report_of_a_whipple_bicycle(run):
    code, out, _ = run("solve", "problems/whipple_benchmark.toml")
    assert code == 0
    for words in ("; stands on both wheels", "from 4.2924 to 6.0243 m/s", "1/s"):
        assert words in out
    assert "dimensionless" not in out


def test_import_command(tmp_path, run):
    (tmp_path / "b.txt").write_text(FILE)
    out = tmp_path / "b.toml"
    assert run("import", tmp_path / "b.txt", "--speed", "4.6", "-o", out)[0] == 0
    assert tmsopt.load(out).fixed == {**BENCHMARK, "v": 4.6}
    assert run("import", tmp_path / "b.txt")[1] == problem_text(tmsopt.read_bicycle(tmp_path / "b.txt"))
    (tmp_path / "bad.txt").write_text("w = 1\n")
    assert run("import", tmp_path / "bad.txt")[0] == 2


def test_compare_says_that_its_laws_are_of_skates(run):
    code, out, _ = run("compare", "problems/whipple_trail.toml")
    assert code == 0
    assert "no laws are known for the Carvallo–Whipple bicycle" in out
    assert "matching minus abscissa" in out


def test_proof_tells_unknowns_from_parameters_of_the_same_name():
    """Gravity is g, and so is the line of `pair+real`; without a way to tell them apart the proof proves another root."""
    free = {"lambda_s": (0.1, 0.7)}
    fixed = {n: v for n, v in {**BENCHMARK, "c": 0.0}.items() if n != "lambda_s"}
    design = tmsopt.solve(tmsopt.Problem(whipple, fixed=fixed, free=free, minimize="abscissa"))
    assert design.structure == "pair+real"
    assert tmsopt.prove(design).proved
    assert tmsopt.prove(design).unknowns["pair+real.g"].value.startswith("-0.5968467881862")
