"""A problem as it is stated and as it is solved: normalised once, derived as if it were stated anew, nothing added."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import tmsopt

FILES = ("ep4", "realistic", "speed_band", "tolerant", "pt_pair", "ziegler", "whipple_ep4", "childs_bicycle")


def changes(problem):
    """Other numbers and texts that a problem may have."""
    name, (low, high) = next(iter(problem.free.items()))
    width = high - low
    yield {"free": {**problem.free, name: (low + width / 4, high - width / 4)}}
    yield {"free": {**problem.free, name: (high, high)}}  # one value: it is fixed
    yield {
        "free": {n: e for n, e in problem.free.items() if n != name},
        "fixed": {**problem.fixed, name: np.float64(low)},
    }
    yield {"free": {}, "start": {}, "fixed": {**problem.fixed, **{n: e[1] for n, e in problem.free.items()}}}
    yield {
        "constraints": {"held": f"{name} <= {high - width / 8!r}"},
        "locate": None,
        "minimize": name,
        "maximize": None,
    }
    yield {"start": {name: low + width / 3}}


@pytest.mark.parametrize("name", FILES)
def test_what_is_derived_is_what_is_stated_anew(name):
    problem = tmsopt.load(Path("problems") / f"{name}.toml")
    for change in changes(problem):
        kept = {n: x for n, x in problem.start.items() if n in change.get("free", problem.free)}
        asked = {"start": {}, **change} if "free" in change else {"start": kept, **change}
        derived, stated = problem.posed.derive(**asked), replace(problem, **asked)
        assert derived.problem == stated, asked
        assert type(derived.fixed.get(next(iter(problem.free)), 0.0)) is float
        assert (derived.units, derived.written) == (stated.units, stated.written)


def test_a_solve_normalises_once_and_parses_each_text_once(monkeypatch):
    stated, parser = import_module("tmsopt.problem.problem"), import_module("tmsopt.models.expression")
    made, read, plain = [], [], parser.Expression.__init__
    monkeypatch.setattr(stated, "normalise", lambda given=stated.normalise, **x: made.append(1) or given(**x))
    monkeypatch.setattr(
        parser.Expression, "__init__", lambda self, text, *x, **y: (read.append(text), plain(self, text, *x, **y))[0]
    )
    for parse in (parser._parse_value_text, parser._parse_comparison_text):
        parse.cache_clear()
    tmsopt.solve("problems/realistic.toml")
    assert len(made) == 1
    assert len(read) == len(set(read)) > 2


def test_what_is_known_otherwise_makes_other_values():
    problem = tmsopt.load("problems/ep4.toml").posed
    values = problem.values(problem.ordered({n: low for n, (low, _) in problem.free.items()}))
    own, trail = values["abscissa"], values["nu_H"]
    other = values.with_known({"abscissa": own + 1.0})
    assert (other["abscissa"], other["nu_H"], values["abscissa"]) == (own + 1.0, trail, own)
    assert other.with_known({"nu_H": 7.0})["abscissa"] == own + 1.0
    with pytest.raises(TypeError):
        values["abscissa"] = 0.0


def test_what_follows_from_what_is_known_otherwise_follows_anew():
    """The abscissa of the roots that are told, whatever was asked before."""
    problem = tmsopt.load("problems/ep4.toml").posed
    ends = (problem.ordered({n: e[k] for n, e in problem.free.items()}) for k in (0, 1))
    one, other = map(problem.values, ends)
    own, told = one["abscissa"], other["abscissa"]
    assert own != told
    assert one.with_known({"structure": other["structure"]})["abscissa"] == told
    assert one["abscissa"] == own
