"""The two-mass-skate model: its polynomial proved symbolically, its quantities against 60 digits and laws."""

import math
import pickle

import casadi as ca
import numpy as np
import pytest
import sympy
from helpers.designs import designs
from helpers.oracles import polynomial_60, symbolic_copo, weave_Fr_60
from hypothesis import given, settings, strategies as st
from matplotlib.mathtext import MathTextParser
from mpmath import mp

from tmsopt import laws
from tmsopt.models import (
    GRAVITY,
    MODELS,
    Range,
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


def test_coefficients_of_floats_are_right_to_a_few_roundings():
    """Against 60 digits of the very doubles, relative to the terms of each coefficient; tan carries an ulp too."""
    expressions, symbols = symbolic_copo()
    terms = [sympy.lambdify(list(symbols.values()), sum(map(abs, e.args))) for e in expressions]
    for p in designs(50):
        T = math.tan(p["lambda_s"])
        sizes = [float(f(*(list(p.values())[:6]), T)) for f in terms]
        got = tms.coefficients(p)
        for a, b, size in zip(got, polynomial_60(**p), sizes, strict=True):
            assert abs(a - b) <= 12 * np.finfo(float).eps * size


# SI


length = st.floats(1e-3, 1e3)


@st.composite
def si_designs(draw):
    return {
        "w": draw(length),
        "v": draw(length),
        "g": draw(length),
        "lambda_s": draw(st.floats(-1.5, 1.5)),
        "m_B": draw(length),
        "x_B": draw(length),
        "z_B": -draw(length),
        "m_H": draw(length),
        "x_H": draw(length),
        "z_H": -draw(length),
    }


def within_ulps(got, expected, ulps):
    return abs(got - expected) <= ulps * math.ulp(expected)


@repeatable
@given(si_designs())
def test_si_there_and_back_to_2_ulp(p):
    """One division and one product, each rounded once; √(g w) is the same double both ways."""
    back = to_si(from_si(p), w=p["w"], m_B=p["m_B"], g=p["g"])
    assert list(back) == list(SI.names)
    assert all(within_ulps(back[name], p[name], 2) for name in p)
    native = from_si(p)
    assert list(native) == list(NATIVE.names)
    again = from_si(to_si(native, w=p["w"], m_B=p["m_B"], g=p["g"]))
    assert all(within_ulps(again[name], native[name], 2) for name in native)


def test_si_of_a_metre_and_a_kilogram_at_9_81():
    """The defaults of the contract: w = 1 m and g = 9.81 m/s²."""
    native = from_si(BENCHMARK)
    back = to_si(native)
    assert GRAVITY == 9.81
    assert (back["w"], back["g"], back["m_B"]) == (1.0, 9.81, 1.0)
    assert back["v"] == pytest.approx(3.0, rel=1e-15)
    assert back["m_H"] == pytest.approx(0.1, rel=1e-15)
    assert SI["g"].default == 9.81
    assert [p.name for p in SI.parameters if p.default is not None] == ["g"]


def test_coefficients_for_si_values_are_those_of_their_dimensionless_ones():
    assert tms.coefficients(BENCHMARK, SI) == tms.coefficients(from_si(BENCHMARK))
    assert tms.parameter_set("SI") is SI
    assert tms.parameter_set("dimensionless") is NATIVE


# Derived quantities


QUANTITIES = {
    "nu_H",
    "omega0",
    "Fr_c",
    "chi_T",
    "load_front",
    "load_rear",
    "ballast_rear",
    "ballast_front",
    "mass_margin",
}
SI_UNITS = {
    "v_c": "m/s",
    "u_H": "m",
    "N_F": "N",
    "N_R": "N",
    "m_ballast_rear": "kg",
    "m_ballast_front": "kg",
}


def test_nu_H_is_the_distance_from_the_steer_axis():
    for p in designs(50):
        with mp.workdps(60):
            lam = mp.mpf(p["lambda_s"])
            terms = (mp.mpf(p["chi_H"]) - 1) * mp.cos(lam), -p["zeta_H"] * mp.sin(lam)
        assert abs(quantities(p)["nu_H"] - sum(terms)) <= 8 * np.finfo(float).eps * sum(map(abs, terms))


def test_omega0_is_the_mean_decay_where_it_exists():
    """−(a4/a0)^(1/4) at 60 digits; nan for a4/a0 < 0. Where a4 or a0 cancels, ω0 inherits its rounding."""
    seen = set()
    for p in designs(100):
        a0, _, _, _, a4 = polynomial_60(**p)
        got = quantities(p)["omega0"]
        seen.add(bool(a4 / a0 >= 0))
        if a4 / a0 < 0:
            assert math.isnan(got)
            continue
        with mp.workdps(60):
            expected = float(-mp.root(a4 / a0, 4))
        assert got == pytest.approx(expected, rel=1e-12)
    assert seen == {True, False}


def test_Fr_c_is_the_speed_where_the_hurwitz_determinant_vanishes():
    """Found by bisection of the 60-digit determinant, not by a formula; nan where it keeps its sign."""
    found = 0
    for p in designs(40, seed=1):
        shape = {name: p[name] for name in p if name != "Fr"}
        expected = weave_Fr_60(**shape)
        got = float(quantities(p)["Fr_c"])
        if expected is None:
            assert math.isnan(got) or not 1e-3 < got < 1e3
        else:
            found += 1
            assert got == pytest.approx(float(expected), rel=1e-12)
    assert 5 < found < 35


def test_Fr_c_agrees_with_flus_on_arrays():
    rows = designs(500, seed=2)
    columns = {name: np.array([p[name] for p in rows]) for name in rows[0]}
    square = laws.flus(**{name: value for name, value in columns.items() if name != "Fr"})
    got = quantities(columns)["Fr_c"]
    np.testing.assert_array_equal(np.isnan(got), square < 0)
    np.testing.assert_allclose(got[square > 0] ** 2, square[square > 0], rtol=1e-9)
    assert (square < 0).any()
    assert (square > 0).any()


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
    names = set(SI.names) | set(NATIVE.names) | {"a0", "a1", "a2", "a3", "a4"}
    assert set(values) == names | QUANTITIES | set(SI_UNITS) | set(TIMES)
    assert len(values) == len(set(values))
    assert {*tms.quantity_names(SI), *SI.names} == set(values)
    assert {*tms.quantity_names(NATIVE), *NATIVE.names} == set(quantities(from_si(BENCHMARK)))
    assert all(np.isfinite(values[name]) or name in ("omega0", *TIMES) for name in values)  # without roots no times
    with pytest.raises(KeyError):
        values["nu_h"]


# The model as data

TIMES = {"decay_rate": "1/s", "decay_time": "s", "frequency": "Hz"}
"""Quantities of time, of the roots and the unit of rates."""


def test_a_decay_without_an_end_warns_of_nothing():
    (time,) = (q for q in SI.quantities if q.name == "decay_time")
    with np.errstate(over="raise", divide="raise"):
        assert time.value({"w": 1.0, "g": 9.81, "abscissa": np.float64(-1e-310)}) == math.inf


def test_the_parameters_of_the_contract():
    assert NATIVE.names == ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")
    assert SI.names == ("w", "v", "g", "lambda_s", "m_B", "x_B", "z_B", "m_H", "x_H", "z_H")
    assert tms.coefficient_names() == ("a0", "a1", "a2", "a3", "a4")
    assert MODELS["tms"] is tms
    assert {q.name for q in tms.quantities} == QUANTITIES
    assert {q.name for q in SI.quantities} == set(SI_UNITS) | set(TIMES)


UNITS = {
    "w": "m",
    "v": "m/s",
    "g": "m/s^2",
    "lambda_s": "rad",
    "m_B": "kg",
    "x_B": "m",
    "z_B": "m",
    "m_H": "kg",
    "x_H": "m",
    "z_H": "m",
    **dict.fromkeys(("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H"), "1"),
}
EVERY = [p for s in tms.sets for p in s.parameters] + [*tms.quantities, *SI.quantities]


@pytest.mark.parametrize("item", EVERY, ids=lambda p: p.name)
def test_every_parameter_and_quantity_is_documented(item):
    assert item.name.isidentifier()
    assert len(item.meaning) > 4
    assert item.unit == {**UNITS, **SI_UNITS, **TIMES}.get(item.name, "1")
    assert isinstance(item.range, Range)
    MathTextParser("agg").parse(f"${item.latex}$")  # raises on what a figure could not show


PHYSICAL = {
    "Fr": ([0, 3], [-1e-9]),
    "mu": ([0, 30], [-0.1]),
    "chi_B": ([-1, 0, 2], []),
    "chi_H": ([-1, 0, 2], []),
    "zeta_B": ([0, -1], [0.1]),
    "zeta_H": ([0, -1], [0.1]),
    "lambda_s": ([-1.5, 0, 1.5], [math.pi / 2, -math.pi / 2, 2]),
    "w": ([1], [0, -1]),
    "v": ([0, 5], [-1]),
    "g": ([9.81, 1.62], [0, -9.81]),
    "m_B": ([1], [0, -1]),
    "m_H": ([0, 1], [-1]),
    "x_B": ([-1, 0, 1], []),
    "x_H": ([-1, 0, 1], []),
    "z_B": ([-1, 0], [1]),
    "z_H": ([-1, 0], [1]),
}


@pytest.mark.parametrize("parameter", [p for s in tms.sets for p in s.parameters], ids=lambda p: p.name)
def test_ranges_hold_what_can_be_built(parameter):
    """z points down, so heights are ≤ 0; masses and lengths are positive; a tilt of 90° has no tangent."""
    inside, outside = PHYSICAL[parameter.name]
    assert all(x in parameter.range for x in inside)
    assert not any(x in parameter.range for x in [*outside, math.nan])


def test_a_range_says_what_it_accepts():
    assert str(Range()) == "any finite number"
    assert str(Range(lower=0.0)) == ">= 0"
    assert str(Range(upper=0.0)) == "<= 0"
    assert str(Range(0.0, 2.0, closed=False)) == "> 0 and < 2"


def test_tms_is_frozen():
    for item in (tms, NATIVE, NATIVE["Fr"], tms.quantities[0], NATIVE["Fr"].range):
        with pytest.raises(AttributeError):
            item.name = "other"  # type: ignore[misc]


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
