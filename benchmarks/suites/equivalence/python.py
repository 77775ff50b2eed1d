"""Cases that a function answers, in a process of its own: random problems, broken files, wrong calls, signatures.

``python -m benchmarks.suites.equivalence.python SEED NAME...`` writes one line of JSON for each.
"""

import inspect
import json
import random
import re
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import tmsopt
from benchmarks.suites.equivalence.cases import PROBLEMS


def answer(name: str, seed: int) -> Any:
    """Plain data; what is raised is an answer too."""
    kind, _, rest = name.partition("/")
    try:
        if kind == "fault":
            file, _, number = rest.partition("/")
            return _load(_broken((PROBLEMS / f"{file}.toml").read_text(encoding="utf-8"), f"{file}{number}"), file)
        if kind == "signatures":
            return _signatures()
        if kind == "calls":
            return {text: _call(call) for text, call in _calls().items()}
        return tmsopt.solve(_problem(kind, int(rest)), throw=False, seed=seed).to_json()
    except Exception as error:
        return {"raised": type(error).__name__, "message": str(error)}


def _problem(kind: str, number: int) -> Any:
    """One random problem of a kind, or the path of its file."""
    from benchmarks import suites
    from benchmarks.suites import fresh, narrow_optima

    families = list(fresh.FAMILIES.values())
    makers: dict[str, Callable[[], Any]] = {
        "designs": lambda: suites.random_problem(number),
        "systems": lambda: suites.random_system(number).problem,
        "varied": lambda: suites.varied_problem(number),
        "hard": lambda: suites.hard_problem(5 * number + 2),
        "conflicts": lambda: suites.conflict(number).problem,
        "narrow": lambda: _written(narrow_optima.hidden()[3 * number].text),
        "fresh": lambda: _written(families[number % len(families)](number // len(families)).text),
    }
    return makers[kind]()


def _written(text: str) -> Path:
    path = Path(tempfile.mkdtemp()) / "problem.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _load(text: str, name: str) -> Any:
    path = Path(tempfile.mkdtemp()) / f"{name}.toml"
    for other in PROBLEMS.glob("*.toml"):
        shutil.copy(other, path.parent)
    path.write_text(text, encoding="utf-8")
    try:
        found = tmsopt.load_study(path) if "[study]" in text else tmsopt.load(path)
    except tmsopt.InputError as error:
        return {"faults": str(error).replace(str(path.parent), "")}
    return {"accepted": type(found).__name__}


def _broken(text: str, name: str) -> str:
    """A text with one line changed, always the same for a name."""
    rng = random.Random(name)
    lines = text.split("\n")
    places = [i for i, line in enumerate(lines) if "=" in line and not line.startswith("#")]
    i = rng.choice(places)
    key, _, value = lines[i].partition("=")
    changes: list[Callable[[], str]] = [
        lambda: f"{key[:1]}{key}= {value}",
        lambda: f"{key}= nan",
        lambda: f'{key}= "5 furlong"',
        lambda: f'{key}= "nothing + 1"',
        lambda: f"{key}= {{ min = 2, max = 1 }}",
        lambda: f"{key}= {{ min = 1, most = 2 }}",
        lambda: f"{key}= []",
        lambda: lines[i] + "\n" + lines[i],
        lambda: f"{key}= {value}]",
        lambda: lines[i].replace("<=", "<").replace(">=", "=>").replace('"', '"(', 1),
        lambda: "",
        lambda: f"{key}= -1e300",
        lambda: f'{key}= "sqrt(Fr - 9) + frequency <= 2"',
    ]
    lines[i] = rng.choice(changes)()
    return "\n".join(lines)


def _call(call: Callable[[], object]) -> str:
    try:
        return f"accepted: {type(call()).__name__}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def _calls() -> dict[str, Callable[[], object]]:
    """Wrong calls of the public verbs, as text."""
    names = ("problem", "solved", "path")
    texts = [
        "tmsopt.solve(path, starts=0)",
        "tmsopt.solve(path, seed=-1)",
        "tmsopt.solve(path, near={'bogus': 1.0})",
        "tmsopt.solve(3)",
        "tmsopt.solve('nowhere.toml')",
        "tmsopt.prove(path, digits=0)",
        "tmsopt.compare(None)",
        "tmsopt.trace(path, 'EP99')",
        "tmsopt.trace(path, 'EP2', step=0)",
        "tmsopt.chart(path, points=(1, 1))",
        "tmsopt.chart(path, axes=('Fr', 'bogus'))",
        "tmsopt.speeds(path, parameter='bogus')",
        "tmsopt.simulate(solved, lean='much')",
        "tmsopt.robustness([])",
        "tmsopt.run_study(path, workers=0)",
        "tmsopt.over_grid(problem, {'bogus': [1.0]})",
        "tmsopt.over_grid(problem, {'mu': []})",
        "tmsopt.Problem(tmsopt.models.tms, fixed={'Fr': 'fast'})",
        "tmsopt.Problem(tmsopt.models.tms, free={'Fr': (2, 1)})",
        "tmsopt.Problem(tmsopt.models.tms)",
        "tmsopt.models.from_matrices(A=[[1, 2]])",
        "tmsopt.models.from_matrices()",
        "tmsopt.models.from_polynomial(['b', 1])",
        "tmsopt.load_study(path)",
        "tmsopt.open_chart(path)",
        "tmsopt.read_bicycle(path)",
        "solved.plot(ax=3)",
        "tmsopt.certify(solved, seconds=-1)",
    ]
    path = str(PROBLEMS / "ep4.toml")
    known = dict(zip(names, (tmsopt.load(path), tmsopt.solve(path), path), strict=True)) | {"tmsopt": tmsopt}
    return {text: lambda text=text: eval(text, known) for text in texts}  # type: ignore[misc]


def _signatures() -> dict[str, Any]:
    """Public name → signature, or attributes of a class with theirs."""
    found: dict[str, Any] = {}
    for name in sorted(dir(tmsopt)):
        thing = getattr(tmsopt, name)
        found[name] = _signature(thing)
        if inspect.isclass(thing):
            for part in sorted(n for n in dir(thing) if not n.startswith("_")):
                found[f"{name}.{part}"] = _signature(inspect.getattr_static(thing, part, None))
        elif inspect.ismodule(thing):
            for part in sorted(getattr(thing, "__all__", [n for n in dir(thing) if not n.startswith("_")])):
                found[f"{name}.{part}"] = _signature(getattr(thing, part))
    return found


def _signature(thing: Any) -> str:
    if not callable(thing) or inspect.ismodule(thing):
        return "value" if not isinstance(thing, property) else "property"
    try:
        text = str(inspect.signature(thing))
    except (TypeError, ValueError):
        return "callable"
    text = re.sub(r"<(\w+)[^>]*>", r"<\1>", text)  # addresses of objects
    return re.sub(r"\b(?:\w+\.)+(?=\w)", "", text)  # where a type lives may change


def main(seed: int, names: list[str]) -> None:
    """Answer, one line each."""
    for name in names:
        print(json.dumps([name, answer(name, seed)]), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
