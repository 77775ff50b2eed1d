"""Expressions over arrays: against mpmath, against one design at a time, in blocks and whole."""

import dataclasses
import math
from importlib import import_module

import casadi as ca
import numpy as np
import pytest

from benchmarks.suites import TEMPLATES
from tmsopt.algebra import evaluate_on_arrays, from_casadi
from tmsopt.errors import InputError
from tmsopt.models import Quantity, Values, from_coefficients, tms
from tmsopt.problem import NO_RADIUS, Problem, array_function, parse_comparison
from tmsopt.roots import roots

arrays, Bounded = import_module("tmsopt.algebra.arrays"), import_module("tmsopt.algebra.rounding").Bounded

NATIVE = Problem(
    model=tms,
    fixed={"chi_H": 1.02, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 3.0, "chi_B": 1.3},
    free={"Fr": (0.1, 5.0), "lambda_s": (-1.2, 1.4)},
)
SI = Problem(
    model=tms,
    fixed={"w": 1.0, "m_B": 10.0, "x_B": 1.2, "z_B": -0.5, "m_H": 1.0, "x_H": 1.0, "z_H": -0.3},
    free={"v": (0.1, 8.0), "lambda_s": (-1.0, 1.0)},
)


def grid(problem, rows=7, columns=11):
    """Every parameter: the first free one along the columns, the second along the rows."""
    (first, ends), (second, others) = problem.free.items()
    return problem.posed.ordered(
        {first: np.linspace(*ends, columns)[None, :], second: np.linspace(*others, rows)[:, None]}
    )


def single(problem, columns, i, j, shape=(7, 11)):
    """One design of a grid as numbers."""
    return {n: float(np.broadcast_to(v, shape)[i, j]) for n, v in columns.items()}


@pytest.mark.parametrize("problem", [NATIVE, SI], ids=["native", "SI"])
def test_every_quantity_is_that_of_one_design_at_a_time(problem):
    of_roots = ("abscissa", "damping_ratio", "angular_frequency", "decay_rate", "decay_time", "frequency")
    names = [n for n in problem.posed.vocabulary if n not in of_roots]
    written = array_function(problem.posed, dict(zip(names, names, strict=True)))
    columns = grid(problem)
    values = written(columns)
    for i, j in np.ndindex(7, 11):
        one = Values(tms, problem.posed.parameter_set, single(problem, columns, i, j), extra=(NO_RADIUS,))
        for name in names:
            found = float(np.broadcast_to(values[name], (7, 11))[i, j])
            assert found == pytest.approx(float(one[name]), rel=1e-12, nan_ok=True), name


def test_constraints_are_those_of_one_design_at_a_time():
    """Forms of every kind, left minus right; the powers in them cost up to 2 ulp of a side."""
    texts = {f"{text} {sign} 0.7": sign for text, sign in TEMPLATES}
    conditions = {t: parse_comparison(t, NATIVE.posed.vocabulary) for t in texts}
    columns = grid(NATIVE)
    values = array_function(NATIVE.posed, conditions)(columns)
    for i, j in np.ndindex(7, 11):
        one = NATIVE.posed.values(single(NATIVE, columns, i, j))
        for text, condition in conditions.items():
            left, right = condition.sides(one)
            found = float(np.broadcast_to(values[text], (7, 11))[i, j])
            assert math.isnan(found) == math.isnan(left - right), text
            assert math.isnan(found) or abs(found - (left - right)) <= 2 * math.ulp(max(abs(left), abs(right))), text


@pytest.mark.parametrize(
    ("text", "exists"),
    {
        "sqrt(lambda_s)": lambda s: s >= 0,
        "sqrt(lambda_s)**2": lambda s: s >= 0,  # lambda_s, if it were simplified
        "0 * log(lambda_s)": lambda s: s > 0,
        "log(lambda_s) - log(lambda_s)": lambda s: s > 0,
        "min(Fr, sqrt(lambda_s))": lambda s: s >= 0,  # Fr, in CasADi
        "max(asin(2 * lambda_s), 5)": lambda s: abs(s) <= 0.5,
    }.items(),
)
def test_nan_where_a_value_does_not_exist(text, exists):
    tilts = np.array([-1.1, -0.5, -0.25, 0.25, 0.5, 1.2])[:, None]
    columns = grid(NATIVE) | {"lambda_s": tilts}
    found = np.broadcast_to(array_function(NATIVE.posed, {"x": text})(columns)["x"], (6, 11))
    assert np.array_equal(np.isfinite(found[:, 0]), [exists(s) for s in tilts.ravel()])


def test_a_difference_keeps_its_roundings():
    """(x + y) − y is not x."""
    found = array_function(NATIVE.posed, {"x": "(lambda_s + 1e16) - 1e16"})(grid(NATIVE) | {"lambda_s": 1.5})
    assert found["x"] == 2.0


# Shapes


def test_what_depends_on_one_axis_stays_on_it():
    found = array_function(NATIVE.posed, {"a3": "a3", "a4": "a4", "a2": "a2", "mass": "mu * zeta_H"})(grid(NATIVE))
    assert {n: np.shape(v) for n, v in found.items()} == {"a3": (1, 11), "a4": (7, 1), "a2": (7, 11), "mass": ()}


def test_root_quantities_are_given_or_computed():
    found, columns = array_function(NATIVE.posed, {"x": "2 * abscissa", "y": "Fr"}), grid(NATIVE)
    alpha = np.random.default_rng(0).normal(size=(7, 11))
    assert np.array_equal(found(columns | {"abscissa": alpha})["x"], 2 * alpha)
    z = roots(np.stack(np.broadcast_arrays(*tms.coefficients(columns)), axis=-1))
    assert found(columns)["x"] == pytest.approx(2 * z.real.max(axis=-1), abs=1e-9)  # by another way to the roots


def test_there_are_no_roots_where_a_coefficient_does_not_exist():
    lone = Problem(from_coefficients([1, "log(c)", 2]), free={"c": (0.0, 9.0)}).posed
    found = array_function(lone, {"x": "abscissa"})({"c": np.array([-1.0, 3.0])})["x"]
    assert np.isnan(found).tolist() == [True, False]


def test_bounds_of_errors_hold_what_is_near():
    """Columns a hundredth off: the values of 200 designs so near are within the bounds."""
    texts, rng = {"a2": "a2", "Fr_c": "Fr_c", "mixed": "exp(Fr) / (2 + sin(lambda_s))"}, np.random.default_rng(0)
    columns = {n: np.ravel(x) for n, x in NATIVE.posed.ordered({"Fr": [1.5], "lambda_s": [0.4]}).items()}
    wide = array_function(NATIVE.posed, texts)({n: Bounded(x, 0.01 * np.abs(x)) for n, x in columns.items()})
    near = {n: x * (1 + rng.uniform(-0.01, 0.01, 200)) for n, x in columns.items()}
    for name, values in array_function(NATIVE.posed, texts)(near).items():
        off = np.abs(values - wide[name].value)
        assert np.all(off <= wide[name].error), name
        assert np.max(off) >= 0.01 * np.max(wide[name].error), name  # bounds that say something


def test_a_formula_that_asks_for_its_numbers_is_refused_in_words():
    odd = Quantity("steps", "1", "Fr where it is positive", "", lambda v: v["Fr"] if v["Fr"] > 0 else 0)
    model = dataclasses.replace(tms, quantities=(*tms.quantities, odd))
    with pytest.raises(TypeError, match=r"write choose\(condition, a, b\)"):
        array_function(dataclasses.replace(NATIVE, model=model).posed, {"x": "steps * lambda_s"})


# Programs


def test_blocks_change_nothing(monkeypatch):
    """Blocks are parts of a row."""
    written, columns = array_function(NATIVE.posed, {n: n for n in ("a2", "a4", "Fr_c")}), grid(NATIVE, 40, 30)
    whole = written(columns)
    monkeypatch.setattr(arrays, "BLOCK", 5)
    for name, part in written(columns).items():
        np.testing.assert_allclose(part, whole[name], rtol=1e-12)


def test_inputs_are_left_as_they_are_and_may_be_read_only():
    problem, columns = NATIVE, grid(NATIVE)
    for array in (columns["Fr"], columns["lambda_s"]):
        array.flags.writeable = False
    alpha = np.broadcast_to(np.linspace(-1, 1, 11), (7, 11))
    found = array_function(problem.posed, {"x": "abscissa * Fr - lambda_s", "y": "abscissa"})
    values = found(columns | {"abscissa": alpha})
    assert np.array_equal(values["x"], alpha * columns["Fr"] - columns["lambda_s"])
    assert np.array_equal(values["y"], alpha)


def test_an_empty_output_is_zero():
    x = ca.SX.sym("x")
    asked = from_casadi(ca.Function("f", [x], [ca.densify(ca.vertcat(x, ca.SX(1, 1)))]))
    assert evaluate_on_arrays(asked, {"0": 3.0}) == [3.0, 0.0]


def test_unknown_names_are_refused():
    with pytest.raises(InputError, match=r"quantities\.x: .*unknown name 'Froude'"):
        array_function(NATIVE.posed, {"x": "Froude"})
