"""What rounding makes of multiple roots and of values is not called optimal."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import casadi as ca
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.roots import Root

x = ca.SX.sym("x")
PLAIN = tmsopt.Problem(from_coefficients([1, 3 + x, 2]), free={"x": (0.0, 1.0)}, minimize="abscissa")


def unclear(roots, stored, asked="abscissa"):
    """Of real roots with multiplicities, the rightmost of which the stored design has elsewhere."""
    listed = [Root(re, 0.0, m) for re, m in roots]
    structure = SimpleNamespace(roots=listed, abscissa=max(re for re, _ in roots))
    checked = SimpleNamespace(structure=structure, realised=stored)
    problem = replace(PLAIN, minimize=None, maximize=asked) if asked == "damping_ratio" else PLAIN
    return bool(import_module("tmsopt.search.outcome").is_unclear(problem.posed, checked))


@pytest.mark.parametrize(
    ("roots", "stored", "said"),
    [
        ([(-1.0, 4)], -1 + 4e-4, False),  # what doubles leave of a 4-fold root
        ([(-1.0, 4)], -1 + 4e-2, True),
        ([(-1.0, 2), (-9.0, 1)], -1 + 1e-7, False),
        ([(-1.0, 2), (-9.0, 1)], -1 + 1e-2, True),
        ([(-1e-16, 3), (-1.0, 1)], 5e-6, True),  # a triple root at 0 that is one of rounding alone
        ([(0.0, 2), (-1.0, 1)], 0.0, False),  # one that is there
        ([(-1e-17, 1), (-1.0, 1)], 1e-17, False),  # a simple one at 0 but for rounding
    ],
)
def test_roots_as_stored_lie_where_the_multiple_ones_allow(roots, stored, said):
    """An m-fold root is off by the m-th root of what its coefficients are: 1e-8 at most."""
    assert unclear(roots, stored) is said


def test_roots_at_0_but_for_rounding_have_no_damping_ratio():
    assert unclear([(-1e-16, 2), (-1.0, 1)], -1e-16, "damping_ratio")
    assert not unclear([(-1e-16, 2), (-1.0, 1)], -1e-16)


@pytest.mark.parametrize(("off", "status"), [(1e-9, "optimal"), (1e-4, "not_converged")])
def test_a_value_that_hangs_on_rounding_is_no_optimum(monkeypatch, off, status):
    module = import_module("tmsopt.search.solve")
    plain = module.certified_numbers

    def exact(*given):
        numbers = plain(*given)
        return replace(numbers, value=numbers.value + off)

    monkeypatch.setattr(module, "certified_numbers", exact)
    assert tmsopt.solve(PLAIN, throw=False).status == status


@pytest.mark.parametrize(
    ("room", "name", "said"),
    [
        ("outcome", "is_unclear", lambda problem, checked: True),
        ("search", "demote_if_unbounded", lambda state, found: replace(found, status="not_converged")),
        ("search", "demote_if_beaten", lambda state, found: replace(found, status="not_converged")),
    ],
)
def test_every_optimum_is_asked(monkeypatch, room, name, said):
    assert tmsopt.solve(PLAIN, throw=False).status == "optimal"
    monkeypatch.setattr(import_module(f"tmsopt.search.{room}"), name, said)
    assert tmsopt.solve(PLAIN, throw=False).status == "not_converged"
