"""Commands that make or explain files, or recompute the paper: `tmsopt new`, `example`, `describe`, `schema`,
`convert`, `import`, `figure`, `verify`."""

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Literal

import click

import tmsopt
from tmsopt import guide
from tmsopt.cli.answers import (
    FIGURE_ENDINGS,
    Reply,
    answer,
    check_output,
    print_or_write,
    report_writing,
    write_file,
    write_new,
)
from tmsopt.cli.command import Command, OnFile, WithPlot, argument, option
from tmsopt.cli.terminal import progress_listener
from tmsopt.errors import input_error
from tmsopt.files import write_atomic, write_text
from tmsopt.progress import start_steps


class NewCommand(OnFile):
    """Write FILE, a commented problem to start from, and tmsopt.schema.json for editors.

    Examples:
      tmsopt new robot.toml && tmsopt solve robot.toml
      tmsopt new bicycle.toml --model whipple
      tmsopt new absorber.toml --model own

    Exit status: 0 done, 2 bad input, such as a FILE that is there already.
    """

    model: str = option("Model of the problem.", "tms", metavar="[tms|whipple|own]")

    def run(self) -> None:
        check_output("FILE", self.file, ("toml",))
        write_new("FILE", self.file, guide.new_problem(self.model))


def _complete_names(_context: Any, _argument: Any, incomplete: str) -> list[str]:
    return [name for name in guide.examples() if name.startswith(incomplete)]


class WithToml(Command):
    output: Path | None = option("Name of the new file (toml).", None, "-o", endings=("toml",))


class ExampleCommand(WithToml):
    """Write the example NAME here, with the files it refers to; without a name, list all.

    Examples:
      tmsopt example
      tmsopt example ep4 && tmsopt solve ep4.toml
      tmsopt example delivery_robot --output mine.toml

    Exit status: 0 done, 2 bad input, such as a file that is there already.
    """

    name: str | None = argument(None, shell_complete=_complete_names)
    json: bool = option("Write the list as JSON.")

    def run(self) -> None:
        if self.name is not None:
            path = self.output or Path(f"{self.name.removesuffix('.toml')}.toml")
            write_new("--output" if self.output else "NAME", path, guide.example(self.name))
        elif self.output is not None:
            raise input_error("found no NAME; tmsopt example lists all", "NAME")
        else:
            titles = guide.examples()
            width = max(map(len, titles), default=0)
            lines = "\n".join(f"{name.ljust(width)}  {title}" for name, title in titles.items())
            answer(self.json, lines, lambda: titles)


class DescribeCommand(Command):
    """Show symbols, units, signs and meanings of a model, or of the problem or study in FILE.

    Examples:
      tmsopt describe tms
      tmsopt describe whipple --json
      tmsopt describe problems/delivery_robot.toml

    Exit status: 0 done, 2 bad input.
    """

    what: str = argument(metavar="NAME|FILE")
    json: bool = option("Write JSON to stdout instead of text.")

    def run(self) -> None:
        description = tmsopt.describe(self.what)
        answer(self.json, description, description.to_json)


class SchemaCommand(Command):
    """Write the JSON Schema of problem and study files, with which editors complete and check them.

    Examples:
      tmsopt schema --output tmsopt.schema.json
      tmsopt schema | less

    Exit status: 0 done, 2 bad input.
    """

    output: Path | None = option("Name of the new file (json).  [default: stdout]", None, "-o", endings=("json",))

    def run(self) -> None:
        print_or_write(guide.schema_text(), self.output)


class ConvertCommand(WithToml, OnFile):
    """Make a problem of Whipple's bicycle from the point masses of FILE (tms).

    Examples:
      tmsopt convert problems/point_mass_robot.toml -o robot.toml
      tmsopt convert problems/point_mass_robot.toml --body 40x20x30cm -o robot.toml
      tmsopt convert problems/point_mass_robot.toml --inertia none

    Exit status: 0 done, 2 bad input, such as a file that is there already.
    """

    to: str = option("Model of the new problem.", "whipple", metavar="[whipple]")
    inertia: str = option("Shape of the bodies.", "boxes", metavar="[boxes|none]")
    body: str | None = option("Size of the rear frame, e.g. 40x20x30cm.")
    front: str | None = option("Size of the front assembly, e.g. 10x10x30cm.")

    def run(self) -> None:
        text = guide.converted_file(self.file, **self.select("to inertia body front"))
        print_or_write(text, self.output)


class ImportCommand(WithToml, OnFile):
    """Make a problem file of a bicycle that was measured with BicycleParameters.

    Examples:
      tmsopt import BrowserBenchmark.txt
      tmsopt import benchmark-browser.yml --speed 4.6 --output browser.toml

    Exit status: 0 done, 2 bad input.
    """

    speed: float | None = option("Speed in m/s.  [default: the speed in FILE, or 5]", type=click.FloatRange(0))

    def run(self) -> None:
        from tmsopt.models import problem_text, read_bicycle

        text = problem_text(read_bicycle(self.file), self.speed)
        if self.output is None:
            click.echo(text, nl=False)
        write_file("--output", self.output, lambda path: write_text(path, text))


class FigureCommand(Command):
    """Draw the figure NAME of the paper, or all figures.

    NAME is a name that --list shows, a label of the paper such as fig3, or 'all'.

    Examples:
      tmsopt figure --list
      tmsopt figure fig3 --output locus.pdf
      tmsopt figure all --output figures --format svg

    Exit status: 0 drawn, 2 bad input.
    """

    name: str | None = argument(None)
    output: Path | None = option("File, or with 'all' a folder.  [default: NAME.png]")
    format: Literal["png", "pdf", "svg"] | None = option("Format.  [default: ending of --output, or png]")
    json: bool = option("Write names, captions and file names as JSON.")
    list: bool = option("List the figures and draw nothing.")

    def run(self) -> None:
        from tmsopt.plots.paper import GALLERY, find_item

        if not (self.name or self.list):  # no NAME, or an empty one
            raise input_error(f"missing; accepted: {' '.join(GALLERY)} all", "NAME")
        is_for_all = self.list or self.name == "all"
        items = [*GALLERY.values()] if is_for_all else [find_item(str(self.name))]
        data = [{"name": item.name, "alias": item.alias, "caption": item.caption} for item in items]
        if not self.list:
            files = self._choose_files([f"{item.name}.{self.format or 'png'}" for item in items], is_for_all)
            _draw_items(items, files)
            data = [{**item_data, "file": str(path)} for item_data, path in zip(data, files, strict=True)]
        if self.json or self.list:
            text = "\n".join(map(_describe_item, items))
            answer(self.json, text, lambda: {"schema": 1, "figures": data})

    def _choose_files(self, names: Sequence[str], is_for_all: bool) -> Sequence[Path]:
        """The files to write; raise InputError if a file cannot be written."""
        files = [self.output or Path(names[0])]
        if is_for_all:
            folder = self.output or Path()
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise input_error(f"'{folder}' cannot be a directory: {error.strerror}", "--output") from None
            files = [folder / name for name in names]
        for path in files:
            check_output("--output", path, (self.format,) if self.format else FIGURE_ENDINGS)
        return files


def _describe_item(item: Any) -> str:
    name = f"{item.name} ({item.alias})" if item.alias else item.name
    return f"{name}\n{click.wrap_text(item.caption, 100, '    ', '    ')}"


def _draw_items(items: Sequence[Any], files: Sequence[Path]) -> None:
    from tmsopt.plots.paper import render_pictures

    steps = start_steps(progress_listener(), "drawing", "figure")
    with closing(render_pictures(items, [path.suffix[1:].lower() for path in files])) as finished_pictures:
        for count, (k, picture) in enumerate(finished_pictures, start=1):
            with report_writing("--output", files[k]), write_atomic(files[k]) as temporary:
                temporary.write_bytes(picture)
            if steps:
                steps(count, len(items), items[k].name)


class VerifyCommand(WithPlot):
    """Recompute every number and statement of the paper, and give a verdict on each.

    Examples:
      tmsopt verify --only 'tab1-*' --only epset
      tmsopt verify --json > ledger.json
      tmsopt verify --markdown problems/paper.md

    Exit status: 0 the ledger was computed, whatever its verdicts; 2 bad input.
    """

    markdown: Path | None = option("Write the ledger as a page (md).", endings=("md",))
    only: tuple[str, ...] = option("Compute only these entries; wildcards: * and ?.", metavar="KEY")

    def run(self) -> Reply:
        from tmsopt.documents import write_ledger_page

        ledger = tmsopt.verify(progress_listener(), self.only)
        write_file("--markdown", self.markdown, lambda path: write_text(path, write_ledger_page(ledger)))
        return Reply(ledger)
