"""What an optimum means: multipliers beside closed forms and independent optima, rounding beside 60-digit roots."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import hunt
from helpers.oracles import polynomial_60, roots_60
from mpmath import mp

import tmsopt
from tmsopt import laws
from tmsopt.analysis import move_limit, natural_step, proof_line, round_design, step_within
from tmsopt.cli import command_group as main
from tmsopt.documents import describe_rounding
from tmsopt.models import Range, from_coefficients, tms
from tmsopt.problem import Unit, unit_of

ZETA_B, ZETA_H = -0.4, -0.2
CHI_H_1 = {"chi_H": 1.0, "zeta_B": ZETA_B, "zeta_H": ZETA_H, "mu": 0.1}
BOX = {"Fr": (0.01, 10.0), "chi_B": (1.01, 5.0), "lambda_s": (0.02, 1.4)}


def explained(**asked):
    solution = tmsopt.solve(tmsopt.Problem(tms, units={"lambda_s": "deg"}, **asked), throw=False)
    explanation = tmsopt.explain(solution)
    json.dumps(explanation.to_json(), allow_nan=False)
    assert explanation.report().splitlines()
    return solution, explanation, {lever.name: lever for lever in explanation.levers}


@pytest.fixture(scope="module")
def ep4():
    return explained(fixed=CHI_H_1, free=BOX, minimize="abscissa")


@pytest.fixture(scope="module")
def realistic():
    solution = tmsopt.solve("problems/realistic.toml")
    return solution, tmsopt.explain(solution)


# Levers beside closed forms


@pytest.mark.slow
def test_least_speed_of_an_ep4_beside_its_closed_form():
    """Fr = (r² + 6r + 1)/(4 √h (r + 1)), r = chi_B, h = omega0⁻², grows with r: it leans on chi_B.min."""

    def least(r, omega0):
        return -omega0 * (r * r + 6 * r + 1) / (4 * (r + 1))

    free = {"zeta_B": (-1, -0.3), "zeta_H": (-1, -0.1), "Fr": (0.01, 10), "chi_B": (1.2, 5), "lambda_s": (0.02, 1.4)}
    solution, explanation, levers = explained(
        fixed={"chi_H": 1.0, "mu": 0.1}, free=free, minimize="Fr", locate="EP4", constraints={"decay": "omega0 == -1.5"}
    )
    assert solution.value == pytest.approx(least(1.2, -1.5), rel=1e-11)
    bound, equality = levers["chi_B.min"], levers["decay"]
    slope = float(mp.diff(lambda r: least(r, mp.mpf(-1.5)), mp.mpf(1.2)))
    assert bound.step == -0.01
    assert bound.per_unit == pytest.approx(slope, rel=1e-8)
    assert bound.resolved == pytest.approx(least(1.2, -1.5) - least(1.19, -1.5), rel=1e-8)
    # linear in omega0; the right-hand side is moved to the side that helps, here upwards
    assert equality.step == 0.02
    assert equality.predicted == pytest.approx(least(1.2, -1.5) - least(1.2, -1.48), rel=1e-8)
    assert equality.resolved == pytest.approx(equality.predicted, rel=1e-8)
    assert equality.sentence.startswith("moving decay (omega0 == -1.5) by 0.02 improves the objective by 0.0219")
    assert explanation.summary.startswith("four roots coincide (EP4): the smallest Fr found is 1.64")
    assert [w for w in explanation.warnings if "chi_B.min = 1.2" in w]
    assert not [w for w in explanation.warnings if "decay" in w]  # a named constraint is meant


# Levers beside independent optima


def test_relaxing_never_costs_and_every_limit_that_binds_is_a_lever(realistic):
    solution, explanation = realistic
    assert {v.name for v in explanation.levers} == set(solution.active)
    assert all(v.resolved >= 0 for v in explanation.levers)  # the old optimum stays feasible
    assert all(v.per_unit == solution.active[v.name] for v in explanation.levers)
    assert any(v.sentence.startswith("raising lambda_s.max by 1 deg improves") for v in explanation.levers)


def test_the_reader_is_told_why_the_gain_ends():
    """Just below the speed of EP4 a step of 0.02 reaches it: Fr = 2.23631751837 in closed form."""
    solution, _, levers = explained(fixed=CHI_H_1, free=BOX | {"Fr": (0.01, 2.2363)}, minimize="abscissa")
    lever = levers["Fr.max"]
    assert lever.structure == "EP4"
    assert lever.resolved == pytest.approx(solution.value + (ZETA_B * ZETA_H) ** -0.25, rel=1e-9)
    assert abs(lever.relative) > 0.2
    assert f"the structure changes from {solution.structure} to EP4" in lever.reason
    assert "no longer active: Fr.max" in lever.reason
    assert lever.reason in lever.sentence


def test_without_solving_again(realistic):
    levers = tmsopt.explain(realistic[0], resolve=False).levers
    assert all(math.isnan(v.resolved) and v.predicted > 0 and "(first-order estimate)" in v.sentence for v in levers)


# Steps and moved problems

DEG, CM, KMH = ("rad", "deg", math.pi / 180), ("m", "cm", 0.01), ("m/s", "km/h", 1 / 3.6)
NONE = ("1", "", 1.0)


@pytest.mark.parametrize(
    ("unit", "size", "text"),
    [
        (DEG, 1.0, "1 deg"),
        (DEG, math.radians(3), "0.1 deg"),
        (CM, 1.2, "1 cm"),
        (CM, 0.02, "0.1 cm"),
        (KMH, 4.0, "1 km/h"),
        (KMH, 0.5, "0.1 km/h"),
        (("m/s", "m/s", 1.0), 4.0, "0.2 m/s"),
        (NONE, 10.0, "0.1"),
        (NONE, 0.02, "0.0002"),
        (NONE, 0.45, "0.005"),
        (("kg", "kg", 1.0), 85.0, "1 kg"),
        (NONE, 0.0, "0.01"),
    ],
)
def test_natural_steps(unit, size, text):
    assert natural_step(Unit(*unit[1:]), unit[0], size).text == text


def test_a_step_stays_within_what_is_physical():
    allowed = Range(0.0)
    step = step_within(Unit(*KMH[1:]), "m/s", 10.0, 0.1, -1.0, allowed)
    assert 0 < step.size <= 0.1
    assert step.text == "0.2 km/h"  # 0.5 km/h is more than 0.1 m/s
    assert step_within(Unit(), "1", 1.0, 0.0, -1.0, allowed) is None
    tilt = step_within(
        Unit(*DEG[1:]), "rad", 1.0, math.radians(89.5), 1.0, Range(-math.pi / 2, math.pi / 2, closed=False)
    )
    assert tilt.text == "0.2 deg"


def test_moved_constraints_keep_their_sense():
    problem = tmsopt.Problem(
        tms, fixed=CHI_H_1, free=BOX, minimize="abscissa", constraints={"a": "Fr <= 2", "b": "1 - nu_H>=chi_B - 1"}
    )
    values = problem.posed.values({**CHI_H_1, "Fr": 2.0, "chi_B": 1.4, "lambda_s": 0.4})
    for name, step in (("a", 0.5), ("b", -1e-5), ("a", -0.25)):
        after = move_limit(problem.posed, name, step)
        assert after.conditions[name].comparison == problem.posed.conditions[name].comparison
        change = after.conditions[name](values) - problem.posed.conditions[name](values)  # of left minus right
        assert change == pytest.approx(-step, rel=1e-9)
    assert move_limit(problem.posed, "Fr.max", 1.0).free["Fr"] == (0.01, 11.0)


# Rounding


def of_decimals(solution, written):
    """60-digit abscissa and damping ratio of decimals as written, the other parameters as stored."""
    with mp.workdps(80):
        numbers = {name: mp.mpf(text.removesuffix(" deg")) for name, text in written.items()}
        if "lambda_s" in numbers:
            numbers["lambda_s"] *= mp.pi / 180
        found = roots_60(polynomial_60(**{**solution.dimensionless, **numbers}))
        return float(max(z.real for z in found)), float(min(-z.real / abs(z) for z in found))


@pytest.mark.parametrize("which", ["ep4", "realistic"])
def test_rounding_beside_roots_at_60_digits(request, which):
    solution, explanation = request.getfixturevalue(which)[:2]
    assert [row.digits for row in explanation.precision] == [2, 3, 4, 6]
    for row in (*explanation.precision, *explanation.rounding.values()):
        truth, damping = of_decimals(solution, row.written)
        assert row.realised == pytest.approx(truth, rel=1e-15)  # both are right to the last bit but one
        assert row.loss == pytest.approx(truth - solution.abscissa, abs=1e-15)
        # a change of 1e-16 of roots a relative 1e-6^(1/4) apart moves them by 1e-16 / (4 · 0.03³), some 1e-12
        assert row.damping_ratio == pytest.approx(damping, abs=1e-10)
    losses = {n: of_decimals(solution, row.written) for n, row in explanation.rounding.items()}
    assert explanation.worst == max(losses, key=losses.get)


def test_decimals_are_those_of_the_reported_unit(ep4):
    """Fr = 2.23632, chi_B = 1.41421, lambda_s = 23.5301 deg in closed form."""
    table = {row.digits: dict(row.written) for row in ep4[1].precision}
    assert table[2] == {"Fr": "2.2", "chi_B": "1.4", "lambda_s": "24 deg"}
    assert table[6] == {"Fr": "2.23632", "chi_B": "1.41421", "lambda_s": "23.5301 deg"}


def test_violations_of_rounding_are_named(realistic):
    """nu_H = 0.02 and chi_T = 1 bind: by the definitions of both, what rounding does to them."""
    solution, explanation = realistic
    row = explanation.rounding["chi_B"]
    p = {**solution.dimensionless, "chi_B": 1.03}
    excess = (p["chi_B"] + p["mu"] * p["chi_H"]) / (1 + p["mu"]) - 1
    assert row.written["chi_B"] == "1.03"
    assert dict(row.violations) == {"not_over_the_front": pytest.approx(excess, rel=1e-9)}
    assert "mu" not in explanation.rounding  # at its limit 0.2, which has fewer digits
    bound = replace(solution.problem, free={**solution.problem.free, "Fr": (0.5, 2.4936)})
    moved_there = replace(solution, problem=bound, parameters={**solution.parameters, "Fr": 2.4936})
    five, two = round_design(moved_there, [(["Fr"], 5), (["Fr"], 2)])
    assert "Fr.max" not in five.violations
    assert (two.written["Fr"], dict(two.violations)) == ("2.4", {})  # inwards: 2.5 is beyond the end


# Warnings


def test_nothing_to_warn_of_at_a_free_optimum(ep4):
    _, explanation, levers = ep4
    assert (explanation.warnings, levers) == ((), {})
    assert explanation.summary == "four roots coincide (EP4): no design within the limits decays faster (proved)"
    assert explanation.bound.proven


def test_an_arbitrary_bound_is_warned_of_and_a_constraint_is_not(realistic):
    (warned,) = realistic[1].warnings  # and nothing of mu without effect, for chi_H is not 1
    assert "Fr.max = 2.5, mu.max = 0.2, lambda_s.max = 30 deg; if a range is a guess" in warned


def test_a_physical_end_is_no_arbitrary_bound():
    asked = {"fixed": {n: v for n, v in CHI_H_1.items() if n != "mu"} | {"Fr": 1.0, "chi_B": 1.4, "lambda_s": 0.4}}
    _, explanation, levers = explained(**asked, free={"mu": (0.0, 1.0)}, minimize="mu")
    assert explanation.warnings == ()
    assert levers["mu.min"].physical
    assert levers["mu.min"].step == 0
    assert "cannot be moved" in levers["mu.min"].sentence
    _, explanation, levers = explained(**asked, free={"mu": (0.001, 1.0)}, minimize="mu")
    assert "mu.min = 0.001" in explanation.warnings[0]
    assert levers["mu.min"].resolved == pytest.approx(1e-5, rel=1e-6)  # 1 % of it, and the objective is mu


def test_a_parameter_without_effect_is_named():
    """At chi_H = 1 the polynomial does not depend on mu; chi_T = (chi_B + mu)/(1 + mu) does."""
    fixed = {n: v for n, v in CHI_H_1.items() if n != "mu"}
    free = BOX | {"mu": (0.0, 1.0)}
    _, explanation, _ = explained(fixed=fixed, free=free, minimize="abscissa")
    (warning,) = explanation.warnings
    assert warning.startswith("mu has no effect on abscissa here: any value from 0 to 1 ")
    _, explanation, _ = explained(fixed=fixed, free=free, minimize="abscissa", constraints={"front": "chi_T <= 2"})
    assert len(explanation.warnings) == 1
    assert "any value from 0 to 1 that satisfies front" in explanation.warnings[0]


def test_a_bound_touched_for_nothing_is_named():
    """A bound put at a free optimum: nothing is gained by moving it."""
    solution = tmsopt.solve(tmsopt.Problem(tms, fixed=CHI_H_1, free=BOX, minimize="abscissa"))
    problem = replace(solution.problem, free=BOX | {"chi_B": (1.01, solution.parameters["chi_B"])})
    warned = tmsopt.explain(replace(solution, problem=problem)).warnings
    assert len(warned) == 1
    assert warned[0].startswith("chi_B is at chi_B.max = 1.414213562")
    assert "relaxing it improves nothing" in warned[0]


# Whatever the problem


def test_nothing_free():
    solution = tmsopt.solve("problems/benchmark.toml")
    explanation = tmsopt.explain(solution)
    assert explanation.summary == "one complex pair is rightmost (pair): the given design, with nothing free"
    assert (explanation.levers, dict(explanation.rounding), explanation.precision) == ((), {}, ())


def test_located_only():
    fixed = {"chi_H": 1.02, "zeta_H": ZETA_H, "zeta_B": ZETA_B}
    free = {"chi_B": (1.0, 3.0), "mu": (0.001, 100.0), "Fr": (0.01, 10.0), "lambda_s": (0.02, 1.5)}
    _, explanation, levers = explained(fixed=fixed, free=free, locate="EP4", constraints={"decay": "omega0 == -1"})
    assert levers == {}
    assert explanation.summary == "four roots coincide (EP4): a design with EP4, as asked"
    assert all("decay" in row.violations for row in explanation.precision)  # an equality bears no rounding


@pytest.mark.slow
def test_infeasible():
    solution, explanation, levers = explained(
        fixed=CHI_H_1, free=BOX, minimize="abscissa", constraints={"fast": "abscissa <= -3"}
    )
    assert solution.status == "infeasible"
    assert explanation.summary.endswith("violates fast")
    assert (levers, explanation.precision, explanation.warnings) == ({}, (), ())


def test_not_converged(ep4):
    explanation = tmsopt.explain(replace(ep4[0], status="not_converged"))
    assert "did not converge" in explanation.summary
    assert explanation.levers == ()
    assert len(explanation.precision) == 4


@pytest.mark.slow
def test_the_command_says_what_it_means():
    def printed(*options):
        done = CliRunner().invoke(main, ["solve", "problems/ep4.toml", *options])
        assert done.exit_code == 0
        return done.stdout

    data, text = json.loads(printed("--json", "--full")), printed("--full")
    meaning = data["meaning"]
    assert meaning["summary"].startswith("four roots coincide (EP4)")
    assert [row["digits"] for row in meaning["precision"]] == [2, 3, 4, 6]
    assert re.search(
        r"minimize abscissa = -1.8803015; -1.8[\d]+ in double precision; four roots coincide \(EP4\)", text
    )
    for words in (
        "lambda_s alone  23.5 deg",
        "4-fold root -1.8803015: defective",
        "holds for ε > 0",
        "local optimality: this EP4 is a strict local minimum of abscissa",
    ):
        assert words in text
    assert "-1.8803 (4-fold)  0.25  0.133" in re.sub(r"  +", "  ", text)
    assert meaning["optimality"]["verdict"] == "strict minimum"
    assert [(d["algebraic"], d["geometric"], d["partial"]) for d in data["diagnosis"]] == [(4, 1, [4])]
    assert data["stable"]
    assert data["units"]["lambda_s"] == "rad"


@pytest.mark.slow
def test_rounding_over_a_band_is_judged_between_its_speeds_too():
    """By NumPy's eigenvalues at 4 001 speeds: a rounded design has its worst speed where the design had none."""
    design = tmsopt.solve("problems/speed_band.toml")
    Fr = np.linspace(1.2, 2.4, 4001)
    for row in tmsopt.explain(design).precision:
        own = dict(design.parameters)
        for name, text in row.written.items():
            value, _, unit = text.partition(" ")
            own[name] = math.radians(float(value)) if unit == "deg" else float(value)
        worst = hunt.abscissa({**own, "Fr": Fr}).max()
        assert row.realised == pytest.approx(worst, abs=3e-7)  # the peak between two of the speeds
        assert row.loss >= -1e-9  # no design is better than the best


@pytest.mark.slow
def test_rounding_in_one_line_says_how_many_digits_are_enough():
    """By companion eigenvalues of the rounded designs: those with a simple rightmost root, which doubles resolve."""
    design = tmsopt.solve("problems/realistic.toml")
    told = describe_rounding(tmsopt.explain(design, resolve=False))
    digits, share = map(int, re.findall(r"with (\d) digits (?:the design|it) keeps (\d+) %", told)[-1])
    kept = {}
    for n in (2, 3, 4, 6):
        one = {name: unit_of(design.problem.posed, name).factor for name in design.problem.free}
        short = {name: float(f"{design.parameters[name] / u:.{n}g}") * u for name, u in one.items()}
        a = laws.copo(**{**design.parameters, **short})
        kept[n] = np.roots(a).real.max() / design.abscissa
    assert digits == min(n for n in kept if kept[n] >= 0.95)
    assert share == int(100 * kept[digits])
    assert told.endswith(f"keeps {share} % of the decay rate; {tmsopt.explain(design).worst} needs the most digits")
    assert told.startswith(
        f"with 3 digits the design loses {round(100 * (1 - kept[3]))} % of the decay rate and violates the limit 'offset' and "
    )  # a workshop's


def test_digits_that_are_enough_by_chance_are_not_told():
    """With two and three digits gain and loss of the pair are equal again, with four they are not: roots by NumPy."""
    design = tmsopt.solve("problems/pt_pair.toml")
    moved = {}
    for digits in (2, 4, 6):
        short = {n: float(f"{x:.{digits}g}") for n, x in design.parameters.items() if n in design.problem.free}
        moved[digits] = np.roots(design.problem.model.coefficients({**design.parameters, **short})).real.max()
    assert moved[2] < 1e-7 < moved[6] < moved[4]
    assert describe_rounding(tmsopt.explain(design, resolve=False)) == (
        f"with 6 digits the design shifts its rightmost root by {moved[6]:.2g}"
    )


@pytest.mark.parametrize("value", [-1.0488041, -1.0488049, 8.6400041, 8.6400049])
@pytest.mark.parametrize("sense", ["minimize", "maximize"])
def test_a_bound_is_printed_on_its_safe_side(sense, value):
    """Rounded to six digits, it excludes no design that the proved bound admits."""
    problem = tmsopt.Problem(from_coefficients([1, "x", 1]), free={"x": (0.1, 1)}, **{sense: "x"})
    design = tmsopt.solve(problem)
    text = proof_line(replace(design, bound=replace(design.bound, value=value, gap=1.0, proven=False)))
    sign, printed = re.search(r"x ([<>]) (\S+) \(method", text).groups()
    assert abs(float(printed) - value) <= 1e-5
    assert (sign, float(printed) <= value) == (("<", True) if sense == "minimize" else (">", False))


def test_rounding_that_makes_a_design_unstable_is_said_so():
    """s² + (x − 1.23456) s + 1 is stable for x > 1.23456 alone: two digits round 1.2346, the box's end, down to 1.2."""
    model = from_coefficients([1, "x - 1.23456", 1])
    problem = tmsopt.Problem(model, free={"x": (1.0, 1.23466)}, minimize="abscissa")
    told = describe_rounding(tmsopt.explain(tmsopt.solve(problem), resolve=False))
    assert told.startswith("with 3 digits the design is unstable (x alone: 1.23); ")
    assert told.endswith("with 6 digits it keeps 100 % of the decay rate")
