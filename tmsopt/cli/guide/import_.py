"""The command that makes a problem file of a measured bicycle."""

from pathlib import Path

import click

from tmsopt.cli.common import file_argument, output_option, write_file
from tmsopt.files import write_text

_EXAMPLES = """
\b
Examples:
  tmsopt import BrowserBenchmark.txt
  tmsopt import benchmark-browser.yml --speed 4.6 --output browser.toml

FILE is one of the program BicycleParameters: lines such as rF = 0.344+/-0.0001, or YAML with values. A problem file can
also name it: bicycle = "BrowserBenchmark.txt" in place of the parameters that it gives.

Exit status: 0 done, 2 bad input.
"""


@click.command("import", epilog=_EXAMPLES)
@file_argument
@output_option(("toml",), "Write the problem file (toml). [default: stdout]")
@click.option("--speed", type=click.FloatRange(min=0), help="In m/s. [default: of FILE, or 5]")
def import_(file: Path, output: Path | None, speed: float | None) -> None:
    """Make a problem file of a bicycle that BicycleParameters has measured."""
    from tmsopt.models import problem_text, read_bicycle

    text = problem_text(read_bicycle(file), speed)
    if output is None:
        click.echo(text, nl=False)
    write_file("--output", output, lambda path: write_text(path, text))
