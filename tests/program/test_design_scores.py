"""Designs judged many at once are worth, and violate, what the recheck says of each: other code, without arrays."""

from importlib import import_module

import casadi as ca
import numpy as np
import pytest
from helpers.designs import designs

import tmsopt
from tmsopt.evaluation import recheck
from tmsopt.models import from_coefficients

design_scores = import_module("tmsopt.program.design_scores")
rechecking = import_module("tmsopt.evaluation.recheck")

x, y = ca.SX.sym("x"), ca.SX.sym("y")
TMS = tmsopt.models.tms
LIMITS = {
    "own": "chi_B + 0.3*abs(chi_H) <= 1.5",
    "decay": "abscissa <= -0.2",
    "sway": "damping_ratio >= 0.3",
    "tied": "Fr == mu + 1",
    "held": "abscissa + Fr == 2",
    "kink": "max(nu_H, omega0) >= 0.1*Fr",
}
SIMPLE = 1e-7  # of random designs, whose roots are simple: two algorithms, 1e-9 or so near the worst conditioned


def problem(**asked):
    free = {
        "Fr": (0.0, 8.0),
        "mu": (0.01, 40.0),
        "chi_B": (-2.0, 4.0),
        "chi_H": (-2.0, 4.0),
        "zeta_B": (-3.0, -0.01),
        "zeta_H": (-3.0, -0.01),
        "lambda_s": (-1.4, 1.4),
    }
    drop = asked.pop("drop", ())
    return tmsopt.Problem(TMS, free={n: e for n, e in free.items() if n not in drop}, constraints=LIMITS, **asked).posed


def judged(stated, drawn):
    return design_scores.score_designs(stated, {n: np.array([d[n] for d in drawn]) for n in stated.free})


@pytest.mark.parametrize(
    "asked",
    [
        {"minimize": "abscissa"},
        {"maximize": "damping_ratio - 0.1*Fr"},
        {"minimize": "abscissa + mu", "scenarios": {"Fr": [0.5, 1.5, 4.0]}, "drop": ("Fr",)},
        {"minimize": "angular_frequency + mu", "scenarios": {"Fr": [0.5, 1.5, 4.0]}, "drop": ("Fr",)},
        {"maximize": "damping_ratio*mu + chi_B", "tolerances": {"chi_B": 0.1, "zeta_H": 0.005}},
        {"minimize": "Fr", "scenarios": {"Fr": [0.5, 4.0]}, "tolerances": {"chi_H": 0.1}, "drop": ("Fr",)},
    ],
    ids=["abscissa", "damping", "scenarios", "frequency", "tolerances", "both"],
)
def test_the_recheck_says_the_same_of_each_design(asked):
    stated, drawn = problem(**asked), designs(40, seed=3)
    found = judged(stated, drawn)
    names = list(stated.conditions)
    assert found.is_equality.tolist() == [name in ("tied", "held") for name in names]
    for k, design in enumerate(drawn):
        parameters = stated.ordered({n: design[n] for n in stated.free})
        checked = recheck(stated, parameters, stated.cases)
        amounts = rechecking.measure_excesses(stated, parameters, stated.cases)
        assert found.objective[k] == pytest.approx(stated.sign * checked.objective, rel=SIMPLE, abs=SIMPLE)
        for name, own in zip(names, found.excess[:, k], strict=True):
            # Where a root is real and positive the ratio is -1, whatever the design: the abscissa tells designs apart.
            flat = name == "sway" and amounts[name] == pytest.approx(1.3, abs=1e-12)
            worse = checked.structure.abscissa if flat else 0.0
            assert own == pytest.approx(abs(amounts[name]) + worse, rel=SIMPLE, abs=SIMPLE), name


def test_root_quantities_are_the_worst_of_all_cases_and_an_equality_that_of_the_nominal_design():
    """s + x − y, with y from 0 to 2 and x up to 1 off: the abscissa is y − x, at worst 3 − x."""
    stated = tmsopt.Problem(
        from_coefficients([1, x - y]),
        free={"x": (0.0, 9.0)},
        scenarios={"y": [0.0, 2.0]},
        tolerances={"x": 1.0},
        minimize="abscissa + x",
        constraints={"decay": "abscissa <= -0.5", "own": "x == 4", "all": "x - y >= 2"},
    ).posed
    found = design_scores.score_designs(stated, {"x": np.array([3.0, 4.0, 6.0])})
    # The objective: x is 1 more at worst, beside the worst abscissa.
    assert found.objective == pytest.approx([4.0, 4.0, 4.0], abs=1e-12)
    assert found.excess == pytest.approx(np.array([[0.5, 0, 0], [1.0, 0, 2.0], [2.0, 1.0, 0]]), abs=1e-12)
    assert found.signed_excess[list(stated.conditions).index("decay")] == pytest.approx([0.5, -0.5, -2.5], abs=1e-12)


def test_of_an_equality_the_difference_alone_counts():
    """Of s² + x s − 1, one root of which is positive, the damping ratio is −1 whatever x is; no abscissa is added."""
    model = from_coefficients([1, x, -1])
    stated = tmsopt.Problem(model, free={"x": (0.0, 1.0)}, constraints={"flat": "0.3 == damping_ratio"}).posed
    assert design_scores.score_designs(stated, {"x": np.array([0.0, 0.5])}).signed_excess[0] == pytest.approx(
        [1.3, 1.3], abs=1e-12
    )


def test_a_design_without_motion_is_none():
    """A singular mass matrix, or a coefficient that does not exist: neither is a design to the recheck."""
    model = from_coefficients([x, 1 + ca.log(y), 1])
    stated = tmsopt.Problem(
        model, free={"x": (-1.0, 1.0), "y": (0.0, 1.0)}, minimize="x", constraints={"own": "y <= 2"}
    ).posed
    found = design_scores.score_designs(
        stated, {"x": np.array([0.0, 0.5, -0.5, 0.0]), "y": np.array([1.0, 0.0, 1.0, 0.0])}
    )
    assert np.isfinite(found.objective).tolist() == [False, False, True, False]
    assert found.excess.tolist() == [[np.inf, np.inf, 0.0, np.inf]]
    assert set(recheck(stated, {"x": 0.0, "y": 1.0}).violations) == {"a0"}
