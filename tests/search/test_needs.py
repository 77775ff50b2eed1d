"""Problems without an answer at their speed: the least one that takes, by closed forms and by scans of eigenvalues."""

import json
from dataclasses import replace

import numpy as np
import pytest
from helpers import hunt
from helpers.skates import FIXED, skate

import tmsopt
from tmsopt import laws
from tmsopt.analysis import infeasible_sentences

SLOW = skate({"chi_B": (1.01, 3.0), "lambda_s": (0.1, 1.2)}, {"Fr": 0.5}, minimize="abscissa")


def grid(*ends, points=801):
    return np.meshgrid(*(np.linspace(lo, hi, points) for lo, hi in ends))


def least_weave():
    """Fr_c (equation flus) at χ_B = √2 and the least tilt: no other design of the box has less."""
    chi_B, lambda_s = grid(*SLOW.free.values())
    scanned = laws.Fr_c(chi_B=chi_B, lambda_s=lambda_s, **FIXED)  # nan where no speed is a boundary
    least = float(laws.Fr_c(chi_B=np.sqrt(2), lambda_s=SLOW.free["lambda_s"][0], **FIXED))
    assert np.nanmin(scanned) >= least
    return least


@pytest.fixture(scope="module")
def slow():
    return tmsopt.solve(SLOW, throw=False)


def test_the_least_speed_at_which_a_design_is_stable(slow):
    assert slow.status == "optimal"
    assert not slow.stable
    assert slow.need.parameter == "Fr"
    assert not slow.need.most
    assert slow.need.value == pytest.approx(least_weave(), rel=1e-9)
    assert json.loads(json.dumps(slow.to_json()))["need"]["value"] == slow.need.value
    shown = float(infeasible_sentences(slow)[0].rsplit(" ", 1)[1])
    assert shown == pytest.approx(slow.need.value, rel=1e-4)
    assert shown >= slow.need.value
    assert "no stable design" in infeasible_sentences(slow)[0]
    assert "found for a stable design that satisfies all other limits" in infeasible_sentences(slow)[0]


@pytest.mark.slow
def test_the_least_speed_for_a_decay():
    """Freed from the start, the speed is minimised (problems/least_speed.toml); a scan of eigenvalues finds none below."""
    asked = {"constraints": {"decay": "abscissa <= -0.8"}, "fixed": FIXED, "free": {**SLOW.free, "Fr": (0.5, 1.5)}}
    design = tmsopt.solve(replace(SLOW, **asked), throw=False)
    free = replace(SLOW, **asked | {"free": {**SLOW.free, "Fr": (0.1, 5.0)}, "minimize": "Fr"})
    assert design.status == "infeasible"
    assert design.need.value == pytest.approx(tmsopt.solve(free).value, rel=1e-9)
    chi_B, lambda_s = grid(*SLOW.free.values(), points=201)
    for Fr, any_ in ((0.98 * design.need.value, False), (1.02 * design.need.value, True)):
        scanned = hunt.abscissa({**FIXED, "Fr": Fr, "chi_B": chi_B, "lambda_s": lambda_s})
        assert (scanned.min() <= -0.8) == any_
    first, *others = infeasible_sentences(design)
    assert first.startswith("no design with decay (abscissa <= -0.8) was found")
    assert "found for a design that satisfies all limits" in first
    assert others == []
    assert any("abscissa <= " in line for line in infeasible_sentences(design, full=True)[1:])


def test_a_speed_in_the_unit_in_which_it_was_typed(tmp_path):
    file = tmp_path / "slow.toml"
    file.write_text(
        """model = "tms"
        parameters = { w = 1, v = "3 km/h", m_B = 10, m_H = 1, z_B = -0.4, z_H = -0.2, x_H = 1, \
                       x_B = { min = 1.01, max = 3 }, lambda_s = { min = 0.1, max = 1.2 } }
        objective = { minimize = "abscissa" }""".replace("\\\n", "")
    )
    line = infeasible_sentences(tmsopt.solve(file, throw=False))[0]
    assert line.endswith(" km/h")
    assert float(line.split()[-2]) == pytest.approx(3.6 * least_weave() * np.sqrt(9.81), rel=1e-4)


@pytest.mark.slow
def test_the_speed_plays_no_part_where_the_loads_conflict_or_a_limit_is_about_it():
    """chi_T <= 1 asks chi_B <= 1 at chi_H = 1; the speed is in no coefficient of that."""
    loads = replace(SLOW, constraints={"load": "load_rear >= 0"})
    limits, free = {"decay": "abscissa <= -0.8", "slow": "Fr <= 1"}, {**SLOW.free, "Fr": (0.1, 5.0)}
    limited = replace(SLOW, fixed=FIXED, free=free, constraints=limits)
    for problem in (loads, limited):
        design = tmsopt.solve(problem, throw=False)
        assert design.status == "infeasible"
        assert design.need is None
    line, conflict, change = infeasible_sentences(tmsopt.solve(replace(loads, minimize="lambda_s"), throw=False))
    assert line == "load (load_rear >= 0) needs chi_B at most 1 (at least 1.01 is allowed)"
    assert conflict == "in conflict: load (load_rear >= 0), chi_B >= 1.01"
    assert change == "smallest change found: load_rear >= -0.009091 instead of 0 (load)"  # 1 − (1.01 + 0.1)/1.1


@pytest.mark.slow
def test_no_speed_helps_where_the_product_of_the_roots_forbids_it():
    """−omega0 = (0.08)^(-1/4) is the geometric mean of the roots at every speed."""
    design = tmsopt.solve(replace(SLOW, constraints={"decay": "abscissa <= -2"}), throw=False)
    assert not design.need.found
    assert design.need.looked[1] == 10.0


def test_a_design_that_answers_has_nothing_to_say():
    design = tmsopt.solve(replace(SLOW, fixed={**FIXED, "Fr": 3.0}))
    assert design.need is None
    assert infeasible_sentences(design) == []
