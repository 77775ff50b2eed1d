"""Numbers in formulas are what their digits and quotients say: against mpmath, at 60 digits."""

import pickle
import random
import re
from fractions import Fraction

import casadi as ca
import flint
import pytest
from mpmath import mp

import tmsopt
from tmsopt.models import from_coefficients, from_matrices

NUMBERS = ["0.1", "8/3", "2/7", "1.8", "sqrt(2)", "pi", "2", "0.5", "(1/3 - 0.3)", "exp(0.1)", "-0.7", "1e-3", "12"]
NAMES = {name: getattr(mp, name) for name in ("sqrt", "exp", "sin")} | {"pi": mp.pi, "mpf": mp.mpf, "__builtins__": {}}


def truth(text, x, y):
    """The value at 60 digits; a number is made of its digits."""
    exactly = re.sub(r"\d+\.?\d*(e-?\d+)?", lambda found: f"mpf('{found[0]}')", text)
    return mp.mpf(eval(exactly, {**NAMES, "x": mp.mpf(x), "y": mp.mpf(y)}))


def random_text(rng, depth):
    """Sums, products and quotients of numbers and of x and y, which CasADi would like to gather."""
    if depth == 0:
        return rng.choice([*NUMBERS, "x", "y", "x", "y"])
    a, b = random_text(rng, depth - 1), random_text(rng, rng.randrange(depth))
    return rng.choice([f"({a} + {b})", f"({a} - {b})", f"({a})*({b})", f"({a})/(2 + ({b})**2)", f"sin({a})"])


@pytest.mark.parametrize("seed", range(15))
def test_random_formulas_hold_the_60_digit_value(seed):
    rng = random.Random(seed)
    text = f"{random_text(rng, 4)} + x/3*0.6/0.2 + y - y"
    model = pickle.loads(pickle.dumps(from_coefficients(["1", text, "0.1*x"], quantities={"q": f"{text} - 0.3"})))
    x, y = Fraction(rng.randrange(1, 900), 100), Fraction(rng.randrange(-900, 900), 100)
    values = {"x": flint.fmpq(*x.as_integer_ratio()), "y": flint.fmpq(*y.as_integer_ratio())}
    with flint.ctx.workdps(70), mp.workdps(70):
        written = truth(text, str(float(x)), str(float(y)))
        found = flint.arb(model.coefficients(values)[1]), flint.arb(model.quantities[0].value(values))
        for ball, wanted in zip(found, (written, written - mp.mpf("0.3")), strict=True):
            off = abs(flint.arb(mp.nstr(wanted, 65)) - ball)
            assert off.abs_upper() < flint.arb(10) ** -55 * (1 + abs(ball))
        assert model.coefficients({"x": float(x), "y": float(y)})[1] == pytest.approx(
            float(written), rel=1e-11, abs=1e-12
        )


@pytest.mark.parametrize("eight_thirds", ["8/3", Fraction(8, 3), "2.6 + 1/15"], ids=["text", "Fraction", "sum"])
def test_a_quotient_is_a_fraction_however_it_is_given(eight_thirds):
    """c = 2 √(8/3), not twice the root of the double nearest to 8/3, which is 9e-17 off."""
    with mp.workdps(60):
        wanted = mp.nstr(2 * mp.sqrt(mp.mpf(8) / 3), 50)
    for model in (
        from_coefficients([1, "c", eight_thirds]),
        from_matrices(A=[[0, 1], [f"-({eight_thirds})", "-c"]]),
        from_matrices(M=[[1]], D=[["c"]], K=[[eight_thirds]]),
    ):
        proof = tmsopt.prove(tmsopt.solve(tmsopt.Problem(model, free={"c": (1, 9)}, locate="EP2")))
        assert proof.proved
        assert proof.numbers in (("8/3",), ("-8/3",))
        assert "8/3" in proof.report().split("exact numbers:")[1]
        assert proof.parameters["c"].contains(wanted)
        assert float(proof.parameters["c"].radius) < 1e-30


def test_decimals_of_arrays_and_of_casadi_are_decimals():
    """As in [[0.1, 0.7], [0.3, 2.1]], whose determinant is 0 and in binary is not."""
    c = ca.SX.sym("c")
    for rows in ([[0.1, 0.7], ["0.3*c", "2.1*c"]], [[ca.SX(0.1), ca.SX(0.7)], [0.3 * c, 2.1 * c]]):
        a = from_matrices(A=rows).coefficients({"c": flint.fmpq(1, 3)})
        assert a[2] == 0
        assert a[1] == -flint.fmpq(1, 10) - flint.fmpq(7, 10)


@pytest.mark.parametrize(
    ("entry", "im", "listed"),
    [
        ("1j/3", Fraction(1, 3), "1/3"),
        ("-1j/3", Fraction(-1, 3), "-1/3"),
        ("2.5j/3", Fraction(5, 6), "5/6"),
        ("k + 1j/7", Fraction(1, 7), "1/7"),
    ],
)
def test_numbers_in_complex_entries_are_listed(entry, im, listed):
    model = tmsopt.models.from_hamiltonian([[entry, "k"], ["k", 0]])
    assert model.numbers == (listed,)
    assert model.pencil is not None
    with flint.ctx.workdps(60):
        found = model.pencil({"k": flint.fmpq(1)})[1][0][0].real  # −Im H, of s + i H
        assert found.contains(-flint.fmpq(im.numerator, im.denominator))
        assert found.rad() < 1e-55
