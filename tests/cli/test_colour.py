"""Colours and widths of answers: on a terminal, in a pipe, and where they are asked for."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

if os.name == "posix":
    import fcntl
    import pty
    import struct
    import termios

ROOT = Path(__file__).resolve().parents[2]
EP4 = str(ROOT / "problems" / "ep4.toml")
COMMAND = [sys.executable, "-m", "tmsopt"]
pytestmark = pytest.mark.skipif(os.name != "posix", reason="terminals of POSIX")


def environment(**own):
    """Variables of a terminal with colours, and those given."""
    kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "COLUMNS")}
    return kept | {"PYTHONPATH": str(ROOT), "TERM": "xterm"} | own


def on_a_terminal(*words, columns=100, program=COMMAND, **own):
    """What a command writes to a terminal that is stdout and stderr."""
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("4H", 24, columns, 0, 0))
    process = subprocess.Popen([*program, *words], env=environment(**own), stdout=follower, stderr=follower)
    os.close(follower)
    written = b""
    while True:
        try:
            text = os.read(leader, 100_000)
        except OSError:  # as Linux says that nobody writes any more
            break
        if not text:
            break
        written += text
    os.close(leader)
    assert process.wait() == 0
    return written.decode().replace("\r\n", "\n")


def in_a_pipe(*words, **own):
    done = subprocess.run([*COMMAND, *words], env=environment(**own), capture_output=True, check=True)
    return done.stdout


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
def test_a_terminal_has_colours_unless_somebody_objects(words, own, coloured):
    assert is_coloured(on_a_terminal("solve", EP4, *words, **own)) is coloured


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
def test_a_pipe_has_colours_where_they_are_asked_for(words, coloured):
    assert is_coloured(in_a_pipe(*words).decode()) is coloured


def test_another_word_for_colours_is_refused(run):
    status, out, err = run("solve", EP4, "--color", "sometimes")
    assert (status, out) == (2, "")
    assert all(word in err for word in ("auto", "always", "never"))


@pytest.mark.parametrize("columns", [80, 60])
def test_a_report_fits_the_terminal(columns):
    lines = on_a_terminal("speeds", EP4, "--color=never", columns=columns).split("\033[K")[-1].splitlines()
    assert max(map(len, lines)) <= columns


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


def test_progress_is_gone_before_the_answer():
    """Also where stdout and stderr are one terminal."""
    written = on_a_terminal("example", program=[sys.executable, "-c", SLOW_EXAMPLES])
    assert "starting" in written
    before, _, after = written.rpartition("\033[K")
    assert "starting" in before
    assert after.startswith("balance_assist")
