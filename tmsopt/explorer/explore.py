"""One page for a problem: solved where it asks something, with what is worth going to."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.metadata import version
from importlib.resources import files
from os import PathLike
from typing import Any, Unpack

from tmsopt.errors import input_error
from tmsopt.explorer.javascript import kernel_script, model_script
from tmsopt.explorer.known import Known, known_designs
from tmsopt.explorer.subject import subject
from tmsopt.files import as_path, write_text
from tmsopt.problem import Given, Posed, Problem, Solution, pose
from tmsopt.problem.toml import read_page
from tmsopt.program.options import CommonOptions
from tmsopt.progress import start_steps
from tmsopt.records import plain
from tmsopt.search import solve

_HEIGHT = 900  # pixels of the frame in a notebook: header and the first row of pictures
_ENDINGS = (".html", ".htm")

_COMMENT = re.compile(r"^//.*$|^/\*\*[\s\S]*?\*/$", re.MULTILINE)
_BLANKS = re.compile(r"\s*([{};,])\s*|(:)\s+")  # that mean nothing in a style
_TEXT = re.compile(r'("(?:[^"\\]|\\.)*")')
_AROUND = re.compile(r" ?([=!]==|=>|\*=|[<>]=?|[?:|&*]{1,2}|[-+]=|[=,;{}()\[\]]) ?| ([-+]) (?![-+])")  # in a script
_PARTS = "numerics state axes chart plane growth bicycle motion controls facts api main"


@dataclass(frozen=True, repr=False)
class Explorer:
    """A page for a browser, complete in itself.

    Attributes:
        problem: that the page is about.
        solution: its optimum, None where nothing was asked.
        html: the page, which asks nothing of any server.

    Example:
        >>> page = tmsopt.explore("problems/ep4.toml")
        >>> page.solution.structure, "<script src" in page.html, "https://" in page.html
        ('EP4', False, False)

    More: docs/how_to/explorer.md
    """

    problem: Problem
    solution: Solution | None
    html: str = field(compare=False)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the page, as a whole or not at all.

        Raises:
            InputError: for a name that does not end in html or htm.
            OSError: when the file cannot be written.
        """
        path = as_path(path, "the file to write")
        if path.suffix.lower() not in _ENDINGS:
            raise input_error(f"found '{path}'; accepted: a file name ending in html, htm", "path")
        write_text(path, self.html)

    def __repr__(self) -> str:
        return f"Explorer({self.problem.title or self.problem.model.title}; {len(self.html.encode()) / 1000:.0f} kB)"

    def _repr_html_(self) -> str:
        return frame(self.html, self.problem.title)


def explore(problem: Given, **options: Unpack[CommonOptions]) -> Explorer:
    """The page of a problem, which is solved if it asks something; of a solution, without solving it again.

    The page shows one design at a time: of bands and tolerances the nominal one. For a front it minimises the
    first objective. A design that violates something, or did not converge, is shown as what it is.

    Args:
        problem: or the path of its file, or a solution.
        options: ``starts``, ``seed``, ``linear_solver`` and ``progress``; see `tmsopt.Options`.

    Raises:
        InputError: for a file with faults, and for anything that is no problem.

    Example:
        >>> tmsopt.explore("problems/benchmark.toml").html.startswith("<!DOCTYPE html>")
        True

    More: docs/how_to/explorer.md
    """
    told = options.get("progress")
    model = read_page(problem, "problem").data.get("model") if isinstance(problem, str | PathLike) else None
    posed, solution = pose(problem), problem if isinstance(problem, Solution) else None
    if solution is None:
        if posed.pareto:
            posed = posed.derive(pareto=(), minimize=posed.pareto[0])
        if posed.sense != "evaluate" or not posed.free:
            solution = solve(posed, throw=False, stability=0.0, **options)
    start_steps(told, "looking for designs worth going to")
    designs = known_designs(posed, solution, search=True)
    start_steps(told, "writing the page")
    html = _write_html(posed, designs, model if isinstance(model, dict) else {}, trace_curves=True)
    return Explorer(posed.problem, solution, html)


def page_of(
    design: Problem | Posed | Solution,
    others: Sequence[tuple[str, Mapping[str, float]]] = (),
    *,
    trace_curves: bool = False,
) -> str:
    """The page of a problem as it stands, or of a solution, as HTML; nothing is searched for it.

    Args:
        others: names and parameters of more designs to go to; of a problem the page opens at the first.
        trace_curves: whether to trace what bounds stability around the design that the page opens at.
    """
    problem, solution = pose(design), design if isinstance(design, Solution) else None
    return _write_html(problem, known_designs(problem, solution, search=False, others=others), {}, trace_curves)


def frame(html: str, title: str) -> str:
    """A page within another one, of which it can neither see nor change anything."""
    return (
        f'<iframe title="{escape(title or "explorer")}" sandbox="allow-scripts allow-downloads" '
        f'style="width:100%;height:{_HEIGHT}px;border:0" srcdoc="{escape(html)}"></iframe>'
    )


# The page as one file: what is the same in every page, with the formulas and the data of this one


def _write_html(problem: Posed, designs: Sequence[Known], model: Mapping[str, Any], trace_curves: bool) -> str:
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
    text = re.sub(r" // .*", "", _COMMENT.sub("", "\n".join(lines)))
    if name.endswith(".js"):
        text = "\n".join(_tight(text.splitlines()))
    return re.sub(r",?\n+(?=[)}\]])|(?<=[,;({\[])\n+", "", re.sub(r"\n{2,}", "\n", text)).strip()


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
