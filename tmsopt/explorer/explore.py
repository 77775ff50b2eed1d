"""Writes one page for a problem: its solution, if the problem has an objective, and other designs."""

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
from tmsopt.explorer.designs import PageDesign, list_designs
from tmsopt.explorer.javascript import is_bicycle, kernel_script, model_script
from tmsopt.explorer.page_data import make_page_data
from tmsopt.files import as_path, write_text
from tmsopt.problem import Posed, Problem, ProblemSource, Solution, pose
from tmsopt.problem.real_form import real_form
from tmsopt.problem.toml import read_page
from tmsopt.program.options import CommonOptions
from tmsopt.progress import start_steps
from tmsopt.records import plain
from tmsopt.search import solve

_FRAME_HEIGHT = 900  # pixels of the frame in a notebook; it shows the header and the first row of pictures
_ENDINGS = (".html", ".htm")

_COMMENT = re.compile(r"^//.*$|^/\*\*[\s\S]*?\*/$", re.MULTILINE)  # a comment on lines of its own
_STYLE_BLANKS = re.compile(r"\s*([{};,])\s*|(:)\s+")  # blanks that have no meaning in a style sheet
_TEXT = re.compile(r'("(?:[^"\\]|\\.)*")')  # a text in double quotes
_OPERATOR_BLANKS = re.compile(r" ?([=!]==|=>|\*=|[<>]=?|[?:|&*]{1,2}|[-+]=|[=,;{}()\[\]]) ?| ([-+/%]) (?![-+])")
"""Operators of a script with the blanks around them."""
_SCRIPT_NAMES = "numerics state axes chart plane growth motion controls facts api"


@dataclass(frozen=True, repr=False)
class Explorer:
    """A page for a browser that needs no other file.

    Attributes:
        problem: the problem that the page shows.
        solution: the optimum of the problem; None if the problem has no objective.
        html: the page, which sends no request to a server.

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
        """Write the page; the file is written completely or not at all.

        Raises:
            InputError: for a name that does not end in html or htm.
            OSError: if the file cannot be written.
        """
        path = as_path(path, "the file to write")
        if path.suffix.lower() not in _ENDINGS:
            raise input_error(f"found '{path}'; accepted: a file name ending in html, htm", "path")
        write_text(path, self.html)

    def __repr__(self) -> str:
        return f"Explorer({self.problem.title or self.problem.model.title}; {len(self.html.encode()) / 1000:.0f} kB)"

    def _repr_html_(self) -> str:
        return frame(self.html, self.problem.title)


def explore(problem: ProblemSource, **options: Unpack[CommonOptions]) -> Explorer:
    """Make the page of a problem, which is solved if it has an objective; a solution is not solved again.

    The page shows one design at a time, at the nominal values of bands and tolerances. For a front, the first objective
    is minimised. A design that is infeasible, or did not converge, is shown with its status.

    Args:
        problem: a problem, the path of its file, or a solution.
        options: ``starts``, ``seed``, ``linear_solver`` and ``progress``; see `tmsopt.Options`.

    Raises:
        InputError: for a file with faults, or an argument that is not a problem.

    Example:
        >>> tmsopt.explore("problems/benchmark.toml").html.startswith("<!DOCTYPE html>")
        True

    More: docs/how_to/explorer.md
    """
    listener = options.get("progress")
    model = read_page(problem, "problem").data.get("model") if isinstance(problem, str | PathLike) else None
    posed, solution = pose(problem), problem if isinstance(problem, Solution) else None
    real_form(posed)  # raises an error if the matrices are too large
    if solution is None:
        if posed.pareto:
            posed = posed.derive(pareto=(), minimize=posed.pareto[0])
        if posed.sense != "evaluate" or not posed.free:
            solution = solve(posed, throw=False, stability=0.0, **options)
    start_steps(listener, "looking for other designs")
    designs = list_designs(posed, solution, search=True)
    start_steps(listener, "writing the page")
    html = _write_html(posed, designs, model if isinstance(model, dict) else {}, trace_curves=True)
    return Explorer(posed.problem, solution, html)


def page_of(
    design: Problem | Posed | Solution,
    more_designs: Sequence[tuple[str, Mapping[str, float]]] = (),
    *,
    trace_curves: bool = False,
) -> str:
    """The page of a problem or a solution as HTML, without a search for further designs.

    Args:
        more_designs: names and parameters of more designs; the page of a problem opens with the first of them.
        trace_curves: whether to trace the boundaries of stability around the design with which the page opens.
    """
    problem, solution = pose(design), design if isinstance(design, Solution) else None
    designs = list_designs(problem, solution, search=False, more_designs=more_designs)
    return _write_html(problem, designs, {}, trace_curves)


def frame(html: str, title: str) -> str:
    """A page in a frame of another page; it can neither read nor change that page."""
    return (
        f'<iframe title="{escape(title or "explorer")}" sandbox="allow-scripts allow-downloads" '
        f'style="width:100%;height:{_FRAME_HEIGHT}px;border:0" srcdoc="{escape(html)}"></iframe>'
    )


# The page is one file. It has the parts that are the same in every page, and the formulas and data of one problem.


def _write_html(problem: Posed, designs: Sequence[PageDesign], model: Mapping[str, Any], trace_curves: bool) -> str:
    """The page of a problem; the arguments are those of `make_page_data`."""
    script = model_script(problem)
    data = make_page_data(problem, designs, script, model, trace_curves) | {"version": version("tmsopt")}
    page_scripts = (
        script.text,
        kernel_script(real_form(problem).problem.model.degree),
        f"const DATA = {_format_json(data)};",
    )
    names = f"{_SCRIPT_NAMES} {'bicycle' if is_bicycle(problem) else 'sheets'} main".split()
    contents = {  # mark in page.html → what replaces it
        "<!-- title -->": escape(problem.title or problem.model.title),
        "/* style */": _STYLE_BLANKS.sub(r"\1\2", _read_minified("page.css")),
        "/* script */": "\n".join([*page_scripts, *(_read_minified(f"{name}.js") for name in names)]),
    }
    pattern = "|".join(map(re.escape, contents))
    # All marks are replaced at once, because a title may look like a mark.
    return re.sub(pattern, lambda mark: contents[mark[0]], _read_minified("page.html"))


def _read_minified(name: str) -> str:
    """A file of the page without indentation, comments, line breaks and blanks that a browser does not need."""
    text = (files("tmsopt.explorer") / "page" / name).read_text(encoding="utf-8")
    lines = [line.strip() for line in text.splitlines()]
    text = re.sub(r" // .*", "", _COMMENT.sub("", "\n".join(lines)))
    if name.endswith(".js"):
        text = "\n".join(_strip_blanks(text.splitlines()))
    return re.sub(r",?\n+(?=[)}\]])|(?<=[,;({\[])\n+", "", re.sub(r"\n{2,}", "\n", text)).strip()


def _strip_blanks(lines: Sequence[str]) -> Iterator[str]:
    """Lines of a script without blanks around operators; lines with a template literal stay unchanged."""
    is_in_template = False
    for line in lines:
        is_in_template ^= line.count("`") % 2 == 1
        if is_in_template or "`" in line:
            yield line
        else:
            parts = _TEXT.split(line)
            yield "".join(t if k % 2 else _OPERATOR_BLANKS.sub(r"\1\2", t) for k, t in enumerate(parts))


def _format_json(data: Mapping[str, Any]) -> str:
    """JSON in which no text can end or change the script around it; nan is null."""
    text = json.dumps(plain(data), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text
