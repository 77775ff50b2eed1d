"""Studies as a user meets them: rows that obey the laws, whoever solves them, and a command that can be stopped."""

import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import oracles
from helpers.places import PROBLEMS
from helpers.rows import assert_same, faults, row as row_of, stored
from threadpoolctl import threadpool_info, threadpool_limits

from tmsopt import laws
from tmsopt.cli import command_group as main
from tmsopt.evaluation import law_rows
from tmsopt.executor import Crash
from tmsopt.models import tms
from tmsopt.problem import Problem, load
from tmsopt.records import Table
from tmsopt.search import solve
from tmsopt.studies import (
    Row,
    RowTable,
    Solver,
    Study,
    batch_rows,
    load_study,
    monte_carlo,
    open_store,
    over_grid,
    read_results,
    run_study,
    solve_row,
    summarise,
)

EP4 = load("problems/ep4.toml")
HEIGHTS = {"zeta_B": [-0.4, -0.8], "zeta_H": [-0.2, -0.3, -0.35]}
GRID = over_grid(EP4, HEIGHTS, title="heights", report=["nu_H", "2*Fr"])

FILE = """
title = "heights"
[problem.parameters]
chi_H = 1.0
zeta_H = -0.2
zeta_B = -0.4
mu = 0.1
chi_B = { min = 1.01, max = 5 }
Fr = { min = 0.01, max = 10 }
lambda_s = { min = 0.02, max = 1.4 }
[problem.objective]
minimize = "abscissa"
[vary]
zeta_B = [-0.4, -0.8]
zeta_H = [-0.2, -0.3, -0.35]
"""


def command(*arguments):
    return CliRunner().invoke(main, ["study", *map(str, arguments)])


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "heights.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


# Rows


@pytest.mark.slow
def test_every_row_obeys_the_laws_of_ep4():
    found = run_study(GRID, workers=1)
    for row in found.rows:
        heights = dict(row.varied)
        assert row.status == "optimal"
        assert row.structure == "EP4"
        assert row.objective == row.abscissa == pytest.approx(laws.w01(**heights), rel=1e-12)
        assert row.reports["2*Fr"] == pytest.approx(2 * laws.frep4(**heights)[0], rel=1e-11)
        assert row.proven
        assert row.bound == pytest.approx(row.abscissa, rel=1e-12)
        assert row.laws.keys() >= {"w01", "chib1", "tls", "frep4", "epset"}
        assert max(abs(residual) for residual in row.laws.values()) < 1e-9  # coefficients are matched to 1e-10
    assert [row.number for row in found.rows] == list(range(6))
    assert (found.solved, dict(found.summary.counts)) == (6, {"optimal": 6})
    np.testing.assert_array_equal(found.column("varied.zeta_H"), [-0.2, -0.3, -0.35] * 2)
    np.testing.assert_array_equal(found.column("chi_B"), [row.parameters["chi_B"] for row in found.rows])
    np.testing.assert_array_equal(found.column("report.2*Fr"), 2 * found.column("Fr"))
    assert "Row(" not in repr(found)
    assert "did you mean 'chi_B'" in faults(found.column, "chi_b")


def test_failures_are_rows_with_a_cause():
    """One box is empty, one limit cannot be met (the trail of EP4 is 0.08), one row is as it should be."""
    problem = replace(EP4, constraints={"trail": "nu_H >= 0.02"})
    study = Study(problem, {"lambda_s.min": [0.02, 1.5, 0.02], "trail.limit": [0.02, 0.02, 50.0]})
    rows = run_study(study, workers=1).rows
    assert [row.status for row in rows] == ["optimal", "failed", "infeasible"]
    assert rows[0].cause == ""
    assert "lambda_s" in rows[1].cause
    assert "1.5" in rows[1].cause
    assert "trail" in rows[2].cause
    assert rows[2].violations["trail"] > 0
    told = summarise(rows)
    assert dict(told.counts) == {"optimal": 1, "infeasible": 1, "failed": 1}
    assert told.best == rows[0]
    assert sum(told.causes.values()) == 2


def test_a_row_that_breaks_the_program_is_a_row(monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError("of a bug")

    monkeypatch.setattr("tmsopt.studies.solving.solve", broken)
    rows = run_study(GRID, workers=1).rows
    assert {row.status for row in rows} == {"failed"}
    assert rows[0].cause == "ZeroDivisionError: of a bug"


def test_a_summary_of_rows_is_what_its_numbers_are_by_definition():
    """Rows that are made up: one of them unstable, three not solved for causes that differ in their numbers or not."""
    given = [(2.0, 1e-9), (1.0, -1e-3), (3.0, 1e-6), (7.0, 0.0)]
    made = [row_of(k, GRID, objective=v, abscissa=v - 6, laws=Table({"w01": law})) for k, (v, law) in enumerate(given)]
    study = over_grid(EP4, {"mu": [0.1] * 7})
    causes = ("a by 0.1", "a by 2e-05", "b by 3")
    made += [row_of(4 + k, study, status="infeasible", abscissa=math.nan, cause=c) for k, c in enumerate(causes)]
    told = summarise(RowTable(study, [batch_rows(made)]))
    assert (told.spread["objective"], told.spread["abscissa"]) == ((1.0, 2.5, 7.0), (-5.0, -3.5, 1.0))
    assert (told.best.number, told.stable, dict(told.laws)) == (1, 3, {"w01": 1e-3})
    assert dict(told.causes) == {"a": 2, "b by 3": 1}
    greatest = over_grid(replace(EP4, minimize=None, maximize="Fr"), {"mu": [0.1] * 7})
    assert summarise(RowTable(greatest, [batch_rows(made)])).best.number == 3


def test_calls_that_make_no_sense_are_refused():
    assert "accepted: a Study" in faults(run_study, EP4)
    for workers in (0, True, 1.5):
        assert "1 or more" in faults(run_study, GRID, workers=workers)


# Warm starts

TWO = Problem(
    model=tms,
    fixed={"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1, "chi_B": 1.4, "lambda_s": 0.4},
    free={"Fr": (0.0, 4.0)},
    minimize="min((Fr - 1)**2 + 0.1*mu, (Fr - 3)**2 + 0.1*(1 - mu))",
)
"""Two valleys, at Fr = 1 and 3; over mu the second overtakes the first at one half: least value 0.1 min(mu, 1 − mu)."""


THREE = "min((Fr - 0.5)**2 + 0.1*mu, min((Fr - 2)**2 + 0.03, (Fr - 3.5)**2 + 0.1*(1 - mu)))"
"""A third valley at Fr = 2, of least value 0.03, is the best from mu = 0.3 to 0.7 and nowhere else."""


@pytest.mark.parametrize(
    ("asked", "sign", "most"),
    [
        ({}, 1, 1.0),
        ({"minimize": THREE}, 1, 0.03),
        ({"minimize": None, "maximize": f"-({TWO.minimize})"}, -1, 1.0),
    ],
    ids=["overtaken by the far end", "found on the way and carried both ways", "hills"],
)
def test_the_best_valley_is_kept(asked, sign, most):
    """What is better follows the sense of the objective."""
    values = np.linspace(0.0, 1.0, 11).tolist()
    rows = run_study(over_grid(replace(TWO, **asked), {"mu": values}, warm=True), workers=1).rows
    assert sum(row.warm for row in rows) >= 6
    for row, mu in zip(rows, values, strict=True):
        assert sign * row.objective == pytest.approx(min(0.1 * mu, 0.1 * (1 - mu), most), abs=1e-12)
    best = summarise(rows).best
    assert best is not None
    assert best.objective == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
def test_warm_rows_are_the_same_alone_and_by_processes():
    study = over_grid(TWO, {"mu": np.linspace(0, 1, 24).tolist()}, warm=True)
    here = run_study(study, workers=1).rows
    assert_same(run_study(study, workers=2).rows, here)
    assert_same([solve_row(study, k).row for k in (0, 11, 23)], [here[k] for k in (0, 11, 23)])


def test_rows_without_a_design_are_not_solved_again_on_the_way_back(monkeypatch):
    """No design has Fr above 4: such rows are solved from many starts once each."""
    tried = Counter()
    original = Solver._solve_row

    def counting(self, number, neighbour=None, afar=0):
        if neighbour is None or neighbour.status != "optimal":
            tried[number] += 1
        return original(self, number, neighbour, afar)

    monkeypatch.setattr(Solver, "_solve_row", counting)
    problem = replace(TWO, constraints={"fast": "Fr >= 0"})
    study = over_grid(problem, {"fast.limit": [0.0, 1.0, 2.0, 5.0, 5.5, 6.0]}, warm=True)
    rows = run_study(study, workers=1).rows
    assert [row.status for row in rows] == ["optimal"] * 3 + ["infeasible"] * 3
    assert dict(tried) == {0: 1, 4: 1, 5: 1}


def test_a_block_stored_in_part_is_finished_and_only_what_lacks_is_added(tmp_path):
    study = over_grid(TWO, {"mu": np.linspace(0, 1, 6).tolist()}, warm=True)
    whole = run_study(study, workers=1).rows
    with open_store(tmp_path / "s.sqlite", study) as store:
        store.add(batch_rows(whole[:2]))
    resumed = run_study(study, tmp_path / "s.sqlite", workers=1)
    assert resumed.solved == 4
    assert_same(resumed.rows, whole)


class Crashing:
    """An executor whose workers die of row 3."""

    name = "2 processes"

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def map(self, function, items):
        for place, numbers in enumerate(items):
            yield place, Crash("signal 9") if 3 in numbers else function(numbers)


@pytest.mark.parametrize("warm", [False, True])
def test_a_row_that_ends_its_worker_costs_itself_alone(warm, monkeypatch, tmp_path):
    """Of a block of neighbours too, which is taken apart."""
    monkeypatch.setattr("tmsopt.studies.run.processes", lambda *_: Crashing())
    study = over_grid(TWO, {"mu": np.linspace(0, 1, 6).tolist()}, warm=warm)
    notes = []
    run_study(study, tmp_path / "s.sqlite", workers=2, note=notes.append)
    rows = read_results(study, tmp_path / "s.sqlite").rows
    assert [row.status for row in rows] == ["optimal"] * 3 + ["quarantined"] + ["optimal"] * 2
    assert rows[3].cause == "ended its worker twice (signal 9)"
    assert notes == ["row 3 is quarantined"]


# What a row is solved with, and what is said of all


@pytest.mark.slow
def test_a_row_is_solved_from_its_own_seed_with_the_starts_of_the_study_on_one_thread(
    monkeypatch,
):
    """Sums of several threads have other last digits, so that rows would depend on the machine."""
    seen = []

    def spied(problem, **options):
        assert {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"} <= {1}
        seen.append((options["seed"], options["starts"]))
        return solve(problem, **options)

    monkeypatch.setattr("tmsopt.studies.solving.solve", spied)
    study = over_grid(EP4, HEIGHTS, seed=5, starts=3)
    with threadpool_limits(2):  # more than one, wherever this runs
        run_study(study, workers=1)
    assert seen == [(study.seed_of(row), 3) for row in range(6)]


def test_a_row_tells_how_far_its_design_is_from_the_laws():
    """The residuals are those that `tmsopt compare` shows, each under a label of its own."""
    answer = solve_row(GRID, 4)
    assert answer.solution is not None
    applying = [law for law in law_rows(answer.solution) if law.applies]
    assert sorted(answer.row.laws.values()) == sorted(law.relative for law in applying)
    assert any(answer.row.laws.values())  # rounding leaves something to compare


# The command


@pytest.mark.slow
def test_the_command_solves_stores_and_shows_rows(file):
    first = command(file, "--workers", 1, "--json", "--export", "rows.csv")
    assert first.exit_code == 0
    told = json.loads(first.stdout)
    assert told["schema"] == 1
    assert told["counts"] == {"optimal": 6}
    assert [row["number"] for row in told["table"]] == list(range(6))
    assert told["run"]["rows_solved"] == 6
    assert told["best"]["objective"] == pytest.approx(
        min(laws.w01(b, h) for b in HEIGHTS["zeta_B"] for h in HEIGHTS["zeta_H"]), rel=1e-12
    )
    lines = Path("rows.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 7
    header, line = lines[0].split(","), lines[1].split(",")
    assert float(line[header.index("chi_B")]) == pytest.approx(math.sqrt(2), rel=1e-12)

    again = command(file)
    assert again.exit_code == 0
    assert "6 of 6 rows are in" in again.stderr
    assert "grid over zeta_B (2) × zeta_H (3): 6 rows; 6 optimal" in again.stdout

    row = command(file, "--row", 4, "--json")
    kept = read_results(load_study(file), "heights.sqlite").rows[4].to_json()
    solved = json.loads(row.stdout)
    assert_same([Row.from_json(solved)], [Row.from_json(kept)])
    assert solved["solution"]["parameters"] == pytest.approx(kept["parameters"], rel=1e-9)


def test_the_command_writes_no_file_twice_and_none_that_it_reads(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = 'problem = "other.toml"\n[study]\nmethod = "csv"\ncsv = "own.csv"\n'
    Path("own.csv").write_text("zeta_B\n-0.4\n", encoding="utf-8")
    shutil.copy(PROBLEMS / "ep4.toml", "other.toml")
    Path("rows.toml").write_text(text, encoding="utf-8")
    for words, said in [
        (("--store", "s.csv", "--export", "./s.csv"), "--export: 's.csv' is the file that --store writes"),
        (("--store", "s.html", "--report", "s.html"), "--report: 's.html' is the file that --store writes"),
        (("--export", "s.csv", "--export", "s.csv"), "--export: 's.csv' is the file that --export writes"),
        (("--export", "own.csv"), "--export: 'own.csv' is a file of the study"),
        (("--store", "other.toml"), "--store: 'other.toml' is a file of the study"),
    ]:
        refused = command("rows.toml", *words)
        assert (refused.exit_code, refused.stderr.strip()) == (2, f"{said}; give another name")
    assert Path("own.csv").read_text(encoding="utf-8") == "zeta_B\n-0.4\n"
    Path("rows.toml").write_text(text.replace("other", "{a}}"), encoding="utf-8")
    assert "rows.toml:1: problem: '{a}}.toml' no such file" in command("rows.toml").stderr


@pytest.mark.slow
def test_the_command_refuses_what_it_cannot_do(file):
    for words, said in [
        ((file, "--row", 6), "0 to 5"),
        ((PROBLEMS / "ep4.toml",), "is one problem, not a study"),
        ((file, "--export", "rows.xlsx"), ".parquet"),
        ((file, "--store", "nowhere/s.sqlite"), "nowhere"),
        (("absent.toml",), "no such file"),
        ((file, "--scheduler", "tcp://127.0.0.1:1", "--workers", 2), "--workers"),
        ((file, "--row", 1, "--export", "rows.csv", "--fresh"), "--fresh: has no effect with --row"),
    ]:
        refused = command(*words)
        assert refused.exit_code == 2
        assert said in refused.stderr
    assert [line.split(":")[0] for line in refused.stderr.splitlines()] == ["--fresh", "--export"]
    assert command(file, "--workers", 1).exit_code == 0
    file.write_text(FILE.replace("mu = 0.1", "mu = 0.2"), encoding="utf-8")
    changed = command(file)
    assert changed.exit_code == 2
    assert "mu" in changed.stderr
    assert "--fresh" in changed.stderr
    assert command(file, "--fresh", "--workers", 1).exit_code == 0


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
def test_an_interrupted_command_goes_on(file):
    """Ended once some rows are stored (killed: test_kills.py), then run again: those are there, and all are as if nothing was."""
    many = FILE.replace("zeta_H = [-0.2, -0.3, -0.35]", "zeta_H = { min = -0.35, max = -0.2, points = 18 }")
    file.write_text(many, encoding="utf-8")
    run = [sys.executable, "-m", "tmsopt", "study", str(file), "--workers", "2", "--json"]
    store = file.parent / "heights.sqlite"
    process = subprocess.Popen(run, cwd=file.parent, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while len(kept := stored(store)) < 5:
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    answer, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "the same command continues" in told
    assert "Traceback" not in told
    data = json.loads(answer)
    assert data["run"] == {"store": str(store), "rows_found": 0, "interrupted": True}
    assert kept <= {row["number"] for row in data["table"]}
    before = {row.number: row for row in read_results(load_study(file), store).rows}
    assert kept <= before.keys()
    assert len(before) < 36
    assert command(file, "--workers", 2).exit_code == 0
    rows = read_results(load_study(file), store).rows
    assert [row.number for row in rows] == list(range(36))
    assert all(rows[n] == row for n, row in before.items())  # seconds too: they were not solved again


@pytest.mark.parametrize("number", [2, -1])
def test_rows_that_a_study_cannot_have_are_refused(number, tmp_path):
    """In a store from somebody else: before anything is solved, and where its rows are shown."""
    study, path = over_grid("problems/ep4.toml", {"mu": [0.1, 0.2]}), tmp_path / "s.sqlite"
    with open_store(path, study) as store:
        store.add(batch_rows([Row(n, 1, Table({"mu": 0.2}), "failed") for n in (1, number)]))
    told = []
    refused = faults(read_results, study, path), faults(run_study, study, path, progress=told.append)
    assert all(f"row {number} does not belong to this study" in text for text in refused)
    assert {t.what for t in told} == {"waiting for the store", "reading the store"}


def test_what_a_row_says_is_printable(tmp_path):
    study = over_grid("problems/ep4.toml", {"mu": [0.1]})
    with open_store(tmp_path / "s.sqlite", study) as store:
        store.add(batch_rows([Row(0, 1, Table({"mu": 0.1}), "failed", cause="\x1b[31mred\u202e")]))
    assert "\ufffd[31mred\ufffd" in str(read_results(study, tmp_path / "s.sqlite"))


# By the clock

METRES = {"w": 1.0, "m_B": 10.0, "m_H": 1.0, "x_B": 1.3, "z_B": -0.4, "x_H": 1.01, "z_H": -0.2, "lambda_s": 0.2618}


def by_clock(row):
    """Eigenvalues of the oracle's polynomial times √(g/w)."""
    p = row.parameters
    w, rate = p["w"], np.sqrt(p["g"] / p["w"])
    lengths = (p[name] / w for name in ("x_B", "x_H", "z_B", "z_H"))
    a = oracles.polynomial_exact(p["v"] / (rate * w), p["m_H"] / p["m_B"], *lengths, np.tan(p["lambda_s"]))
    return float(np.roots([float(c) for c in a]).real.max() * rate)


def test_rows_are_ranked_by_the_clock():
    """On the moon it decays as fast per √(g/w), and the speed of the best design is in the box: not so on the earth."""
    problem = Problem(tms, METRES, {"v": (1, 6)}, minimize="abscissa")
    found = run_study(over_grid(problem, {"g": [1.62, 3.71, 9.81]}), workers=1)
    decays = [by_clock(row) for row in found.rows]
    assert int(np.argmin([row.abscissa for row in found.rows])) == 0
    assert found.summary.best.number == int(np.argmin(decays)) == 2
    least, median, most = found.summary.clocked["abscissa"]
    assert [least, median, most] == pytest.approx(sorted(decays), rel=1e-6)
    text = str(found)
    assert "abscissa 1/s" in text
    assert f"best: row 2, {decays[2]:.6g} 1/s" in text
    assert found.to_json()["spread"]["abscissa"]["min"] == min(row.abscissa for row in found.rows)


def test_quantiles_of_a_monte_carlo_are_by_the_clock():
    problem = Problem(tms, {**METRES, "g": 9.81, "v": 4.0}, minimize="abscissa")
    found = run_study(monte_carlo(problem, 41, tolerances={"w": 0.005}), workers=1)
    decays = sorted(by_clock(row) for row in found.rows)
    assert found.summary.clocked["quantiles"][2] == pytest.approx(decays[20], rel=1e-9)
    assert f"50 % {decays[20]:.6g}" in " ".join(str(found).split())
