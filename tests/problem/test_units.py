"""Numbers with units, against their definitions; nothing but a ValueError, and that at once, for the rest."""

import math
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from itertools import permutations
from pathlib import Path

import flint
import pytest
from helpers.places import PROBLEMS
from hypothesis import given, settings, strategies as st
from mpmath import mp

import tmsopt
from tmsopt.problem import parse_value
from tmsopt.problem.units import COMMON_UNITS, dimension, parse_exact_quantity, parse_quantity, pint_factor, unit_factor

AT_ONCE = 1.0
"""Seconds; pint needs a third of one to start."""


@contextmanager
def at_once():
    started = time.perf_counter()
    yield
    assert time.perf_counter() - started < AT_ONCE


@pytest.fixture(autouse=True, scope="module")
def _pint_is_warm():
    pint_factor("m", "m")


DEFINED = {
    "rad": {
        "5 deg": math.radians(5),
        "80 deg": math.radians(80),
        "-12.5 degree": math.radians(-12.5),
        "5°": math.radians(5),
        "0.25 rad": 0.25,
        "100 mrad": 0.1,
    },
    "m": {
        "1.2 m": 1.2,
        "40 cm": 0.4,
        "40cm": 0.4,
        "  40   cm  ": 0.4,
        "-900 mm": -0.9,
        "1e3 mm": 1.0,
        ".5 m": 0.5,
        "5. m": 5.0,
        "+5E-1 m": 0.5,
        "1 inch": 0.0254,
    },
    "kg": {"10 kg": 10.0, "500 g": 0.5, "1 lb": 0.45359237},
    "m/s": {"15 km/h": 15 / 3.6, "36 km / h": 10.0, "4 m/s": 4.0, "10 mph": 10 * 1609.344 / 3600},
    "m/s^2": dict.fromkeys(("9.81 m/s^2", "9.81 m/s²", "9.81 m/s**2", "981 cm/s^2"), 9.81),
}
"""Unit of the parameter → text → number in it."""


@pytest.mark.parametrize(("unit", "text"), [(unit, text) for unit, table in DEFINED.items() for text in table])
def test_units_by_their_definitions(text, unit):
    """A factor and a product: two roundings, and two more in the factor of a quotient."""
    assert parse_quantity(text, unit) == pytest.approx(DEFINED[unit][text], rel=4 * sys.float_info.epsilon)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e300, max_value=1e300))
def test_the_parameters_own_unit_changes_nothing(number):
    for unit in ("m", "kg", "m/s", "m/s^2", "rad"):
        assert parse_quantity(f"{number!r} {unit}", unit) == number


@pytest.mark.parametrize(
    ("written", "unit"), [(written, unit) for unit, table in COMMON_UNITS.items() for written in table]
)
def test_usual_units_are_as_pint_has_them(written, unit, monkeypatch):
    """To the last bit of what is read and shown, for every one of the table that spares loading pint."""
    texts = [f"{number} {written}" for number in ("1", "-0.7", "3.1e5", "12.345678", "1e-9", "0")]
    own = [parse_exact_quantity(text, unit) for text in texts], unit_factor(written, unit)
    monkeypatch.setattr("tmsopt.problem.units.text._known_factor", pint_factor)
    assert own == ([parse_exact_quantity(text, unit) for text in texts], unit_factor(written, unit))


CONSTANTS = {
    ("8/3", "1"): lambda: mp.mpf(8) / 3,
    ("-sqrt(2)/2", "1"): lambda: -1 / mp.sqrt(2),
    ("0.1234567890123456789012345", "1"): lambda: mp.mpf("0.1234567890123456789012345"),
    ("2*pi/3 rad", "rad"): lambda: 2 * mp.pi / 3,
    ("20/3 deg", "rad"): lambda: mp.pi / 27,
    ("1/3 m", "m"): lambda: mp.mpf(1) / 3,
    ("10 km/h", "m/s"): lambda: mp.mpf(25) / 9,
    ("sqrt(2) in", "m"): lambda: mp.sqrt(2) * mp.mpf("0.0254"),
    ("7 ft", "m"): lambda: mp.mpf("2.1336"),
    ("exp(1)/3 kg", "kg"): lambda: mp.e / 3,
}


@pytest.mark.parametrize(("text", "unit"), CONSTANTS)
def test_a_constant_is_kept_as_it_is_written(text, unit):
    """The double is near, and the exact number is the true one, to 50 digits by mpmath."""
    with mp.workdps(60), flint.ctx.workdps(70):
        truth = CONSTANTS[text, unit]()
        number, _, exact = parse_exact_quantity(text, unit)
        assert exact is not None
        assert number == pytest.approx(float(truth), rel=3e-16)
        assert abs(mp.mpf(exact.ball().str(60, radius=False)) - truth) < 1e-50


def test_a_problem_keeps_the_constants_that_it_was_given():
    system = tmsopt.models.from_coefficients([1, "c", "k"])
    problem = tmsopt.Problem(system, fixed={"k": "8/3"}, free={"c": ("1/10", "sqrt(50)")}, locate="EP2")
    assert problem.fixed["k"] == 8 / 3
    assert problem.posed.typed({"k": 8 / 3, "c": 50**0.5}) == {"k": "8/3", "c": "sqrt(50)"}
    assert "c" not in problem.posed.typed({"c": 0.1})  # whose own decimal is exact
    assert replace(problem, fixed={"k": 2.5}).posed.typed({"k": 2.5}) == {}
    assert tmsopt.Problem(system, fixed={"k": Fraction(8, 3)}, free={"c": (0, 9)}).posed.typed({"k": 8 / 3}) == {
        "k": "8/3"
    }


REFUSED = {
    "wrong dimension": {
        "rad": ["5 m", "5 rad/s", "5 percent", "5 Hz"],
        "m": ["5 deg", "5 m/s", "5 m^2", "5 m*deg"],
        "m/s": ["5 m"],
        "kg": ["5 N"],
    },
    "a unit on a dimensionless number": {"1": ["5 m", "5 deg", "5 %", "5 rad", "5 percent"]},
    "no unit": {"m": ["5", " 5 ", "8/3"], "rad": ["5.0", "pi/6"], "kg": ["1e3"]},
    "no constant": {"1": ["1/0", "sqrt(-1)", "8/3*c", "2*(3", "9^2", "1e999"]},
    "malformed": {
        "m": [
            "",
            " ",
            "m",
            "5,5 m",
            "1.2.3 m",
            "--5 m",
            "5 m*",
            "5 m)",
            "5 m**",
            "5 m; 3",
            "5 m\x00",
            "5 m/0",
            "5 m/(m-m)",
            "5 m - 3 m",
            "0x10 m",
            "5e m",
            "5 []",
            "5 lambda",
            "5 m.__class__",
            "5 \ud800",
            "5 ｍ",
            "٣ m",
        ],
        "rad": ["deg"],
    },
    "unknown": {"m": ["5 furlongz"], "rad": ["5 Deg"], "kg": ["5 xyz"], "m/s": ["5 kmh"]},
    "not finite": {"m": ["nan m", "-inf m", "1e999 m", "1e308 km", "9" * 400 + " m"]},
    "offset": {"K": ["5 degC", "5 degF", "5 celsius"]},
    "logarithmic": {"W": ["5 dBm"], "m": ["5 dB", "5 pH"], "rad": ["5 Np"]},
}
"""Fault → unit of the parameter → texts."""


@pytest.mark.parametrize(
    ("kind", "text", "unit"),
    [(k, text, unit) for k, table in REFUSED.items() for unit, texts in table.items() for text in texts],
    ids=lambda x: ascii(x)[:40],
)
def test_everything_else_is_refused(kind, text, unit):
    with at_once(), pytest.raises(ValueError, match="found"):
        parse_quantity(text, unit)


HOSTILE = {
    "power": "5 m^99",
    "negative power": "5 m**-999999999",
    "power tower": "5 m**9**9**9**9",
    "tower in brackets": "5 m**(9**(9**(9**9)))",
    "factors": "5 9**9**9**9 m",
    "long number": "1" * 100_000 + " m",
    "long exponent": "1e" + "1" * 100_000 + " m",
    "long blank": "5 " + " " * 100_000 + "+",
    "long unit": "5 " + "m" * 100_000,
    "long product": "5 " + "m*" * 50_000 + "m",
    "brackets": "5 " + "(" * 100_000,
    "blanks in a unit": "5 m" + " " * 70 + "?",
    "division": "5 m" + "/m" * 19,
    "signs": "5 m**" + "-" * 35 + "1",
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_text_is_refused_at_once(kind):
    with at_once(), pytest.raises(ValueError, match="found"):
        parse_quantity(HOSTILE[kind], "m")


def test_products_and_powers_are_read():
    for text in ("5 m*m/m", "5 m^2/m", "5 m**2 / m", "5 m² m^-1", "5 m s / s"):
        with at_once():
            assert parse_quantity(text, "m") == 5


def test_a_sum_of_unlike_units_has_none_whatever_is_added():
    """In any order: metres and kilograms added are neither, and no third summand gives its unit to all."""
    units = {"metre": "m", "kilogram": "kg"}
    for parts in permutations(("metre", "kilogram", "kilogram", "none", "1.0")):
        total = " + ".join(parts)
        for text in (total, f"sqrt({total})", f"({total})*metre/2.0"):
            assert dimension(parse_value(text, None), units).unit == "1"
    assert dimension(parse_value("metre + none + metre", None), units).unit == "m"


@settings(max_examples=120, deadline=None, derandomize=True)
@given(
    st.lists(
        st.sampled_from(
            [*"0123456789.+-*/^() _%°²³µ", "m", "kg", "deg", "rad", "s", "km", "h", "**", "e", "degC", "x", "\n"]
        ),
        max_size=14,
    ).map("".join),
    st.sampled_from(["m", "rad", "kg", "m/s", "m/s^2", "1"]),
)
def test_random_text_gives_a_finite_number_or_a_value_error(text, unit):
    try:
        with at_once():
            value = parse_quantity(text, unit)
    except ValueError:
        return
    assert math.isfinite(value)


PROBLEM = """
model = "tms"
[parameters]
Fr = 1.0
mu = 0.1
chi_B = 1.2
chi_H = 1.02
zeta_B = -0.4
zeta_H = -0.2
lambda_s = "300 arcmin"
"""


def test_pint_is_imported_only_when_an_unusual_unit_is_written(tmp_path):
    file, root = tmp_path / "problem.toml", Path(__file__).parents[2]
    file.write_text(PROBLEM, encoding="utf-8")
    usual = sorted((root / "problems").glob("[!s]*.toml"))[::3]
    script = "import sys, tmsopt; [(tmsopt.load(f), print('pint' in sys.modules)) for f in sys.argv[1:]]"
    command = [sys.executable, "-c", script, *usual, file]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=root, check=True)
    assert ended.stdout.split() == ["False"] * len(usual) + ["True"]
    assert tmsopt.load(file).fixed["lambda_s"] == pytest.approx(math.radians(5), rel=1e-15)


@pytest.mark.slow
def test_json_names_seconds_only_where_there_are_seconds():
    """A system of one's own, as a dimensionless bicycle, is in no unit of time."""
    own = tmsopt.models.from_matrices([[1]], [["c"]], [[1]])
    assert tmsopt.solve(tmsopt.Problem(own, fixed={"c": 1.0})).to_json()["units"] == {}
    problems = PROBLEMS
    free, robot = (tmsopt.solve(problems / f"{n}.toml").to_json()["units"] for n in ("ep4", "point_mass_robot"))
    assert not {"decay_rate", "decay_time", "frequency", "abscissa"} & set(free)
    assert (robot["decay_rate"], robot["decay_time"], robot["frequency"]) == ("1/s", "s", "Hz")
