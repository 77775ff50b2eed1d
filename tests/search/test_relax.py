"""Problems without an answer: which limits are in conflict, and the least that frees them, in closed form where there is one."""

import json
from dataclasses import replace
from functools import cache
from math import sqrt

import numpy as np
import pytest
from helpers import hunt
from helpers.hunt import abscissa
from helpers.skates import BOX, EP4, FIXED, skate
from helpers.texts import load

import tmsopt
from tmsopt.analysis import infeasible_sentences
from tmsopt.models import from_coefficients
from tmsopt.problem import move_limits, replace_limits
from tmsopt.records import Table


def problem(free=None, **asked):
    return skate({**BOX, **(free or {})}, **{"minimize": "Fr", **asked})


@cache
def failed(key):
    return tmsopt.solve(PROBLEMS[key], throw=False)


PROBLEMS = {
    "two bounds": problem(constraints={"high": "chi_B >= 1.8", "low": "chi_B <= 1.5"}),
    "faster than omega0": problem(constraints={"decay": "abscissa <= -2"}),
    "ep4 above the law": problem({"chi_B": (1.6, 3.0)}, minimize=None, locate="EP4"),
    "ep4 too slow": problem({"Fr": (0.5, 2.0)}, minimize=None, locate="EP4"),
    "equal, below": problem(constraints={"place": "chi_B == 1"}),
    "equal, above": problem(constraints={"place": "2*chi_B == 7"}),
    "slow and stable": problem(constraints={"decay": "abscissa <= -1", "slow": "Fr <= 1.2"}),
}


# Closed forms


AMOUNTS = {
    "two bounds": {"low": 0.3},  # or high
    "faster than omega0": {"decay": 2 - 0.08**-0.25},  # omega0 = −(ζ_B ζ_H)^(−1/4), the product of the roots
    "ep4 above the law": {"chi_B.min": 1.6 - sqrt(2)},
    "ep4 too slow": {"Fr.max": float(EP4.Fr) - 2.0},
    "equal, below": {"place": 0.05},  # chi_B is 1.05, so the right-hand side goes up
    "equal, above": {"place": -1.0},  # 2 chi_B is 6, so it goes down
}


@pytest.mark.parametrize("key", AMOUNTS)
@pytest.mark.slow
def test_amounts_in_closed_form(key):
    design = failed(key)
    assert design.status == "infeasible"
    found = dict(design.relaxation.amounts)
    expected = AMOUNTS[key] if "high" not in found else {"high": 0.3}  # equal limits give way one at a time
    assert found == pytest.approx(expected, abs=1e-9)
    assert set(found) <= set(design.relaxation.conflict)
    assert json.loads(json.dumps(design.to_json()))["relaxation"]["amounts"] == found


def test_the_relaxed_design_is_the_ep4_where_nothing_decays_faster():
    relaxed = failed("faster than omega0").relaxation.parameters
    for name in BOX:
        assert relaxed[name] == pytest.approx(float(getattr(EP4, name)), abs=1e-9)


@pytest.mark.slow
def test_conflicts_name_the_limits_that_hold_and_no_others():
    assert {key: set(failed(key).relaxation.conflict) for key in PROBLEMS} == {
        "two bounds": {"high", "low"},
        "faster than omega0": {"decay"},  # no bound is near
        "ep4 above the law": {"chi_B.min"},
        "ep4 too slow": {"Fr.max"},
        "equal, below": {"place", "chi_B.min"},
        "equal, above": {"place", "chi_B.max"},
        "slow and stable": {"decay", "slow"},  # at a lower tilt less would do, 0.5690 for 0.5695, but not nothing
    }


@pytest.mark.parametrize(
    ("key", "alone"),
    [
        ("two bounds", {"high": 0.3, "low": 0.3}),
        ("equal, above", {"place": -1.0, "chi_B.max": 0.5}),
        ("equal, below", {"place": 0.05, "chi_B.min": 0.05}),
        ("faster than omega0", {}),  # there is one limit only
    ],
)
def test_limits_alone(key, alone):
    assert failed(key).relaxation.alone == pytest.approx(alone, abs=1e-9)


# Limits that take no part are not named


ABSORBER = """
[model]
M = [[1, 0], [0, "mu"]]
D = [["c", "-c"], ["-c", "c"]]
K = [["1 + mu*w**2", "-mu*w**2"], ["-mu*w**2", "mu*w**2"]]
[parameters]
mu = 0.1
c = { min = 0, max = 1 }
w = { min = 0.1, max = 3 }
[objective]
minimize = "abscissa"
[constraints]
fast = "abscissa <= -0.3"
soft = "w <= 0.5"
"""
ROBOT = """
model = "tms"
[parameters]
w = "80 cm"
v = 3
m_B = 20
m_H = { min = 1, max = 6 }
x_B = { min = 0.2, max = 1 }
z_B = -0.5
x_H = { min = 0.5, max = 1.1 }
z_H = -0.7
lambda_s = 0.2
[objective]
minimize = "abscissa"
[constraints]
"""


def test_a_limit_at_which_the_nearest_design_ends_has_no_part_where_another_fails_alone(tmp_path):
    """The absorber's abscissa is -sqrt(mu/(1 + mu))/2 = -0.151 at best, whatever its spring; w = 0.5 costs more of it."""
    design = tmsopt.solve(load(tmp_path, ABSORBER), throw=False)
    assert design.parameters["w"] == pytest.approx(0.5)
    assert (design.relaxation.conflict, design.relaxation.irreducible) == (("fast",), True)


@pytest.mark.parametrize(
    ("limits", "conflict"),
    [
        # g (x_B m_B + x_H m_H)/w is on the front wheel, 85.84 N at least; g (m_B + m_H) is at most 255.06 N in all.
        ('rear = "N_R >= 200"\nfront = "N_F >= 200"', {"rear", "m_H.max", "x_B.min", "x_H.min"}),
        ('rear = "N_R >= 100"\nfront = "N_F >= 200"\nlow = "N_F >= 20"', {"rear", "front", "m_H.max"}),
    ],
)
def test_without_any_one_limit_of_a_conflict_the_others_are_met(tmp_path, limits, conflict):
    asked = load(tmp_path, ROBOT + limits)
    relaxation = tmsopt.solve(asked, throw=False, alone=False).relaxation
    assert (set(relaxation.conflict), relaxation.irreducible) == (conflict, True)
    for left_out in conflict:
        kept = {n: text for n, text in asked.constraints.items() if n in conflict - {left_out}}
        free = dict(asked.free)
        if left_out not in asked.constraints:
            name, end = left_out.split(".")
            free[name] = (free[name][0] - 1.5, free[name][1]) if end == "min" else (free[name][0], 21.0)
        rest = replace(asked, minimize="m_H", constraints=kept, free=free)
        assert tmsopt.solve(rest, throw=False).status == "optimal"


# The smallest change


DAMPED = (
    ABSORBER.partition("mu = 0.1")[0]
    + """mu = { min = 0.01, max = 0.1 }
c = { min = 0, max = 2 }
w = { min = 0.95, max = 3 }
[objective]
minimize = "c"
[constraints]
decay = "abscissa <= -0.2"
cheap = "c <= 0.05"
zeta = "damping_ratio >= 0.2"
"""
)
SLOW_ROBOT = """
model = "tms"
[parameters]
w = "70 cm"
v = { min = "1 km/h", max = "7 km/h" }
m_B = "15 kg"
m_H = "3 kg"
x_B = { min = "20 cm", max = "60 cm" }
z_B = "-35 cm"
x_H = { min = "60 cm", max = "80 cm" }
z_H = { min = "-40 cm", max = "-20 cm" }
lambda_s = { min = "0 deg", max = "25 deg" }
[objective]
minimize = "abscissa"
[constraints]
decay = "decay_time <= 0.4"
rear = "N_R >= 20"
"""


@pytest.mark.slow
def test_a_change_asks_no_more_than_what_the_nearest_design_misses(tmp_path):
    """Where two pairs meet at w = 1/(1 + mu) = 0.95, the abscissa is -sqrt(mu/(1 + mu))/2 = -0.1118, zeta 0.1147."""
    asked = load(tmp_path, DAMPED)
    (change,) = tmsopt.solve(asked, throw=False).relaxation.remedies
    assert dict(change) == {"decay": "abscissa <= -0.1118", "zeta": "damping_ratio >= 0.1147"}
    assert tmsopt.solve(replace_limits(asked.posed, change)).status == "optimal"


@pytest.mark.slow
def test_no_limit_is_moved_for_nothing_nor_farther_than_a_known_design_needs(tmp_path):
    """At v = 11.861 km/h, x_B = 61 cm, z_H = -44 cm, lambda_s = -4.5 deg a design decays within 0.4 s.

    Of eight seeds two are led elsewhere, and which ones they are depends on how a processor rounds.
    """
    asked = load(tmp_path, SLOW_ROBOT)
    changes = [tmsopt.solve(asked, throw=False, seed=seed).relaxation.remedies for seed in range(4)]
    change, _ = [found[0] for found in changes if len(found) == 1 and not set(found[0]) & set(asked.constraints)][:2]
    moved = replace_limits(asked.posed, change)
    design = tmsopt.solve(moved)
    assert design.stable
    known = {**asked.free, "v": (1 / 3.6, 11.861 / 3.6), "x_B": (0.2, 0.61)}
    known |= {"z_H": (-0.44, -0.2), "lambda_s": (np.radians(-4.5), np.radians(25))}
    assert tmsopt.solve(replace(asked, free=known)).status == "optimal"

    def widths(free):
        return sum((hi - lo) / np.subtract(*reversed(asked.free[n])) - 1 for n, (lo, hi) in free.items())

    assert widths(moved.free) <= widths(known) * 1.01


# By moving the limits and solving again


@pytest.mark.slow
def test_the_amount_of_one_limit_is_the_least_by_a_search():
    """The slowest design with abscissa <= −1, and the most stable one with Fr <= 1.2: what each limit needs alone."""
    relaxation = failed("slow and stable").relaxation
    slowest, fastest = (
        min(hunt.least(merit, FIXED, BOX, seed, 60, 6)[1] for seed in (1, 31))
        for merit in (lambda d: (d["Fr"], abscissa(d) + 1), lambda d: (abscissa(d), d["Fr"] - 1.2))
    )
    assert relaxation.alone == pytest.approx({"slow": slowest - 1.2, "decay": fastest + 1}, abs=1e-6)
    # And together: the sum of the amounts, each relative to the limit, is no more than of one alone.
    assert sum(relaxation.amounts.values()) <= 1.5 * max(slowest - 1.2, fastest + 1)


def test_a_bound_that_may_not_move_beyond_what_is_physical():
    """Fr >= 0 always: no amount of Fr.min makes −1 of it."""
    design = tmsopt.solve(problem(constraints={"back": "Fr <= -1"}), throw=False)
    assert design.status == "infeasible"
    assert design.relaxation.amounts == pytest.approx({"back": 1.5}, abs=1e-9)
    assert design.relaxation.conflict == ("back",)


# No stable design


@pytest.mark.slow
def test_without_a_stable_design_the_least_unstable_one_is_said_to_be_that():
    """At chi_H = 1 normal rake is stable only with chi_B > 1."""
    box = {"chi_B": (0.5, 0.95)}
    design = tmsopt.solve(problem(box, minimize="abscissa"))
    assert any("no stable design was found in the box; this is the least unstable one" in n for n in design.notes)
    assert design.value > 0
    assert design.value == pytest.approx(
        hunt.least(lambda d: (abscissa(d), 0 * d["Fr"]), FIXED, {**BOX, **box})[1], abs=1e-8
    )


def test_a_solved_problem_has_no_relaxation():
    design = tmsopt.solve(problem(minimize="abscissa"))
    assert design.relaxation is None
    assert "relaxation" not in design.to_json()


@pytest.mark.slow
def test_a_limit_that_no_design_can_meet_moves_alone():
    """A damping ratio is 1 at most, and that where all roots are real, so that 0.009 is the least; more may be found."""
    box = {"mu": (0.034, 3.3), "chi_B": (0.904, 1.33), "zeta_B": (-1.08, -0.25), "zeta_H": (-0.407, -0.222)}
    plane = "(zeta_B + 0.67)/0.42 + (lambda_s - 0.64)/0.61 <= 0.385"
    limits = {"damped": "damping_ratio >= 1.009", "plane": plane}
    free, fixed = {**box, "lambda_s": (0.03, 1.25)}, {"Fr": 2.77, "chi_H": 0.795}
    asked = skate(free, fixed, maximize="damping_ratio", constraints=limits)
    relaxation = tmsopt.solve(asked, throw=False, stability=0.0).relaxation
    assert set(relaxation.amounts) == {"damped"}
    assert relaxation.amounts["damped"] >= 0.009 - 1e-9
    at = relaxation.parameters
    assert (at["zeta_B"] + 0.67) / 0.42 + (at["lambda_s"] - 0.64) / 0.61 <= 0.385 + 1e-9
    assert hunt.damping_ratio(dict(at)) >= 1.009 - relaxation.amounts["damped"] - 1e-6


def test_the_headline_names_what_is_out_of_reach_and_not_what_has_no_value_for_it(tmp_path):
    """No x_H of the box is 2; that the nearest design is unstable, and so has no decay time, says nothing of others."""
    limits = 'arm = "abs(u_H) >= 0.02"\nfar = "x_H >= 2"\nquick = "decay_time <= 0.01"'
    design = tmsopt.solve(load(tmp_path, ROBOT + limits), throw=False, alone=False)
    assert set(design.relaxation.conflict) == {"far", "x_H.max"}
    for shown in (design, replace(design, abscissa=1.0, stable_elsewhere=None)):
        assert infeasible_sentences(shown)[0].startswith("far (x_H >= 200 cm) is out of reach: ")


def test_a_limit_that_must_go_down_to_nothing_is_shown_as_0():
    """0.02 moved by 0.02 and what rounding adds to it."""
    asked = problem(constraints={"arm": "abs(nu_H) >= 0.02"})
    amounts, design = Table({"arm": 0.0200000000000183}), replace(failed("two bounds"), problem=asked)
    written = (Table(move_limits(asked, amounts)),)
    moved = replace(design.relaxation, amounts=amounts, conflict=("arm",), remedies=written)
    design = replace(design, relaxation=moved)
    assert infeasible_sentences(design)[-1] == "smallest change found: abs(nu_H) >= 0 instead of 0.02 (arm)"


def test_what_is_proved_of_all_limits_is_not_said_of_some():
    """A bound without a gap for a problem of three limits says nothing about two of them."""
    limits = {"decay": "abscissa <= -1", "slow": "Fr <= 1", "wide": "chi_B >= 0.5"}
    design = replace(failed("two bounds"), problem=problem(constraints=limits), bound=tmsopt.Bound(proven=True))
    two, three = (replace(design.relaxation, remedies=(), conflict=tuple(limits)[:k]) for k in (2, 3))
    said = [infeasible_sentences(replace(design, relaxation=r))[0] for r in (two, three)]
    assert said[0] == "no design was found that meets both decay (abscissa <= -1) and slow (Fr <= 1)"
    assert said[1].endswith("wide (chi_B >= 0.5) cannot all be met")


@pytest.mark.parametrize(("irreducible", "said"), [(True, "in conflict: "), (False, "in conflict, not proved: ")])
def test_what_a_search_cannot_tell_of_a_conflict_is_said(irreducible, said):
    design = failed("two bounds")
    design = replace(design, relaxation=replace(design.relaxation, conflict=("high", "low"), irreducible=irreducible))
    assert infeasible_sentences(design)[1] == f"{said}high (chi_B >= 1.8), low (chi_B <= 1.5)"


@pytest.mark.parametrize(("known", "said"), [(False, "proof: no design is stable (proved); "), (None, "proof: ")])
def test_a_proof_that_none_is_stable_is_no_proof_that_none_is_feasible(known, said):
    design = replace(failed("faster than omega0"), bound=tmsopt.Bound(), abscissa=1.0, stable_elsewhere=known)
    assert f"{said}infeasibility is not proved; --certify" in " ".join(design.report().split())


# Limits as a file would write them


DECAYING = tmsopt.Problem(
    from_coefficients([1, "c", 1]), free={"c": (0.1, 1.5)}, minimize="c", constraints={"decay": "abscissa <= -0.8"}
)
"""−c/2 <= −0.8 takes c >= 1.6."""


def test_the_smallest_change_is_solved_again_as_it_is_written():
    found = tmsopt.solve(DECAYING, throw=False).relaxation
    assert dict(found.remedies[0]) == {"decay": "abscissa <= -0.75"}
    assert [dict(written) for written in found.remedies[1:]] == [{"c.max": "1.6"}]
    for constraints, free in (({"decay": "abscissa <= -0.75"}, {}), ({}, {"c": (0.1, 1.6)})):
        changed = replace(DECAYING, constraints=constraints or DECAYING.constraints, free=free or DECAYING.free)
        assert tmsopt.solve(changed).stable


def test_an_end_moves_where_no_limit_makes_a_design_stable():
    """s² + c s + 1 is stable for c > 0 alone: the greatest abscissa allowed is no remedy."""
    asked = replace(DECAYING, free={"c": (-3.0, -1.0)}, constraints={"decay": "abscissa <= -0.1"})
    design = tmsopt.solve(asked, throw=False)
    assert design.relaxation.remedies
    for written in design.relaxation.remedies:
        assert float(written["c.max"]) > 0
    assert "abscissa <= 0." not in " ".join(infeasible_sentences(design))


@pytest.mark.parametrize(
    ("text", "amount", "digits", "written"),
    [
        ("c >= 0.02", 0.00123456, 5, "c >= 0.018765"),
        ("0.02 <= c", 0.00123456, 3, "0.0187 <= c"),
        ("c**2 <= 2", 0.000123, 3, "c**2 <= 2.01"),
        ("2 >= c**2", 0.5, 2, "2.5 >= c**2"),
        ("c == 1", -0.25, 5, "c == 0.75"),
        ("1 == c", -0.25, 5, "1.25 == c"),
        ("c**2 <= c", 0.5, 5, "c**2 <= c + 0.5"),
        ("c >= c**2", 0.123456789, 3, "c >= c**2 - 0.124"),
    ],
)
def test_a_limit_is_written_so_that_it_suffices(text, amount, digits, written):
    """Moved to where it forbids less; of an equality the signed amount is added to the right-hand side."""
    asked = replace(DECAYING, constraints={"limit": text})
    assert move_limits(asked, {"limit": amount}, digits) == {"limit": written}


def test_limits_that_exclude_each_other_are_proved_to():
    """14 + 1.5 > 15."""
    masses = {"a": (14.0, 20.0), "b": (1.5, 3.0)}
    asked = tmsopt.Problem(
        from_coefficients([1, "a", "b"]), free=masses, minimize="abscissa", constraints={"total": "a + b <= 15"}
    )
    design = tmsopt.solve(asked, throw=False)
    assert (design.status, design.bound.proven, design.bound.method) == ("infeasible", True, "interval")
    assert not tmsopt.solve(replace(asked, constraints={"total": "a + b <= 15.5"}), throw=False).violations


@pytest.mark.parametrize(
    ("sense", "name", "other"),
    [
        ("minimize", "damping_ratio", "maximize"),
        ("maximize", "abscissa", "minimize"),
        ("maximize", "-damping_ratio", "minimize"),
    ],
)
def test_an_objective_that_asks_for_the_least_stable_design_is_told_so(sense, name, other):
    asked = replace(DECAYING, constraints={}, **{"minimize": None, sense: name})
    assert any(f'{other} = "{name}"' in note for note in tmsopt.solve(asked, throw=False).notes)
    better = replace(DECAYING, constraints={}, **{"minimize": None, other: name})
    assert not any("least stable" in note for note in tmsopt.solve(better, throw=False).notes)
