"""Local optimality: multipliers beside the closed form and 60-digit values of moved factors, verdicts beside samples."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.oracles import abscissa_60, polynomial_60
from helpers.structures import times as product
from mpmath import mp

import tmsopt
from tmsopt.analysis import NOT_COVERED, NOT_MINIMAL, STRICT, UNDECIDED
from tmsopt.models import tms

NATIVE = ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")
CHI_H_1 = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
BOX = {"Fr": (0.01, 10.0), "chi_B": (1.01, 5.0), "lambda_s": (0.02, 1.4)}
BENCHMARK = {"chi_H": 1.02, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 20.8}


def solved(**asked):
    return tmsopt.solve(tmsopt.Problem(tms, **asked))


def judged(solution):
    found = tmsopt.optimality(solution)
    json.dumps(found.to_json(), allow_nan=False)
    assert found.report().splitlines()
    return found


@pytest.fixture(scope="module")
def ep4():
    return solved(fixed=CHI_H_1, free=BOX, minimize="abscissa")


@pytest.fixture(scope="module")
def other_ep4():
    """An EP4 at which a4/a0 varies with the tilt."""
    return solved(fixed=BENCHMARK, free=BOX, locate="EP4")


@pytest.fixture(scope="module")
def ep3():
    return solved(fixed=CHI_H_1 | {"lambda_s": 0.3}, free={n: BOX[n] for n in ("Fr", "chi_B")}, minimize="abscissa")


@pytest.fixture(scope="module")
def cep2():
    return solved(fixed=CHI_H_1 | {"Fr": 3.5}, free={n: BOX[n] for n in ("chi_B", "lambda_s")}, locate="CEP2")


@pytest.fixture(scope="module")
def realistic():
    return tmsopt.solve("problems/realistic.toml")


def moved_abscissa(solution, factor, extra, scale):
    """γ, at 60 digits, of the design whose polynomial about γ is a0 · factor, and of that with one coefficient ε.

    `factor(eps, *extra unknowns)` are its coefficients in t. The free parameters are whatever makes them agree.
    """
    names = list(solution.problem.free)

    def equations(eps):
        def residual(*x):
            design = dict(solution.parameters) | dict(zip(names, x[: len(names)], strict=True))
            a = polynomial_60(**{n: mp.mpf(design[n]) if isinstance(design[n], float) else design[n] for n in NATIVE})
            gamma = x[len(names)]
            moved = np.poly1d(a)(np.poly1d([mp.mpf(1), gamma])).coeffs
            wanted = factor(eps, *x[len(names) + 1 :])
            return [moved[k] - a[0] * wanted[k] for k in range(1, 5)]

        start = [solution.parameters[n] for n in names] + [solution.abscissa, *extra]
        return mp.findroot(residual, start, tol=mp.mpf(10) ** -80, maxsteps=60)[len(names)]

    with mp.workdps(50):
        step = mp.mpf(scale)
        return float((equations(step) - equations(-step)) / (2 * step))


# Multipliers beside closed forms and moved factors


def test_multipliers_of_the_ep4_in_closed_form(ep4):
    """At chi_H = 1 a4/a0 = 1/(zeta_B zeta_H) =: ω⁴ is given, so ω³c₁ + ω²c₂ + ωc₃ + c₄ = 4 ω³ (γ + ω) to first order."""
    found = judged(ep4)
    omega = (0.4 * 0.2) ** -0.25
    (root,) = found.roots
    assert (found.verdict, found.order, root.multiplicity) == (STRICT, 1, 4)
    assert (found.unknowns, found.conditions) == (4, 4)
    expected = [1 / (4 * omega**k) for k in range(4)]
    # the design is met to 1e-14, and the condition number of four equations is below 1e3
    assert [root.beta, root.kappa, *root.ties] == pytest.approx(expected, rel=1e-10)
    assert found.residual < 1e-10


def test_multipliers_of_an_ep4_beside_moved_factors(other_ep4):
    """The design with (t⁴ + ε t²) instead of t⁴, and so on, at 50 digits: differences over ε are the multipliers."""
    found = judged(other_ep4)
    (root,) = found.roots
    multipliers = [root.beta, root.kappa, *root.ties]
    assert abs(root.kappa - 1 / (4 * abs(root.re))) > 1e-2  # not that of a given a4/a0
    for k, multiplier in enumerate(multipliers, start=1):
        moved = moved_abscissa(other_ep4, lambda eps, k=k: [1, *(eps if j == k else 0 for j in range(1, 5))], [], 1e-9)
        assert multiplier == pytest.approx(moved, rel=1e-8, abs=1e-10)  # doubles in, differences good to 1e-16


def test_multipliers_of_an_ep3_beside_moved_factors(ep3):
    """t³ + ε t and t³ + ε beside the simple root, likewise."""
    found = judged(ep3)
    (root,) = found.roots
    assert ep3.structure == "EP3"
    assert (found.verdict, root.beta) == (STRICT, pytest.approx(1 / 3))
    distance = root.re - min(r.re for r in ep3.roots)
    for k, multiplier in ((2, root.kappa), (3, root.ties[0])):

        def factor(eps, r, k=k):
            return product([1, *(eps if j == k else 0 for j in range(1, 4))], [1, r])

        assert multiplier == pytest.approx(moved_abscissa(ep3, factor, [distance], 1e-9), rel=1e-8)


def test_multipliers_of_a_complex_double_pair_beside_moved_factors(cep2):
    """((t − iω)² + u + iv) times its conjugate, likewise."""
    (root,) = judged(cep2).roots
    assert (root.multiplicity, root.share) == (2, pytest.approx(1))

    def factor(u, v, omega):
        re, im = [1, 0, u - omega * omega], [-2 * omega, v]
        square = product(im, im)
        return [a + b for a, b in zip(product(re, re), [0, 0, *square], strict=True)]

    split = moved_abscissa(cep2, lambda eps, w: factor(eps, 0, w), [root.im], 1e-9)
    twist = moved_abscissa(cep2, lambda eps, w: factor(0, eps, w), [root.im], 1e-9)
    assert (root.kappa, root.ties[0]) == pytest.approx((split, twist), rel=1e-7)
    assert root.kappa < 0


def test_shares_of_the_line_add_up():
    """Σ m y of the first coefficients is 1: weight −1/m of each, as in the subgradients of Burke and Overton (2001)."""
    free = {n: BOX[n] for n in ("lambda_s", "chi_B")}
    solution = solved(fixed=CHI_H_1 | {"Fr": 2.0}, free=free, minimize="abscissa")
    found = judged(solution)
    assert solution.structure == "pair+real"
    pair = next(r for r in found.roots if r.im)
    real = next(r for r in found.roots if not r.im)
    assert pair.share + real.share == pytest.approx(1)
    assert 2 * pair.beta + real.beta == pytest.approx(1)
    assert (found.verdict, found.order) == (STRICT, 2)


@pytest.mark.slow
def test_multipliers_of_limits_are_those_of_the_solver(realistic):
    """Two routes to one number: Newton's method on the factors t² + βt + κ, and least squares on those of the line."""
    for solution in (realistic, tmsopt.solve("problems/point_mass_robot.toml")):
        found = judged(solution)
        assert (found.verdict, found.order) == (STRICT, 1)
        assert dict(found.limits) == pytest.approx(dict(solution.active), rel=1e-6)


def test_multiplier_of_a_quantity_at_its_kink_beside_a_solved_problem():
    """ballast_rear = max(0, …) <= 0: the gain of allowing 1e-4 of it, by solving again; second order is 1e-4."""
    problem = tmsopt.load("problems/ballast_free.toml")
    solution = tmsopt.solve(problem)
    allowed = {**problem.constraints, "no_ballast_at_the_rear": "ballast_rear <= 1e-4"}
    gain = (solution.value - tmsopt.solve(replace(problem, constraints=allowed)).value) / 1e-4
    found = judged(solution)
    assert found.verdict == STRICT
    assert found.limits["no_ballast_at_the_rear"] == pytest.approx(gain, rel=1e-3)


# Verdicts beside samples


def least_sampled(solution, sizes, count):
    """Least rise of the abscissa, at 60 digits, over random feasible designs at several distances."""
    problem = solution.problem.posed
    rng = np.random.default_rng(1)
    rises = []
    for size in sizes:
        taken = 0
        while taken < count:
            step = rng.standard_normal(len(problem.free))
            moved = dict(solution.parameters)
            for name, d in zip(problem.free, step / np.linalg.norm(step), strict=True):
                lower, upper = problem.free[name]
                moved[name] = min(max(moved[name] + size * d, lower), upper)
            if any(c.violation(problem.values(moved)) > 0 for c in problem.conditions.values() if "==" not in c.text):
                continue
            taken += 1
            native = problem.parameter_set.native(moved)
            a = polynomial_60(**{n: native[n] for n in NATIVE})
            rises.append(float(abscissa_60(a)) - solution.abscissa)
    return min(rises)


@pytest.mark.parametrize("name", ["ep4", "other_ep4", "ep3", "realistic"])
def test_no_sample_beside_a_strict_minimum_is_better(name, request):
    """The abscissa is met to 1e-13; a rise in proportion to the distance is far more than that."""
    solution = request.getfixturevalue(name)
    assert judged(solution).verdict == STRICT
    assert least_sampled(solution, (1e-2, 1e-5), count=6) > 0


def certainly_better(solution, found):
    """Whether the better design that is named has a lower abscissa at 60 digits, in the box."""
    problem = solution.problem
    assert all(lo <= found.better[n] <= hi for n, (lo, hi) in problem.free.items())
    value = float(abscissa_60(polynomial_60(**{n: found.better[n] for n in NATIVE})))
    return value < solution.abscissa and math.isclose(value, found.better_value, rel_tol=1e-7)


def test_a_double_pair_that_is_no_minimum(cep2):
    """Its kappa has a negative multiplier: drawn apart along the line, the roots go left together."""
    found = judged(cep2)
    assert (found.verdict, found.order) == (NOT_MINIMAL, 1)
    assert found.residual < 1e-10  # stationary for the factors all the same
    assert certainly_better(cep2, found)
    assert "multiple root splits" in found.reason


@pytest.mark.parametrize(
    "asked",
    [
        {
            "fixed": {k: v for k, v in BENCHMARK.items() if k != "mu"},
            "free": BOX | {"mu": (1.0, 100.0)},
            "locate": "EP4",
        },
        {"fixed": CHI_H_1, "free": BOX | {"Fr": (2.4, 2.6), "lambda_s": (0.02, 0.4)}, "locate": "2EP2"},
    ],
    ids=["EP4 with one more parameter free", "2EP2"],
)
def test_located_patterns_that_are_no_minima(asked):
    solution = solved(**asked)
    found = judged(solution)
    assert solution.structure == asked["locate"]
    assert found.verdict == NOT_MINIMAL
    assert not found.roots  # numbers that do not explain the gradient are no multipliers
    assert certainly_better(solution, found)
    assert "not asked for" in found.reason


@pytest.mark.parametrize(("bend", "verdict"), [(5.0, NOT_MINIMAL), (-5.0, STRICT)])
def test_curvature_decides_where_the_slope_does_not(bend, verdict):
    """Along a curve that touches the level line of the abscissa, α = α0 − bend τ² + …: a maximum, or a minimum.

    The gradient is one of 60-digit roots; the abscissa's own curvature there, below 1, is less than the bend.
    """
    at = {"Fr": 2.0, "chi_B": 1.2}
    design = CHI_H_1 | {"lambda_s": 0.3} | at

    def growth(**moved):
        return abscissa_60(polynomial_60(**design | moved))

    with mp.workdps(50):
        slope = {
            n: float((growth(**{n: x + mp.mpf("1e-15")}) - growth(**{n: x - mp.mpf("1e-15")})) / mp.mpf("2e-15"))
            for n, x in at.items()
        }
    linear = " + ".join(f"({slope[n]!r})*({n} - {x})" for n, x in at.items())
    square = " + ".join(f"({n} - {x})**2" for n, x in at.items())
    asked = tmsopt.Problem(
        tms,
        fixed={n: v for n, v in design.items() if n not in at},
        free={n: BOX[n] for n in at},
        constraints={"curve": f"{linear} + ({bend})*({square}) == 0"},
        minimize="abscissa",
    )
    found = judged(replace(solved(fixed=design), problem=asked))
    assert (found.verdict, found.order) == (verdict, 2)
    if verdict == NOT_MINIMAL:
        moved = {n: found.better[n] for n in at}
        assert float(growth(**moved)) < float(growth())
        assert asked.posed.conditions["curve"].violation(asked.posed.values(asked.posed.ordered(moved))) < 1e-9


# Parameters without effect


def test_a_parameter_without_effect_is_named():
    """At chi_H = 1 the polynomial does not depend on mu, so the minimum is strict in the others only."""
    fixed = {n: v for n, v in CHI_H_1.items() if n != "mu"}
    found = judged(solved(fixed=fixed, free=BOX | {"mu": (0.05, 1.0)}, minimize="abscissa"))
    assert (found.verdict, found.idle, found.unknowns) == (STRICT, ("mu",), 4)
    assert "without effect: mu" in found.reason


@pytest.mark.slow
def test_scale_and_speed_together_are_flat():
    """Wheelbase, speed and lengths that grow together keep the spectrum: no strict minimum may be claimed."""
    solution = solved(
        fixed={"m_B": 20.0, "m_H": 2.0},
        free={
            "w": (0.5, 1.0),
            "v": (0.1, 30.0),
            "x_B": (0.2, 4.0),
            "x_H": (0.2, 2.0),
            "z_B": (-2.0, -0.1),
            "z_H": (-2.0, -0.1),
            "lambda_s": (0.02, 1.4),
        },
        minimize="abscissa",
        constraints={"level": "chi_H == 1", "rear": "zeta_B <= -0.4", "front": "zeta_H <= -0.2"},
    )
    found = judged(solution)
    assert found.verdict == UNDECIDED
    assert "flat" in found.reason
    assert found.residual < 1e-10


# What is not covered


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"fixed": CHI_H_1 | {"Fr": 2.0, "chi_B": 1.4, "lambda_s": 0.4}}, "nothing is free"),
        (
            {
                "fixed": CHI_H_1 | {"chi_B": 1.2, "lambda_s": 0.3},
                "free": {"Fr": BOX["Fr"]},
                "minimize": "Fr",
                "constraints": {"d": "damping_ratio >= 0.2"},
            },
            "damping ratio is active",
        ),
        ({"fixed": CHI_H_1, "free": BOX, "minimize": "Fr"}, "abscissa is not active"),
        (
            {
                "fixed": CHI_H_1,
                "free": {n: BOX[n] for n in ("chi_B", "lambda_s")},
                "minimize": "abscissa",
                "scenarios": {"Fr": (1.5, 2.0)},
            },
            "several cases",
        ),
    ],
    ids=["nothing free", "damping", "no roots", "scenarios"],
)
def test_what_is_not_covered_is_said_in_a_line(asked, words):
    found = judged(solved(**asked))
    assert found.verdict == NOT_COVERED
    assert words in found.reason
    assert found.report().startswith("local optimality: not decided")


def test_an_optimum_over_a_pattern_is_not_judged(ep4):
    problem = tmsopt.Problem(tms, fixed=CHI_H_1, free=BOX, minimize="Fr", locate="2EP2")
    found = judged(replace(ep4, problem=problem))
    assert (found.verdict, "optimised over" in found.reason) == (NOT_COVERED, True)


def test_a_design_that_is_no_solution_is_not_judged(ep4):
    assert judged(replace(ep4, status="not_converged")).verdict == NOT_COVERED


def test_a_rounded_ep4_is_not_called_a_minimum(ep4):
    """Parameters rounded to 4 digits under the roots of the ideal design: the factors are not met."""
    rounded = {n: float(f"{v:.4g}") for n, v in ep4.parameters.items()}
    assert judged(replace(ep4, parameters=rounded)).verdict != STRICT
