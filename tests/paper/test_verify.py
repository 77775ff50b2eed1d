"""The ledger of the paper against independent arithmetic: mpmath and the oracles, fractions, sampling; and whether a
wrong digit or a wrong formula in the paper would change a verdict."""

import json
import re
from collections import Counter
from decimal import ROUND_HALF_EVEN, Decimal
from fractions import Fraction

import flint
import numpy as np
import pytest
from click.testing import CliRunner
from helpers import oracles
from helpers.bicycles import MATRICES
from helpers.places import PROBLEMS
from mpmath import mp

from tmsopt import laws
from tmsopt.cli import command_group as main
from tmsopt.documents import write_ledger_page
from tmsopt.paper.ledger import (
    VERDICTS,
    compute,
    compute_entry,
    judge_decimal,
    judge_identity,
    judge_statement,
    list_definitions,
    select_claims,
    verify,
)

EXACT, HOLDS, OFF, CONDITIONAL, FAILS = VERDICTS
PAGE = PROBLEMS / "paper.md"
ZB, ZH = Fraction(-2, 5), Fraction(-1, 5)


@pytest.fixture(scope="module")
def ledger():
    return verify()


@pytest.fixture(scope="module")
def by_key(ledger):
    return {entry.key: entry for entry in ledger.entries}


# The ledger as a whole


def test_every_entry_is_complete(ledger):
    assert len({entry.key for entry in ledger.entries}) == len(ledger.entries)
    for entry in ledger.entries:
        assert entry.remark or entry.verdict == EXACT
        assert bool(entry.computed) or not entry.printed
    assert sum(ledger.counts.values()) == len(ledger.entries)


def test_labels_of_the_paper_are_covered(ledger):
    """Every labelled equation, the table and every figure with numbers or claims has a place in the ledger."""
    places = " ".join(entry.place for entry in ledger.entries)
    labels = (
        "matrices chapo copo lscf flus bench fr1 w0 4poly a1a3 chib a2 e1 e2 e3 Frc1 chibm frm w01 chib1 tls frep4 epset "
        "dp fig0 fig00 fig1 fig2 fig3 fige"
    )
    assert {*labels.split()} <= {*re.findall(r"\w+", places)}
    assert "Table 1" in places


# Numbers, at 50 digits by other means


@pytest.fixture(scope="module")
def numbers():
    with mp.workdps(60):
        out = {}
        Fr_c = oracles.weave_Fr_60(Fraction(1, 10), Fraction(6, 5), Fraction(102, 100), ZB, ZH, mp.pi / 36)
        out["fr1-Fr_c"], out["fr1-v_c"] = Fr_c, Fr_c * mp.sqrt(mp.mpf("9.81"))

        def matching(Fr, mu, T):
            """a2 − 6 a0, a4 − a0 and p(−1) at ω0 = −1, by the oracle's own coefficients."""
            a = oracles.polynomial_60(Fr, mu, Fraction(119, 100), Fraction(102, 100), ZB, ZH, mp.atan(T))
            return [a[2] - 6 * a[0], a[4] - a[0], a[0] - a[1] + a[2] - a[3] + a[4]]

        Fr, mu, T = mp.findroot(matching, (2.3, 20, 1.1))
        out["e123-Fr"], out["e123-mu"], out["e123-lambda_s"] = Fr, mu, mp.atan(T)

        root = mp.sqrt(2)
        tilt = mp.atan(mp.mpf(15) / 4 - mp.mpf(75) / 32 * root)
        out["Fr_EP4"] = 3 * mp.sqrt(110 * root - 120) / 8
        for key, off, start in (("2EP2", "-0.05", (2.26, 4.1)), ("CEP2", "0.8", (4.1, 1.5))):
            lean = tilt + mp.mpf(off)
            out[f"tab1-{key}-Fr_c"] = oracles.weave_Fr_60(1, root, 1, ZB, ZH, lean)

            def pair(Fr, b, lean=lean):
                a0, a1, a2, a3, _ = oracles.polynomial_60(Fr, 1, root, 1, ZB, ZH, lean)
                return [a1 / a0 - 2 * b, a2 / a0 - b**2 - 2 * a3 / a1]

            out[f"tab1-{key}-Fr_EP"] = mp.findroot(pair, start)[0]
        out["fige-ratio"] = mp.sqrt(mp.mpf(1158) / 526)
        return out


KEYS = (
    "fr1-Fr_c fr1-v_c e123-Fr e123-mu e123-lambda_s Fr_EP4 tab1-2EP2-Fr_c tab1-2EP2-Fr_EP tab1-CEP2-Fr_c "
    "tab1-CEP2-Fr_EP fige-ratio"
)


@pytest.mark.parametrize("key", KEYS.split())
def test_decimals_have_forty_true_digits_and_the_verdict_of_rounding(key, numbers, by_key):
    """Decimal rounding of the independent value to the printed places, in a rule of its own."""
    entry = by_key[key]
    with mp.workdps(60):
        assert abs(mp.mpf(entry.computed) / numbers[key] - 1) < mp.mpf(10) ** -39
        true = Decimal(mp.nstr(numbers[key], 50))
    rounded = true.quantize(Decimal(entry.printed), rounding=ROUND_HALF_EVEN)
    assert entry.verdict == (HOLDS if rounded == Decimal(entry.printed) else OFF)


@pytest.mark.parametrize("key", KEYS.split())
def test_a_wrong_printed_digit_would_not_pass(key, by_key):
    text, value = by_key[key].printed, by_key[key].computed
    last, early = list(text), list(text)
    last[-1] = str((int(text[-1]) + 5) % 10)
    early[3] = str((int(text[3]) + 4) % 10)
    with flint.ctx.workdps(60):
        assert judge_decimal("".join(last), flint.arb(value)).verdict in (OFF, FAILS)
        assert judge_decimal("".join(early), flint.arb(value)).verdict == FAILS


def test_the_rule_for_decimals():
    third = flint.fmpq(1, 3)
    with flint.ctx.workdps(60):
        assert judge_decimal("0.5", flint.fmpq(1, 2)).verdict == EXACT
        assert judge_decimal("0.3333", third).verdict == HOLDS
        assert judge_decimal("0.33333333334", third).verdict == OFF
        assert judge_decimal("0.3334", third).verdict == FAILS  # one unit, but more than a millionth
        assert judge_decimal("0.333333334444", third).verdict == FAILS  # a thousand units
        with pytest.raises(ArithmeticError, match="too wide"):
            judge_decimal("0.5", flint.arb(0.5, 0.1))


def test_the_rule_for_statements():
    assert judge_identity(True).verdict == EXACT
    assert judge_identity(False).verdict == FAILS
    assert judge_statement("c", True, "x", True).verdict == CONDITIONAL
    assert judge_statement("c", False, "x", True).verdict == FAILS
    with pytest.raises(ArithmeticError):
        judge_statement("c", True, "x", False)


def test_expressions_are_a_small_part_of_python():
    assert compute("[1/10 == 0.1, 1 < 2 < 2, *[x + y for x, y in [[1, 2], [3, 4]] if x > 1]]", {}) == [True, False, 7]
    for text in ("(lambda: 1)()", "1 if 2 else 3", "open('x')", "sqrt.__class__"):
        with pytest.raises((SyntaxError, KeyError, TypeError)):
            compute(text, {})


# A wrong formula changes the verdict


WRONG = [
    ("copo", "copo-a2", lambda f: lambda *p: [*f(*p)[:2], f(*p)[2] + p[0], *f(*p)[3:]]),
    ("flus", "flus", lambda f: lambda mu, b, h, zb, zh, T: f(mu, b, h, zb, zh, T) + (h - 1) * b),
    ("poly4", "4poly-expansion", lambda f: lambda w: [1, -4 * w, 6 * w**2, -4 * w**2, w**4]),
    ("chib", "chib", lambda f: lambda w, h, zb, zh: (w**2 * zb + 1) / (w**2 * zh + 1) * h),
    ("Frc1", "Frc1", lambda f: lambda b, zb, zh, T: f(b, zb, zh, T) * b),
    ("tls", "tls", lambda f: lambda zb, zh: f(zb, zh) / 2),
    ("printed_w0", "w0", lambda text: f"-({text})"),
    ("printed_frm", "frm", lambda text: "(root_B - root_H)/(root_B + root_H)*T"),
    ("printed_frep4", "frep4", lambda text: f"{text} + Fr"),
    ("printed_epset", "epset", lambda text: f"({text})*T"),
    ("printed_e1", "e1", lambda text: text.replace("0.004", "0.005")),
]


@pytest.mark.parametrize(("name", "key", "change"), WRONG)
def test_a_wrong_printed_formula_would_not_hold(name, key, change, by_key, monkeypatch):
    assert by_key[key].verdict != FAILS
    if name in list_definitions():
        _, table = list_definitions()[name]
        monkeypatch.setitem(table, "value", change(table["value"]))
    else:
        monkeypatch.setattr(laws, name, change(getattr(laws, name)))
    (claim,) = select_claims([key])
    with flint.ctx.workdps(60):
        assert compute_entry(claim).verdict == FAILS


# Counterexamples by hand


def fractions(name):
    return [Fraction(str(x)) for x in compute(name, {})]


def test_the_counterexample_to_sufficiency():
    """Judged in `test_laws.test_a_design_the_printed_conditions_wrongly_admit`; here it is that design."""
    assert [float(x) for x in fractions("witness_design(2)")] == [2, 5, 1.2, 0.9, -0.5, -0.4, 0.5]


@pytest.mark.parametrize(
    ("tilt", "chi_B", "speeds", "real"),
    [
        (0.435437, 1.404214, (2.2, 2.3), [2, 0]),
        (0.435437, 1.424214, (2.2, 2.3), [2, 0]),
        (0.377177, 1.404214, (2.2, 2.221, 2.23), [2, 4, 2]),
        (0.377177, 1.424214, (2.23, 2.239, 2.25), [2, 4, 2]),
    ],
)
def test_curves_still_meet_near_the_real_exceptional_points(tilt, chi_B, speeds, real, by_key):
    """Number of real roots, exactly, from the oracle's own coefficients."""
    polynomials = [oracles.polynomial_exact(str(Fr), 1, chi_B, 1, ZB, ZH, tilt) for Fr in speeds]
    assert [sum(m for z, m in oracles.certified_roots(a) if z.imag == 0) for a in polynomials] == real
    assert by_key["fig3-repelling"].verdict == CONDITIONAL


def test_other_chi_H_affect_generality(by_key):
    """Faster than the ω0 of χ_H = 1 with the same heights; and μ moves the product of the roots only off χ_H = 1."""
    a = oracles.polynomial_exact("2.2362", "1.9673", "1.4754", "0.95", ZB, ZH, "0.4903")
    shifted = np.poly1d([float(c / a[0]) for c in a])(np.poly1d([1, -2.4]))
    assert oracles.routh_exact([Fraction(x) for x in shifted.coeffs])
    assert -(float((ZB * ZH) ** -1) ** 0.25) > -2.4
    for chi_H, moves in (("1", False), ("1.02", True)):
        products = {
            b[4] / b[0] for mu in (1, 2) for b in [oracles.polynomial_exact(2, mu, "1.3", chi_H, ZB, ZH, "0.5")]
        }
        assert (len(products) == 2) is moves
    assert by_key["chi_H-generality"].verdict == CONDITIONAL


def test_the_speed_of_capsize_is_a_closed_form(by_key):
    """Meijaard et al. (2007), Table 2: 6.02426201538837 m/s; here det(g K0 + v² K2), which is affine in v²."""
    *_, K0, K2 = map(np.array, MATRICES)
    still, moving = (np.linalg.det(9.81 * K0 + square * K2) for square in (0, 1))
    speed = np.sqrt(still / (still - moving))
    assert float(by_key["conclusion-numerical"].computed) == pytest.approx(speed, rel=1e-12)
    assert by_key["conclusion-numerical"].verdict == FAILS


def test_a_bicycle_that_is_stable_backward():
    """In the sense of the paper's own polynomial, with both masses behind the rear contact."""
    design = fractions("backward_design")
    assert design[0] < 0 < design[6]
    assert oracles.routh_exact(oracles.polynomial_exact(*design))
    assert not oracles.routh_exact(oracles.polynomial_exact(-design[0], *design[1:]))


def test_the_tangent_of_the_printed_curve_in_the_figure(by_key):
    with mp.workdps(60):
        omega0, zeta_B = -mp.mpf(25) / 2, mp.mpf(-2) / 5
        square = mp.sqrt(-omega0)
        ratio = (square * zeta_B - 1) / (square * zeta_B + 1)

        def curve(lean):
            return ratio * 2 * mp.tan(lean) / mp.sqrt(square**2 * zeta_B + 4 * mp.tan(lean) * ratio)

        turn = mp.findroot(lambda lean: mp.diff(curve, lean), 0.4)
        assert abs(turn - mp.mpf(by_key["epset-tangent"].computed)) < mp.mpf(10) ** -25


def test_negative_eigenvalues_first_move_apart(by_key):
    """The turning speed of the bicycle of Table 1, by sampling its roots around it."""
    turn = float(by_key["motion-negative"].computed)
    T = float(15 / 4 - 75 / 32 * np.sqrt(2))
    spans = []
    for Fr in (turn - 0.01, turn, turn + 0.01):
        p = [float(c) for c in oracles.polynomial_exact(Fr, 1, float(np.sqrt(2)), 1, -0.4, -0.2, T)]
        real = np.sort([z.real for z in np.roots(p) if abs(z.imag) < 1e-9])
        spans.append(real[1] - real[0])
    assert spans[1] > max(spans[0], spans[2])


def test_dp_is_empty_for_lower_rear_mass():
    """ζ_B = −1/2, ζ_H = −2: ω0 = −1, and (tls) in fractions."""
    assert laws.dp(-0.5, -2)[1] == pytest.approx(-17 / 192, rel=1e-14)


def test_the_cusp_is_a_triple_root(by_key):
    with mp.workdps(60):
        chi_B = mp.sqrt(2) - mp.mpf("0.1")

        def triple(Fr, T, s):
            a = oracles.polynomial_60(Fr, 1, chi_B, 1, ZB, ZH, mp.atan(T))
            return [
                sum(c * mp.ff(4 - k, n) * s ** (4 - k - n) for k, c in enumerate(a) if 4 - k >= n) for n in range(3)
            ]

        found = mp.findroot(triple, (2.02, 0.2, -0.94))
        assert abs(found[0] / mp.mpf(by_key["fig2-left"].computed) - 1) < mp.mpf(10) ** -38


def test_the_machine_of_the_photograph_has_an_EP4(by_key):
    """With the μ, λ_s and Fr that the entry names: rounded to six digits the coefficients match to about as many."""
    text = by_key["fige-abscissa"].remark
    mu, T, Fr = (float(text.split(f"{name} = ")[1].split(" ")[0].rstrip(",")) for name in ("μ", "tan λ_s", "Fr"))
    a = oracles.polynomial_exact(Fr, mu, 1.526, 0.921, -1.158, -0.526, T)
    root = float(by_key["fige-abscissa"].computed)
    assert [float(c / a[0]) for c in a] == pytest.approx(list(np.poly([root] * 4)), rel=1e-4)


# What a reader sees


def test_the_text_fits_the_page_and_counts(ledger):
    text = ledger.report()
    assert max(map(len, text.splitlines())) <= 100
    for entry in ledger.entries:
        assert f"{entry.key}:" in text
    assert text.splitlines()[-1].split() == [str(len(ledger.entries)), "entries"]


def test_the_page_in_the_repository_is_the_ledger(ledger):
    again = "`tmsopt verify --markdown problems/paper.md` writes it anew"
    assert PAGE.read_text(encoding="utf-8") == write_ledger_page(ledger), again


def test_the_documentation_counts_as_the_ledger(ledger):
    text = " ".join((PAGE.parents[1] / "docs" / "explanation" / "paper.md").read_text(encoding="utf-8").split())
    verdicts = Counter(entry.verdict for entry in ledger.entries)
    assert f"{len(ledger.entries)} numbers and statements" in text
    assert f"{verdicts['exact']} are exact" in text
    assert f"{verdicts[CONDITIONAL]} hold only under a condition" in text


def test_the_command(tmp_path):
    runner = CliRunner()
    found = runner.invoke(main, ["verify", "--only", "tab1-*", "--only", "epset", "--json"])
    assert found.exit_code == 0
    keys = [entry["key"] for entry in json.loads(found.stdout)["entries"]]
    assert "epset" in keys
    assert all(key == "epset" or key.startswith("tab1-") for key in keys)
    page = tmp_path / "page.md"
    assert runner.invoke(main, ["verify", "--only", "epset", "--markdown", str(page)]).exit_code == 0
    assert "**`epset`**" in page.read_text(encoding="utf-8")
    for wrong_use in (["--only", "nothing"], ["--markdown", str(tmp_path / "page.txt")]):
        assert runner.invoke(main, ["verify", *wrong_use]).exit_code == 2
