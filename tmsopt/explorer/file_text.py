"""The text of a problem file around its parameters, so that a design seen on a page can be solved and shared."""

import re
from collections.abc import Iterator, Mapping
from itertools import starmap
from typing import Any

from tmsopt.guide import toml_key, toml_text
from tmsopt.problem import Posed

_SHARED = re.compile(r"\[(\d+)\]")


def surrounding_lines(problem: Posed, model: Mapping[str, Any]) -> dict[str, str]:
    """What stands before and after the lines of [parameters].

    Args:
        model: the table that states the model, as typed; without one it is written from the model itself.
    """
    before = [_line("title", problem.title)]
    if problem.model.statement is None:
        before.append(_line("model", problem.model.name))
    else:
        before += ["", *_model(model or model_table(problem))]
    after = []
    for name in ("constraints", "weights"):
        if entries := getattr(problem, name):
            after += ["", f"[{name}]", *starmap(_line, entries.items())]
    if problem.nominal is not problem:
        before.append("# one design, at its nominal values: bands and tolerances are left out")
    return {"before": "\n".join([*before, "", "[parameters]", ""]), "after": "\n".join([*after, ""])}


def _model(table: Mapping[str, Any]) -> Iterator[str]:
    yield "[model]"
    inner = {n: v for n, v in table.items() if isinstance(v, Mapping)}
    yield from (_line(n, v) for n, v in table.items() if n not in inner)
    for name, values in inner.items():
        yield from ("", f"[model.{toml_key(name)}]", *starmap(_line, values.items()))


def model_table(problem: Posed) -> dict[str, Any]:
    """The table of a model that was made in Python, with every shared part written out."""
    said = {n: v for n, v in (problem.model.statement or {}).items() if n != "parameters"}
    shared = said.pop("shared")

    def write(value: Any) -> Any:
        if isinstance(value, str):
            return _SHARED.sub(lambda found: write(shared[int(found[1]) - 1]), value)
        if isinstance(value, Mapping):
            return {n: write(v) for n, v in value.items()}
        return [write(v) for v in value]

    found = {n: write(v) for n, v in said.items() if v} | {"name": problem.model.name}
    return found | {n: rows[0] for n, rows in found.items() if n == "coefficients"}


def _line(key: str, value: Any) -> str:
    return f"{toml_key(key)} = {toml_text(value)}"
