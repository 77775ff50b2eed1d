"""A statement that can be refuted: files, a command, and a judge that knows the truth."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SECONDS = 300
"""After which a command counts as unanswered."""


@dataclass(frozen=True)
class Answer:
    """What a command left behind.

    Attributes:
        status: its exit status; None where it took longer than `SECONDS`.
        folder: where it ran, with every file that it wrote.
    """

    status: int | None
    stdout: str
    stderr: str
    folder: Path

    @property
    def data(self) -> Any:
        """What it wrote as JSON.

        Raises:
            ValueError: if it wrote something else.
        """
        return json.loads(self.stdout)


@dataclass(frozen=True)
class Case:
    """One statement.

    Attributes:
        name: of the case, unique within its kind.
        files: name → text; written before the command runs.
        arguments: of ``tmsopt``, or ``("python", "script.py")`` for a script among the files.
        judge: nothing if what the answer says is true; else what is false, in a few words.
        truth: where the truth comes from: a closed form, a source, an independent computation.
    """

    name: str
    files: Mapping[str, str]
    arguments: tuple[str, ...]
    judge: Callable[[Answer], str]
    truth: str


def verdict(case: Case, checkout: Path) -> str:
    """Nothing if the tmsopt of a checkout says the truth; else what it says that is false."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in case.files.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        own = case.arguments[1:] if case.arguments[0] == "python" else ("-m", "tmsopt", *case.arguments)
        environment = {**os.environ, "PYTHONPATH": str(checkout), "MPLBACKEND": "agg"}
        try:
            ran = subprocess.run(
                [sys.executable, *own],
                cwd=folder,
                env=environment,
                capture_output=True,
                text=True,
                timeout=SECONDS,
                check=False,
            )
            answer = Answer(ran.returncode, ran.stdout, ran.stderr, Path(folder))
        except subprocess.TimeoutExpired:
            answer = Answer(None, "", "", Path(folder))
        if "Traceback" in answer.stderr:
            return "a traceback: " + answer.stderr.strip().splitlines()[-1]
        try:
            return case.judge(answer)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            return f"no such statement: {type(error).__name__}: {error}"
