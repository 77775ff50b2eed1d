"""Proofs: closed forms lie in the balls, exact input counts, and what is not so is refused."""

import json
import math
import pickle
import re
from dataclasses import replace
from fractions import Fraction
from functools import cache
from importlib import import_module

import numpy as np
import pytest
from click.testing import CliRunner
from flint import arb, ctx, fmpq
from helpers.oracles import ep4_of_heights, polynomial_60, roots_60
from helpers.places import PROBLEMS
from helpers.structures import native_60
from mpmath import atan, mp, mpf, sqrt, tan, workdps

from tmsopt import InputError, Problem, load, models, prove, solve
from tmsopt.algebra import Number, ProofFailed, enclose_solution, number, refine_solution
from tmsopt.cli import command_group as main
from tmsopt.documents import list_numbers
from tmsopt.models import decimal
from tmsopt.problem import Case
from tmsopt.proofs import Factorisation, prove_design
from tmsopt.roots import exact_roots, product

factored = import_module("tmsopt.proofs.factorisation")

HEIGHTS = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
SQRT2 = math.sqrt(2)


@cache
def solved(name):
    return solve(load(PROBLEMS / f"{name}.toml"))


def bicycle(pattern, held, free):
    """The problem that locates a pattern in a bicycle with the heights of the paper."""
    return Problem(models.tms, fixed={**HEIGHTS, **held}, free=free, locate=pattern)


def prove_stored(name, structure, **changes):
    """The proof for the design of a file, with changes, that its problem's pattern is there."""
    design = solved(name)
    return prove_design(design.problem.posed, {**design.parameters, **changes}, structure)


def check_refused(proof, *words):
    """Check that nothing is proved, and that the reason has these words."""
    assert not proof.proved
    assert all(word in proof.reason for word in words)


def holds(found, truth):
    """Whether an mpmath number is within the radius of a decimal, to the precision of mpmath."""
    return bool(abs(mpf(found.value) - truth) <= mpf(found.radius) + mpf(10) ** (5 - mp.dps))


def ep_set(T):
    """Fr² on the EP set of ζ_B = −0.4, ζ_H = −0.2 (equation epset)."""
    r = sqrt(2)
    h = r / 5
    return 4 * (r + 1) ** 2 * h * T**2 / ((r - 1) * (4 * h * T * (r + 1) - r * (r - 1)))


def on_ep_set(lambda_s, kind):
    """The design of the EP set at a tilt in doubles, and the problem that locates it in Fr and χ_B."""
    problem = bicycle(kind, {"lambda_s": lambda_s}, {"Fr": (0.1, 6.0), "chi_B": (1.01, 3.0)})
    with workdps(30):
        Fr = float(sqrt(ep_set(tan(mpf(repr(lambda_s))))))
    return problem.posed, {**problem.fixed, "Fr": Fr, "chi_B": SQRT2}


# Closed forms in the balls


@pytest.mark.parametrize("digits", [5, 30, 50])
def test_the_printed_EP4_lies_in_the_balls(digits):
    """Table 1: χ_B = √2, tan λ_s = 15/4 − 75√2/32, Fr = 3√(110√2 − 120)/8, s = −√5/2^(1/4); at 60 digits."""
    proof = prove(solved("ep4"), digits)
    with workdps(70):
        root2 = sqrt(2)
        T = mpf(15) / 4 - 75 * root2 / 32
        assert holds(proof.parameters["chi_B"], root2)
        assert holds(proof.tangents["lambda_s"], T)
        assert holds(proof.parameters["lambda_s"], atan(T))
        assert holds(proof.parameters["Fr"], 3 * sqrt(110 * root2 - 120) / 8)
        for value in (proof.unknowns["r"], proof.abscissa, proof.roots[0].re):
            assert value is not None
            assert holds(value, -sqrt(5) / mp.root(2, 4))
    assert (proof.proved, proof.pattern, proof.method) == (True, "EP4", "Krawczyk")
    assert (proof.stable.holds, proof.heavily_damped.holds, proof.inside.holds) == (True, True, True)
    assert "edge" in proof.heavily_damped.words
    assert prove(solved("ep4")).digits == 30
    assert [z.multiplicity for z in proof.roots] == [4]
    for value in (*proof.parameters.values(), *proof.unknowns.values()):
        assert Fraction(value.radius) < Fraction(1, 10**digits) * 4  # numbers of size 1 to 4, to as many digits
    assert proof.radius < 10.0 ** -(digits + 5)
    assert proof.uniqueness > 1e-3 > proof.explained > proof.distance


def test_the_optimised_benchmark_on_all_its_branches():
    """The line is −1, and +1 where Fr < 0; each branch is another design."""
    design = solved("optimised_benchmark")
    points = [design.parameters, *(b.parameters for b in design.branches)]
    assert len({round(p["Fr"], 6) for p in points}) == 4
    for parameters in points:
        proof = prove_design(design.problem.posed, parameters, "EP4", 40)
        root = -1 if parameters["Fr"] > 0 else 1
        verdicts = proof.proved, proof.inside.holds, proof.stable.holds
        assert verdicts == (True, parameters is design.parameters, root < 0)
        numbers = proof.unknowns["r"], proof.unknowns["omega0"], proof.parameters["chi_B"]
        with workdps(70):
            assert all(map(holds, numbers, (mpf(root), mpf(-1), mpf("1.19"))))


def test_a_triple_root_and_its_derivatives():
    """The EP3 of heavy damping at the least speed: p, p′, p″ vanish, by mpmath's root finder at 60 digits."""
    proof = prove(solved("heavily_damped"))
    with workdps(60):
        T = tan(mpf(proof.parameters["lambda_s"].value))

        def conditions(Fr, chi_B, s):
            a = models.tms.polynomial(Fr, mpf("0.1"), chi_B, mpf(1), -mpf("0.4"), -mpf("0.2"), T)
            d1, d2 = [4 * a[0], 3 * a[1], 2 * a[2], a[3]], [12 * a[0], 6 * a[1], 2 * a[2]]
            return [mp.polyval(p, s) for p in (a, d1, d2)]

        start = [float(proof.parameters["Fr"]), float(proof.parameters["chi_B"]), float(proof.unknowns["r"])]
        truth = mp.findroot(conditions, start, tol=1e-110)
        found = proof.parameters["Fr"], proof.parameters["chi_B"], proof.unknowns["r"]
        assert all(holds(value, exact) for value, exact in zip(found, truth, strict=True))
    assert solved("heavily_damped").value == pytest.approx(float(truth[0]), abs=1e-11)
    assert proof.pattern == "EP3"
    assert [z.multiplicity for z in proof.roots] == [3, 1]
    assert proof.held["lambda_s"] == str(Fraction(repr(math.radians(10))))  # a double in radians, as its decimal


@pytest.mark.parametrize(("tangent", "pattern"), [("2/5", "2EP2"), ("6/5", "CEP2")])
def test_the_EP_set_at_an_exact_tangent(tangent, pattern):
    """Equation epset; real pairs below the EP4 (tan λ_s = 0.435), complex ones above. The tangent is a fraction."""
    T = Fraction(tangent)
    proof = prove_design(*on_ep_set(math.atan(T), pattern), pattern, 40, {"tan(lambda_s)": tangent})
    with workdps(60):
        assert holds(proof.parameters["Fr"], sqrt(ep_set(mpf(T.numerator) / T.denominator)))
        assert holds(proof.parameters["chi_B"], sqrt(2))
        assert holds(proof.unknowns["c"], 5 / sqrt(2))  # 1/√(ζ_B ζ_H)
    assert (proof.proved, proof.pattern) == (True, pattern)
    assert proof.heavily_damped.holds is (pattern == "2EP2")
    assert proof.held["tan(lambda_s)"] == tangent
    assert proof.stated == ("tan(lambda_s)",)
    sign = float(proof.unknowns["b"]) ** 2 - 4 * float(proof.unknowns["c"])
    assert (sign > 0) is (pattern == "2EP2")


def test_the_printed_region_and_error_are_proved():
    """Rounded to two digits, the region does not grow, and the error does not shrink."""
    proof = prove("problems/ep4.toml")
    text = " ".join(proof.report().split())
    error, region = (float(re.search(rf"{words} (\S+)", text)[1]) for words in ("error at most", "by more than"))
    assert proof.radius <= error < 1.2 * proof.radius
    assert 0.9 * proof.uniqueness < region <= proof.uniqueness


def test_the_critical_speed():
    """Table 1: Fr_c = √(30√2 + 120)/8 at the EP4's tilt and χ_B = √2; held here at doubles, so to 1e-14."""
    held = {"chi_B": SQRT2, "lambda_s": math.atan(15 / 4 - 75 * SQRT2 / 32)}
    proof = prove(bicycle("weave", held, {"Fr": (0.5, 3)}))
    assert float(proof.parameters["Fr"]) == pytest.approx(math.sqrt(30 * SQRT2 + 120) / 8, abs=1e-13)
    assert proof.stable.holds is False
    assert "boundary of stability" in proof.stable.words
    assert proof.abscissa == Number("0", "0")


def test_a_zero_is_printed_as_0():
    """Of the PT-symmetric trimer both detunings are 0, and gain and loss √2."""
    lines = [line.split() for line in prove("problems/pt_trimer.toml").report().splitlines()]
    shown = {words[0]: words[1] for words in lines if words and words[0] in ("d1", "d3", "gain")}
    assert (shown["d1"], shown["d3"], float(shown["gain"])) == ("0", "0", math.sqrt(2))


def test_a_root_at_0():
    """a4 = −ζ_B T − μ (χ_H − 1) vanishes at tan λ_s = μ (χ_H − 1)/|ζ_B| = 1/20."""
    held = {"chi_H": 1.2, "chi_B": 1.3, "Fr": 1.3}
    proof = prove(bicycle("capsize", held, {"lambda_s": (0.01, 0.4)}))
    assert proof.proved
    assert proof.tangents["lambda_s"].contains("0.05")


def test_the_same_EP4_in_SI():
    """v = Fr √(g w), x_B = χ_B w: with w = 2 m, g = 9.81 m/s²."""
    problem = Problem(
        models.tms,
        fixed={"w": 2.0, "m_B": 10.0, "m_H": 1.0, "x_H": 2.0, "z_B": -0.8, "z_H": -0.4},
        free={"v": (1, 20), "x_B": (2.1, 5), "lambda_s": (0.1, 1)},
        locate="EP4",
    )
    proof = prove(solve(problem))
    with workdps(50):
        truth = ep4_of_heights(-mpf("0.4"), -mpf("0.2"))
        assert holds(proof.parameters["v"], truth["Fr"] * sqrt(mpf("9.81") * 2))
        assert holds(proof.parameters["x_B"], 2 * truth["chi_B"])
        assert holds(proof.unknowns["r"], truth["r"])
    assert proof.held["g"] == "981/100"


@pytest.mark.parametrize(
    ("name", "pattern"), [pytest.param("physical_machine", "EP2", marks=pytest.mark.slow), ("least_speed", "pair+real")]
)
def test_patterns_of_optima(name, pattern):
    """Whatever the rightmost roots show; the proved polynomial has the abscissa of the design."""
    design = solved(name)
    proof = prove(design)
    assert (design.structure, proof.pattern, proof.proved, proof.stable.holds) == (pattern, pattern, True, True)
    assert float(proof.abscissa or "nan") == pytest.approx(design.abscissa, abs=1e-12)


def test_a_design_without_multiple_roots_is_taken_as_it_is():
    """Nothing is solved for: its roots are isolated; beside them those of mpmath at 60 digits."""
    design = solved("benchmark")
    proof = prove(design)
    assert (proof.proved, proof.pattern, proof.moved, proof.method) == (True, "pair", (), "isolated roots")
    with workdps(60):
        p = {n: mpf(v.value) for n, v in proof.parameters.items()} | {"lambda_s": mp.radians(5)}  # as typed
        roots = roots_60(polynomial_60(**native_60(p)))
        for found, truth in zip(proof.roots, sorted(roots, key=lambda z: (-z.real, -z.imag)), strict=True):
            assert holds(found.re, truth.real)
            assert holds(found.im, truth.imag)
    assert proof.stable.holds is True
    assert proof.heavily_damped.holds is False


# Exact input


def test_a_double_stands_for_the_decimal_that_prints_it():
    assert decimal(0.1) == Fraction(1, 10)
    assert decimal(1e-17) == Fraction(1, 10**17)
    proof = prove(solved("ep4"))
    assert proof.held == {"mu": "1/10", "chi_H": "1", "zeta_B": "-2/5", "zeta_H": "-1/5"}
    assert proof.parameters["zeta_B"] == Number("-0.4", "0")


def test_thirds_are_thirds_where_they_are_given_exactly():
    """ζ_B = −1/3: the closed form lies in the balls of the fraction, and 1e-17 beside those of the decimal."""
    held = {"zeta_B": -1 / 3, "zeta_H": -0.2}
    design = solve(bicycle("EP4", held, {"Fr": (0.1, 6), "chi_B": (1.01, 3), "lambda_s": (0.01, 1)}))
    with workdps(60):
        truth = ep4_of_heights(-mpf(1) / 3, -mpf("0.2"))
        for given in (Fraction(-1, 3), "-1/3", fmpq(-1, 3)):
            proof = prove(design, exact={"zeta_B": given})
            assert all(holds(proof.parameters[n], truth[n]) for n in ("Fr", "chi_B"))
            assert proof.held["zeta_B"] == "-1/3"
            assert Fraction(proof.parameters["zeta_B"].radius) > 0
        beside = prove(design)
        assert not any(holds(beside.parameters[n], truth[n]) for n in ("Fr", "chi_B"))
        assert float(beside.parameters["Fr"]) == pytest.approx(float(truth["Fr"]), abs=1e-14)


def test_an_angle_in_degrees_is_exact_where_it_is_given_so():
    problem, design = on_ep_set(math.radians(20), "2EP2")
    exact = prove_design(problem, design, "2EP2", exact={"lambda_s": "20 deg"})
    plain = prove_design(problem, design, "2EP2")
    with workdps(60):
        truth = sqrt(ep_set(tan(mp.pi / 9)))
        assert holds(exact.parameters["Fr"], truth)
        assert not holds(plain.parameters["Fr"], truth)
    assert exact.held["lambda_s"] == "20 deg"
    assert "not as degrees" in plain.report()
    assert "not as degrees" not in exact.report()


def fractions(**changed):
    """ζ_B = −2, ζ_H = −1/2, χ_B = 2: the compact forms give tan λ_s = 17/48, Fr = 17/12, s = −1."""
    fixed = {"Fr": 17 / 12, "mu": 0.1, "chi_B": 2.0, "chi_H": 1.0, "zeta_B": -2.0, "zeta_H": -0.5}
    return solve(Problem(models.tms, fixed={**fixed, "lambda_s": math.atan(17 / 48), **changed}), throw=False)


def test_a_pattern_in_fractions_needs_no_free_parameter():
    exact = {"Fr": Fraction(17, 12), "tan(lambda_s)": "17/48"}
    proof = prove(fractions(), exact=exact)
    assert (proof.proved, proof.pattern, proof.method) == (True, "EP4", "exact factorisation")
    assert [(z.re.value.rstrip("0"), z.re.radius, z.multiplicity) for z in proof.roots] == [("-1.", "0", 4)]
    assert (proof.stable.holds, proof.heavily_damped.holds) == (True, True)
    assert proof.radius == 0


def test_nothing_free_and_not_exact_is_refused():
    """The same bicycle in doubles is no EP4, and one in a fraction a little off is none either."""
    for proof in (
        prove(fractions()),
        prove(fractions(chi_B=2.0000000000000004), exact={"Fr": "17/12", "tan(lambda_s)": "17/48"}),
    ):
        check_refused(proof, "0 free parameters")
        assert (proof.stored, proof.stable.holds) == (True, True)
        assert [z.multiplicity for z in proof.roots] == [1, 1, 1, 1]


@pytest.mark.parametrize(
    ("exact", "words"),
    [
        ({"zeta": 1}, ["unknown parameter 'zeta'", "tan(lambda_s)"]),
        ({"zeta_B": "-1/3"}, ["-1/3", "-0.4"]),
        ({"zeta_B": "two"}, ["'two'", "'-2/5'"]),
        ({"zeta_B": "20 deg"}, ["'20 deg'", "accepted"]),
        ({"zeta_B": True}, ["True"]),
        ({"chi_H": "1/0"}, ["'1/0'"]),
        ({"chi_H": float("nan")}, ["nan"]),
        ({"lambda_s": "20 deg"}, ["20 deg", "0.41067"]),
        ({"zeta_B": "-1/3", "zeta": 1}, ["exact.zeta_B", "exact.zeta:"]),
    ],
)
def test_exact_numbers_that_are_not_accepted(exact, words):
    with pytest.raises(InputError) as raised:
        prove(solved("ep4"), exact=exact)
    assert all(word in str(raised.value) for word in words)


@pytest.mark.parametrize("digits", [0, 1001, 2.5, True])
def test_digits_that_are_not_accepted(digits):
    with pytest.raises(InputError, match="1 to 1000"):
        prove(solved("ep4"), digits)


# Refusals


@pytest.mark.parametrize(
    ("name", "digits"),
    [(n, d) for n in ("ep4", "optimised_benchmark", "heavily_damped") for d in (3, 9)]
    + [("ep4", 12), ("heavily_damped", 12)],
)
def test_a_rounded_design_is_refused(name, digits):
    """A true EP is near it, but not where the stored numbers say, and 16 digits would be nearer than these.

    Of the optimised benchmark 12 digits are left out: 64 roundings of each number move its μ = 20.8 by 2e-10.
    """
    design = solved(name)
    rounded = {n: float(f"{v:.{digits}g}") for n, v in design.parameters.items()}
    proof = prove_stored(name, design.structure, **rounded)
    assert (proof.proved, proof.stored) == (False, True)
    assert "not the stored design" in proof.reason or "finds no solution" in proof.reason
    assert prove_stored(name, design.structure).proved


def test_a_fold_is_refused():
    """At Fr = √5 the EP set turns back, so with Fr held its equations are singular (tan λ_s = r (r − 1)/(2 h (r + 1))).

    The doubles beside √5 have no solution, or two 4e-8 apart.
    """
    r, h = SQRT2, SQRT2 / 5
    tilt = math.atan(r * (r - 1) / (2 * h * (r + 1)))
    for Fr in (math.nextafter(math.sqrt(5), 0), math.sqrt(5), math.nextafter(math.sqrt(5), 9)):
        problem = bicycle("2EP2", {"Fr": Fr}, {"chi_B": (1.01, 3.0), "lambda_s": (0.02, 1.4)})
        proof = prove_design(problem.posed, {**problem.fixed, "chi_B": r, "lambda_s": tilt}, "2EP2")
        check_refused(proof, "singular")
    assert prove_design(*on_ep_set(tilt, "2EP2"), "2EP2").proved


@pytest.mark.parametrize(
    ("free", "words"),
    [
        ({"mu": (0.05, 0.2), "Fr": (1, 4), "lambda_s": (0.1, 1)}, ["do not depend on mu"]),  # since χ_H = 1
        ({"lambda_s": (0.1, 1)}, ["3 conditions and 1 free parameter", "free 2 more"]),
    ],
)
def test_parameters_that_do_not_suffice(free, words):
    design = solved("ep4").parameters
    fixed = {n: v for n, v in design.items() if n not in free}
    problem = Problem(models.tms, fixed=fixed, free=free, locate="EP4")
    check_refused(prove_design(problem.posed, design, "EP4"), *words)


@pytest.mark.parametrize("rate", [1e-9, 1e12])
@pytest.mark.parametrize("carrier", [0.0, 1e6])
def test_an_EP2_of_H_in_any_unit_and_frame(rate, carrier):
    """|g1 − g2|/2 = k and d = 0, whatever the unit of rates; a carrier costs its own digits of double precision."""
    dimer = models.from_hamiltonian([["w + d - 1j*g1", "k"], ["k", "w - 1j*g2"]])
    fixed = {"w": carrier * rate, "g1": 3 * rate, "g2": rate}
    free = {"d": (-5 * rate, 5 * rate), "k": (rate / 10, 5 * rate)}
    proof = prove(Problem(dimer, fixed=fixed, free=free, locate="EP2"))
    assert proof.proved, proof.reason
    half = (Fraction(repr(3 * rate)) - Fraction(repr(rate))) / 2  # of the decimals that print them
    assert abs(Fraction(proof.parameters["k"].value) / half - 1) <= Fraction(1, 10**30)
    assert 2 * proof.uniqueness > proof.distance >= 0
    # The other EP2 of H, at −k, is 2 k away; a design in fractions is proved without a search.
    assert proof.uniqueness < 2 * rate or proof.method == "exact factorisation"


@pytest.mark.parametrize("rate", [1e-6, 1e6])
def test_a_CEP2_of_oscillators_in_any_unit_of_time(rate):
    """c1 − c2 = ±2 δ with δ² = A + B − 2 √(AB − k²), A = 1 + k, B = w + k, in units of the rate."""
    k, w = 0.3, 1.2
    square = rate * rate
    stiff = [[(1 + k) * square, -k * square], [-k * square, (w + k) * square]]
    free = {"c1": (-3 * rate, 3 * rate), "c2": (-3 * rate, 3 * rate)}
    model = models.from_matrices([[1, 0], [0, 1]], [["c1", 0], [0, "c2"]], stiff)
    proof = prove(Problem(model, free=free, locate="CEP2"))
    assert proof.proved, proof.reason
    A, B = 1 + k, w + k
    apart = abs(float(proof.parameters["c1"]) - float(proof.parameters["c2"])) / rate
    assert apart == pytest.approx(2 * math.sqrt(A + B - 2 * math.sqrt(A * B - k * k)), rel=1e-12)


def test_an_irrational_design_is_not_called_rounded():
    """The double pair of 2 s⁴ + (7 − 2 p) s² + 1 at p = 7/2 − √2, which fractions cannot show."""
    ziegler = models.from_matrices(M=[[3, 1], [1, 1]], K=[["2 - p", "p - 1"], [-1, 1]])
    proof = prove(Problem(ziegler, fixed={"p": "7/2-sqrt(2)"}))
    check_refused(proof, "could not be proved", "may be rounded, or irrational", "fractions")


def test_numbers_in_the_unit_of_the_roots_have_it():
    """In SI the roots are per √(g/w); a dimensionless design has no such unit."""
    design = solved("point_mass_robot")
    proof = prove(design)
    units = {row[0]: row[3] for row in list_numbers(design.problem.posed, proof)}
    assert {units[n] for n in ("abscissa", "r")} == {"√(g/w)"}
    assert proof.to_json()["units"]["abscissa"] == "√(g/w)"
    r, times = float(proof.abscissa), math.sqrt(design.parameters["g"] / design.parameters["w"])
    assert r * times == pytest.approx(-design.quantities["decay_rate"], rel=1e-9)
    free = list_numbers(solved("ep4").problem.posed, prove(solved("ep4")))
    assert {row[3] for row in free if row[0] in ("abscissa", "r")} == {""}


def test_a_singular_mass_matrix_is_refused():
    """χ_H = 1 and λ_s = 0 make a0 = 0."""
    proof = prove_stored("ep4", "EP4", lambda_s=0.0)
    check_refused(proof, "a0")
    assert proof.stable.holds is None
    check_refused(prove_stored("ep4", "EP4", lambda_s=1e-14))


@pytest.mark.parametrize(("asked", "T"), [("2EP2", 1.2), ("CEP2", 0.4)])
def test_the_other_kind_of_pair_is_refused(asked, T):
    kind = "CEP2" if asked == "2EP2" else "2EP2"
    check_refused(prove_design(*on_ep_set(math.atan(T), asked), kind), f"a {kind}, not a {asked}")


def test_the_wrong_structure_is_refused():
    """An EP3 and a pair of double roots are no EP4, an EP4 is no EP3 with a root apart, and a weave is elsewhere."""
    triple = solved("heavily_damped")
    problem = solved("ep4").problem.posed
    wrong = [
        *(prove_design(problem, triple.parameters, structure) for structure in ("EP4", "2EP2")),
        *(prove_stored("ep4", structure) for structure in ("EP3", "undecided")),
        prove_design(problem.derive(minimize=None, locate="weave"), solved("ep4").parameters, "pair"),
        prove_stored("benchmark", "real"),
    ]
    assert not any(p.proved for p in wrong)
    assert all(p.reason for p in wrong)


def test_an_EP3_that_a_last_bit_chooses_is_not_the_designs():
    """Along the EP3s the tilt leaves that of the EP4 as (r − t)²: rounded to their side, it has one with roots 1e-8 apart.

    At 1e-4 of a radian from there rounding has no say any more.
    """
    tilt = solved("ep4").parameters["lambda_s"]
    for bits in (-4, 0, 1):
        near = tilt + bits * math.ulp(tilt)
        assert prove_stored("ep4", "EP4", lambda_s=near).proved
        check_refused(prove_stored("ep4", "EP3", lambda_s=near), "singular")
    proof = prove(bicycle("EP3", {"lambda_s": tilt - 1e-4}, {"Fr": (1.0, 3.0), "chi_B": (1.01, 3.0)}))
    assert (proof.proved, proof.pattern) == (True, "EP3")


def test_what_is_not_solved_is_not_proved():
    check_refused(prove(replace(solved("ep4"), status="infeasible")), "not solved (infeasible)")
    with pytest.raises(InputError, match="asks for a front"):
        prove(load(PROBLEMS / "pareto.toml"))


# Stability and heavy damping


def test_stability_and_heavy_damping_of_random_polynomials():
    """Beside isolated roots of the same fractions; strictly inside, on the edge and outside."""
    rng = np.random.default_rng(5)
    seen = set()
    for _ in range(300):
        kinds = rng.integers(0, 3, size=2)
        factors = []
        for kind in kinds:
            x, y = (Fraction(int(v), 16) for v in rng.integers(-8, 40, size=2))
            factors += [[[1, x], [1, y]], [[1, 2 * x, x * x + y * y]], [[1, x], [1, x]]][kind]
        a = product(*factors)
        truth = exact_roots(a)
        stable = all(z.re < 0 for z in truth)
        heavy = stable and all(z.im == 0 for z in truth)
        with ctx.workdps(60):
            exact = factored.factor_polynomial([fmpq(c.numerator, c.denominator) for c in a])
            assert (exact.stable, exact.heavily_damped) == (stable, heavy)
            if all(z.multiplicity == 1 for z in truth):
                balls = Factorisation((([arb(fmpq(c.numerator, c.denominator)) for c in a], 1),))
                assert balls.stable in ((stable,) if all(z.re != 0 for z in truth) else (False, None))
                assert balls.heavily_damped in (heavy, None)
        seen.add((stable, heavy, any(z.multiplicity > 1 for z in truth)))
    assert len(seen) == 6


def test_signs_that_cannot_be_told_are_not():
    wide = arb(0, 1e-10)
    zero, double = (Factorisation((([arb(1), arb(2), constant + wide], 1),)) for constant in (0, 1))
    assert (zero.stable, double.stable, double.heavily_damped) == (None, True, None)
    assert double.abscissa.contains(-1)
    assert double.abscissa.rad() < 2e-5


# The test itself


def enclose_root(constant, start):
    """A root of x² + constant, enclosed by Krawczyk's test."""

    def system(at):
        return [at["x"] * at["x"] + arb(constant)]

    return enclose_solution(system, refine_solution(system, {"x": start}, ["x"], 45), ["x"], 45)


def test_krawczyk_on_a_square():
    """x² = 2 has ±√2; its test fails at 0, and where there is no root, and for a double one."""
    with ctx.workdps(50):
        enclosure = enclose_root("-2", arb(1))
        assert enclosure.balls["x"].overlaps(arb(2).sqrt())
        assert 0.1 < enclosure.uniqueness < 2 * SQRT2
        for constant in ("1", "0"):
            with pytest.raises(ProofFailed):
                enclose_root(constant, arb("0.3"))
        assert enclose_root("-1e-40", arb("1e-20").mid()).uniqueness < 2e-20  # two roots 2e-20 apart


def test_decimals_hold_their_balls():
    """Whatever the size and radius: the ends of the ball are within the radius of the decimal."""
    rng = np.random.default_rng(1)
    with ctx.workdps(60):
        for _ in range(400):
            middle = arb(float(rng.normal() * 10.0 ** rng.integers(-30, 30)))
            ball = (middle / 7 if rng.random() < 0.8 else middle) + arb(0, 10.0 ** rng.integers(-70, 5))
            shown = number(ball, int(rng.integers(1, 40)))
            for end in (ball.lower(), ball.upper()):
                mantissa, exponent = end.man_exp()
                exact = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
                assert abs(exact - Fraction(shown.value)) <= Fraction(shown.radius) + abs(exact) * Fraction(1, 10**55)
            assert shown.contains(Fraction(shown.value))


# As data, as text, on the command line


def test_a_proof_is_plain_data():
    proof = prove(solved("ep4"))
    assert pickle.loads(pickle.dumps(proof)) == proof
    assert prove(pickle.loads(pickle.dumps(solved("ep4")))).parameters == proof.parameters
    assert b"flint" not in pickle.dumps(proof)
    data = json.loads(json.dumps(proof.to_json(), allow_nan=False))
    assert data["parameters"]["chi_B"]["value"].startswith("1.414213562373095048801688724209698")
    assert data["proved"] is True


def test_a_band_is_proved_in_its_worst_case():
    problem = load(PROBLEMS / "speed_band.toml")
    design = {**HEIGHTS, "Fr": 1.8, "chi_B": 1.28, "lambda_s": 0.12}
    proof = prove_design(problem.posed, design, "pair", case=Case(at={"Fr": 1.2}))
    assert proof.proved
    assert proof.parameters["Fr"] == Number("1.2", "0")
    assert (proof.stable.holds, proof.inside.holds) == (True, True)
    assert "worst case" in proof.report()


def run(*arguments):
    return CliRunner().invoke(main, ["prove", *arguments])


def test_the_command():
    done = run(str(PROBLEMS / "ep4.toml"), "--digits", "40")
    assert done.exit_code == 0
    assert "proved: a design with EP4 (4-fold real root) exists" in done.stdout
    assert "2.236317518367822033046344317154434852029" in done.stdout
    assert "zeta_B = -0.4" in done.stdout
    data = json.loads(run(str(PROBLEMS / "heavily_damped.toml"), "--json", "--exact", "lambda_s=10 deg").stdout)
    assert (data["proved"], data["status"], data["pattern"]) == (True, "optimal", "EP3")
    assert data["held"]["lambda_s"] == "10 deg"
    assert data["inside"]["holds"] is True
    assert data["limits"] == {"heavy_damping": "binds"}
    assert "Examples" in run("--help").stdout


@pytest.mark.slow
def test_the_exit_status_of_the_command(tmp_path):
    text = (PROBLEMS / "ep4.toml").read_text(encoding="utf-8")
    infeasible, none = tmp_path / "infeasible.toml", tmp_path / "none.toml"
    infeasible.write_text(text + '\n[constraints]\nfast = "abscissa <= -3"\n', encoding="utf-8")
    held = text.replace("{ min = 1.01, max = 5 }", "1.4142135623730951").replace(
        "{ min = 0.01, max = 10 }", "2.236317518367822"
    )
    none.write_text(held.replace('{ min = "1 deg", max = "80 deg" }', "0.4106775324124522").split("[objective]")[0])
    assert run(str(infeasible)).exit_code == 3
    refused = run(str(none))
    assert refused.exit_code == 4
    assert "not proved" in refused.stdout
    assert "0 free parameters" in refused.stdout
    for bad in (["missing.toml"], [str(none), "--exact", "zeta_B"], [str(none), "--exact", "zeta_B=1"]):
        assert run(*bad).exit_code == 2
    assert run(str(PROBLEMS / "pareto.toml")).exit_code == 2
