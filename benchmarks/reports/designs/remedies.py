"""Infeasible problems: whether what the report advises helps, once the text of it is put into the file."""

import re
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from tqdm import tqdm

from benchmarks.judges import FEASIBLE, exactly, verdict
from benchmarks.reports.tables import Asked, median, page, share, table
from benchmarks.suites.statements.remedies import File, infeasible_files, toml
from tmsopt import Solution, load, solve
from tmsopt.analysis import infeasible_sentences

_ROOTS = ("abscissa", "decay", "damping_ratio")
_CHANGE = re.compile(r"(?P<left>.+?) (?P<sign><=|>=|==) (?P<new>.+?)(?: instead of \S+)? \((?P<name>\w+)(?:, in .+)?\)")
_RANGE = re.compile(r"(?P<name>\w+) (?P<way>up|down) to (?P<new>.+?) instead of \S+")
_SPEED = re.compile(r"the (?P<which>least|greatest) (?P<name>\w+) found is (?P<new>.+)$")
_NEEDS = re.compile(r"(?P<name>\w+) at (?P<way>least|most) (?P<new>[^,()]+?) \(at (?:least|most) .+? is allowed\)")


@dataclass(frozen=True)
class Obeyed:
    """What became of a file and of the remedies that are printed for it.

    Attributes:
        status: of the file as it is.
        remedies: line as printed → nothing where it helps, or what it leads to.
    """

    name: str
    status: str
    seconds: float
    remedies: dict[str, str] = field(default_factory=dict)


def obey(asked: tuple[str, File]) -> Obeyed:
    """Solve a file, change it as each line of the report says, and solve what that gives."""
    name, file = asked
    first = _solved(file)
    if first.status != "infeasible":
        return Obeyed(name, first.status, first.seconds)
    found = {}
    for line in infeasible_sentences(first, full=True):
        if changed := _changed(file, line):
            found[line] = _judged(changed, file)
    return Obeyed(name, first.status, first.seconds, found)


def _changed(file: File, line: str) -> File | None:
    """A file with what a line advises; None for one without advice."""
    parameters, limits = dict(file["parameters"]), dict(file.get("constraints", {}))
    text, advice = line.strip(), False
    if found := _SPEED.search(text):
        parameters[found["name"]], advice = _value(found["new"]), True
    for found in _NEEDS.finditer(text):
        _widen(parameters, found["name"], "max" if found["way"] == "least" else "min", found["new"])
        advice = True
    for head in ("smallest change found: ", "or alone: "):
        for part in text.removeprefix(head).split(" and ") if text.startswith(head) else ():
            if found := _RANGE.fullmatch(part):
                _widen(parameters, found["name"], "max" if found["way"] == "up" else "min", found["new"])
            elif found := _CHANGE.fullmatch(part):
                limits[found["name"]] = f"{found['left']} {found['sign']} {found['new']}"
            else:
                raise ValueError(f"cannot be obeyed: {part}")
            advice = True
    return file | {"parameters": parameters, "constraints": limits} if advice else None


def _widen(parameters: File, name: str, end: str, new: str) -> None:
    parameters[name] = {**{k: v for k, v in parameters[name].items() if k != "start"}, end: _value(new)}


def _value(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text


def _judged(changed: File, file: File) -> str:
    """Nothing where there is an answer now, by an independent judge, and a stable one where the roots are asked for."""
    try:
        again = _solved(changed)
    except ValueError as error:
        return f"refused: {error}"
    if again.status != "optimal":
        return again.status
    beyond = verdict(again.problem, again.parameters).violation
    if beyond > FEASIBLE and not again.problem.posed.cases:  # beside a triple root eigenvalues are 1e-5 off
        beyond = min(one.violation for one in exactly(again.problem, again.parameters))
    if beyond > FEASIBLE:
        return f"violates by {beyond:.1e}"
    texts = [*file.get("constraints", {}).values(), *file["objective"].values()]
    about = any(word in str(text) for text in texts for word in _ROOTS)
    edge = any(text.replace(" ", "") == "abscissa<=0" for text in file.get("constraints", {}).values())
    return "not stable" if about and not edge and not again.stable else ""


def _solved(file: File) -> Solution:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "problem.toml")
        path.write_text(toml(file), encoding="utf-8")
        return solve(load(path), throw=False)


def report(asked: Asked) -> str:
    """The report in Markdown."""
    files = list(infeasible_files(asked.of(60, 3)))
    with ProcessPoolExecutor(asked.workers) as pool:
        every = list(tqdm(pool.map(obey, files), desc="remedies", total=len(files)))
    rows = []
    for kind in dict.fromkeys(found.name.split()[0] for found in every):
        group = [found for found in every if found.name.split()[0] == kind and found.status == "infeasible"]
        lines = [verdict for found in group for verdict in found.remedies.values()]
        some, helped = sum(bool(found.remedies) for found in group), sum(not verdict for verdict in lines)
        rows.append((kind, len(group), some, len(lines), helped, median(found.seconds for found in group)))
    failed = [(found.name, line, said) for found in every for line, said in found.remedies.items() if said]
    header = ("files", "infeasible", "with a remedy", "remedies printed", "that help", "median time")
    return page(
        "Remedies",
        asked,
        f"**{share(not said for found in every for said in found.remedies.values())}** of the remedies that are "
        "printed for infeasible problems help.",
        table(header, rows),
        "The text of each is put into the file as it stands and the file is solved again: it must have an optimum that "
        "meets all limits by the independent judge, and a stable one where the file says something of the roots.",
        "### Failures",
        table(("file", "advice", "what it leads to"), failed, "None."),
    )
