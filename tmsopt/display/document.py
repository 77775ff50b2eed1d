"""A result as one file to hand on: it needs no network and no script, and whoever reads it has no tmsopt."""

import math
import platform
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from importlib.resources import files as resources
from os import PathLike
from typing import TYPE_CHECKING, Any

from tmsopt.display import document_parts as parts
from tmsopt.display.document_designs import explored
from tmsopt.display.markup import Chapter, facts, verbatim, words
from tmsopt.display.page import badges
from tmsopt.display.writers import WRITERS, report, title_of
from tmsopt.errors import Fault, InputError, short
from tmsopt.files import path_of, write_text
from tmsopt.progress import Counts, Listener, start_steps
from tmsopt.versions import installed

if TYPE_CHECKING:
    from tmsopt.problem import Solution

ENDINGS = ("html", "htm")
"""Of the name of a document."""

_PARTS: Mapping[str, Callable[[Any], Iterator[Chapter]]] = {
    "Chart": parts.of_chart,
    "Trace": parts.of_trace,
    "Front": parts.of_front,
    "Results": parts.of_results,
}
_PACKAGES = ("tmsopt", "CasADi", "NumPy")
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Nothing is asked of any server, whatever the page holds."""


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
    """Write a result as one page: the answer, pictures, tables, the explorer, the report as text, and where it is from.

    Args:
        path: ends in html or htm.
        command: that found it, as typed.
        files: name → text of what it was asked by.
        seed: of the starts.
        full: all there is to say: gains of limits solved again, every number of the report.
        design: of a proof, what it was proved of: for its pictures and the explorer.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for what is no result, or another ending.
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
    if type(result).__name__ not in WRITERS:
        raise InputError([Fault(f"found {short(result)}; accepted: a result, such as a solution", ("result",))])
    place = path_of(path, "the file to write")
    if place.suffix.lstrip(".").lower() not in ENDINGS:
        raise InputError([Fault(f"found '{place}'; accepted: a file name ending in {', '.join(ENDINGS)}", ("path",))])
    steps = start_steps(progress, "writing the page", "part")
    write_text(place, _document(result, command, files or {}, seed, full, design, steps))


def _document(
    result: Any,
    command: str,
    files: Mapping[str, str],
    seed: int | None,
    full: bool,
    design: "Solution | None",
    progress: Counts | None,
) -> str:
    """The whole page."""
    name, title = type(result).__name__, words(title_of(result) or "untitled")
    sections = []
    for done, part in enumerate(_sections(result, command, files, seed, full, design), 1):
        sections += [part] if part.body else []
        if progress:
            progress(done, math.nan, f"{part.heading} done")
    links = " ".join(f'<a href="#{part.name}">{words(part.heading)}</a>' for part in sections)
    body = "\n".join(part.markup for part in sections)
    style, script = (resources("tmsopt.display").joinpath("document", f"document.{ending}") for ending in ("css", "js"))
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>
{style.read_text(encoding="utf-8")}</style>
</head>
<body>
<header>
<h1>{title}</h1>
<p class="badges">{badges(result)}</p>
<nav aria-label="Parts of this {name.lower()}">{links}</nav>
</header>
<main>
{body}
</main>
<script>
{script.read_text(encoding="utf-8")}</script>
</body>
</html>
"""


def _sections(
    result: Any, command: str, files: Mapping[str, str], seed: int | None, full: bool, design: "Solution | None"
) -> Iterator[Chapter]:
    match type(result).__name__:
        case "Solution":
            yield from parts.of_solution(result, full)
        case "Proof":
            yield from parts.of_proof(result, design)
        case name:
            yield from _PARTS.get(name, parts.of_other)(result)
    yield Chapter("explorer", "Explorer", _explorer(result, design), "whole")
    text = verbatim(report(result, full), "report as text")
    yield Chapter("text", "As text", f"<details><summary>The report as text</summary>{text}</details>", "whole")
    yield Chapter("origin", "Where it is from", _origin(result, command, files, seed), "whole")


def _explorer(result: Any, design: "Solution | None") -> str:
    """The page that moves the design, in a frame from which nothing gets out; empty for what has none."""
    of, designs = explored(result, design)
    if of is None:
        return ""
    from tmsopt.explorer import frame, page_of

    problem: Any = getattr(of, "problem", None) or of
    of_H = problem.model.carrier is not None
    roots, side = ("eigenfrequencies", "below the real axis") if of_H else ("roots", "left of the imaginary axis")
    return (
        f"<p>Move a parameter, and see the {roots} move: disturbances die out where all are {side}.</p>\n"
        f"{frame(page_of(of, designs, trace_curves=True), 'Explorer of this problem')}\n"
        '<p class="print">The explorer is in the file itself, not on paper.</p>'
    )


def _origin(result: Any, command: str, files: Mapping[str, str], seed: int | None) -> str:
    """Versions, system, date, seed, command and files."""
    seed = getattr(getattr(result, "study", None), "seed", seed)
    listed = [(name, found or "") for name, found in installed(_PACKAGES).items()]
    when = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    system = f"{platform.system()} {platform.machine()}".strip()
    about = facts(
        (
            *listed,
            ("Python", platform.python_version()),
            ("system", system),
            ("date", when),
            ("seed", "" if seed is None else str(seed)),
        )
    )
    texts = {"command": command} | dict(files)
    return about + "\n".join(f"<h3>{words(n)}</h3>\n{verbatim(text, n)}" for n, text in texts.items() if text)
