"""One page for a problem: solved where it asks something, with what is worth going to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from os import PathLike
from typing import Unpack

from tmsopt.errors import input_error
from tmsopt.explorer.known import known_designs
from tmsopt.explorer.page import html_of
from tmsopt.files import as_path, write_text
from tmsopt.problem import Given, Posed, Problem, Solution, pose
from tmsopt.problem.toml import read_page
from tmsopt.program.options import CommonOptions
from tmsopt.progress import start_steps
from tmsopt.search import solve

_HEIGHT = 900  # pixels of the frame in a notebook: header and the first row of pictures
_ENDINGS = (".html", ".htm")


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
    html = html_of(posed, designs, model if isinstance(model, dict) else {}, trace_curves=True)
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
    return html_of(problem, known_designs(problem, solution, search=False, others=others), {}, trace_curves)


def frame(html: str, title: str) -> str:
    """A page within another one, of which it can neither see nor change anything."""
    return (
        f'<iframe title="{escape(title or "explorer")}" sandbox="allow-scripts allow-downloads" '
        f'style="width:100%;height:{_HEIGHT}px;border:0" srcdoc="{escape(html)}"></iframe>'
    )
