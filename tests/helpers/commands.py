"""The program in a process of its own."""

import subprocess
import sys


def tmsopt(*words, cwd=None):
    """A command, run to its end."""
    command = [sys.executable, "-c", "from tmsopt.cli import main; main()", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, cwd=cwd, encoding="utf-8")
