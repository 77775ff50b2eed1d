"""Colours and widths of answers: on a terminal, in a pipe, and where they are asked for."""

import os
import subprocess
import sys

import pytest
from helpers.terminal import ROOT, environment, on_a_terminal

EP4 = str(ROOT / "problems" / "ep4.toml")
FILES = {"speeds": "ep4", "study": "study_heights"}
pytestmark = pytest.mark.skipif(os.name != "posix", reason="terminals of POSIX")


def in_a_pipe(*words, **own):
    command = [sys.executable, "-m", "tmsopt", *words]
    return subprocess.run(command, env=environment(**own), capture_output=True, check=True).stdout


def is_coloured(text):
    return "\033[1" in text or "\033[3" in text


@pytest.mark.parametrize(
    ("words", "own", "coloured"),
    [
        ((), {}, True),
        ((), {"NO_COLOR": "1"}, False),
        ((), {"NO_COLOR": ""}, True),
        ((), {"TERM": "dumb"}, False),
        (("--color", "never"), {}, False),
        (("--colour=always",), {"NO_COLOR": "1"}, True),
    ],
)
def test_a_terminal_has_colours_unless_somebody_objects(words, own, coloured, tmp_path):
    seen = on_a_terminal(["solve", EP4, *words], tmp_path, whole=True, **own)
    assert (seen.status, is_coloured(seen.text)) == (0, coloured)


@pytest.mark.parametrize(
    ("words", "coloured"),
    [
        (("solve", EP4), False),
        (("solve", EP4, "--color", "auto"), False),
        (("solve", EP4, "--color", "always"), True),
        (("--color", "always", "solve", EP4), True),
        (("--color", "always", "solve", EP4, "--color", "never"), False),
    ],
)
def test_a_pipe_has_colours_where_they_are_asked_for(words, coloured, run):
    assert is_coloured(run(*words)[1]) is coloured


def test_another_word_for_colours_is_refused(run):
    status, out, err = run("solve", EP4, "--color", "sometimes")
    assert (status, out) == (2, "")
    assert all(word in err for word in ("auto", "always", "never"))


@pytest.mark.parametrize("command", ["speeds", pytest.param("study", marks=pytest.mark.slow)])
def test_a_report_fits_the_terminal(command, tmp_path):
    file = tmp_path / "few.toml"
    file.write_text((ROOT / "problems" / f"{FILES[command]}.toml").read_text().replace("rows = 32", "rows = 4"))
    seen = on_a_terminal([command, file, "--color=never"], tmp_path, columns=60, whole=True)
    lines = seen.text.split("\033[K")[-1].replace(str(tmp_path), "").splitlines()  # a path is one word
    assert max(map(len, lines)) <= 60


def test_a_narrow_encoding_gets_its_own_letters():
    """And no question marks in their place."""
    assert "√" in in_a_pipe("solve", EP4).decode()
    plain = in_a_pipe("solve", EP4, PYTHONIOENCODING="ascii").decode("ascii")
    assert "sqrt" in plain


SLOW_EXAMPLES = """
import time
from tmsopt import guide
examples = guide.examples
def slowly():
    time.sleep(1)
    return examples()
guide.examples = slowly
from tmsopt.cli import main
main(prog_name="tmsopt")
"""


def test_progress_is_gone_before_the_answer(tmp_path):
    """Also where stdout and stderr are one terminal."""
    before, _, after = on_a_terminal(["example"], tmp_path, SLOW_EXAMPLES, whole=True).text.rpartition("\033[K")
    assert "starting" in before
    assert after.startswith("balance_assist")
