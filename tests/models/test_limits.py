"""What is hostile in an expression or a number is refused before anything is computed, in words and at once."""

import sys
import time
from fractions import Fraction
from importlib import import_module
from pathlib import Path

import casadi as ca
import flint
import numpy as np
import pytest

import tmsopt
from tmsopt import models

degree = import_module("tmsopt.models.stated.degree")
expression = import_module("tmsopt.models.expression")
balls = import_module("tmsopt.algebra.balls")
power = import_module("tmsopt.algebra.kinds").BALLS.operations["pow"]
text = import_module("tmsopt.problem.units.text")

EP4 = Path("problems/ep4.toml").read_text(encoding="utf-8")
SI = {"v": 3, "lambda_s": 0.3, "m_B": 1, "x_B": 0.5, "z_B": -1, "m_H": 0.1, "x_H": 0.9, "z_H": -0.5}

REFUSED = {
    "Fr**-99999999999": "has the exponent -99999999999; accepted: from -1023 to 1023",
    "Fr**1000000000": "has the exponent 1000000000",
    "Fr**9223372036854775808": "has the exponent 9.22",
    "Fr**(500 + 600)": "'Fr**(500 + 600)' has the exponent 1100",
    "9**9**9**9*Fr": "'9**9**9' has the exponent 387420489",
    "((Fr**99)**99)**99": "has the degree 970299 when multiplied out; accepted: up to 10000",
    "0**-1*Fr": "'0**-1' is inf",
    "2 + 1/0": "'1/0' divides by 0",
    "Fr/(2 - 2)": "'Fr/(2 - 2)' divides by 0",
    "exp(exp(exp(exp(9)))) + Fr": "'exp(exp(9))' is inf",
    "Fr*log(-1)": "'log(-1)' is nan",
    "(-1)**0.5*Fr": "'(-1)**0.5' is nan",
    "Fr*1e-400": "contains 1e-400, a number beyond double precision",
    "1e99999999*Fr": "contains 1e99999999, a number beyond double precision",
    "9" * 1900 + "*Fr": "a number beyond double precision",
    "Fr" + "+Fr" * 100_000: "characters; accepted: up to 2000",
    "(" * 900 + "Fr" + ")" * 900: "does not parse",
    "-" * 1500 + "Fr": "nested deeper than 200 levels",
}
"""Expression → what is said of it."""


@pytest.mark.parametrize("written", REFUSED, ids=lambda t: t[:24])
def test_hostile_expressions_are_refused_wherever_one_may_stand(tmp_path, written):
    """In an objective, a constraint and a front, at the line of the file, within a second."""
    for place, asked in {
        "objective.minimize": EP4.replace('"abscissa"', f'"{written}"'),
        "objective.maximize": EP4.replace('minimize = "abscissa"', f'maximize = "{written}"'),
        "objective.pareto": EP4.replace('minimize = "abscissa"', f'pareto = ["abscissa", "{written}"]'),
        "constraints.c": f'{EP4}\n[constraints]\nc = "{written} <= 1"\n',
    }.items():
        file = tmp_path / "p.toml"
        file.write_text(asked, encoding="utf-8")
        line = next(n for n, said in enumerate(asked.splitlines(), start=1) if written in said)
        began = time.process_time()
        with pytest.raises(tmsopt.InputError) as caught:
            tmsopt.load(file)
        assert time.process_time() - began < 1
        (fault,) = caught.value.faults
        assert (fault.line, ".".join(fault.key)) == (line, place)
        assert REFUSED[written] in fault.message


@pytest.mark.parametrize("written", [t for t in REFUSED if len(t) < 2000], ids=lambda t: t[:24])
def test_hostile_expressions_make_no_model(written):
    for state in (
        lambda: models.from_matrices(A=[["k", written], [1, -1]]),
        lambda: models.from_coefficients([1, written, "k"]),
        lambda: models.from_coefficients([1, "k"], quantities={"q": written}),
    ):
        with pytest.raises(models.Unfit) as caught:
            state()
        assert REFUSED[written] in str(caught.value)


@pytest.mark.parametrize(
    "written", ["Fr**1023", "Fr**-1023", "(Fr**99)**99", "Fr*2**1000", "0**0*Fr", "Fr*5e-324", "Fr/1e308"]
)
def test_what_is_not_beyond_is_read(written):
    assert expression.parse_value(written, ["Fr"]).names == ("Fr",)


def test_what_a_program_builds_may_cancel():
    """An inverse is of the degree of its matrix, and the steps to it sum up to more than 10 000."""
    m, c = ca.SX.sym("m"), ca.SX.sym("c")
    masses, springs = np.eye(6) + 1, 2 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)

    def matrix(numbers, m, c, inverse):
        solved = inverse(numbers(masses) * m + numbers(np.diag(np.arange(6))) * m * m)
        return -(solved @ numbers(springs + np.eye(6))) * c

    found = models.from_matrices(A=matrix(ca.SX, m, c, ca.inv)).coefficients({"m": 0.7, "c": 0.3})
    expected = np.poly(matrix(np.array, 0.7, 0.3, np.linalg.inv))
    assert [float(x) for x in found] == pytest.approx(expected, rel=1e-9)


def layers(count, first, second):
    """Quantities two by two, each layer of the next."""
    found = {}
    for i in range(count):
        found[f"a{i}"] = first.format(a=f"a{i + 1}", b=f"b{i + 1}")
        found[f"b{i}"] = second.format(a=f"a{i + 1}", b=f"b{i + 1}")
    return {**found, f"a{count}": "k", f"b{count}": "k + 1"}


def test_quantities_in_layers_are_walked_once_each():
    """a ← (a + b)/2, b ← (a − b)/2 multiplies (a, b) by a matrix whose square is 1/2."""
    began = time.process_time()
    model = models.from_coefficients([1, "a0 + b0"], quantities=layers(40, "({a} + {b})/2", "({a} - {b})/2"))
    values = tmsopt.Problem(model=model, fixed={"k": 3.0}).posed.values({"k": 3.0})
    assert (float(values["a0"]), float(values["b0"])) == pytest.approx((3 * 2.0**-20, 4 * 2.0**-20), rel=1e-12)
    assert time.process_time() - began < 2
    with pytest.raises(models.Unfit, match="has the degree"):
        models.from_coefficients([1, "a0 + b0"], quantities=layers(40, "{a}*{b}", "{a} + {b}"))


def test_a_chain_of_quantities_as_long_as_is_read():
    most = import_module("tmsopt.models.stated.texts").MAX_QUANTITIES
    limit = sys.getrecursionlimit()

    def chain(count):
        return {f"q{i}": f"q{i + 1} + 1" for i in range(count - 1)} | {f"q{count - 1}": "k"}

    model = models.from_coefficients([1, "q0"], quantities=chain(most))
    assert [float(c) for c in model.coefficients({"k": 2.0})] == [1, most + 1]
    with pytest.raises(models.Unfit, match="found 1500 quantities; accepted: up to 500"):
        models.from_coefficients([1, "q0"], quantities=chain(1500))
    assert sys.getrecursionlimit() == limit
    with pytest.raises(models.Unfit, match=r"q0: uses itself: q0 → q1 → .* → q0"):
        models.from_coefficients([1, "q0"], quantities=chain(most) | {f"q{most - 1}": "q0"})


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("1e-99999999 cm", "beyond double precision"),
        ("1e99999999 cm", "beyond double precision"),
        ("5 ym^9/Ym^8", "beyond double precision"),
        ("5 m" + "  m" * 25 + " ?", "does not read as a unit"),
        ("5 m" + "  m" * 100_000 + " ?", "300005 characters; write up to 80"),
        ("1," + "1" * 100_000, "100002 characters"),
    ],
    ids=lambda t: t[:24],
)
def test_hostile_numbers_with_units_are_refused_at_once(written, said):
    began = time.process_time()
    for table, given in {
        "fixed": {"fixed": {**SI, "w": written}},
        "tolerances": {"fixed": {**SI, "w": 1}, "tolerances": {"w": written}},
        "free": {"fixed": SI, "free": {"w": (written, 2)}, "minimize": "abscissa"},
        "scenarios": {"fixed": SI, "scenarios": {"w": [written, 1]}},
    }.items():
        with pytest.raises(tmsopt.InputError, match="w") as caught:
            tmsopt.Problem(model=tmsopt.models.tms, **given)
        assert any(said in f.message for f in caught.value.faults), table
    assert time.process_time() - began < 2


def test_a_nought_may_have_any_exponent():
    assert text.parse_exact_quantity("0e99999999 cm", "m")[:2] == (0.0, "cm")
    assert text.parse_exact_quantity("5  km /  h", "m/s")[0] == pytest.approx(25 / 18, rel=1e-15)


@pytest.mark.parametrize("value", [-1e300, 1e51, 1e-51])
def test_sizes_of_parameters_whose_products_are_no_doubles_are_refused(value):
    for given in ({"fixed": {**SI, "w": value}}, {"fixed": {**SI, "w": 1}, "tolerances": {"w": value}}):
        with pytest.raises(tmsopt.InputError, match="found") as caught:
            tmsopt.Problem(model=tmsopt.models.tms, **given)
        assert "w" in str(caught.value)


@pytest.mark.parametrize("mass", [5e-324, 1e-310, 1e-200])
def test_a_mass_next_to_nought_is_a_singular_mass_matrix(mass):
    """Without a warning, of which pytest would make an error."""
    assert _light(mass).posed.values({"c": 0.1, "d": 1.0})["structure"].name == "undecided"


def _light(mass):
    """Two masses, one of them as light as that."""
    model = models.from_matrices([[1, 0], [0, mass]], [["c", 0], [0, "c"]], [[2, "1 - d"], [1, 2]])
    return tmsopt.Problem(
        model=model, fixed={"c": 0.1}, free={"d": (0, 3)}, maximize="d", constraints={"q": "abscissa <= 0"}
    )


@pytest.mark.slow
def test_a_search_says_that_a_mass_next_to_nought_is_singular():
    with pytest.raises(tmsopt.NotSolved) as caught:
        tmsopt.solve(_light(5e-324), starts=1)
    assert "mass matrix is singular" in caught.value.solution.report()


@pytest.mark.parametrize(
    "exact",
    ["1e-99999999", "1e9_999_999_999", "1" * 5000, 10**5000, Fraction(10**5000, 3), "1e99999999 deg"],
    ids=range(6),
)
def test_exact_numbers_have_as_many_digits_as_doubles_need(exact):
    written = import_module("tmsopt.models.exact").as_exact_design
    of = tmsopt.models.tms.sets[0]
    design = dict.fromkeys(of.names, 0.3)
    with pytest.raises(tmsopt.InputError, match=r"lambda_s: found .* of up to 400 digits"):
        written(of, design, {"lambda_s": exact})


def test_powers_of_fractions_that_would_fill_the_memory_are_balls():
    third = flint.fmpq(1, 3)
    assert power(third, flint.fmpq(-5)) == 243
    huge = power(third**1000, flint.fmpq(1000))
    assert isinstance(huge, flint.arb) or huge == third**1_000_000
    huge = power(huge, flint.fmpq(1000))
    assert isinstance(huge, flint.arb)
    assert np.isclose(float(flint.arb(huge).log()), -1e9 * np.log(3), rtol=1e-12)
    for ball in (flint.arb(-(10**300)).exp(), flint.arb(2) ** 10**12):
        assert float(flint.arb(balls.rational(ball))) == float(ball)


def test_whether_a_leading_coefficient_vanishes_is_not_asked_of_millions_of_terms():
    """(a + … + f)³² has C(37, 5) = 435 897 terms."""
    began = time.process_time()
    total = "(a + b + c + d + e + f)"
    for n, left in ((2, 1), (32, 2)):  # where that is told, one root is left
        model = models.from_coefficients([f"{total}**{n} - {total}**{n - 1}*{total}", 1, "k"])
        assert model.degree == left
    assert time.process_time() - began < 3
