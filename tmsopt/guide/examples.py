"""Files to start from: the examples that come with tmsopt, and new problems with a comment on each line."""

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
"""Name of the schema file. The first line of each problem file refers to it, in the same folder."""

_INSTALLED_FOLDER = "share/tmsopt/problems"  # the same as in pyproject.toml

TEMPLATES = {
    "tms": "an engineer's bicycle or robot on two wheels, as two masses on skates, in SI units",
    "whipple": "a bicycle with wheels and trail, in SI units",
    "own": "a system of your own, by its matrices",
}
"""Model of a new problem → meaning of the model."""


def new_problem(model: str = "tms") -> str:
    """Return a problem file to start from. It can be solved without changes.

    Raises:
        InputError: unless `model` is one of `TEMPLATES`.
    """
    if model not in TEMPLATES:
        raise input_error(f"found '{model}'; {suggest(model, TEMPLATES)}", "model")
    return (files("tmsopt.guide") / "templates" / f"{model}.toml").read_text(encoding="utf-8")


def examples() -> dict[str, str]:
    """List the examples that come with tmsopt: name → title."""
    return {name: str(tomllib.loads(example(name)).get("title", "")) for name in _find_files()}


def example(name: str) -> str:
    """Return the text of an example.

    Raises:
        InputError: if no example has this name.
    """
    stem, paths = name.removesuffix(".toml"), _find_files()
    if stem not in paths:
        raise input_error(f"found '{name}'; {suggest(stem, paths)}", "name")
    return paths[stem].read_text(encoding="utf-8")


def companions(text: str) -> dict[str, str]:
    """Return name → text of the files that must be in the folder of a problem or study file.

    These are the schema, the problem that a study names, and, if a problem names a bicycle, all bicycles of tmsopt.
    """
    data = tomllib.loads(text)
    problem = data.get("problem")
    problems = {problem: example(problem)} if isinstance(problem, str) else {}
    bicycles = next(iter(_find_files().values())).parent.glob("bicycles/*.txt") if "bicycle" in data else ()
    bicycle_files = {f"bicycles/{path.name}": path.read_text(encoding="utf-8") for path in sorted(bicycles)}
    return {SCHEMA_FILE: schema_text(), **problems, **bicycle_files}


def schema_text() -> str:
    """Write the JSON Schema as the text of a file."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


@cache
def _find_files() -> Mapping[str, Path]:
    """Find the files of the examples, in the source repository or installed with the package."""
    root = Path(__file__).parents[2]
    folder = root / "problems"  # in the source repository
    if not (folder / SCHEMA_FILE).is_file():
        folder = root / _INSTALLED_FOLDER  # after pip install --target
    paths = [*folder.glob("*.toml")]
    if not paths:
        installed = metadata.files("tmsopt") or []
        example_files = (f for f in installed if str(f.parent).endswith(_INSTALLED_FOLDER) and f.suffix == ".toml")
        paths = [Path(str(f.locate())) for f in example_files]
    return {path.stem: path for path in sorted(paths)}
