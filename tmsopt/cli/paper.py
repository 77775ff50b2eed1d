"""`tmsopt figure` and `verify`: the figures of the paper, and its numbers recomputed."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

import tmsopt
from tmsopt.cli.answers import Reply, answer
from tmsopt.cli.command import Command, WithPlot, argument, option
from tmsopt.cli.outputs import FIGURES, check_output, report_writing, write_file
from tmsopt.cli.terminal import progress_listener
from tmsopt.errors import input_error
from tmsopt.files import write_atomic, write_text
from tmsopt.progress import start_steps

if TYPE_CHECKING:
    from tmsopt.plots.paper import Item


class FigureCommand(Command):
    """Draw the figure NAME of the paper, or all of them.

    NAME is one that --list shows, its label in the paper such as fig3, or 'all'.

    Examples:
      tmsopt figure --list
      tmsopt figure fig3 --output locus.pdf
      tmsopt figure all --output figures --format svg

    Exit status: 0 drawn, 2 bad input.
    """

    name: str | None = argument(None)
    output: Path | None = option("File, or with 'all' a folder.  [default: NAME.png]")
    format: Literal["png", "pdf", "svg"] | None = option("[default: as --output ends, or png]")
    json: bool = option("Write names, captions and files as JSON.")
    list: bool = option("List the figures and draw nothing.")

    def run(self) -> None:
        from tmsopt.plots.paper import GALLERY, find

        if not (self.name or self.list):  # no label of the paper is empty either
            raise input_error(f"missing; accepted: {' '.join(GALLERY)} all", "NAME")
        every = self.list or self.name == "all"
        items = [*GALLERY.values()] if every else [find(str(self.name))]
        data = [{"name": item.name, "alias": item.alias, "caption": item.caption} for item in items]
        if not self.list:
            files = self._choose_files([f"{item.name}.{self.format or 'png'}" for item in items], every)
            _draw_items(items, files)
            data = [{**one, "file": str(path)} for one, path in zip(data, files, strict=True)]
        if self.json or self.list:
            answer(self.json, "\n".join(_caption_items(items)), lambda: {"schema": 1, "figures": data})

    def _choose_files(self, names: Sequence[str], every: bool) -> Sequence[Path]:
        """The files to write, unless one of them cannot be."""
        files = [self.output or Path(names[0])]
        if every:
            folder = self.output or Path()
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise input_error(f"'{folder}' cannot be a directory: {error.strerror}", "--output") from None
            files = [folder / name for name in names]
        for path in files:
            check_output("--output", path, (self.format,) if self.format else FIGURES)
        return files


def _caption_items(items: "Sequence[Item]") -> Iterator[str]:
    for item in items:
        yield f"{item.name} ({item.alias})" if item.alias else item.name
        yield click.wrap_text(item.caption, 100, "    ", "    ")


def _draw_items(items: "Sequence[Item]", files: Sequence[Path]) -> None:
    from tmsopt.plots.paper import pictures

    steps = start_steps(progress_listener(), "drawing", "figure")
    with closing(pictures(list(items), [path.suffix[1:].lower() for path in files])) as drawn:
        for done, (k, picture) in enumerate(drawn, start=1):
            with report_writing("--output", files[k]), write_atomic(files[k]) as temporary:
                temporary.write_bytes(picture)
            if steps:
                steps(done, len(items), items[k].name)


class VerifyCommand(WithPlot):
    """Recompute every number and statement of the source paper, with a verdict on each.

    Examples:
      tmsopt verify --only 'tab1-*' --only epset
      tmsopt verify --json > ledger.json
      tmsopt verify --markdown problems/paper.md

    Exit status: 0 when the ledger was computed, whatever the verdicts; 2 bad input.
    """

    markdown: Path | None = option("Write the ledger as a page (md).", endings=("md",))
    only: tuple[str, ...] = option("Compute these entries; * and ? are wildcards.", metavar="KEY")

    def run(self) -> Reply:
        from tmsopt.documents import write_ledger_page

        ledger = tmsopt.verify(progress_listener(), self.only)
        write_file("--markdown", self.markdown, lambda path: write_text(path, write_ledger_page(ledger)))
        return Reply(ledger)
