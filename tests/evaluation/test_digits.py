"""Every digit that ``solve --json`` prints of a design, from the printed parameters alone: another way, 60 digits.

Nothing here uses a formula of the package. The polynomial is the determinant of the paper's matrices in mpmath, roots
are mpmath's, mass margins are eigenvalues, and the weave speed is where the Hurwitz determinant changes sign. The
numbers compared are equal as doubles, ``==``: the printed one is the double nearest to the 60-digit one.

The ideal roots are those of the nearest polynomial with the printed structure. Nearest means least in
Σ (Δₖ/wₖ)², Δₖ the change of the k-th monic coefficient and wₖ the k-th coefficient of ∏ (s + |zᵢ|) for the roots zᵢ of
the nearest polynomial, those below a thousandth of the median |z| counted as that.
"""

import json
import math
import tomllib

import flint
import numpy as np
import pytest
from helpers.oracles import polynomial_60, roots_60
from helpers.places import PROBLEMS
from helpers.structures import FORMS, NATIVE, native_60, quantities_60, times
from mpmath import mp

import tmsopt
from benchmarks.suites import random_problem
from tmsopt.algebra import exact
from tmsopt.evaluation import omega0_bound
from tmsopt.models import tms, to_si
from tmsopt.roots import structure
from tmsopt.roots.patterns import enclosed_roots, nearest_decimal, nearest_double, nearest_roots

DIGITS = 60

SLOW = ("tolerant", "ep_set")  # a search for the radius in every step; a search over a curve
NO_DESIGN = ("chart", "pareto")  # a chart and a front are not solved for one design


def in_case(p, case):
    """The parameters in a printed case, offsets added without rounding."""
    found = {name: mp.mpf(value) for name, value in p.items()}
    if case:
        found |= {name: mp.mpf(value) for name, value in case["at"].items()}
        found |= {name: found[name] + mp.mpf(value) for name, value in case["offset"].items()}
    return found


# The nearest polynomial with a structure, as factors with unknowns


def nearest_60(structure, coefficients, printed):
    """Roots of the nearest polynomial: least squares, the weights renewed, until 60 digits stand."""
    factors, roots, unknowns = FORMS[structure]
    z = [mp.mpc(r["re"], r["im"]) for r in printed for _ in range(r["multiplicity"])]
    if structure == "EP2":  # the double root first
        z.sort(key=lambda x: -max(r["multiplicity"] for r in printed if mp.mpc(r["re"], r["im"]) == x))
    u = mp.matrix(unknowns(z))
    target = [c / coefficients[0] for c in coefficients]
    for _ in range(60):
        sizes = sorted(abs(x) for x in roots(*u))
        floor = (sizes[1] + sizes[2]) / 2000
        weights = times(*([1, max(size, floor)] for size in sizes))

        def residual(*u, weights=weights):
            return mp.matrix([(x - y) / w for x, y, w in zip(times(*factors(*u)), target, weights, strict=True)])

        off, slopes = residual(*u), mp.jacobian(residual, u)
        move = mp.lu_solve(slopes, -off)  # by least squares
        u += move
        if mp.norm(move) < mp.mpf(10) ** -45 * mp.norm(u):
            break
    else:
        raise AssertionError("the least squares do not converge")
    assert mp.norm(off) <= mp.mpf("1.01e-11")  # the structure holds within the tolerance of the package
    return roots(*u)


def roots_of(data, case):
    """Roots of the design in a case as stored, and of the ideal one."""
    coefficients = polynomial_60(**native_60(in_case(data["parameters"], case)))
    stored = roots_60(coefficients)
    located = any(r["multiplicity"] > 1 for r in data["roots"])  # and not rightmost
    if data["structure"] in ("pair", "real", "undecided"):
        return stored, nearest_60(data["objective"]["locate"], coefficients, data["roots"]) if located else stored
    return stored, nearest_60(data["structure"], coefficients, data["roots"])


def damping_60(roots):
    return min(-mp.re(z) / abs(z) for z in roots)


def wrong_digits(data):
    """Everything printed that is not the double nearest to the number that it stands for."""
    wrong = []

    def compare(what, printed, true):
        if true is not None and abs(true) < mp.mpf(10) ** -DIGITS:
            true = mp.mpf(0)  # as χ_B − χ_H times rounding
        if printed != (None if true is None else float(true)):
            wrong.append(f"{what}: printed {printed!r}, true {mp.nstr(true, 25)}")

    with mp.workdps(DIGITS + 20):
        p = in_case(data["parameters"], None)
        worst, least = data.get("worst_case"), data.get("least_damped_case")
        stored, ideal = roots_of(data, worst)
        abscissa = max(mp.re(z) for z in ideal)
        compare("abscissa", data["abscissa"], abscissa)
        compare("abscissa_realised", data["abscissa_realised"], max(z.real for z in stored))
        printed = [mp.mpc(r["re"], r["im"]) for r in data["roots"] for _ in range(r["multiplicity"])]
        assert len(printed) == 4
        for z in ideal:  # each takes the printed one that is nearest
            close = min(printed, key=lambda x: abs(x - z))
            printed.remove(close)
            compare("root", float(close.real), mp.re(z))
            compare("root", float(close.imag), mp.im(z))
        true = quantities_60(p)
        if least == worst:
            true["damping_ratio"] = damping_60(ideal)
        else:  # the structure in another case is not printed: simple roots, which a multiple one is 1e-8 or more off
            other = damping_60(roots_60(polynomial_60(**native_60(in_case(data["parameters"], least)))))
            shown = data["quantities"]["damping_ratio"]
            true["damping_ratio"] = other if abs(other - shown) < 1e-11 else mp.mpf(shown)
        if "si" in data:
            rate = mp.sqrt(mp.mpf(p["g"]) / mp.mpf(p["w"]))
            true["decay_rate"] = -abscissa * rate
            true["decay_time"] = 1 / (-abscissa * rate) if abscissa < 0 else None
            true["frequency"] = max(mp.im(z) for z in ideal) * rate / (2 * mp.pi)
        for name, value in data["quantities"].items():
            if name != "radius":  # a search of its own, over all parameters
                compare(name, value, true[name])
        assert set(true) - set(data["quantities"]) <= set(NATIVE) | {"damping_ratio"}
        for name, value in data["dimensionless"].items():
            compare(f"dimensionless {name}", value, true[name])
        expression = data["objective"]["expression"]
        if data["objective"]["sense"] in ("minimize", "maximize") and "radius" not in expression:
            names = {**{n: v for n, v in true.items() if v is not None}, **p, "abscissa": abscissa}
            compare("objective", data["objective"]["value"], eval(expression, {"__builtins__": {}}, names))
        if "si" in data:
            for name, value in readings_60(p, true, abscissa, ideal).items():
                values = value if isinstance(value, list) else [value]
                shown = data["si"][name] if isinstance(value, list) else [data["si"][name]]
                assert len(values) == len(shown)
                for x, y in zip(shown, values, strict=True):
                    compare(f"si {name}", x, y)
            assert set(readings_60(p, true, abscissa, ideal)) == set(data["si"])
    return wrong


def readings_60(p, true, abscissa, roots):
    """Times in s, frequencies in Hz, and lengths, speeds and angles to 15 digits in mm, km/h and degrees."""
    rate = mp.sqrt(p["g"] / p["w"])
    above = {mp.nstr(z.imag, 50): z for z in map(mp.mpc, roots) if z.imag > 0}.values()
    hertz = [z.imag for z in sorted(above, key=lambda z: (-z.real, -z.imag))]  # rightmost first, as the roots are
    return {
        "decay_time_s": -1 / (abscissa * rate) if abscissa < 0 else None,
        "growth_time_s": 1 / (abscissa * rate) if abscissa > 0 else None,
        "frequencies_Hz": [f * rate / (2 * mp.pi) for f in hertz],
        "g_ms2": p["g"],
        "lambda_s_deg": read(p["lambda_s"] * 180 / mp.pi),
        "v_kmh": read(p["v"] * 18 / 5),
        "v_c_kmh": read(None if true["v_c"] is None else true["v_c"] * 18 / 5),
        "u_H_mm": read(true["u_H"] * 1000),
        **{f"{name}_mm": read(p[name] * 1000) for name in ("w", "x_B", "z_B", "x_H", "z_H")},
        **{f"{name}_kg": p[name] for name in ("m_B", "m_H")},
        **{f"{name}_kg": true[name] for name in ("m_ballast_rear", "m_ballast_front")},
        **{f"{name}_N": true[name] for name in ("N_F", "N_R")},
    }


def read(x):
    return None if x is None else mp.mpf(float(mp.nstr(x, 15)))


def printed(design):
    """What reaches the reader: the text and nothing else."""
    return json.loads(json.dumps(design.to_json()))


FILES = sorted(
    path.stem
    for path in PROBLEMS.glob("*.toml")
    if path.stem not in (*SLOW, *NO_DESIGN) and not path.stem.startswith("study_")
    if tomllib.loads(path.read_text(encoding="utf-8"))["model"] == "tms"  # of others: test_published.py
)


@pytest.mark.parametrize("name", FILES)
@pytest.mark.slow
def test_every_digit_of_the_problem_files(name):
    assert wrong_digits(printed(tmsopt.solve(PROBLEMS / f"{name}.toml"))) == []


@pytest.mark.slow
@pytest.mark.parametrize("index", range(6))
def test_every_digit_of_random_problems(index):
    """Whether or not they are solved: the numbers are those of the design that is shown."""
    assert wrong_digits(printed(tmsopt.solve(random_problem(index), throw=False, starts=4))) == []


def test_every_digit_of_designs_with_nothing_free():
    """Random designs in both sets of parameters, tilted either way, stable or not, some at special values."""
    rng = np.random.default_rng(7)
    special = [{}, {"v": 0.0}, {"lambda_s": 0.0}, {"z_B": -0.3, "z_H": -0.3}, {"x_B": 0.8, "x_H": 0.8}, {"w": 1.0}]
    for k in range(30):
        low, high = (0.5, 0.1, 9.81, -1.1, 1, -0.5, -1.5, 0.1, -0.5, -1.5), (1.5, 6, 9.81, 1.1, 30, 2, -0.1, 9, 2, -0.1)
        p = dict(zip(tms.sets[1].names, rng.uniform(low, high).tolist(), strict=True))
        p |= special[k % len(special)]
        if k % 2:
            q = tms.sets[1].native(p)
            p = {name: float(q[name]) for name in NATIVE}
        assert wrong_digits(printed(tmsopt.solve(tmsopt.Problem(tms, fixed=p)))) == []


def test_the_omega0_bound_is_never_above_the_true_one():
    """A design free in Fr and χ_B alone has ω0 as its bound: at 60 digits, where a0 is a difference that cancels to
    1e-9 of its terms too. It is at most a few roundings below: its own margin is 1e-15."""
    rng = np.random.default_rng(0)
    for k in range(60):
        tilt, zeta_H = rng.uniform(0.05, 1.0), -rng.uniform(0.1, 1.0)
        ahead = 1 + zeta_H * math.tan(tilt) + 10 ** rng.uniform(-9, -1)
        p = {"chi_H": ahead, "zeta_H": zeta_H, "zeta_B": -rng.uniform(0.1, 1.0), "mu": rng.uniform(0.01, 1.0)}
        free = {"Fr": (0.5, 2.0), "chi_B": (0.6, 2.0)}
        fixed = {name: float(v) for name, v in p.items()} | {"lambda_s": tilt}
        if k % 2:
            si = to_si({**fixed, "Fr": 1.0, "chi_B": 1.0}, w=0.7, m_B=10.0)
            free = {"v": (1.0, 5.0), "x_B": (0.4, 1.4)}
            fixed = {name: v for name, v in si.items() if name not in free}
        problem = tmsopt.Problem(model=tms, fixed=fixed, free=free, minimize="abscissa")
        bound = omega0_bound(problem.posed, 0.0)
        with mp.workdps(DIGITS):
            anywhere = native_60({**fixed, **{name: lower for name, (lower, _) in free.items()}})
            a0, *_, a4 = polynomial_60(**anywhere)
            true = -mp.root(abs(a4 / a0), 4)
            assert bound.method == "omega0"
            assert true * (1 + mp.mpf("2e-15")) <= bound.value <= true


# Roots by themselves


STRUCTURED = {
    "EP4": (-1.3, -1.3, -1.3, -1.3),
    "EP3": (-0.7, -0.7, -0.7, -2.9),
    "2EP2": (-0.7, -0.7, -1.9, -1.9),
    "CEP2": (-0.4 + 1.1j, -0.4 + 1.1j, -0.4 - 1.1j, -0.4 - 1.1j),
    "EP2": (-0.7, -0.7, -1.1 + 2j, -1.1 - 2j),
    "EP2+pair": (-0.7, -0.7, -0.7 + 2j, -0.7 - 2j),
    "pair+real": (-0.6 + 1.4j, -0.6 - 1.4j, -0.6, -3.1),
    "two pairs": (-0.6 + 1.4j, -0.6 - 1.4j, -0.6 + 0.3j, -0.6 - 0.3j),
}


@pytest.mark.parametrize("name", STRUCTURED)
def test_the_nearest_polynomial_of_every_structure(name):
    """Coefficients off by 1e-12, where the weights decide the last digits; and with roots 30000 times apart."""
    rng = np.random.default_rng(3)
    for scale in (1.0, 3e4):
        exact_ones = np.poly(STRUCTURED[name]).real.tolist()
        a = [
            c * (1 + x) * scale**k
            for k, (c, x) in enumerate(zip(exact_ones, rng.uniform(-1e-12, 1e-12, 5), strict=True))
        ]
        found = structure(a, 1e-11)
        assert found.name == name
        with flint.ctx.workprec(212):
            balls = nearest_roots([exact(c) for c in a], found.roots)
            got = sorted((nearest_double(b.re), nearest_double(b.im)) for b in balls for _ in range(b.multiplicity))
        with mp.workdps(DIGITS + 20):
            shown = [{"re": r.re, "im": r.im, "multiplicity": r.multiplicity} for r in found.roots]
            true = nearest_60(name, [mp.mpf(c) for c in a], shown)
            assert got == sorted((float(mp.re(z)), float(mp.im(z))) for z in true)


def test_exact_multiple_roots_are_kept_and_uncertain_ones_refused():
    with flint.ctx.workprec(212):
        double = enclosed_roots([exact(c) for c in (1, 4, 5, 2, 0)])  # s (s + 1)² (s + 2)
        assert [(float(r.re), r.multiplicity) for r in double] == [(0.0, 1), (-1.0, 2), (-2.0, 1)]
        vague = flint.arb(4, 1e-60)
        assert enclosed_roots([flint.arb(1), vague, flint.arb(6), flint.arb(4), flint.arb(1)]) is None
        at_0 = enclosed_roots([flint.arb(3).sqrt(), flint.arb(2).sqrt(), 0 * flint.arb(1), flint.arb(0)])
        assert (float(at_0[0].re), at_0[0].multiplicity) == (0.0, 2)
        assert enclosed_roots([exact(0), exact(2), exact(3)]) is not None  # the degree drops
        assert enclosed_roots([exact(1)]) == ()


def test_rounding_is_refused_where_a_ball_does_not_settle_it():
    """Halfway between two doubles, and between two decimals; to 15 digits 1.05 km/h stays 1.05."""
    with flint.ctx.workprec(212):
        half = flint.arb(1) + flint.arb(2) ** -53
        assert nearest_double(half + flint.arb(0, 1e-40)) is None
        assert nearest_double(half) == 1.0  # exact: ties go to even
        assert nearest_double(half + flint.arb(2) ** -150) == math.nextafter(1.0, 2.0)
        assert nearest_decimal(flint.arb("0.125"), 2) == 0.12
        assert nearest_decimal(flint.arb("0.125") + flint.arb(0, 1e-40), 2) is None
        assert nearest_decimal(exact(1.05 / 3.6) * 18 / 5, 15) == 1.05
        assert math.isnan(nearest_double(flint.arb("nan")) or 0.0)
        assert math.copysign(1, nearest_double(flint.arb(0)) or 0.0) == 1
