"""The cases: commands on every file of ``problems/``, random problems of each kind, faults, signatures.

Nothing here imports tmsopt: a case is a name and what a process needs to answer it.
"""

from dataclasses import dataclass
from pathlib import Path

PROBLEMS = Path(__file__).resolve().parents[3] / "problems"
_NEWER = {"passive_dimer", "pt_dimer", "ring_of_modes"}
"""Files that the version of the net did not have."""

EACH = 60
"""Random problems of each kind."""

FAULTS = 10
"""Broken copies of each file of ``problems/``."""

KINDS = ("designs", "systems", "varied", "hard", "narrow", "conflicts", "fresh")
"""Kinds of random problems."""


@dataclass(frozen=True)
class Case:
    """A question.

    Attributes:
        name: such as ``solve/ep4``.
        command: arguments of the command line; empty where a function of `python` answers.
        seeded: whether the command takes ``--seed``.
    """

    name: str
    command: tuple[str, ...] = ()
    seeded: bool = False

    @property
    def group(self) -> str:
        """What stands before the first slash: cases of one kind."""
        return self.name.partition("/")[0]


_ON_FILES: dict[str, tuple[tuple[str, ...], bool]] = {
    "solve": (("solve", "FILE", "--json"), True),
    "text": (("solve", "FILE"), True),
    "full": (("solve", "FILE", "--full"), True),
    "all": (("solve", "FILE", "--all", "--json"), True),
    "describe": (("describe", "FILE", "--json"), False),
    "described": (("describe", "FILE"), False),
    "compare": (("compare", "FILE", "--json"), True),
    "prove": (("prove", "FILE", "--json"), True),
    "speeds": (("speeds", "FILE", "--json"), False),
    "speeds_text": (("speeds", "FILE"), False),
    "simulate": (("simulate", "FILE", "--lean", "5", "--seconds", "3", "--points", "21", "--json"), False),
    "trace": (("trace", "FILE", "--json"), True),
    "trace_text": (("trace", "FILE"), True),
    "chart": (("chart", "FILE", "--points", "21x15", "--json"), False),
    "chart_text": (("chart", "FILE", "--points", "21x15"), False),
    "convert": (("convert", "FILE"), False),
    "explore": (("explore", "FILE", "-o", "page.html"), True),
}
"""Name → command, and whether it takes a seed; what a file is not made for is refused, and how is a case too."""

_COMMANDS = (
    "chart",
    "compare",
    "convert",
    "describe",
    "example",
    "explore",
    "figure",
    "import",
    "new",
    "prove",
    "schema",
    "simulate",
    "solve",
    "speeds",
    "study",
    "trace",
    "verify",
)


def _commands() -> list[Case]:
    """Commands on files, their helps and what they say of wrong usage."""
    files = sorted({path.stem for path in PROBLEMS.glob("*.toml")} - _NEWER)
    cases = [
        Case(f"{name}/{file}", tuple(f"{file}.toml" if word == "FILE" else word for word in words), seeded)
        for file in files
        if not file.startswith("study_")
        for name, (words, seeded) in _ON_FILES.items()
    ]
    for file in (file for file in files if file.startswith("study_")):
        study = ("study", f"{file}.toml", "--store", "rows.sqlite", "--workers", "2")
        cases += [Case(f"study/{file}", (*study, "--json")), Case(f"study_text/{file}", study)]
    for command in _COMMANDS:
        cases += [
            Case(f"help/{command}", (command, "--help")),
            Case(f"usage/{command}/nothing", (command, *(["no_file.toml"] if command != "schema" else []))),
            Case(f"usage/{command}/option", (command, "--no-such-option")),
        ]
    models = ("tms", "whipple")
    cases += [Case(f"model/{name}", ("describe", name, "--json")) for name in models]
    return [*cases, Case("verify/all", ("verify", "--json")), Case("schema/all", ("schema",)), Case("help/all")]


def _functions() -> list[Case]:
    """Cases that a function answers, in a process with others."""
    random = [Case(f"{kind}/{number:02d}") for kind in KINDS for number in range(EACH)]
    files = sorted({path.stem for path in PROBLEMS.glob("*.toml")} - _NEWER)
    faults = [Case(f"fault/{file}/{number}") for file in files for number in range(FAULTS)]
    return [*random, *faults, Case("signatures/all"), Case("calls/all")]


CASES = (*_commands(), *_functions())
"""All of them."""
