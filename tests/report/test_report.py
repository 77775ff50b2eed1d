"""What the report of a design says, line by line, in words and in the units that a builder reads."""

import json
import math
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.designs import ROBOT

import tmsopt
from tmsopt.design import Relaxation, Solution
from tmsopt.models import tms
from tmsopt.records import Table
from tmsopt.report import solution_table

BENCHMARK = dict(tmsopt.load("problems/benchmark.toml").fixed)
CEP2 = {
    "Fr": 11 / 6, "mu": 0.1, "chi_B": 2.0, "chi_H": 1.0, "zeta_B": -2.0, "zeta_H": -0.5, "lambda_s": math.atan(11 / 12),
}  # fmt: skip
"""Equation copo gives a0 … a4 = (11/6)(1, 2, 3, 2, 1), that is (s² + s + 1)² up to a factor."""
TWO_PAIRS = {
    "Fr": 44 / 13, "mu": 0.1, "chi_B": 28 / 13, "chi_H": 1.0, "zeta_B": -1.0, "zeta_H": -0.25,
    "lambda_s": math.atan(528 / 169),
}  # fmt: skip
"""Likewise (s² + s + 1)(s² + s + 4)."""
LATERAL = "without any effect on the lateral motion"


def solved(**changes: float) -> Solution:
    """The benchmark bicycle in SI, with changes; nothing is free, so this is an evaluation."""
    return tmsopt.solve(tmsopt.Problem(tms, fixed={**BENCHMARK, **changes}))


def rows(report: str) -> list[list[str]]:
    """Cells of each line that belongs to a table."""
    return [re.split(r"\s{2,}", line.strip()) for line in report.splitlines() if line.startswith("  ")]


def read(report: str, symbol: str) -> tuple[float, str]:
    """Number and unit that follow a symbol in a table."""
    cells = next(row[row.index(symbol) :] for row in rows(report) if symbol in row)
    return float(cells[1]), cells[2]


def balance(report: str) -> str:
    lines = [line for line in report.splitlines() if line.startswith("balance: ")]
    assert len(lines) == 1
    return lines[0].removeprefix("balance: ")


def test_lengths_speeds_and_angles_read_as_they_were_written() -> None:
    report = solution_table(solved())
    expected = {
        "x_B": (1200, "mm"), "z_B": (-400, "mm"), "x_H": (1020, "mm"), "z_H": (-200, "mm"), "w": (1000, "mm"),
        "m_H": (1, "kg"), "m_B": (10, "kg"), "v": (4, "m/s"),
    }  # fmt: skip
    assert {symbol: read(report, symbol) for symbol in expected} == expected
    assert ["14.4", "km/h"] in rows(report)
    assert any(row[-3:] == ["5", "deg", "fixed"] for row in rows(report))


def test_loads_u_H_and_critical_speed_of_the_benchmark() -> None:
    """By hand: moments 10·0.2 + 1·0.02 kg m about the front contact, 13.02 about the rear one, of 11 kg."""
    report = solution_table(solved())
    assert ["load_front", "118.364 %", "N_F", "127.726", "N"] in rows(report)  # 13.02/11, 13.02 · 9.81
    assert ["load_rear", "-18.3636 %", "N_R", "-19.8162", "N"] in rows(report)  # -2.02/11
    u_H = 20 * math.cos(math.radians(5)) + 200 * math.sin(math.radians(5))
    assert read(report, "u_H") == (pytest.approx(u_H, rel=1e-11), "mm")
    assert read(report, "v_c") == (2.8410083, "m/s")  # 2.8410083233664, the number of the issue
    assert ["10.22763", "km/h"] in rows(report)
    margin = next(float(row[1]) for row in rows(report) if row[0] == "mass_margin")
    assert 0 < margin < 0.1 * (u_H / 1000) ** 2  # below M22, as a Rayleigh quotient


def test_a_bicycle_that_pitches_over_the_front_is_told_its_ballast() -> None:
    text = balance(solution_table(solved()))
    assert text.startswith("pitches over the front wheel; more than 2.02 kg (0.202 m_B) of ballast at the rear contact")
    assert text.endswith(LATERAL)


def test_a_bicycle_that_pitches_over_the_rear_is_told_its_ballast() -> None:
    """x_B = -0.3 m: -10·0.3 + 1.02 = -1.98 kg m about the rear contact."""
    text = balance(solution_table(solved(x_B=-0.3)))
    assert text.startswith("pitches over the rear wheel; more than 1.98 kg (0.198 m_B) of ballast at the front contact")
    assert text.endswith(LATERAL)


def test_a_bicycle_on_both_wheels() -> None:
    assert balance(solution_table(solved(x_B=0.5))) == "stands on both wheels"


@pytest.mark.parametrize(("x_B", "lifted"), [(0.998, "rear"), (-0.102, "front")])
def test_a_wheel_that_carries_nothing_is_named(x_B: float, lifted: str) -> None:
    """Moments 10·0.002 = 1·0.02 about the front contact; 10·0.102 = 1·1.02 about the rear one: 0 up to rounding."""
    report = solution_table(solved(x_B=x_B))
    assert f"the {lifted} wheel carries no load" in balance(report)
    assert [f"load_{lifted}", "0 %", f"N_{lifted[0].upper()}", "0", "N"] in rows(report)


def test_a_stable_oscillation_has_decay_time_and_frequency() -> None:
    design = solved()
    report = solution_table(design)
    rate = math.sqrt(9.81)
    assert read(report, "decay time") == (pytest.approx(-1 / (design.abscissa * rate), rel=1e-3), "s")
    assert read(report, "frequency") == (pytest.approx(design.roots[0].im * rate / (2 * math.pi), rel=1e-5), "Hz")
    assert "growth time" not in report


def test_two_pairs_have_two_frequencies() -> None:
    """√3/2 and √15/2 times √(g/w)/2π, in either order: their real parts are the same."""
    cells = [row[-2:] for row in rows(solution_table(tmsopt.solve(tmsopt.Problem(tms, fixed=TWO_PAIRS))))]
    expected = [[f"{math.sqrt(k * 9.81) / (4 * math.pi):.6g}", "Hz"] for k in (3, 15)]
    assert sorted(cell for cell in cells if cell[-1] == "Hz") == sorted(expected)


def test_an_unstable_bicycle_has_a_growth_time() -> None:
    design = solved(v=2.0)
    report = solution_table(design)
    assert read(report, "growth time") == (pytest.approx(1 / (design.abscissa * math.sqrt(9.81)), rel=1e-3), "s")
    assert "decay time" not in report


def test_a_double_pair_has_one_frequency_and_EP4_none() -> None:
    """s = −1/2 ± i√3/2, twice: one frequency, √3/2 · √(g/w)/2π. At EP4 nothing oscillates."""
    cep2 = tmsopt.solve(tmsopt.Problem(tms, fixed=CEP2))
    assert cep2.structure == "CEP2"
    cells = [row for row in rows(solution_table(cep2)) if "frequency" in row]
    assert cells == [["damping_ratio", "0.5", "frequency", f"{math.sqrt(0.75 * 9.81) / (2 * math.pi):.6g}", "Hz"]]
    ep4 = solution_table(tmsopt.solve(tmsopt.load("problems/ep4.toml")))
    assert [row for row in rows(ep4) if "frequency" in row] == [["damping_ratio", "1", "frequency", "none"]]


def test_wheelbase_and_rear_mass_scale_a_dimensionless_design() -> None:
    """Twice the length: lengths ×2, speeds and times ×√2; three times the mass: loads and ballast ×3."""
    design = tmsopt.solve(tmsopt.load("problems/ep4.toml"))
    small, large = solution_table(design), solution_table(design, 2.0, 3.0)
    for symbol, factor in (("x_B", 2), ("u_H", 2), ("x_T", 2), ("v", 2**0.5), ("v_c", 2**0.5), ("decay time", 2**0.5)):
        assert read(large, symbol)[0] == pytest.approx(factor * read(small, symbol)[0], rel=5e-4)
    for symbol in ("N_F", "N_R"):
        assert read(large, symbol)[0] == pytest.approx(3 * read(small, symbol)[0], rel=1e-5)
    assert "more than 0.4142 kg (0.4142 m_B)" in balance(small)  # √2 − 1: chi_H = 1 has no part in it
    assert "more than 1.243 kg (0.4142 m_B)" in balance(large)


def test_a_singular_mass_matrix_is_reported_all_the_same() -> None:
    """No front mass: a root at infinity, no time and no frequency, but loads."""
    fixed = {**BENCHMARK, "z_H": 0.0, "x_H": 1.0}
    design = tmsopt.solve(tmsopt.Problem(tms, fixed=fixed), throw=False)
    report = solution_table(design)
    assert ["mass_margin", "0"] in rows(report)
    assert balance(report).startswith("pitches over the front wheel; more than 2 kg")
    data = design.to_json()["si"]
    assert (data["decay_time_s"], data["growth_time_s"], data["frequencies_Hz"]) == (None, None, [])
    json.dumps(data, allow_nan=False)


FILE = (
    ROBOT
    % """ballast = "m_ballast_rear <= 2"
offset = "u_H >= 0.015"
inertia = "mass_margin >= 1e-4\""""
)


@pytest.mark.slow
def test_from_a_file_in_units_to_a_report_in_units(tmp_path: Path) -> None:
    """One file through the command line, as text and as JSON; v.max binds (a robot is steadier when faster)."""
    file = tmp_path / "robot.toml"
    file.write_text(FILE, encoding="utf-8")
    command = [
        sys.executable,
        "-c",
        "from tmsopt.cli import main; main()",
        "solve",
        str(file),
        "--starts",
        "6",
        "--brief",
    ]
    table, data = (
        subprocess.run([*command, *more], capture_output=True, text=True, timeout=120, check=True, encoding="utf-8")
        for more in ([], ["--json"])
    )
    si = json.loads(data.stdout)["si"]
    assert (table.stderr, data.stderr) == ("", "")
    assert si["w_mm"] == 800
    assert si["m_B_kg"] == 10
    assert si["v_kmh"] == pytest.approx(15, abs=1e-12)
    assert 5 <= si["lambda_s_deg"] <= 30
    assert si["m_ballast_rear_kg"] == pytest.approx(2, abs=1e-8)
    assert si["N_R_N"] == pytest.approx(-2 * 9.81, abs=1e-7)
    assert read(table.stdout, "w") == (800, "mm")
    assert ["15", "km/h"] in rows(table.stdout)
    assert "more than 2 kg (0.2 m_B) of ballast at the rear contact" in balance(table.stdout)


def test_a_bicycle_that_pitches_over_in_its_worst_case_is_said_to():
    """Moments about the front contact: m_B (w − x_B) against m_H (x_H − w), 1 against 0.75 kg m, and 0.25 with 15 kg less."""
    numbers = {"w": 0.6, "v": 5.0, "m_B": 20.0, "x_B": 0.55, "z_B": -0.3, "m_H": 5.0, "x_H": 0.75, "z_H": -0.4}
    problem = tmsopt.Problem(tms, fixed={**numbers, "lambda_s": -0.3})
    assert balance(solution_table(tmsopt.solve(problem))) == "stands on both wheels"
    worst = tmsopt.solve(tmsopt.Problem(tms, fixed={**numbers, "lambda_s": -0.3}, tolerances={"m_B": 15.0}))
    line = balance(solution_table(worst))
    needed = (0.75 - 0.25) / 0.6  # kg at the rear contact, a wheelbase from the front one
    assert line.startswith("pitches over the front wheel in the worst case")
    assert f"more than {needed:.4g} kg" in line


def test_laws_charts_and_traces_are_of_the_nominal_design():
    band = {"Fr": {"min": 1.2, "max": 2.4}}
    heights = {"chi_H": 1.0, "mu": 0.1, "zeta_B": -0.4, "zeta_H": -0.2}
    free = {"chi_B": (1.01, 3.0), "lambda_s": (0.05, 1.2)}
    asked = tmsopt.Problem(
        tms, fixed=heights, free=free, scenarios=band, tolerances={"chi_B": 0.01}, minimize="abscissa"
    )
    plain = tmsopt.Problem(tms, fixed={**heights, "Fr": 1.8}, free=free, minimize="abscissa")
    assert (asked.nominal.scenarios, asked.nominal.tolerances) == ({}, {})
    assert asked.nominal.fixed == pytest.approx(plain.fixed, abs=1e-15)
    assert plain.nominal is plain
    assert tmsopt.compare(asked).design.abscissa == pytest.approx(tmsopt.solve(plain).abscissa, abs=1e-12)


def test_a_limit_without_a_value_is_named_without_an_amount() -> None:
    """As omega0 >= 0.3 has none at the edge of where omega0, negative wherever it is, exists."""
    design = tmsopt.solve("problems/ep4.toml")
    conflict = Relaxation(design.parameters, Table({"trail": math.inf}), ("trail",), Table({}))
    report = solution_table(replace(design, status="infeasible", relaxation=conflict))
    assert re.search(r"smallest relaxation found: trail \(.*\), which has no value there", report)
