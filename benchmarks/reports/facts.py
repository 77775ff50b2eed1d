"""Section *facts*: every fact of the reports of an earlier checkout is in those of this one.

A fact is a number with its unit, a verdict, or a name. `TMSOPT_BEFORE` is the earlier checkout; texts of both are
written to `TMSOPT_TEXTS`, or to a temporary folder, and read from there where they are already.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.reports.tables import Asked

HERE = Path(__file__).parents[2]

_ABOUT = """\
Numbers with their units, verdicts and names in the short and the full text of every verb on every file of `problems/`,
at an earlier checkout and now; a fact counts once for each verb. Written by `TMSOPT_BEFORE=CHECKOUT python -m
benchmarks --only facts`."""

VERBS = (
    "solve",
    "solve_all",
    "pareto",
    "chart",
    "domain",
    "trace",
    "speeds",
    "growth",
    "simulate",
    "prove",
    "compare",
    "robustness",
    "explain",
    "diagnose",
    "describe",
    "study",
)
"""Whatever a file can be asked; a verb that refuses a file gives the text of its refusal."""

_VOLATILE = re.compile(
    r"[\d.]+ s\b(?=$|\)|,? of )|[;,] [\d.e+]+ s$|\d+ µs|[\d.e+]+ designs per second|\d+ boxes|~?[\d.]+ a second|"
    r"\d+(\.\d+)? s; ",
    re.MULTILINE,
)
"""Times, and what is done in them, which differ from run to run."""

_NUMBER = r"[-+−]?\d[\d.]*(?:e[-+]?\d+)?"
_UNIT = (
    r"(?:kg m\^2|N m s/rad|N m/rad|1/s\^\d|1/s|m/s\^2|m/s|km/h|deg|cm|mm|kg|Hz|%|m\b|s\b|N\b|√\(w/g\)|√\(g/w\)|m_B\b)"
)
_FACT = re.compile(rf"(?<![\w.^]){_NUMBER}(?: ?{_UNIT})?(?![\w.])")
_VERDICT = re.compile(
    r"\b(?:optimal|infeasible|not converged|not stable|stable|marginally stable|unstable|proved|not proved|exact|"
    r"heavily damped|defective|strict local minimum|C?EP\d+|2EP2|pair\+real|weave|capsize|agrees|DIFFERS|yes|no)\b"
)


def facts(text: str, names: frozenset[str] = frozenset()) -> Counter[str]:
    """The facts of a text, with how often each stands there."""
    stable = _VOLATILE.sub(" ", text)
    named = [word for word in re.findall(r"\b[A-Za-z]\w*(?:\.\w+)?", stable) if word in names]
    return Counter([*(f.replace("−", "-") for f in _FACT.findall(stable)), *_VERDICT.findall(stable), *named])


def missing(before: str, now: str, names: frozenset[str] = frozenset()) -> list[str]:
    """Facts of one text that another does not have."""
    there = facts(now, names)
    bare = {fact.split(" ")[0] for fact in there}

    def told(fact: str) -> bool:
        number, _, unit = fact.partition(" ")
        return fact in there or (number in bare and unit in now)  # the unit may stand in a heading

    return sorted(fact for fact in facts(before, names) if not told(fact))


def report(asked: Asked) -> str:
    """The table, a row for each file, and what is missing."""
    before = os.environ.get("TMSOPT_BEFORE")
    if not before:
        return "## Facts\n\nNot run: `TMSOPT_BEFORE` names no earlier checkout."
    with tempfile.TemporaryDirectory() as scratch:
        texts = Path(os.environ.get("TMSOPT_TEXTS", scratch))
        files = sorted(path.name for path in (HERE / "problems").glob("*.toml"))[: asked.count or None]
        jobs = [
            (checkout, name, texts / side)
            for side, checkout in (("before", Path(before)), ("now", HERE))
            for name in files
        ]
        with ThreadPoolExecutor(asked.workers) as pool:
            list(pool.map(lambda job: _write(*job), jobs))
        rows, lost = [], []
        for name in files:
            old, new = (_texts(texts / side / Path(name).stem) for side in ("before", "now"))
            names = frozenset(old.get("names", "").split())
            total = sum(len(facts(text, names)) for verb, text in old.items() if verb != "names")
            gone = {v: m for v, t in old.items() if v != "names" and (m := missing(t, new.get(v, ""), names))}
            rows.append(f"| {Path(name).stem} | {len(old) - 1} | {total} | {sum(map(len, gone.values()))} |")
            lost += [f"- {Path(name).stem}, {verb}: {', '.join(some)}" for verb, some in gone.items()]
    head = ["## Facts", "", _ABOUT, "", "| file | verbs | facts | missing |", "| --- | --- | --- | --- |"]
    return "\n".join([*head, *rows, "", "### Missing", "", *(lost or ["None."])])


def _texts(folder: Path) -> dict[str, str]:
    return {path.stem: path.read_text(encoding="utf-8") for path in folder.glob("*.txt")}


def _write(checkout: Path, name: str, folder: Path) -> None:
    """Texts of every verb of a file, by a process of the checkout."""
    target = folder / Path(name).stem
    if not target.is_dir():
        target.mkdir(parents=True)
        environment = {**os.environ, "PYTHONPATH": str(checkout)}
        subprocess.run([sys.executable, __file__, name, str(target)], cwd=checkout, env=environment, check=False)


def _answer(verb: str, path: str, kept: dict[str, Any]) -> Any:
    """What a verb answers: to the file, or to the design or the chart that an earlier verb kept."""
    import tmsopt

    calls: dict[str, Callable[[], Any]] = {
        "solve": lambda: tmsopt.solve(path, throw=False),
        "study": lambda: tmsopt.run_study(tmsopt.load_study(path), workers=1),
        "chart": lambda: tmsopt.chart(path, points=(40, 30)),
        "domain": lambda: kept["chart"].domain,
        "pareto": lambda: tmsopt.pareto(path, points=5),
        "trace": lambda: tmsopt.trace(path, starts=12),
        "solve_all": lambda: tmsopt.solve_all(path, seconds=2.0, starts=16),
        "describe": lambda: tmsopt.describe(path),
    }
    kept[verb] = calls[verb]() if verb in calls else getattr(tmsopt, verb)(kept["solve"])
    return kept[verb]


def _texts_of(path: str, folder: Path) -> None:
    """Write the short and the full text of what each verb answers."""
    import tmsopt

    kept: dict[str, Any] = {}
    for verb in VERBS:
        try:
            found = _answer(verb, path, kept)
            if found is None:
                continue
            listed: list[Any] = list(found) if isinstance(found, tuple | list) else [found]
            text = "\n\n".join(f"{r!r}\n\n{r}\n\n{r.report(full=True)}" for r in listed)
        except (tmsopt.InputError, tmsopt.NotSolved, KeyError, AttributeError, ValueError):
            continue
        (folder / f"{verb}.txt").write_text(text, encoding="utf-8")
    try:
        names = " ".join(tmsopt.load(path).posed.vocabulary)
    except (tmsopt.InputError, AttributeError):
        names = ""
    (folder / "names.txt").write_text(names, encoding="utf-8")


if __name__ == "__main__":
    _texts_of(str(Path("problems") / sys.argv[1]), Path(sys.argv[2]))
