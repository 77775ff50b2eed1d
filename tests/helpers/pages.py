"""A page of the documentation as data: its fenced blocks, what each is, and what running it must print.

A block of `toml` that begins with ``# NAME.toml`` is that file, one that begins with ``# part of problems/NAME.toml`` a part
of it. A block of `console` has commands after ``$`` and what they print, lines in their order; a line ``…`` stands for what
is left out, and so does ``…`` within a line. Blocks of `python` run one after the other, those of `pycon` are compared.
"""

import math
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from helpers.places import ROOT

PAGES = sorted(page for page in (ROOT / "docs").rglob("*.md") if page.parent.name not in ("generated", "gallery"))
"""The pages that are written by hand."""
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_WHOLE = re.compile(NUMBER.pattern + r"(?![\d.]*…)")  # of 3.14… the digits are as they stand
_SECONDS = re.compile(r"(?<![\d.])(?<!decay time )(?<!decay_time <= )\d+(?:\.\d+)?(?= ?(?:s|ms|µs|h|min)\b)")
"""What a run took: other machines, other times. A time of decay is an answer."""
_FENCE = re.compile(r"^(`{3,})(?:\{code-block\} )?(\{[\w-]+\}|\w*)[^\n]*\n(.*?)^\1\s*$", re.MULTILINE | re.DOTALL)
_MARK = re.compile(r"^\s*(?:`{3}|~{3})", re.MULTILINE)
_INSTALLS = ("pip ", "eval ", "_TMSOPT", "python -m venv", "source ", "sphinx-build ", "git ")
_LONGEST = 120  # seconds of a command
_DIGITS = 17  # of a double; a number with more of them is proved, to the last one
_NOISE = 1e-12


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, or directive in braces, its text, the line of the page on which it begins."""

    language: str
    text: str
    line: int


def blocks_of(page):
    """The fenced blocks of a page, in its order."""
    text = page.read_text(encoding="utf-8")
    found = [Block(m[2], m[3], text.count("\n", 0, m.start()) + 1) for m in _FENCE.finditer(text)]
    marks = len(_MARK.findall(text))
    assert marks == 2 * len(found), f"{page.name}: fences that are not read: indented, of tildes, or without an end"
    return found


def lines_of(text):
    """The lines of an answer, blanks aside."""
    return [" ".join(line.split()) for line in text.splitlines() if line.strip()]


def agrees(printed, now):
    """The same words, and the same numbers within the rounding of the last digits: other machines, other sums.

    Times of runs count as equal, and ``…`` stands for anything. Of numbers of more digits than a double every one
    counts, and of those below 1e-12 the size.
    """
    printed, now = _SECONDS.sub("0", re.sub(" ?… ?", "…", printed)), _SECONDS.sub("0", now)
    words = [re.escape(words).replace("…", ".*?") for words in _WHOLE.split(printed)]
    found = re.fullmatch(f"({NUMBER.pattern})".join(words), now)
    if found is None:
        return False
    pairs = zip(_WHOLE.findall(printed), found.groups(), strict=True)
    return all(_same(a, b) for a, b in pairs)


def _same(printed, now):
    a, b = float(printed), float(now)
    if sum(map(str.isdigit, printed.partition("e")[0])) > _DIGITS:
        return printed == now
    if 0 < abs(a) < _NOISE:
        return abs(a) / 10 < abs(b) < 10 * abs(a)
    return math.isclose(a, b, rel_tol=1e-6, abs_tol=_NOISE)


def exchanges(block):
    """Each command of a console block, with what the page says that it prints."""
    before, *parts = re.split(r"^\$ ", block.text, flags=re.MULTILINE)
    assert not before.strip(), f"line {block.line}: a command stands after $"
    assert parts, f"line {block.line}: no command"
    for part in parts:
        command, _, printed = part.partition("\n")
        yield command, lines_of(printed)


def run(command, folder, path):
    """What a command prints, its diagnostics after its answer; it fails no other way than by a message."""
    if command.startswith(_INSTALLS):
        return []
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(path),
        "BROWSER": "true",
        "MPLBACKEND": "agg",
    }
    ended = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=_LONGEST,
        check=False,
    )
    assert "Traceback" not in ended.stderr, f"{command}\n{ended.stderr}"
    assert ended.returncode in (0, 2, 3, 4), f"{command}\n{ended.stderr}"
    return lines_of(ended.stdout) + lines_of(ended.stderr)


def missing(printed, now):
    """The first line that is printed on the page and not by the command, or not where it should be."""
    rest = iter(now)
    anywhere = True  # what is printed may begin anywhere: a page shows a part
    for line in printed:
        if line == "…":
            anywhere = True
        elif anywhere:
            if not any(agrees(line, other) for other in rest):
                return line
            anywhere = False
        elif not agrees(line, next(rest, "")):
            return line
    return None


def may_install(block):
    """Whether a block of `sh` has nothing that should have been run: what installs, or sets up a shell."""
    lines = [line for line in block.text.splitlines() if line.strip() and not line.startswith("#")]
    return all(line.startswith(_INSTALLS) for line in lines)
