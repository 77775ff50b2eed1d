"""When a search ends: so many starts for each optimum met, more where little is feasible."""

from importlib import import_module
from types import SimpleNamespace
from typing import Any

import casadi as ca
import pytest

import tmsopt
from tmsopt.models import from_coefficients

x = ca.SX.sym("x")
PLAIN = tmsopt.Problem(from_coefficients([1, 2 + x]), free={"x": (0.0, 1.0)}, minimize="x")


def settled(ends: list[float | None], share: float, far_off: bool = False) -> bool:
    """Of starts that ended at these objectives, None where at nothing feasible."""
    nlp = SimpleNamespace(size=1.0)
    candidates: list[Any] = [
        SimpleNamespace(objective=1.0 if e is None else e, feasible=e is not None, nlp=nlp) for e in ends
    ]
    sample = SimpleNamespace(met=round(share * 1000), size=1000, far_off=far_off)
    return bool(
        import_module("tmsopt.solver.multistart")._settled(SimpleNamespace(part=PLAIN, sample=sample), candidates)
    )


@pytest.mark.parametrize(
    ("share", "ends", "enough"),
    [
        (0.5, [1.0], 3),  # one optimum: three starts where much is feasible
        (0.5, [1.0, 2.0], 6),  # two: six
        (0.5, [1.0, 2.0, 3.0], 9),
        (0.01, [1.0], 8),  # eight where little is
        (0.01, [1.0, 2.0], 16),
        (0.01, [1.0, 2.0, 3.0], 48),  # and twice as many where there may be many
        (0.5, [None], 8),  # nothing feasible
        (0.5, [1.0, 2.0, *[None] * 20], 18),  # sixteen failed, beside two others
    ],
)
def test_a_search_ends_with_so_many_starts_and_not_before(share: float, ends: list[float | None], enough: int) -> None:
    tried = (ends * enough)[:enough]
    assert settled(tried, share)
    assert not settled(tried[:-1], share)


def test_the_best_must_be_met_twice() -> None:
    assert not settled([1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0], 0.5)
    assert settled([1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 1.0], 0.5)


def test_three_starts_are_enough_where_no_design_of_the_sample_comes_near_the_limits() -> None:
    assert settled([None] * 3, 0.0, far_off=True)
    assert not settled([None] * 2, 0.0, far_off=True)
