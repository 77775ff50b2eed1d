"""What is advised for problems without an answer: limits as a file would write them, held against closed forms."""

from dataclasses import replace

import pytest

import tmsopt
from tmsopt.analysis import infeasible_sentences
from tmsopt.models import from_coefficients
from tmsopt.problem import move_limits

DAMPED = tmsopt.Problem(
    from_coefficients([1, "c", 1]), free={"c": (0.1, 1.5)}, minimize="c", constraints={"decay": "abscissa <= -0.8"}
)
"""−c/2 <= −0.8 takes c >= 1.6."""


def test_the_smallest_change_is_solved_again_as_it_is_written():
    found = tmsopt.solve(DAMPED, throw=False).relaxation
    assert dict(found.remedies[0]) == {"decay": "abscissa <= -0.75"}
    assert [dict(written) for written in found.remedies[1:]] == [{"c.max": "1.6"}]
    for constraints, free in (({"decay": "abscissa <= -0.75"}, {}), ({}, {"c": (0.1, 1.6)})):
        changed = replace(DAMPED, constraints=constraints or DAMPED.constraints, free=free or DAMPED.free)
        assert tmsopt.solve(changed).stable


def test_an_end_moves_where_no_limit_makes_a_design_stable():
    """s² + c s + 1 is stable for c > 0 alone: the greatest abscissa allowed is no remedy."""
    asked = replace(DAMPED, free={"c": (-3.0, -1.0)}, constraints={"decay": "abscissa <= -0.1"})
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
    asked = replace(DAMPED, constraints={"limit": text})
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
    asked = replace(DAMPED, constraints={}, **{"minimize": None, sense: name})
    assert any(f'{other} = "{name}"' in note for note in tmsopt.solve(asked, throw=False).notes)
    better = replace(DAMPED, constraints={}, **{"minimize": None, other: name})
    assert not any("least stable" in note for note in tmsopt.solve(better, throw=False).notes)
