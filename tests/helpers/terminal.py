"""Commands with a terminal of POSIX as their stderr, and what they wrote to it when."""

import os
import re
import select
import signal
import subprocess
import sys
import time
from dataclasses import dataclass

from helpers.places import ROOT

if os.name == "posix":
    import fcntl
    import pty
    import struct
    import termios


@dataclass(frozen=True)
class Seen:
    """What a command did with a terminal as its stderr: its status, its answer, and what was written when."""

    status: int
    answer: str
    written: list[tuple[float, str]]
    seconds: float

    @property
    def text(self):
        """All that was written."""
        return "".join(text for _, text in self.written).replace("\r\n", "\n")

    @property
    def lines(self):
        """Every line of progress that was drawn, and when."""
        drawn = [(at, part) for at, text in self.written for part in re.findall(r"\r([^\r\n\033]+)\033\[K", text)]
        return [(at, line) for at, line in drawn if line]

    @property
    def screen(self):
        """What stands there in the end."""
        left, line, column = [], "", 0
        for character in re.findall(r"\033\[K|.|\n", self.text):
            if character == "\n":
                left.append(line)
                line, column = "", 0
            elif character == "\r":
                column = 0
            elif character == "\033[K":
                line = line[:column]
            else:
                line, column = line[:column] + character + line[column + 1 :], column + 1
        return "".join(f"{one}\n" for one in left) + line


def command(how, args):
    return [sys.executable, *(["-c", how] if how else ["-m", "tmsopt"]), *args]


def environment(**own):
    """Variables of a terminal with colours, and those given."""
    kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "COLUMNS")}
    return kept | {"PYTHONPATH": str(ROOT), "TERM": "xterm"} | own


def on_a_terminal(args, folder, how="", columns=80, stop="", whole=False, **own):
    """Run a command with a terminal as its stderr; with Ctrl-C once `stop` is shown.

    Args:
        how: the program, by default tmsopt's own.
        whole: the terminal is its stdout too.
        own: variables of its environment.
    """
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("4H", 24, columns, 0, 0))
    written = []
    began = time.monotonic()
    with open(folder / "answer", "w+", encoding="utf-8") as out:
        streams = {"stdout": follower if whole else out, "stderr": follower}
        process = subprocess.Popen(command(how, args), cwd=folder, env=environment(**own), **streams)
        os.close(follower)
        while process.poll() is None or select.select([leader], [], [], 0)[0]:
            if not select.select([leader], [], [], 0.02)[0]:
                continue
            try:
                text = os.read(leader, 100_000).decode()
            except OSError:  # as Linux says that nobody writes any more
                break
            written.append((time.monotonic() - began, text))
            if stop and stop in text:
                process.send_signal(signal.SIGINT)
                stop = ""
        status = process.wait()
        out.seek(0)
        answer = out.read()
    os.close(leader)
    return Seen(status, answer, written, time.monotonic() - began)
