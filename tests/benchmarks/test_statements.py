"""Judges of statements: what a closed form refutes is seen, and the truth is not."""

import json
from types import SimpleNamespace

import pytest

from benchmarks.suites import statements

CASES = {(case.kind, case.name): case for case in statements.cases()}


def test_a_design_that_misses_its_limit_must_say_so():
    """s² + 2.2 s + b has its roots at −1.1 up to b = 1.21, and one at −1.1 + 1e-4 for 1e-8 less."""
    judge = CASES["stored", "1 a b, abscissa <= -1.1"].judge
    kept, missed = ({"status": "optimal", "parameters": {"a": 2.2, "b": b}} for b in (1.3, 1.21 - 1e-8))
    assert not judge(kept)
    assert judge(missed)
    assert not judge({**missed, "missed_as_stored": {"limit": 1e-4}})
    assert judge({**missed, "missed_as_stored": {"limit": 1.1e-4}})
    assert judge({**kept, "missed_as_stored": {"limit": 1e-4}})


@pytest.mark.parametrize(("size", "is_right"), [(1.0, True), (1.1, False)])
def test_laws_of_a_double_root(size, is_right):
    """(s + 1)² = x² − y: the roots move by √y, and by x."""
    laws = [("y", "1/2", size), ("x", "1", 1.0)]
    responses = [
        {"parameter": n, "change": "absolute", "unmoved": 0, "laws": [{"exponent": e, "size": c, "roots": 2}]}
        for n, e, c in laws
    ]
    found = {"re": -1.0, "im": 0.0, "algebraic": 2, "responses": responses}
    judge = CASES["splitting", "1 2 1-x**2+y"].judge
    assert (not judge({"diagnosis": [found]})) is is_right
    assert judge({"diagnosis": [{**found, "algebraic": 3}]})


@pytest.mark.parametrize(
    ("value", "is_right"), [("0.5291502622129181181003231507278520851", True), ("0.5291502622129182", False)]
)
def test_an_enclosure_holds_its_closed_form(value, is_right):
    """s² + c s + 0.07 has a double root at c = 2√0.07."""
    judge = CASES["constants", "1 c 0.07 prove"].judge
    data = {"proved": True, "parameters": {"c": {"value": value, "radius": "1e-30"}}}
    assert (not judge(data)) is is_right
    data["parameters"]["c"]["radius"] = "1e-9"
    assert judge(data)


def test_no_answer_is_false(monkeypatch):
    case = CASES["stored", "1 a b, abscissa <= -1.1"]
    monkeypatch.setattr(statements.subprocess, "run", lambda *a, **k: SimpleNamespace(stdout=json.dumps({}), stderr=""))
    assert "KeyError" in statements.find_false(case)
