"""What ends a command from outside: signals at any moment, streams that take no more, surroundings of every kind."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import pytest

from tmsopt.global_search import SCIP
from tmsopt.killable import KillableProcess

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="signals and shells of POSIX"),
    pytest.mark.usefixtures("interruptible"),
]

commands = import_module("tmsopt.cli.commands").command_group.commands
ending = import_module("tmsopt.cli.ending")
answers = import_module("tmsopt.cli.answers")

STOPPED = "stopped; all text printed before is valid\n"
LONG = 20.0  # seconds, of which a test that passes waits for none
SOON = 2.0  # seconds in which a command ends
ONCE, TERM = [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)], (signal.SIGTERM, 143)

BOX = """
[parameters]
Fr = { min = 0.1, max = 2 }
mu = 0.1
chi_B = 1.2
chi_H = 1.0
zeta_B = -0.4
zeta_H = -0.2
lambda_s = 0.4
[objective]
minimize = "(Fr - 1)**2"
"""
"""Solved at once, and with no bound in closed form."""


def at_work(monkeypatch, work):
    """Have `tmsopt schema` do this."""
    monkeypatch.setattr(commands["schema"], "callback", lambda **_: work())


def box(folder):
    (folder / "box.toml").write_text(BOX, encoding="utf-8")
    return folder / "box.toml"


def press(number=signal.SIGINT):
    os.kill(os.getpid(), number)


@pytest.mark.parametrize(("number", "status"), ONCE)
def test_a_signal_ends_with_its_status(run, monkeypatch, number, status):
    def work():
        press(number)
        time.sleep(LONG)

    before = signal.getsignal(number)
    at_work(monkeypatch, work)
    assert run("schema") == (status, "", STOPPED)
    assert signal.getsignal(number) is before


def test_an_exec_that_is_interrupted_changes_no_status(tmp_path):
    """Run by -m, Python ends by SIGINT after one, such as those of dataclasses, whatever was made of the interrupt."""
    work = "import os, signal, time; os.kill(os.getpid(), signal.SIGTERM); time.sleep(9)"
    program = f"""
from importlib import import_module
from tmsopt.cli import main
import_module("tmsopt.cli.commands").command_group.commands["schema"].callback = lambda **_: exec({work!r})
main()
"""
    (tmp_path / "program.py").write_text(program, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[2])])
    done = subprocess.run(
        [sys.executable, "-m", "program", "schema"],
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (143, "", STOPPED)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM])
def test_handlers_wait_for_ipopt(number):
    """CasADi would take what they raise for a failed evaluation."""
    heard = []
    before = signal.signal(number, lambda *_: heard.append("handler"))
    try:
        with import_module("tmsopt.program.ipopt").delay_signals():
            press(number)
            time.sleep(0)
            heard.append("solved")
    finally:
        signal.signal(number, before)
    assert heard == ["solved", "handler"]


def test_a_signal_that_is_ignored_stays_so(run, monkeypatch):
    """As by nohup, and for what a script runs in the background."""
    monkeypatch.setattr(commands["schema"], "callback", lambda **_: press(signal.SIGHUP))
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert run("schema") == (0, "", "")
    finally:
        signal.signal(signal.SIGHUP, before)


def test_the_status_is_that_of_the_signal_whatever_was_made_of_it(run, monkeypatch):
    def work():
        try:
            press()
            time.sleep(LONG)
        except KeyboardInterrupt:
            sys.exit(3)

    at_work(monkeypatch, work)
    assert run("schema") == (130, "", "")


def test_an_interrupt_that_would_be_lost_comes_again(run, monkeypatch):
    """Python reports what a destructor raises, and goes on."""

    class Last:
        def __del__(self):
            press()
            time.sleep(0)

    def work():
        Last()
        time.sleep(LONG)

    at_work(monkeypatch, work)
    assert run("schema") == (130, "", STOPPED)


def test_an_interrupt_waits_for_compiled_modules(run, monkeypatch):
    """While one is loaded it would come out as an ImportError."""

    def create_module():
        try:
            press()
            time.sleep(0.05)
        except KeyboardInterrupt:
            raise ImportError("initialization failed") from None

    def work():
        create_module()
        time.sleep(LONG)

    monkeypatch.setattr(ending, "_LOADERS", {create_module.__code__})
    at_work(monkeypatch, work)
    assert run("schema") == (130, "", STOPPED)


def test_an_interrupt_is_not_lost_in_casadi(run, monkeypatch):
    """Its compiled code asks an argument what it is, and drops what is raised then."""

    class Number:
        presses = iter([press])

        def __DM__(self):
            next(self.presses, int)()
            return ca.DM(1)

    at_work(monkeypatch, lambda: (ca.DM(Number()), time.sleep(LONG)))
    assert run("schema") == (130, "", STOPPED)


def test_a_second_one_ends_what_the_first_has_left(run, monkeypatch):
    gone = []

    def work():
        try:
            press()
            time.sleep(LONG)
        except KeyboardInterrupt:
            try:
                press(signal.SIGTERM)
                time.sleep(LONG)
            except KeyboardInterrupt:
                pytest.fail("the second one is no invitation to leave something")

    monkeypatch.setattr(ending.Signals, "_exit_soon", lambda self: gone.append(self.status))
    monkeypatch.setattr(ending, "_REPEAT_SECONDS", 0.0)
    at_work(monkeypatch, work)
    assert run("schema") == (130, "", "")
    assert gone == [130]


def test_one_that_is_told_twice_at_once_is_one(run, monkeypatch):
    """As timeout(1) tells it to its command, and to the group of that."""

    def work():
        try:
            press(signal.SIGTERM)
            time.sleep(LONG)
        except KeyboardInterrupt:
            press(signal.SIGTERM)
            print("the best so far")
            raise

    at_work(monkeypatch, work)
    assert run("schema") == (143, "the best so far\n", STOPPED)


def test_an_answer_in_hand_is_written_as_a_whole(run, monkeypatch):
    def data():
        press()
        return {"numbers": [*range(1000)]}

    def work():
        answers.answer(True, "", data)
        time.sleep(LONG)

    at_work(monkeypatch, work)
    status, out, err = run("schema")
    assert (status, json.loads(out), err) == (130, {"numbers": [*range(1000)]}, STOPPED)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), TERM])
def test_proofs_leave_what_is_proved(run, monkeypatch, number, status):
    """Of all designs; branch and prune is at its first box."""
    module = import_module("tmsopt.global_search.completeness")
    monkeypatch.setattr(module, "prune", lambda *_: (press(number), time.sleep(LONG)))
    ended, out, _ = run("solve", "problems/ep4_matching.toml", "--all", "--json")
    assert (ended, json.loads(out)["completeness"]["complete"]) == (status, False)


@pytest.mark.skipif(not SCIP.is_available, reason="SCIP is not installed")
@pytest.mark.parametrize("where", ["tmsopt.global_search.race SolverPool.race", "tmsopt.proofs.certify find_exclusion"])
def test_a_proof_that_is_stopped_leaves_the_design(run, monkeypatch, where, tmp_path):
    """While SCIP is at work, and while a question to it is made."""
    module, _, name = where.partition(" ")
    at, _, last = name.rpartition(".")
    owner = import_module(module)
    monkeypatch.setattr(getattr(owner, at, owner), last, lambda *_: (press(), time.sleep(LONG)))
    status, out, _ = run("solve", box(tmp_path), "--certify", "--json")
    data = json.loads(out)
    assert (status, data["interrupted"], data["status"]) == (130, True, "optimal")
    assert "the proof was interrupted" in data["notes"]


@pytest.mark.slow
def test_what_is_said_beside_a_design_may_be_stopped(run, monkeypatch):
    monkeypatch.setattr(
        import_module("tmsopt.documents.analysis"), "explain", lambda *_, **__: (press(), time.sleep(LONG))
    )
    status, out, err = run("solve", "problems/ep4.toml")
    assert (status, err) == (130, "")
    assert "four roots coincide (EP4)" in out


@pytest.mark.skipif(not SCIP.is_available, reason="SCIP is not installed")
def test_what_a_global_solver_raises_is_heard(run, monkeypatch, tmp_path):
    race = import_module("tmsopt.global_search.race")
    process = KillableProcess()
    try:
        failed = process.call(math.sqrt, SimpleNamespace())
        assert str(failed.exception()) == "must be real number, not types.SimpleNamespace"
    finally:
        process.end()
    monkeypatch.setattr(race.SolverPool, "race", lambda *_: race._collect_decisions([failed]))
    status, out, _ = run("solve", box(tmp_path), "--certify")
    assert status == 0
    assert "note: SCIP failed: TypeError: must be real number" in " ".join(out.split())


@pytest.mark.parametrize("word", ["a\0b.toml", "\ud800.toml"])
@pytest.mark.parametrize("words", ["describe {}", "new {}", "study {}", "verify --markdown {}", "figure x --output {}"])
def test_words_that_are_no_names_of_files(run, words, word):
    status, out, err = run(*(w.format(word) for w in words.split()))
    assert (status, out) == (2, "")
    assert f"found {word!r}; accepted: words without NUL" in err


def test_a_figure_has_a_name(run):
    status, out, err = run("figure", "")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "missing; accepted: bicycle" in err


# Commands in processes of their own

PROBLEMS = Path("problems").resolve()
CHEAP = {"figures": "figure --list"}
WORDS = CHEAP | {
    "version": "--version",
    "help": "solve --help",
    "new": "new x.toml",
    "example": "example ep4",
    "describe": f"describe {PROBLEMS}/ep4.toml --json",
    "schema": "schema",
    "solve": f"solve {PROBLEMS}/ep4.toml --plot out/g.png",
    "front": f"solve {PROBLEMS}/pareto.toml --points 3 --starts 1 --csv out/f.csv --plot out/f.svg",
    "all": f"solve {PROBLEMS}/ep4_matching.toml --all --seconds 3 --json",
    "compare": f"compare {PROBLEMS}/ep4.toml",
    "prove": f"prove {PROBLEMS}/ep4.toml",
    "speeds": f"speeds {PROBLEMS}/whipple_benchmark.toml",
    "simulate": f"simulate {PROBLEMS}/whipple_benchmark.toml --csv out/m.csv --plot out/m.pdf",
    "trace": f"trace {PROBLEMS}/off_law.toml --csv out/t.csv --plot out/t.pdf",
    "encircle": f"encircle {PROBLEMS}/loss_only_dimer.toml --starts 1 --plot out/l.png",
    "sheets": f"sheets {PROBLEMS}/loss_only_dimer.toml --grid 9x9 --csv out/z.csv --plot out/z.png",
    "chart": f"chart {PROBLEMS}/chart.toml --points 30x20 --plot out/c.png --output out/c.npz",
    "folder": f"chart {PROBLEMS}/chart.toml --points 30x20 --output out/c.chart",
    "study": f"study {PROBLEMS}/study_decay.toml --store out/s.sqlite --export out/r.csv --workers 2",
    "figure": "figure root-locus --output out/r.png",
    "verify": "verify --only 'tab1-*' --markdown out/v.md",
}
SILENT = {"new", "example", "figure"}  # write nothing to stdout
STREAMS = {
    "full": (">/dev/full", 2),
    "closed": (">&-", 2),
    "nobody reads": ("| true", 141),
    "one line": ("| head -1", (0, 141)),
    "no stdin": ("<&-", 0),
    "no stderr": ("2>&-", 0),
    "full stderr": ("2>/dev/full", 0),
    "only stdout": ("2>&- <&-", 0),
}
"""What follows a command in a shell, and its status then, if it writes to stdout."""

SURROUNDINGS = {
    "backend": {"MPLBACKEND": "nonsense"},
    "no home": {"HOME": "/nonexistent", "MPLCONFIGDIR": "/dev/null/x"},
    "no temporaries": {"TMPDIR": "/nonexistent"},
    "plain": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    "ascii": {"PYTHONIOENCODING": "ascii"},
    "narrow": {"COLUMNS": "1"},
    "nonsense": {"COLUMNS": "x", "LINES": "-1"},
    "dumb": {"TERM": "dumb", "NO_COLOR": "1"},
}


SURROUNDINGS["all"] = {name: value for variables in SURROUNDINGS.values() for name, value in variables.items()}


def shell(line, folder, **variables):
    """Status of the first program of a pipe, stdout, stderr."""
    (folder / "out").mkdir(exist_ok=True)
    program = f'{sys.executable} -c "from tmsopt.cli import main; main()"'
    text = f"{line.replace('tmsopt', program, 1)}\necho ${{PIPESTATUS[0]}} > '{folder}/status'"
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])} | variables
    done = subprocess.run(
        ["bash", "-c", text], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert leftovers(folder) == []
    return int((folder / "status").read_text()), done.stdout, done.stderr


def leftovers(folder):
    """Temporary files, and locks but that of the folder of a chart, which stays in it."""
    files = (p for p in folder.rglob("*") if p.name.startswith(".tmsopt-") or p.suffix == ".lock")
    return [p for p in files if p.name != "chart.lock"]


def pairs(every, chosen):
    """Cheap commands with all there is, at once; the others with what tells most, among the long tests."""
    rest = [name for name in WORDS if name not in CHEAP]
    return [(name, other) for name in CHEAP for other in every] + [
        pytest.param(name, other, marks=pytest.mark.long) for name in rest for other in chosen
    ]


@pytest.mark.parametrize(("name", "stream"), pairs(STREAMS, ["full", "nobody reads", "only stdout"]))
def test_streams_that_take_nothing(name, stream, tmp_path):
    end, accepted = STREAMS[stream]
    status, _, err = shell(f"tmsopt {WORDS[name]} {end}", tmp_path)
    assert status in ((0,) if name in SILENT else accepted if isinstance(accepted, tuple) else (accepted,))
    said = [line for line in err.splitlines() if not line.startswith("wrote ")]
    assert len(said) == (1 if status == 2 else 0), err


@pytest.mark.parametrize(("name", "where"), pairs(SURROUNDINGS, ["all"]))
def test_surroundings_of_every_kind(name, where, tmp_path):
    status, out, err = shell(f"tmsopt {WORDS[name]}", tmp_path, **SURROUNDINGS[where])
    assert status == 0
    assert bool(out) is (name not in SILENT)
    assert [line for line in err.splitlines() if not line.startswith("wrote ")] == []
    if "--json" in WORDS[name]:
        json.loads(out)


REFUSED = {
    "a folder that is gone": "mkdir gone; cd gone; rmdir ../gone; tmsopt new x.toml",
    "no folder for files": "tmsopt new /proc/x.toml",
    "a figure": "tmsopt figure root-locus --output /proc/x.png",
    "a chart": f"tmsopt chart {PROBLEMS}/chart.toml --points 9x9 --output /proc/c.chart",
    "arrays": f"tmsopt chart {PROBLEMS}/chart.toml --points 9x9 --output /proc/c.npz",
    "a store": f"tmsopt study {PROBLEMS}/study_decay.toml --store /proc/s.sqlite",
    "a page": "tmsopt verify --only 'tab1-*' --markdown /proc/v.md",
    "a table": f"tmsopt trace {PROBLEMS}/off_law.toml --csv /proc/t.csv",
}


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="a folder that nobody may write to, not even root")
@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_written_is_named(name, tmp_path):
    status, _, err = shell(REFUSED[name], tmp_path)
    assert status == 2
    assert len(err.splitlines()) == 1
    assert REFUSED[name].split()[-1] in err


@pytest.mark.slow
@pytest.mark.parametrize("name", ["figure", "folder", "study"])
def test_few_files_may_be_open(name, tmp_path):
    status, _, err = shell(f"ulimit -n 9; tmsopt {WORDS[name]}", tmp_path)
    assert status in (0, 2)
    assert "Traceback" not in err
    assert (status == 0) or err.strip()


WORK = {
    "solve": f"solve {PROBLEMS}/point_mass_robot.toml --json",
    "certify": f"solve {PROBLEMS}/physical_machine.toml --certify 60 --json",
    "front": f"solve {PROBLEMS}/pareto.toml --points 60 --json",
    "compare": f"compare {PROBLEMS}/point_mass_robot.toml --json",
    "prove": f"prove {PROBLEMS}/point_mass_robot.toml --digits 1000 --json",
    "trace": f"trace {PROBLEMS}/ep_set.toml --step 0.00003 --json",
    "chart": f"chart {PROBLEMS}/chart.toml --points 3000x3000 --json",
    "folder": f"chart {PROBLEMS}/chart.toml --points 30000x30000 --output out/c.chart --workers 2 --json",
    "study": f"study {PROBLEMS}/study_sway.toml --store out/s.sqlite --workers 2 --json",
    "figure": "figure all --output out --json",
    "verify": "verify --json",
}


@pytest.mark.long
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), TERM])
@pytest.mark.parametrize("seconds", [0.3, 1.0])
@pytest.mark.parametrize("name", WORK)
def test_every_command_ends_soon(name, seconds, number, status, tmp_path):
    (tmp_path / "out").mkdir()
    group = f"TMSOPT_TEST={tmp_path}"
    process = subprocess.Popen(
        [sys.executable, "-c", "from tmsopt.cli import main; main()", *WORK[name].split()],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2]), "TMSOPT_TEST": str(tmp_path)},
    )
    time.sleep(seconds)
    if process.poll() is not None:
        process.communicate()
        pytest.skip("it was done before the signal")
    process.send_signal(number)
    began = time.perf_counter()
    out, err = process.communicate(timeout=60)
    assert time.perf_counter() - began < 2 * SOON  # other tests run beside it
    assert process.returncode in ([status, -number] if seconds < 1 else [status])  # before it listens it just ends
    assert "Traceback" not in err
    assert len(err.splitlines()) <= 1
    if out:
        json.loads(out)
    time.sleep(0.5)
    assert [p for p in Path("/proc").glob("[0-9]*/environ") if group in _text(p)] == []
    assert leftovers(tmp_path) == []


def _text(path):
    try:
        return path.read_bytes().decode(errors="replace")
    except OSError:
        return ""
