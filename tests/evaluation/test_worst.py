"""The worst case of a design and its proof, beside dense samples and closed forms; nothing is solved here."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from helpers import hunt
from scipy.optimize import brentq

import tmsopt
from tmsopt.evaluation import find_worst_cases, prove_worst_case, recheck
from tmsopt.problem import Band

TMS = tmsopt.models.tms
DESIGN = {"chi_H": 1.0, "mu": 0.1, "zeta_B": -0.4, "zeta_H": -0.2, "chi_B": 1.3, "lambda_s": 0.15, "Fr": 1.8}
FIXED_MU = {n: v for n, v in DESIGN.items() if n not in ("mu", "chi_B")} | {"chi_H": 1.02}


def fixed(design=DESIGN, **asked):
    return tmsopt.Problem(TMS, fixed={n: v for n, v in design.items() if n not in asked.get("scenarios", {})}, **asked)


def worst_cases(problem):
    return find_worst_cases(problem.posed, problem.posed.ordered({}))


def prove(problem, limit, **options):
    return prove_worst_case(problem.posed, problem.posed.ordered({}), limit, **options)


def sampled(problem, design, quantity, steps):
    """A root quantity over a grid of all bands and tolerances, `steps` each."""
    axes, names = [], []
    for name, band in problem.scenarios.items():
        axes.append(np.linspace(band.min, band.max, steps) if isinstance(band, Band) else np.array(band))
        names.append(name)
    for name, tolerance in problem.tolerances.items():
        axes.append(tolerance * np.linspace(-1, 1, steps))
        names.append(name)
    varied = {n: np.asarray(v) for n, v in design.items()}
    for k, (name, values) in enumerate(zip(names, np.meshgrid(*axes, indexing="ij"), strict=True)):
        varied[name] = values.ravel() + (varied[name] if k >= len(problem.scenarios) or name in names[:k] else 0.0)
    return quantity(varied)


def some_designs(count, seed):
    low, high = (0.5, 0.05, 0.9, 0.95, -1, -0.8, 0.1), (4, 3, 2, 1.2, -0.3, -0.2, 1.1)
    for row in np.random.default_rng(seed).uniform(low, high, (count, 7)).tolist():
        yield dict(zip(hunt.NATIVE, row, strict=True))


VARIED = [
    # what varies, and how many steps of each a sample takes
    ({"scenarios": {"Fr": Band(0.5, 4.0), "mu": (0.1, 2.0)}}, 4001),
    ({"scenarios": {"Fr": Band(0.5, 4.0)}, "tolerances": {"chi_B": 0.05}}, 151),
    ({"tolerances": {"chi_B": 0.05, "lambda_s": 0.05, "zeta_H": 0.05}}, 15),
    ({"scenarios": {"Fr": Band(1.0, 2.0)}, "tolerances": {"Fr": 0.1, "chi_H": 0.02}}, 31),
]


@pytest.mark.parametrize(("varied", "steps"), VARIED)
def test_worst_case_is_never_better_than_a_dense_sample(varied, steps):
    for design in some_designs(2, seed=steps):
        problem = fixed(design, **varied, constraints={"sway": "damping_ratio >= -2"})
        found = worst_cases(problem)
        for name, quantity, sign in (("abscissa", hunt.abscissa, 1), ("damping_ratio", hunt.damping_ratio, -1)):
            dense = float((sign * sampled(problem, design, quantity, steps)).max())
            assert sign * found[name].value >= dense - 1e-9 * max(1, abs(dense))
            # And it is one of the cases: their own value, inside the bands and the tolerances.
            case = found[name].case
            at = {**design, **case.at}
            at = {n: np.asarray(v + case.offset.get(n, 0.0)) for n, v in at.items()}
            assert float(quantity(at)) == pytest.approx(found[name].value, abs=1e-6)
            assert all(abs(x) <= problem.tolerances[n] * (1 + 1e-15) for n, x in case.offset.items())
            for n, x in case.at.items():
                band = problem.scenarios[n]
                assert (band.min <= x <= band.max) if isinstance(band, Band) else x in band


def test_a_worst_case_on_an_edge_of_the_box_and_in_it():
    """|x − 0.3| + 2 y on the unit square of offsets is worst at a corner, and −(x − 0.3)² − (y + 0.2)² inside."""
    tolerances = {"chi_B": 0.1, "mu": 0.05}
    x, y = "(chi_B - 1.3)/0.1", "(mu - 0.1)/0.05"
    asked = {
        "peak": f"-({x} - 0.3)**2 - ({y} + 0.2)**2 <= 1",
        "ridge": f"-({x} - 0.3)**2 + 2*({y}) <= 1",
        "low": f"{x} >= 0",
    }
    problem = fixed(tolerances=tolerances, constraints=asked)
    found = worst_cases(problem)
    assert found["constraint peak"].value == pytest.approx(-1, abs=1e-12)
    assert found["constraint ridge"].value == pytest.approx(1, abs=1e-12)  # at x = 0.3 on the edge y = 1
    assert found["constraint ridge"].case.offset["mu"] == pytest.approx(0.05, abs=1e-15)
    assert found["constraint ridge"].case.offset["chi_B"] == pytest.approx(0.03, abs=1e-7)
    assert found["constraint low"].value == pytest.approx(-1, abs=1e-12)


def test_an_infinite_root_is_the_worst_there_is():
    """a0 = 0 at T = (chi_H − 1)/zeta_H, inside the band: its roots go to infinity on one side of it."""
    problem = fixed({**DESIGN, "chi_H": 0.98}, scenarios={"lambda_s": [0.05, float(np.arctan(0.1)), 0.4]})
    worst = worst_cases(problem)["abscissa"]
    assert worst.value > 1e6 or not np.isfinite(worst.value)


# Proofs


@pytest.mark.parametrize(("varied", "steps"), VARIED)
def test_a_proven_limit_is_never_below_a_dense_sample(varied, steps):
    for design in some_designs(2, seed=7 * steps):
        problem = fixed(design, **varied)
        worst = worst_cases(problem)["abscissa"].value
        found = prove(problem, worst, max_boxes=600)
        assert found.limit >= worst
        assert found.limit == pytest.approx(worst, abs=2e-6 * (1 + abs(worst)))
        if found.proven:
            assert float(sampled(problem, design, hunt.abscissa, steps).max()) <= found.limit
        low = prove(problem, worst - 1e-3 * (1 + abs(worst)), max_boxes=60)
        assert not low.proven


def test_a_band_is_proven_in_a_few_boxes_and_not_when_they_are_too_few():
    problem = fixed(scenarios={"Fr": Band(1.2, 2.4)})
    worst = worst_cases(problem)["abscissa"].value
    found = prove(problem, worst)
    assert found.proven
    assert found.boxes > 1
    assert not prove(problem, worst, max_boxes=found.boxes - 1).proven


def test_a_singular_mass_matrix_in_a_band_is_not_proven():
    """a0 vanishes where tan lambda_s = (chi_H − 1)/zeta_H: 0.1 here, whatever the limit that is asked."""
    problem = fixed({**DESIGN, "chi_H": 0.98}, scenarios={"lambda_s": Band(0.05, 0.3)})
    for limit in (0.0, 1.0, 1e6):
        assert not prove(problem, limit, max_boxes=300).proven
    clear = fixed({**DESIGN, "chi_H": 0.98}, scenarios={"lambda_s": Band(0.2, 0.3)})
    assert prove(clear, worst_cases(clear)["abscissa"].value).proven


def test_backward_tilts_are_proven_too():
    """a0 < 0 there; the dual of a design has the same spectrum, at a speed and with a band divided by chi_B."""
    dual = {**DESIGN, **{n: float(v) for n, v in tmsopt.laws.dual(1.8, 1.3, -0.4, -0.2, 0.15).items()}}
    worst = []
    for design, band in ((DESIGN, Band(1.2, 2.4)), (dual, Band(1.2 / 1.3, 2.4 / 1.3))):
        problem = fixed(design, scenarios={"Fr": band})
        worst.append(worst_cases(problem)["abscissa"].value)
        assert prove(problem, worst[-1]).proven
    assert dual["lambda_s"] < 0
    assert worst[0] == pytest.approx(worst[1], abs=1e-9)


def test_separate_values_ask_nothing_in_between():
    problem = fixed(scenarios={"Fr": Band(1.2, 2.4)})
    separate = replace(problem, scenarios={"Fr": (1.8, 2.4)})
    ends = hunt.abscissa({**DESIGN, "Fr": np.array([1.8, 2.4])}).max()
    found = worst_cases(separate)["abscissa"]
    assert found.value == pytest.approx(float(ends), abs=1e-9)
    assert prove(separate, found.value).boxes == 2
    assert worst_cases(problem)["abscissa"].value > found.value + 1e-2


# Evaluated


DROOPING = {**DESIGN, "chi_B": 1.28, "lambda_s": 0.1224}
"""Worst at Fr = 1.99, where a real root is rightmost, and better at 1.5 and at 2.3."""


def test_a_problem_with_nothing_free_is_evaluated_at_its_worst():
    problem = fixed(
        DROOPING, scenarios={"Fr": Band(1.5, 2.3, 2)}, minimize="abscissa + Fr", constraints={"fast": "Fr >= 1.4"}
    )
    design = tmsopt.solve(problem)
    dense = sampled(problem, DROOPING, hunt.abscissa, 20001)
    assert 100 < dense.argmax() < 19900
    assert design.abscissa == pytest.approx(float(dense.max()), abs=1e-8)
    assert design.value == pytest.approx(float(dense.max()) + 2.3, abs=1e-8)  # the worst of each, not of one case
    report = json.loads(json.dumps(design.to_json()))
    assert report["worst_case"]["at"] == pytest.approx({"Fr": 1.5 + 0.8 * dense.argmax() / 20000}, abs=1e-4)
    assert report["cover"]["proven"]
    found = worst_cases(problem)["objective"]
    assert found.value == pytest.approx(design.value, abs=1e-8)
    slow = tmsopt.solve(replace(problem, constraints={"fast": "Fr >= 1.6"}), throw=False)
    assert slow.status == "infeasible"
    assert list(slow.violations) == ["fast"]


@pytest.mark.parametrize("speeds", [(1.2, 1.9, 2.4), (1.8, 1.8001)])
def test_root_quantities_are_the_worst_of_the_cases(speeds):
    """Cases close together are told apart, although numeric roots alone would not be trusted to."""
    problem = fixed(scenarios={"Fr": speeds})
    checked = recheck(problem.posed, problem.posed.ordered({}))
    varied = {**{n: v + np.zeros(len(speeds)) for n, v in DESIGN.items()}, "Fr": np.array(speeds)}
    assert checked.worst.at["Fr"] == speeds[int(hunt.abscissa(varied).argmax())]
    assert checked.structure.abscissa == pytest.approx(float(hunt.abscissa(varied).max()), abs=1e-10)
    assert checked.quantities["damping_ratio"] == pytest.approx(float(hunt.damping_ratio(varied).min()), abs=1e-10)


# Solved: what is worst between the cases that a search starts with


def test_a_constraint_holds_between_the_points_of_a_band():
    """chi_B ≥ 1.5 − (Fr − 1.7)² for every speed is chi_B ≥ 1.5, which neither end of the band knows."""
    stated = tmsopt.Problem(
        TMS,
        fixed={n: v for n, v in DESIGN.items() if n not in ("Fr", "chi_B")},
        free={"chi_B": (1.05, 2.0)},
        scenarios={"Fr": Band(1.2, 2.4, 2)},
        constraints={"ahead": "chi_B >= 1.5 - (Fr - 1.7)**2"},
        minimize="chi_B",
    )
    assert tmsopt.solve(stated).value == pytest.approx(1.5, abs=1e-8)


@pytest.mark.slow
def test_the_damping_ratio_holds_at_corners_that_the_search_does_not_start_with():
    """Five tolerances have 32 corners, of which a search starts with two."""
    off = {"chi_B": 0.03, "lambda_s": 0.03, "zeta_B": 0.02, "zeta_H": 0.02, "mu": 0.01}
    stated = tmsopt.Problem(
        TMS,
        fixed={n: v for n, v in DESIGN.items() if n != "Fr"},
        free={"Fr": (1.0, 4.0)},
        tolerances=off,
        constraints={"sway": "damping_ratio >= 0.5"},
        minimize="Fr",
    )
    corners = np.array(list(product((-1.0, 1.0), repeat=5))).T

    def sway(Fr):
        varied = {n: DESIGN[n] + off.get(n, 0.0) * (corners[list(off).index(n)] if n in off else 0) for n in DESIGN}
        return float(hunt.damping_ratio({**varied, "chi_H": 1 + 0 * corners[0], "Fr": Fr + 0 * corners[0]}).min())

    least = brentq(lambda Fr: sway(Fr) - 0.5, 1.0, 2.5, xtol=1e-13)
    assert tmsopt.solve(stated).value == pytest.approx(least, abs=1e-7)  # and no point of the box is worse than these


def test_an_equality_is_one_of_the_nominal_design():
    """chi_T = (chi_B + mu chi_H)/(1 + mu) cannot be 1.15 for every mu; at the mu that is written it gives chi_B."""
    stated = tmsopt.Problem(
        TMS,
        fixed={**FIXED_MU, "mu": 1.0},
        free={"chi_B": (1.05, 2.0)},
        scenarios={"mu": [0.5, 2.0]},
        constraints={"centre": "chi_T == 1.15", "ahead": "chi_T >= 1.05"},
        minimize="abscissa",
    )
    design = tmsopt.solve(stated)
    assert design.parameters["chi_B"] == pytest.approx(1.15 * 2 - 1.02, abs=1e-9)
    least = replace(stated, constraints={"ahead": "chi_T >= 1.15"}, minimize="chi_B")
    assert tmsopt.solve(least).value == pytest.approx(1.15 * 3 - 2 * 1.02, abs=1e-9)  # with the heavier front mass
