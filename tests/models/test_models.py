"""The two-mass-skate model: its polynomial proved symbolically, its quantities against 60 digits and laws."""

import math
import pickle

import casadi as ca
import numpy as np
import pytest
import sympy
from helpers.designs import designs
from helpers.oracles import symbolic_copo
from hypothesis import given, settings, strategies as st
from matplotlib.mathtext import MathTextParser

from tmsopt.models import (
    Values,
    copo,
    from_coefficients,
    from_si,
    in_words_of,
    tms,
    to_si,
    whipple,
    words_of,
)

NATIVE, SI = tms.sets
repeatable = settings(max_examples=100, deadline=None, derandomize=True)

BENCHMARK = {
    "w": 1.0,
    "v": 3.0,
    "g": 9.81,
    "lambda_s": math.radians(5),
    "m_B": 10.0,
    "x_B": 1.2,
    "z_B": -0.4,
    "m_H": 1.0,
    "x_H": 1.02,
    "z_H": -0.2,
}
"""Equation `bench` of the paper."""


def quantities(parameters, of=NATIVE):
    return Values(tms, of, parameters)


# The polynomial


def test_copo_is_what_the_oracle_derives_from_the_printed_matrices():
    """The same identity from the oracle's own copy of the matrices, so that neither copy can hide a misprint."""
    expected, symbols = symbolic_copo()
    assert [sympy.expand(a - b) for a, b in zip(copo(**symbols), expected, strict=True)] == [0] * 5


# SI


def sizes(name):
    if name == "lambda_s":
        return st.floats(-1.5, 1.5)
    return st.floats(-1e3, -1e-3) if name.startswith("z") else st.floats(1e-3, 1e3)


def within_ulps(got, expected, ulps):
    return abs(got - expected) <= ulps * math.ulp(expected)


@repeatable
@given(st.fixed_dictionaries({name: sizes(name) for name in SI.names}))
def test_si_there_and_back_to_2_ulp(p):
    """One division and one product, each rounded once; √(g w) is the same double both ways."""
    back = to_si(from_si(p), w=p["w"], m_B=p["m_B"], g=p["g"])
    assert list(back) == list(SI.names)
    assert all(within_ulps(back[name], p[name], 2) for name in p)
    native = from_si(p)
    assert list(native) == list(NATIVE.names)
    again = from_si(to_si(native, w=p["w"], m_B=p["m_B"], g=p["g"]))
    assert all(within_ulps(again[name], native[name], 2) for name in native)


def test_coefficients_for_si_values_are_those_of_their_dimensionless_ones():
    assert tms.coefficients(BENCHMARK, SI) == tms.coefficients(from_si(BENCHMARK))
    assert tms.parameter_set("SI") is SI
    assert tms.parameter_set("dimensionless") is NATIVE


# Derived quantities


@pytest.mark.parametrize("tilt", [0.5, -0.5])
def test_Fr_c_does_not_exist_where_the_masses_are_above_one_another(tilt):
    """a3 = 0 at χ_B = χ_H: the Hurwitz determinant is −a1² a4, with no zero in the speed."""
    p = {**designs(1)[0], "chi_B": 1.2, "chi_H": 1.2, "lambda_s": tilt}
    assert math.isnan(quantities(p)["Fr_c"])


def test_omega0_does_not_exist_where_the_degree_drops():
    """ζ_H = 0 and χ_H = 1: the front mass is on the steer axis, and a0 = 0."""
    p = {**designs(1)[0], "chi_H": 1.0, "zeta_H": 0.0, "lambda_s": 0.3}
    assert tms.coefficients(p)[0] == 0
    assert math.isnan(quantities(p)["omega0"])


def test_equations_of_quantities_vanish_at_their_values_and_nowhere_near():
    """An optimiser carries x with equation(x) = 0 in place of the formula."""
    checked = 0
    for p in designs(30):
        values = quantities(p)
        for quantity in tms.quantities:
            x = values[quantity.name]
            if quantity.equation is None or not np.isfinite(x):
                continue
            checked += 1
            assert x in quantity.range
            off = [abs(quantity.equation(values, x * (1 + d))) for d in (-1e-3, 0.0, 1e-3)]
            assert off[1] <= 1e-9 * min(off[0], off[2])
    assert checked > 20


def test_values_is_a_mapping_of_everything_an_expression_may_use():
    values = quantities(BENCHMARK, SI)
    assert len(values) == len(set(values))
    assert set(values) == {*SI.names, *NATIVE.names, *tms.quantity_names(SI)}
    assert {*quantities(from_si(BENCHMARK))} == {*NATIVE.names, *tms.quantity_names(NATIVE)}
    assert all(np.isfinite(values[name]) or name in ("omega0", *TIMES) for name in values)  # without roots no times
    with pytest.raises(KeyError):
        values["nu_h"]


# The model as data

TIMES = ("decay_rate", "decay_time", "frequency")
"""Quantities of time, of the roots and the unit of rates."""


def test_a_decay_without_an_end_warns_of_nothing():
    (time,) = (q for q in SI.quantities if q.name == "decay_time")
    with np.errstate(over="raise", divide="raise"):
        assert time.value({"w": 1.0, "g": 9.81, "abscissa": np.float64(-1e-310)}) == math.inf


RANGES = {
    ">= 0": "Fr mu v m_H",
    "> 0": "w g m_B",
    "<= 0": "zeta_B zeta_H z_B z_H",
    "any finite number": "chi_B chi_H x_B x_H",
    "> -1.5708 and < 1.5708": "lambda_s",
}


@pytest.mark.parametrize("said", RANGES)
def test_ranges_hold_what_can_be_built(said):
    """z points down, so heights are ≤ 0; masses and lengths are positive; a tilt of 90° has no tangent."""
    parameters = {p.name: p for of in tms.sets for p in of.parameters}
    for name in RANGES[said].split():
        assert str(parameters[name].range) == said
        assert (0 in parameters[name].range) is (said != "> 0")


EVERY = [p for s in tms.sets for p in s.parameters] + [*tms.quantities, *SI.quantities]


@pytest.mark.parametrize("item", EVERY, ids=lambda p: p.name)
def test_every_parameter_and_quantity_is_documented(item):
    assert len(item.meaning) > 4
    MathTextParser("agg").parse(f"${item.latex}$")  # raises on what a figure could not show


def test_what_stands_beside_a_dimensionless_number_is_that_number_in_si():
    """Lengths are multiples of w, masses of m_B, speeds of √(g w), loads of the weight."""
    native, scaled = tms.sets
    design = {"Fr": 1.7, "mu": 0.3, "chi_B": 1.2, "chi_H": 0.9, "zeta_B": -0.6, "zeta_H": -0.3, "lambda_s": 0.4}
    si = to_si(design, w=0.7, m_B=12.0)
    values = Values(tms, scaled, si)
    scales = {"m": si["w"], "kg": si["m_B"], "m/s": math.sqrt(si["g"] * si["w"]), "N": si["g"] * (12.0 + si["m_H"])}
    pairs = {p.counterpart: (si[p.name], p.unit) for p in scaled.parameters if p.counterpart}
    assert {*pairs, "lambda_s"} == set(native.names)
    derived = {q.name: q.counterpart for q in tms.quantities if q.counterpart}
    assert {q for q in scaled.quantities if q.name not in TIMES} <= set(derived.values())
    pairs |= {name: (q.value(values), q.unit) for name, q in derived.items()}
    for name, (value, unit) in pairs.items():
        assert value == pytest.approx(values[name] * scales[unit], rel=1e-14), name


def test_a_model_has_the_words_of_its_users():
    """Meijaard et al. (2007) for bicycles; flutter and divergence for other systems (Ziegler 1952)."""
    stated = from_coefficients([1, ca.SX.sym("x"), 1])
    for model in (tms, whipple):
        assert dict(words_of(pickle.loads(pickle.dumps(model)))) == {"weave": "weave", "capsize": "capsize"}
    assert dict(words_of(stated)) == {"weave": "flutter", "capsize": "divergence"}
    assert in_words_of(stated, "infinity and weave") == "infinity and flutter"
