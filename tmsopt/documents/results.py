"""The document, headline, picture and page of any result, and the table of all kinds of results."""

import math
import platform
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from importlib import import_module
from os import PathLike
from typing import TYPE_CHECKING, Any

from tmsopt.documents.blocks import Badge, Block, Chapter, Document, Level, Parts, Sentence
from tmsopt.documents.text import to_headline, to_text
from tmsopt.errors import Fault, InputError, short
from tmsopt.files import as_path, write_text
from tmsopt.progress import Listener, start_steps
from tmsopt.versions import installed_versions

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from tmsopt.problem import Solution

_RESULTS = {
    "solution": {"Solution": "draw_growth"},
    "explanation": {"Explanation": "draw_rounding", "Optimality": "draw_roots", "Diagnosis": "draw_splitting"},
    "sensitivity": {"Eigenvalues": ""},
    "robustness": {"Robustness": "draw_robustness", "Nearest": "draw_robustness"},
    "motion": {"Speeds": "draw_speeds", "Growth": "draw_growth", "Simulation": "draw_motion"},
    "curves": {
        "Trace": "draw_trace",
        "Branch": "",
        "Domain": "draw_domain",
        "Swallowtail": "draw_swallowtail",
        "Chart": "draw_chart",
    },
    "spectra": {"Loop": "draw_loop", "Sheets": "draw_sheets"},
    "fronts": {"Front": "draw_front"},
    "studies": {"Results": "draw_histogram"},
    "proofs": {"Proof": "draw_roots", "Every": "draw_designs"},
    "paper": {"Comparison": "draw_comparison", "Ledger": "draw_ledger"},
    "descriptions": {"Description": ""},
}
"""Module → class of result → function in `tmsopt.plots` that draws it; empty if the result has no picture.

The module has a generator for each class, such as `write_solution`. It is imported at its first use.
"""

MODULE_BY_CLASS = {name: module for module, names in _RESULTS.items() for name in names}
"""Class of a result → the module that writes its document."""

ENDINGS = ("html", "htm")
"""File name endings of a page."""

_PACKAGES = ("tmsopt", "CasADi", "NumPy")


def document_of(result: Any, level: Level = "brief", **options: Any) -> Document:
    """Build the document of a result.

    Args:
        options: options of the function that writes the document, such as `si` of `write_solution`.
    """
    document, parts = _begin_document(result, level, **options)
    blocks: list[Block] = []
    chapters = {Chapter("answer"): blocks}
    for part in parts:
        match part:
            case Chapter():
                blocks = chapters.setdefault(part, [])
            case "" | Sentence("") | tuple():
                continue
            case str():
                blocks.append(Sentence(part))
            case _:
                blocks.append(part)
    filled_chapters = (replace(chapter, blocks=tuple(blocks)) for chapter, blocks in chapters.items() if blocks)
    return replace(document, chapters=tuple(filled_chapters))


def _begin_document(result: Any, level: Level, **options: Any) -> tuple[Document, Parts]:
    """Return the document without its chapters, and a generator of the chapters and their blocks."""
    name = type(result).__name__
    module: Any = import_module(f"tmsopt.documents.{MODULE_BY_CLASS[name]}")
    parts = getattr(module, f"write_{name.lower()}")(result, level, **options)
    badges = [Badge(badge) if isinstance(badge, str) else badge for badge in next(parts)]
    return Document(name, title_of(result), tuple(badge for badge in badges if badge.text), level), parts


def picture_of(result: Any) -> str:
    """Return the name of the function in `tmsopt.plots` that draws a result; empty if it has no picture."""
    name = type(result).__name__
    return _RESULTS[MODULE_BY_CLASS[name]][name]


def report(result: Any, full: bool = False) -> str:
    """Write the report of a result as text."""
    return to_text(document_of(result, "full" if full else "brief"))


def headline(result: Any) -> str:
    """Write the kind of a result, how its computation ended, and its title as far as it fits, in one line."""
    document, _ = _begin_document(result, "brief")
    return to_headline(document)


def title_of(result: Any) -> str:
    """Find the title of a result, or of its study, problem or design; empty if there is none."""
    designs = (getattr(result, "design", None), *getattr(result, "solutions", ()))
    holders = (result, getattr(result, "study", None), *designs)
    candidates = (*holders, *(getattr(holder, "problem", None) for holder in holders))
    stored_title = getattr(result, "about", {}).get("title", "")  # a chart's folder may not contain its problem
    return " ".join(next((t for x in candidates if (t := getattr(x, "title", ""))), stored_title).split())


def draw(result: Any, ax: "Axes | None" = None) -> "Axes":
    """Draw a result into Axes.

    Raises:
        InputError: if the result has no picture, or if `ax` is not Axes.
    """
    from matplotlib.axes import Axes

    from tmsopt import plots

    if not isinstance(ax, Axes | None):
        raise InputError([Fault(f"found {type(ax).__name__}; accepted: Axes of Matplotlib, or None", ("ax",))])
    if not (name := picture_of(result)):
        advice = "plot a solution of it, or the result that it is a part of"
        raise InputError([Fault(f"there is no picture of a {type(result).__name__} alone; {advice}")])
    axes: Axes = getattr(plots, name)(result, ax=ax)
    return axes


def plot(result: Any, ax: "Axes | None" = None) -> "Axes":
    """Draw a result for a user: pyplot manages a new figure, so that a notebook or ``plt.show()`` shows it.

    Raises:
        InputError: as `draw`.
    """
    axes = draw(result, ax)
    if ax is None:
        import matplotlib.pyplot as plt
        from matplotlib._pylab_helpers import Gcf

        empty_figure = plt.figure()
        number, canvas = empty_figure.number, type(empty_figure.canvas)
        plt.close(empty_figure)
        figure: Any = axes.get_figure()
        Gcf._set_new_active_manager(canvas.new_manager(figure, number))
    return axes


def to_notebook(result: Any) -> str:
    """Write a result for a notebook: its badges, its brief document and its picture."""
    from tmsopt.documents.html import to_fragment

    options: dict[str, Any] = {"tabulated": True} if type(result).__name__ == "Solution" else {}
    return to_fragment(document_of(result, **options), lambda: draw(result))


def save_report(
    result: Any,
    path: str | PathLike[str],
    *,
    command: str = "",
    files: Mapping[str, str] | None = None,
    seed: int | None = None,
    full: bool = False,
    design: "Solution | None" = None,
    progress: Listener | None = None,
) -> None:
    """Write a result as one page: the answer, pictures, tables, the explorer, the report as text, and its origin.

    Args:
        path: the file to write; its name ends in html or htm.
        command: the command that computed the result, as typed.
        files: name → text of the files that state the problem.
        seed: random seed of the starts.
        full: whether to include slow analyses, such as a new solution for each active limit, and all numbers.
        design: the solution that a proof is about, for pictures and the explorer.
        progress: is called with a `tmsopt.Progress` from time to time.

    Raises:
        InputError: if `result` is not a result, or if `path` has another ending.
        OSError: when the file cannot be written.

    Example:
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     tmsopt.save_report(tmsopt.describe("tms"), f"{folder}/tms.html")
        ...     "Froude number" in Path(folder, "tms.html").read_text(encoding="utf-8")
        True

    More: docs/how_to/hand_on.md
    """
    if type(result).__name__ not in MODULE_BY_CLASS:
        raise InputError([Fault(f"found {short(result)}; accepted: a result, such as a solution", ("result",))])
    file = as_path(path, "the file to write")
    if file.suffix.lstrip(".").lower() not in ENDINGS:
        raise InputError([Fault(f"found '{file}'; accepted: a file name ending in {', '.join(ENDINGS)}", ("path",))])
    from tmsopt.documents.explored import frame_explorer
    from tmsopt.documents.html import mark_verbatim, to_page

    steps = start_steps(progress, "writing the page", "part")
    options: dict[str, dict[str, Any]] = {"Solution": {"full": full}, "Proof": {"design": design}}
    document = document_of(result, "page", **options.get(type(result).__name__, {}))
    if steps:
        steps(1, math.nan, "the document is done")
    text = mark_verbatim(report(result, full), "report as text")
    origin = _mark_origin({"command": command, **(files or {})}, getattr(getattr(result, "study", None), "seed", seed))
    extra_chapters = (
        (Chapter("explorer", width="whole"), frame_explorer(result, design)),
        (Chapter("text", "As text", "whole"), f"<details><summary>The report as text</summary>{text}</details>"),
        (Chapter("origin", "Origin", "whole"), origin),
    )
    write_text(file, to_page(document, extra_chapters))


def _mark_origin(texts: Mapping[str, str], seed: int | None) -> str:
    """Mark up versions, system, date and seed, then the command and the files."""
    from tmsopt.documents.html import escape_text, mark_list, mark_verbatim

    facts = {name: version or "" for name, version in installed_versions(_PACKAGES).items()} | {
        "Python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}".strip(),
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "seed": "" if seed is None else str(seed),
    }
    marked_texts = (
        f"<h3>{escape_text(name)}</h3>\n{mark_verbatim(text, name)}" for name, text in texts.items() if text
    )
    return mark_list(facts.items()) + "\n".join(marked_texts)


def response(solution: Any, **options: Any) -> Any:
    """Simulate the motion of a solution; the method `Solution.response` calls this function."""
    from tmsopt.dynamics import simulate  # imports SciPy, which nothing else here needs

    return simulate(solution, **options)


def analyse(solution: Any) -> Any:
    """Create the analyses of a solution; the attribute `Solution.analysis` calls this function."""
    from tmsopt.documents.analysis import Analysis

    return Analysis(solution)
