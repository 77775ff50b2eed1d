"""The page as one file: what is the same in every page, with the formulas and the data of this one."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from typing import Any

from tmsopt.explorer.javascript import model_script
from tmsopt.explorer.kernel import kernel_script
from tmsopt.explorer.known import Known
from tmsopt.explorer.subject import subject
from tmsopt.problem import Posed
from tmsopt.records import plain

_COMMENT = re.compile(r"^//.*$|^/\*\*[\s\S]*?\*/$", re.MULTILINE)
_BLANKS = re.compile(r"\s*([{};,])\s*|(:)\s+")  # that mean nothing in a style
_TEXT = re.compile(r'("(?:[^"\\]|\\.)*")')
_AROUND = re.compile(r" ?([=!]==|=>|\*=|[<>]=?|[?:|&*]{1,2}|[-+]=|[=,;{}()\[\]]) ?| ([-+]) (?![-+])")  # in a script
_PARTS = "numerics state axes chart plane growth bicycle motion controls facts api main"


def html_of(problem: Posed, designs: Sequence[Known], model: Mapping[str, Any], trace_curves: bool) -> str:
    """The page of a problem; arguments as of `subject`."""
    script = model_script(problem)
    data = subject(problem, designs, script, model, trace_curves) | {"version": version("tmsopt")}
    own = script.text, kernel_script(problem.model.degree), f"const DATA = {_json(data)};"
    parts = [*own, *(_read(f"{name}.js") for name in _PARTS.split())]
    marks = {
        "<!-- title -->": escape(problem.title or problem.model.title),
        "/* style */": _BLANKS.sub(r"\1\2", _read("page.css")),
        "/* script */": "\n".join(parts),
    }
    either = "|".join(map(re.escape, marks))
    return re.sub(either, lambda mark: marks[mark[0]], _read("page.html"))  # at once: a title may look like a mark


def _read(name: str) -> str:
    """A file of the page without what only its readers need: indentation, comments, ends of lines, blanks."""
    text = (files("tmsopt.explorer") / "page" / name).read_text(encoding="utf-8")
    lines = [line.strip() for line in text.splitlines()]
    plain = re.sub(r" // .*", "", _COMMENT.sub("", "\n".join(lines)))
    if name.endswith(".js"):
        plain = "\n".join(_tight(plain.splitlines()))
    return re.sub(r",?\n+(?=[)}\]])|(?<=[,;({\[])\n+", "", re.sub(r"\n{2,}", "\n", plain)).strip()


def _tight(lines: Sequence[str]) -> Iterator[str]:
    """Lines of a script without the blanks around operators; those with a template, or of one, as they stand."""
    inside = False
    for line in lines:
        inside ^= line.count("`") % 2 == 1
        if inside or "`" in line:
            yield line
        else:
            parts = _TEXT.split(line)
            yield "".join(t if k % 2 else _AROUND.sub(r"\1\2", t) for k, t in enumerate(parts))


def _json(data: Mapping[str, Any]) -> str:
    """JSON that no text in it can end or change a script with; a number that does not exist is null."""
    text = json.dumps(plain(data), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text
