"""What the report of a design says, line by line, in words and in the units that a builder reads."""

import json
import math
import pickle
import re
from dataclasses import replace
from importlib import import_module

import pytest

import tmsopt
from tmsopt.documents import convert_to_si, document_of, to_text
from tmsopt.models import tms
from tmsopt.problem import Relaxation
from tmsopt.records import Table

BENCHMARK = dict(tmsopt.load("problems/benchmark.toml").fixed)
NAMES = tms.sets[0].names[:7]
CEP2 = dict(zip(NAMES, (11 / 6, 0.1, 2.0, 1.0, -2.0, -0.5, math.atan(11 / 12)), strict=True))
"""Equation copo gives a0 … a4 = (11/6)(1, 2, 3, 2, 1), that is (s² + s + 1)² up to a factor."""
TWO_PAIRS = dict(zip(NAMES, (44 / 13, 0.1, 28 / 13, 1.0, -1.0, -0.25, math.atan(528 / 169)), strict=True))
"""Likewise (s² + s + 1)(s² + s + 4)."""
UNITS = {**dict.fromkeys(("x_B", "z_B", "x_H", "z_H"), "cm"), "v": "km/h", "lambda_s": "deg"}


def solved(**changes):
    """The benchmark bicycle in SI, with changes; nothing is free, so this is an evaluation."""
    return tmsopt.solve(tmsopt.Problem(tms, fixed={**BENCHMARK, **changes}, units=UNITS))


def full(solution, *scale):
    si = convert_to_si(solution, *scale) if scale else None
    return to_text(document_of(solution, "full", si=si))


def rows(report):
    """Cells of each line that belongs to a table."""
    return [re.split(r"\s{2,}", line.strip()) for line in report.splitlines() if line.startswith("  ")]


def read(report, symbol):
    """Number and unit that follow a symbol in a table."""
    if also := re.search(rf"  {symbol} = (\S+) (\S+)", report):
        return float(also[1]), also[2]
    cells = next(row[row.index(symbol) :] for row in rows(report) if symbol in row)
    return float(cells[1]), cells[2]


def line(report, start):
    """The one line that begins so, with what it is continued by."""
    found = re.findall(rf"^{start}.*(?:\n  .*)*", report, re.MULTILINE)
    assert len(found) == 1
    return " ".join(str(found[0]).split())


def balance(solution):
    """Of the loads, what follows the numbers."""
    return line(solution.report(), "loads: front wheel ").split("; ", 1)[1]


def test_lengths_speeds_and_angles_read_as_they_were_written():
    report = full(solved())
    expected = {
        "x_B": (120, "cm"),
        "z_B": (-40, "cm"),
        "x_H": (102, "cm"),
        "z_H": (-20, "cm"),
        "w": (1, "m"),
        "m_H": (1, "kg"),
        "m_B": (10, "kg"),
        "v": (14.4, "km/h"),
        "lambda_s": (5, "deg"),
    }
    assert {symbol: read(report, symbol) for symbol in expected} == expected


def test_loads_u_H_and_critical_speed_of_the_benchmark():
    """By hand: moments 10·0.2 + 1·0.02 kg m about the front contact, 13.02 about the rear one, of 11 kg."""
    report = full(solved())
    assert next(r[:3] for r in rows(report) if r[0] == "load_front") == ["load_front", "118.364", "%"]  # 13.02/11
    assert read(report, "N_F") == (pytest.approx(13.02 * 9.81, rel=1e-11), "N")
    assert read(report, "N_R") == (pytest.approx(-2.02 * 9.81, rel=1e-11), "N")
    u_H = 2 * math.cos(math.radians(5)) + 20 * math.sin(math.radians(5))
    assert read(report, "u_H") == (pytest.approx(u_H, rel=1e-11), "cm")
    assert read(report, "v_c") == (pytest.approx(2.8410083233664 * 3.6, rel=1e-11), "km/h")
    margin = next(float(row[1]) for row in rows(report) if row[0] == "mass_margin")
    assert 0 < margin < 0.1 * (u_H / 100) ** 2  # below M22, as a Rayleigh quotient
    assert "127.7 N (118.4 %), rear wheel -19.82 N" in line(str(solved()), "loads: front wheel ")


@pytest.mark.parametrize(
    ("x_B", "words"),
    [
        (1.2, "pitches over the front wheel; ballast of 2.02 kg at the rear contact"),
        (-0.3, "pitches over the rear wheel; ballast of 1.98 kg at the front contact"),
        (0.5, "stands on both wheels"),
    ],
)
def test_a_bicycle_that_pitches_over_is_told_its_ballast(x_B, words):
    """x_B = -0.3 m: -10·0.3 + 1.02 = -1.98 kg m about the rear contact."""
    assert balance(solved(x_B=x_B)).startswith(words)


@pytest.mark.parametrize(("x_B", "lifted"), [(0.998, "rear"), (-0.102, "front")])
def test_a_wheel_that_carries_nothing_is_named(x_B, lifted):
    """Moments 10·0.002 = 1·0.02 about the front contact; 10·0.102 = 1·1.02 about the rear one: 0 up to rounding."""
    assert f"the {lifted} wheel carries no load" in balance(solved(x_B=x_B))
    assert f"{lifted} wheel 0 N (0 %)" in line(str(solved(x_B=x_B)), "loads: front wheel ")


def test_a_stable_oscillation_has_decay_time_and_frequency():
    design = solved()
    text = line(design.report(), "motion: decay time ")
    rate = math.sqrt(9.81)
    assert f"decay time {-1 / (design.abscissa * rate):.4g} s" in text
    assert f"frequency {design.roots[0].im * rate / (2 * math.pi):.4g} Hz" in text
    assert "growth time" not in design.report()


def test_two_pairs_have_two_frequencies():
    """√3/2 and √15/2 √(g/w), in either order: their real parts are the same."""
    text = line(str(tmsopt.solve(tmsopt.Problem(tms, fixed=TWO_PAIRS))), "motion: decay time ")
    found = re.search(r"angular frequencies (\S+) and (\S+) √\(g/w\)", text)
    assert found
    assert sorted(found.groups()) == sorted(f"{math.sqrt(k) / 2:.4g}" for k in (3, 15))


def test_an_unstable_bicycle_has_a_growth_time():
    design = solved(v=2.0)
    report = design.report()
    assert f"growth time {1 / (design.abscissa * math.sqrt(9.81)):.4g} s" in report
    assert "decay time" not in report
    assert "as given; not stable" in report


def test_a_double_pair_has_one_frequency_and_EP4_none():
    """s = −1/2 ± i√3/2, twice: one frequency, √3/2. At EP4 nothing swings."""
    cep2 = tmsopt.solve(tmsopt.Problem(tms, fixed=CEP2))
    assert cep2.structure == "CEP2"
    assert "angular frequency 0.866 √(g/w); damping ratio 0.5" in line(cep2.report(), "motion: decay time ")
    assert line(str(tmsopt.solve("problems/ep4.toml")), "motion: decay time ").endswith("no oscillation")


def test_wheelbase_and_rear_mass_scale_a_dimensionless_design():
    """Twice the length: lengths ×2, speeds ×√2; three times the mass: loads ×3."""
    design = tmsopt.solve(tmsopt.load("problems/ep4.toml"))
    small, large = full(design, 1.0, 1.0), full(design, 2.0, 3.0)
    for symbol, factor in (("x_B", 2), ("u_H", 2), ("x_T", 2), ("v", 2**0.5), ("v_c", 2**0.5), ("N_F", 3), ("N_R", 3)):
        assert read(large, symbol)[0] == pytest.approx(factor * read(small, symbol)[0], rel=1e-10)
    shown = to_text(document_of(design, si=convert_to_si(design, 2.0, 3.0)))
    assert ["chi_B", "1.4142", "x_B = 2.8284 m"] in rows(shown)  # 2 √2
    assert "ballast of 0.4142 m_B" in " ".join(design.report().split())  # √2 − 1: chi_H = 1 has no part in it


def test_a_singular_mass_matrix_is_reported_all_the_same():
    """No front mass: a root at infinity, no time and no frequency, but loads."""
    fixed = {**BENCHMARK, "z_H": 0.0, "x_H": 1.0}
    design = tmsopt.solve(tmsopt.Problem(tms, fixed=fixed), throw=False)
    assert next(r[:2] for r in rows(full(design)) if r[0] == "mass_margin") == ["mass_margin", "0"]
    assert balance(design).startswith("pitches over the front wheel; ballast of 2 kg")
    data = design.to_json()["si"]
    assert (data["decay_time_s"], data["growth_time_s"], data["frequencies_Hz"]) == (None, None, [])
    json.dumps(data, allow_nan=False)


def test_a_bicycle_that_pitches_over_in_its_worst_case_is_said_to():
    """Moments about the front contact: m_B (w − x_B) against m_H (x_H − w), 1 against 0.75 kg m, and 0.25 with 15 kg less."""
    numbers = {"w": 0.6, "v": 5.0, "m_B": 20.0, "x_B": 0.55, "z_B": -0.3, "m_H": 5.0, "x_H": 0.75, "z_H": -0.4}
    problem = tmsopt.Problem(tms, fixed={**numbers, "lambda_s": -0.3})
    assert balance(tmsopt.solve(problem)) == "stands on both wheels"
    worst = tmsopt.solve(tmsopt.Problem(tms, fixed={**numbers, "lambda_s": -0.3}, tolerances={"m_B": 15.0}))
    text = balance(worst)
    needed = (0.75 - 0.25) / 0.6  # kg at the rear contact, a wheelbase from the front one
    assert text.startswith("pitches over the front wheel in the worst case")
    assert f"ballast of {needed:.4g} kg" in text


def test_laws_charts_and_traces_are_of_the_nominal_design():
    band = {"Fr": {"min": 1.2, "max": 2.4}}
    heights = {"chi_H": 1.0, "mu": 0.1, "zeta_B": -0.4, "zeta_H": -0.2}
    free = {"chi_B": (1.01, 3.0), "lambda_s": (0.05, 1.2)}
    asked = tmsopt.Problem(
        tms, fixed=heights, free=free, scenarios=band, tolerances={"chi_B": 0.01}, minimize="abscissa"
    )
    plain = tmsopt.Problem(tms, fixed={**heights, "Fr": 1.8}, free=free, minimize="abscissa")
    assert (asked.posed.nominal.scenarios, asked.posed.nominal.tolerances) == ({}, {})
    assert asked.posed.nominal.fixed == pytest.approx(plain.fixed, abs=1e-15)
    assert plain.posed.nominal is plain.posed
    assert tmsopt.compare(asked).design.abscissa == pytest.approx(tmsopt.solve(plain).abscissa, abs=1e-12)


def test_a_limit_without_a_value_is_named_without_an_amount():
    """As omega0 >= 0.3 has none at the edge of where omega0, negative wherever it is, exists."""
    design = tmsopt.solve("problems/ep4.toml")
    conflict = Relaxation(design.parameters, Table({"trail": math.inf}), ("trail",), Table({}))
    report = str(replace(design, status="infeasible", relaxation=conflict))
    assert "changes of limits" in report


@pytest.mark.slow
def test_a_radius_out_of_reach_says_how_near_a_design_comes():
    """What it says is the radius of the design that it shows, of another computation; 0.5 is far beyond it."""
    asked = tmsopt.load("problems/tolerant.toml")
    fixed = {**asked.fixed, "chi_B": 1.4, "lambda_s": 0.35}
    found = tmsopt.solve(
        replace(asked, fixed=fixed, free={"Fr": (0.5, 3.0)}, constraints={"stable": "radius >= 0.5"}), throw=False
    )
    report = " ".join(found.report().split())
    (said,) = re.findall(r"the nearest design found has radius = ([0-9.]+)", report)
    assert "does not cover the robustness radius" in report
    assert "--certify" not in report
    there = tmsopt.robustness(tmsopt.Problem(tms, fixed=dict(found.parameters), minimize="abscissa"))
    assert float(said) == pytest.approx(there.radius, rel=1e-3)


def test_what_a_report_needs_is_computed_once(monkeypatch):
    """Also for the page and the notebook; a pickled solution has it still."""
    room, calls = import_module("tmsopt.documents.analysis"), []
    for name in ("explain", "find_stability_margins", "stable_speeds"):
        made = getattr(room, name)
        monkeypatch.setattr(room, name, lambda *a, _n=name, _f=made, **k: (calls.append(_n), _f(*a, **k))[1])
    design = tmsopt.solve("problems/benchmark.toml")
    assert repr(design)
    assert not calls
    texts = {str(design), design.report(), str(pickle.loads(pickle.dumps(design)))}
    design._repr_html_()
    assert len(texts) == 1
    assert sorted(calls) == ["explain", "find_stability_margins", "stable_speeds"]
