"""What a terminal shows while commands work, and what a pipe does not."""

import os
import subprocess
import time
from importlib import import_module

import pytest
from helpers.terminal import ROOT, command, environment, on_a_terminal

from tmsopt import Progress

describe_progress = import_module("tmsopt.cli.terminal").describe_progress

PROBLEMS = ROOT / "problems"
pytestmark = pytest.mark.skipif(os.name != "posix", reason="terminals of POSIX")

SLOW_TO_LOAD = """
import sys, time
class Slow:
    def find_spec(self, name, *_):
        if name == "casadi":
            time.sleep(1.5)
sys.meta_path.insert(0, Slow())
from tmsopt.cli import main
main(prog_name="tmsopt")
"""
"""The command where CasADi takes long to load."""

SLOW_AT_WORK = """
import time
from tmsopt import progress
begin = progress.Steps.begin
def slowly(self, *about):
    begin(self, *about)
    time.sleep(0.8)
progress.Steps.begin = slowly
from tmsopt.cli import main
main(prog_name="tmsopt")
"""
"""The command where every piece of work that is told of takes long."""

DEAF = """
import os, signal, time
from tmsopt import progress
begin = progress.Steps.begin
def deaf(self, *about):
    begin(self, *about)
    time.sleep(1.0)
    while True:
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.6)
        except BaseException:
            pass
progress.Steps.begin = deaf
from tmsopt.cli import main
main(prog_name="tmsopt")
"""
"""The command where compiled code, as that may, drops what Ctrl-C raises."""

COMMANDS = {
    "solve": ("solve {p}/realistic.toml", {"looking at designs", "searching", "looking for the nearest boundaries"}),
    "certify": ("solve {p}/realistic.toml --json --certify 2", {"searching", "bounding the optimum"}),
    "full": ("solve {p}/realistic.toml --full", {"moving limits", "splitting roots"}),
    "plot": ("solve {p}/ep4.toml --plot growth.png", {"following the roots", "writing the file of --plot"}),
    "report": ("solve {p}/ep4.toml --report page.html", {"writing the file of --report", "writing the page"}),
    "front": ("solve {p}/pareto.toml --points 3", {"following the front"}),
    "chart": ("chart {p}/chart.toml --points 60x50", {"charting", "tracing weave", "tracing capsize", "tracing EP2"}),
    "study": ("study study.toml", {"solving rows"}),
    "figure": ("figure growth --output growth.png", {"drawing"}),
    "verify": ("verify --only tab1-*", {"recomputing claims"}),
}
"""Words of the command line, and what a terminal is to show of it."""

STUDY = 'problem = "{p}/ep4.toml"\n[vary]\nmu = [0.1, 0.2, 0.3]\n'


def into_pipes(args, folder):
    return subprocess.run(command("", args), cwd=folder, env=environment(), capture_output=True, text=True, check=False)


def _loaded(folder):
    """Seconds that a command takes to begin, on this machine at this moment."""
    began = time.monotonic()
    into_pipes(["--version"], folder)
    return time.monotonic() - began


def _steady(answer):
    """An answer without what no two runs have alike."""
    return [line for line in answer.splitlines() if "second" not in line and " s" not in line]


def test_something_is_shown_within_a_second_whatever_takes_long(tmp_path):
    """Here the modules to be loaded: 1.5 s."""
    seen = on_a_terminal(["solve", str(PROBLEMS / "ep4.toml")], tmp_path, SLOW_TO_LOAD)
    at, line = seen.lines[0]
    assert line == "starting"
    assert at <= 1.0 + _loaded(tmp_path)
    assert seen.seconds > 1.5
    assert (seen.status, seen.screen) == (0, "")
    assert "EP4" in seen.answer


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_long_commands_say_what_they_do_and_leave_nothing(name, tmp_path):
    """The same is written as into pipes, but for the line that is gone in the end."""
    text, whats = COMMANDS[name]
    (tmp_path / "study.toml").write_text(STUDY.format(p=PROBLEMS))
    args = text.format(p=PROBLEMS).split()
    loaded = _loaded(tmp_path)
    seen = on_a_terminal(args, tmp_path, SLOW_AT_WORK)
    shown = [line for _, line in seen.lines]
    assert not [what for what in whats if not any(line.startswith(what) for line in shown)], shown
    assert seen.lines[0][0] <= 1.0 + loaded
    gaps = [b - a for (a, _), (b, _) in zip(seen.lines, seen.lines[1:], strict=False)]
    assert max(gaps) < 2.0 + loaded  # it goes on to show that it is alive
    assert "\r" not in seen.answer
    assert "\033" not in seen.answer
    for written in tmp_path.glob("*.sqlite"):
        written.unlink()
    piped = into_pipes(args, tmp_path)
    assert piped.stderr == seen.screen
    assert piped.returncode == seen.status
    if name != "certify":  # what is proved depends on the time that the machine has
        assert _steady(piped.stdout) == _steady(seen.answer)


@pytest.mark.slow
def test_a_narrow_terminal_has_one_line_of_it(tmp_path):
    seen = on_a_terminal(["solve", str(PROBLEMS / "realistic.toml")], tmp_path, SLOW_AT_WORK, columns=20)
    assert max(len(line) for _, line in seen.lines) == 19
    assert seen.screen == ""


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("text", ["prove {p}/ep4.toml", "verify"])
def test_ctrl_c_is_answered_with_a_line(text, tmp_path):
    """The line of progress is gone, and one says that the command was stopped."""
    what = "recomputing" if text == "verify" else "looking at designs"
    seen = on_a_terminal(text.format(p=PROBLEMS).split(), tmp_path, SLOW_AT_WORK, stop=what)
    assert seen.status == 130
    assert seen.screen == "stopped; all text printed before is valid\n"


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
def test_a_second_one_that_is_not_heard_leaves_no_line(tmp_path):
    seen = on_a_terminal(["solve", str(PROBLEMS / "ep4.toml")], tmp_path, DEAF)
    assert (seen.status, seen.answer) == (130, "")
    assert seen.lines
    assert seen.screen == ""


@pytest.mark.slow
def test_a_terminal_that_cannot_erase_shows_nothing(tmp_path):
    seen = on_a_terminal(["compare", str(PROBLEMS / "ep4.toml")], tmp_path, SLOW_AT_WORK, TERM="dumb")
    assert (seen.status, seen.written) == (0, [])


@pytest.mark.parametrize(
    ("told", "since", "line"),
    [
        (Progress("starting"), 0.2, "starting"),
        (Progress("starting"), 3.4, "starting (3 s)"),
        (Progress("searching", 0, unit="start"), 0.5, "searching: 0 starts"),
        (Progress("drawing", 0, 1, "figure", note="growth"), 2.0, "drawing: 0 of 1 figure; growth (2 s)"),
        (
            Progress("searching", 3, 64, "start", 2, 40, "best -1"),
            1,
            "searching: 3 of 64 starts, about 39 s left; best -1 (3 s)",
        ),
        (Progress("solving rows", 14, 15, "row", 9, 2), 3, "solving rows: 14 of 15 rows (12 s)"),
        (
            Progress("charting", 12e6, 1e9, "design", 60, 7260),
            60,
            "charting: 12,000,000 of 1,000,000,000 designs, about 2 h 0 min left (2 min 0 s)",
        ),
        (Progress("bounding the optimum", 2, 60, "s", 2, 58, "gap 0.1"), 1, "bounding the optimum: 3 of 60 s; gap 0.1"),
        (Progress("bounding the optimum", 60, 60, "s", 60, 0), 9, "bounding the optimum: 60 of 60 s"),
    ],
)
def test_a_record_in_words(told, since, line):
    assert describe_progress(told, since) == line


def test_what_does_not_fit_is_said_shorter_before_it_is_cut():
    told = Progress("searching", 7, 64, "start", 3.0, 19.0, "best abscissa = -0.52")
    assert describe_progress(told, 0.0, 80) == "searching: 7 of 64 starts, about 19 s left; best abscissa = -0.52 (3 s)"
    assert describe_progress(told, 0.0, 39) == "searching: 7/64, 19 s left"
    assert describe_progress(told, 0.0, 12) == "searching: 7"
