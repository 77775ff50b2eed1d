"""Files to start from: the examples that come with tmsopt, and new problems with a comment at each line."""

import json
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from importlib.resources import files
from pathlib import Path

from tmsopt.errors import input_error, suggest
from tmsopt.guide.schema import schema

SCHEMA_FILE = "tmsopt.schema.json"
"""What the first line of each file refers to, beside it."""

_INSTALLED = "share/tmsopt/problems"  # as pyproject.toml says

STARTS = {
    "tms": "an engineer's bicycle or robot on two wheels, as two masses on skates, in SI units",
    "whipple": "a bicycle with wheels and trail, in SI units",
    "own": "a system of your own, by its matrices",
}
"""Models of new problems → what each is."""


def new_problem(model: str = "tms") -> str:
    """A problem file to start from, which solves as it stands.

    Raises:
        InputError: unless `model` is one of `STARTS`.
    """
    if model not in STARTS:
        raise input_error(f"found '{model}'; {suggest(model, STARTS)}", "model")
    return (files("tmsopt.guide") / "templates" / f"{model}.toml").read_text(encoding="utf-8")


def examples() -> dict[str, str]:
    """The examples that come with tmsopt: name → title."""
    return {name: str(tomllib.loads(example(name)).get("title", "")) for name in _files()}


def example(name: str) -> str:
    """The text of an example.

    Raises:
        InputError: for a name that is none.
    """
    stem, found = name.removesuffix(".toml"), _files()
    if stem not in found:
        raise input_error(f"found '{name}'; {suggest(stem, found)}", "name")
    return found[stem].read_text(encoding="utf-8")


def companions(text: str) -> dict[str, str]:
    """Files that belong beside a problem or study file: name → text.

    The schema; a problem that a study names; where a problem names a bicycle, all that come with tmsopt.
    """
    data = tomllib.loads(text)
    problem = data.get("problem")
    named = {problem: example(problem)} if isinstance(problem, str) else {}
    bicycles = next(iter(_files().values())).parent.glob("bicycles/*.txt") if "bicycle" in data else ()
    ridden = {f"bicycles/{path.name}": path.read_text(encoding="utf-8") for path in sorted(bicycles)}
    return {SCHEMA_FILE: schema_text(), **named, **ridden}


def schema_text() -> str:
    """The JSON Schema as it is written to files."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


@cache
def _files() -> Mapping[str, Path]:
    """The files of the examples: those of a checkout, or those that were installed with the package."""
    above = Path(__file__).parents[2]
    checkout, beside = above / "problems", above / _INSTALLED
    found = [*(checkout if (checkout / SCHEMA_FILE).is_file() else beside).glob("*.toml")]  # pip install --target
    if not found:
        listed = metadata.files("tmsopt") or []
        found = [Path(str(f.locate())) for f in listed if str(f.parent).endswith(_INSTALLED) and f.suffix == ".toml"]
    return {path.stem: path for path in sorted(found)}
