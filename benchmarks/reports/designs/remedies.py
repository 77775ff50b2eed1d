"""Infeasible problems: whether the changes that are advised help, once the text of them is put into the file."""

import tempfile
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from tqdm import tqdm

from benchmarks.judges import FEASIBLE, exactly, verdict
from benchmarks.reports.tables import Asked, median, page, share, table
from benchmarks.suites.remedies import File, infeasible_files, toml
from tmsopt import Solution, load, solve

_ROOTS = ("abscissa", "decay", "damping_ratio")


@dataclass(frozen=True)
class Obeyed:
    """What became of a file and of its remedies.

    Attributes:
        status: of the file as it is.
        remedies: what is advised → nothing where it helps, or what it leads to.
    """

    name: str
    status: str
    seconds: float
    remedies: dict[str, str] = field(default_factory=dict)


def obey(asked: tuple[str, File]) -> Obeyed:
    """Solve a file, change it as each remedy says, and solve what that gives."""
    name, file = asked
    first = _solved(file)
    advice = first.relaxation.remedies if first.status == "infeasible" and first.relaxation else ()
    found = {str(dict(written)): _judged(_changed(file, written), file) for written in advice}
    return Obeyed(name, first.status, first.seconds, found)


def _changed(file: File, written: Mapping[str, str]) -> File:
    """A file with limits as they are written: constraints by name, ends of ranges as ``v.max``."""
    parameters, limits = dict(file["parameters"]), dict(file.get("constraints", {}))
    for name, text in written.items():
        parameter, _, end = name.partition(".")
        if end:
            kept = {k: v for k, v in parameters[parameter].items() if k != "start"}
            parameters[parameter] = {**kept, end: text if " " in text else float(text)}
        else:
            limits[name] = text
    return file | {"parameters": parameters, "constraints": limits}


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
    header = ("files", "infeasible", "with a remedy", "remedies", "that help", "median time")
    return page(
        "Remedies",
        asked,
        f"**{share(not said for found in every for said in found.remedies.values())}** of the remedies of "
        "infeasible problems help.",
        table(header, rows),
        "The text of each is put into the file as it stands and the file is solved again: it must have an optimum that "
        "meets all limits by the independent judge, and a stable one where the file says something of the roots.",
        "### Failures",
        table(("file", "advice", "what it leads to"), failed, "None."),
    )
