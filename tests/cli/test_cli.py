"""The command line by its contract: streams, exit status, JSON, figures; in a process of its own where that matters."""

import csv
import json
import math
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from helpers.commands import tmsopt
from helpers.terminal import on_a_terminal

KEYS = (
    "schema title model status objective parameters abscissa abscissa_realised roots structure active violations bound "
    "starts seconds"
)
"""Keys of the JSON contract."""


def test_json_of_solve_is_the_contract():
    done = tmsopt("solve", "problems/ep4.toml", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    data = json.loads(done.stdout)
    assert set(data) >= {*KEYS.split()}
    assert data["schema"] == 1
    assert data["status"] == "optimal"
    assert data["objective"] == {"sense": "minimize", "expression": "abscissa", "value": data["abscissa"]}
    assert set(data["parameters"]) == {"Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s"}
    assert data["parameters"]["chi_B"] == pytest.approx(math.sqrt(2), abs=1e-12)  # Table 1 of the paper
    roots = {"re": data["abscissa"], "im": 0.0, "multiplicity": 4, "defective": True, "geometric_multiplicity": 1}
    assert data["roots"] == [roots]
    assert data["structure"] == "EP4"
    assert data["bound"]["proven"] is True
    assert data["bound"]["method"] == "omega0"
    assert set(data["starts"]) == {"tried", "converged", "at_best", "expected_unseen"}


def test_table_of_solve_shows_both_scales(run):
    status, out, err = run("solve", "problems/ep4.toml", "--wheelbase", "2 m")
    assert (status, err) == (0, "")
    assert "1.4142  " in out  # chi_B
    assert "x_B = 2.8284 m" in out  # chi_B w
    assert "23.53 deg" in out  # the tilt, atan(15/4 - 75 sqrt(2)/32) = 23.5300893
    assert "optimal (proved)" in out


def test_benchmark_prints_the_published_critical_speed(run):
    _, out, _ = run("solve", "problems/benchmark.toml", "--full")
    assert "2.84100832337" in out
    assert "0.907064149551" in out


@pytest.mark.slow
def test_compare_shows_laws_and_formulations():
    done = tmsopt("compare", "problems/ep4.toml", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    data = json.loads(done.stdout)
    laws = {row["label"]: row for row in data["laws"]}
    assert all(laws[label]["agrees"] for label in ("w0", "chib", "tls", "frep4", "epset", "flus", "chib1"))
    assert max(abs(d) for d in data["formulations"]["differences"].values()) < 1e-12


INFEASIBLE = """
[parameters]
chi_H = 1.0
zeta_H = -0.2
zeta_B = -0.4
mu = 0.1
chi_B = { min = 1.01, max = 5 }
Fr = 2.0
lambda_s = 0.4
[objective]
minimize = "abscissa"
[constraints]
low = "chi_B <= 1.2"
high = "chi_B >= 1.5"
"""


def test_infeasible_ends_with_3_and_still_reports(tmp_path, run):
    path = tmp_path / "x.toml"
    path.write_text(INFEASIBLE)
    status, out, _ = run("solve", path, "--json")
    data = json.loads(out)
    assert (status, data["status"]) == (3, "infeasible")
    assert data["violations"]
    assert data["parameters"]["Fr"] > 0
    status, out, _ = run("solve", path)
    assert status == 3
    assert "violated" in out


@pytest.mark.parametrize(
    "arguments",
    [
        ["solve"],
        ["solve", "nothing.toml"],
        ["solve", "."],
        ["solv", "problems/ep4.toml"],
        ["solve", "problems/ep4.toml", "--starts", "0"],
        ["solve", "problems/ep4.toml", "--linear-solver", "ma27"],
        ["solve", "problems/ep4.toml", "--plot", "x.bmp"],
        ["solve", "problems/ep4.toml", "--plot", "no/such/x.png"],
        ["solve", "problems/ep4.toml", "--wheelbase", "3 kg"],
        ["solve", "problems/ep4.toml", "--wheelbase", "-1"],
        ["compare", "pyproject.toml"],
    ],
)
def test_bad_usage_ends_with_2_and_one_message(arguments, run):
    status, out, err = run(*arguments)
    assert status == 2
    assert out == ""
    assert err.strip()
    assert "Traceback" not in err


PICTURES = {
    "speeds": "speeds problems/whipple_benchmark.toml",
    "prove": "prove problems/ep4.toml",
    "compare": "compare problems/ep4.toml",
    "all": "solve problems/ep4_matching.toml --all",
    "verify": "verify --only tab1-*",
    "diagnose": "diagnose problems/ep4.toml",
}
"""Commands whose result has a picture, beside those tested elsewhere."""


@pytest.mark.parametrize(
    "name", ["speeds", *(pytest.param(n, marks=pytest.mark.slow) for n in PICTURES if n != "speeds")]
)
def test_every_result_with_a_picture_is_drawn(name, tmp_path, run):
    path = tmp_path / "picture.png"
    status, out, err = run(*PICTURES[name].split(), "--plot", path)
    assert (status, err) == (0, f"wrote {path}\n")
    assert out
    assert path.read_bytes().startswith(b"\x89PNG")


def test_diagnose_says_how_each_multiple_root_splits(run):
    status, out, err = run("diagnose", "problems/ep4.toml", "--json")
    data = json.loads(out)
    assert (status, err, data["schema"], data["status"]) == (0, "", 1, "optimal")
    (root,) = data["diagnoses"]
    assert (root["algebraic"], root["geometric"]) == (4, 1)
    (eigenvalue,) = data["eigenvalues"]
    assert eigenvalue["multiplicity"] == 4
    for entry in (root, eigenvalue):  # infinite numbers are null
        assert (entry["phase_rigidity"], entry["petermann"], entry["condition"]) == (0, None, None)


def test_diagnose_of_simple_roots_says_so(run, tmp_path):
    words = "diagnose", "problems/whipple_benchmark.toml"
    data = json.loads(run(*words, "--json")[1])
    assert data["diagnoses"] == []
    assert [s["multiplicity"] for s in data["eigenvalues"]] == [1, 1, 1, 1]
    assert all(s["petermann"] == pytest.approx(s["phase_rigidity"] ** -2, rel=1e-8) for s in data["eigenvalues"])
    status, out, err = run(*words, "--plot", tmp_path / "none.png")
    assert (status, len(err.splitlines())) == (0, 1)
    assert "no root is multiple" in out
    assert "Petermann factor" in out
    assert list(tmp_path.iterdir()) == []


def test_diagnose_over_a_parameter_writes_petermann_factors(run, tmp_path):
    words, table, figure = ("diagnose", "problems/loss_only_dimer.toml"), tmp_path / "k.csv", tmp_path / "k.png"
    status, _, err = run(*words, "--over", "k", "--csv", table, "--plot", figure)
    assert (status, err) == (0, f"wrote {table}\nwrote {figure}\n")
    with table.open(encoding="utf-8", newline="") as stream:
        rows = [{name: float(x) for name, x in row.items()} for row in csv.DictReader(stream)]
    data = json.loads(run(*words, "--over", "k", "--json")[1])["over"]
    assert [[row["petermann_1"], row["petermann_2"]] for row in rows] == data["petermann"]
    status, out, err = run(*words, "--csv", table)
    assert (status, out) == (2, "")
    assert "--csv: writes Petermann factors" in err


@pytest.mark.parametrize("ending", ["png", *(pytest.param(e, marks=pytest.mark.slow) for e in ("pdf", "svg"))])
def test_plot_is_written_whole(tmp_path, ending, run):
    path = tmp_path / f"growth.{ending}"
    assert run("solve", "problems/ep4.toml", "--plot", path)[0] == 0
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    start = path.read_bytes()[:200]
    assert start.startswith({"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}[ending])


def test_plot_that_cannot_be_written_leaves_nothing(tmp_path, run):
    assert run("solve", tmp_path / "missing.toml", "--plot", tmp_path / "x.png")[0] == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_script_in_problems_runs():
    done = subprocess.run(
        [sys.executable, "problems/heights.py"], capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout.splitlines()) >= 5
    assert Path("problems/heights.py").read_text().startswith('"""')


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is always full")
def test_an_answer_that_cannot_be_written_is_no_traceback():
    command = [sys.executable, "-c", "from tmsopt.cli import main; main()", "figure", "--list"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=120, check=False)
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["ep4.toml", "--over", "Fr"],
            "--over: is the horizontal axis of --plot; add --plot FILE, or leave the option out\n",
        ),
        (
            ["pareto.toml", "--over", "Fr", "--plot", "front.png"],
            "--over: is for one design, and the file asks for a front",
        ),
        (["pareto.toml", "--points", "9999999999"], "9999999999 is not in the range 2<=x<=10000"),
    ],
)
def test_what_would_have_no_effect_or_no_end_is_refused(run, words, said):
    status, out, err = run("solve", f"problems/{words[0]}", *words[1:])
    assert (status, out) == (2, "")
    assert said in err


@pytest.mark.parametrize("option", ["--certify", "--full", "--wheelbase=2", "--rear-mass=3"])
def test_all_designs_are_not_one(run, option):
    code, out, err = run("solve", "problems/ep4_matching.toml", "--all", option)
    assert (code, out) == (2, "")
    assert f"{option.partition('=')[0]}: is for one design, and --all finds all designs" in err


MACHINE = """
model = "tms"

[parameters]
v = 1.98
m_B = 9.6
m_H = 3.45
w = 0.25
x_B = { min = 0.03, max = 0.4 }
x_H = { min = 0.15, max = 0.36 }
z_B = { min = -0.35, max = -0.06 }
z_H = -0.0978
lambda_s = { min = -0.6, max = 0.6 }

[objective]
minimize = "abscissa"

[constraints]
front = "N_F <= 175.0"
arm = "x_H - x_B >= -0.039"
"""
"""Its steer arm may vanish: a search of many seconds."""

"""Slower than it capsizes."""


@pytest.mark.skipif(os.name != "posix", reason="terminals and signals of POSIX")
@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_leaves_the_best_so_far_once_progress_shows(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(MACHINE)
    seen = on_a_terminal(["solve", str(path), "--json", "--full"], tmp_path, stop=" starts")
    assert seen.status == 130
    data = json.loads(seen.answer)
    assert (data["status"], data["interrupted"], data["violations"]) == ("not_converged", True, {})
    assert any("the user stopped the search after" in note for note in data["notes"])
    at = data["parameters"]
    assert at["x_H"] - at["x_B"] >= -0.039 * (1 + 1e-9)
    assert 9.81 * (9.6 * at["x_B"] + 3.45 * at["x_H"]) / 0.25 <= 175 * (1 + 1e-9)  # N_F: moments about the rear contact
    roots = np.roots([data["quantities"][f"a{k}"] for k in range(5)])
    assert data["objective"]["value"] == pytest.approx(roots.real.max(), rel=1e-6)


def test_a_second_one_or_an_early_one_ends_with_130(monkeypatch, run):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(import_module("tmsopt.search.solve"), "search_part", stop)
    monkeypatch.setattr(import_module("tmsopt.search.solve"), "_find_best_so_far", stop)
    for command in ("solve", "prove", "compare", "speeds"):
        status, out, err = run(command, "problems/ep4.toml")
        assert (status, out, err) == (130, "", "stopped; all text printed before is valid\n")


def test_the_rows_of_a_study_are_written_in_blocks_as_they_would_be_at_once(run, tmp_path, monkeypatch):
    answers = import_module("tmsopt.cli.answers")
    text = 'problem = "{}"\n[study]\nmethod = "monte_carlo"\nrows = 7\n[tolerances]\nmu = 0.01\n'
    (tmp_path / "s.toml").write_text(text.format(Path("problems/ep4.toml").resolve()))
    written = []
    for size in (3, 100):
        monkeypatch.setattr(answers, "_ROWS_PER_WRITE", size)
        code, out, _ = run("study", tmp_path / "s.toml", "--json", "--store", tmp_path / "s.sqlite")
        assert code == 0
        written.append(json.loads(out))
        assert out == json.dumps(written[-1], indent=2, ensure_ascii=False) + "\n"
    assert written[0]["table"] == written[1]["table"]
    assert [row["number"] for row in written[0]["table"]] == list(range(7))
