"""The command that makes bodies with inertia of point masses."""

from pathlib import Path

import click

from tmsopt.cli.common import file_argument, output_option
from tmsopt.cli.guide.files import write_with_companions

_EXAMPLES = """
\b
Examples:
  tmsopt convert problems/point_mass_robot.toml -o robot.toml
  tmsopt convert problems/point_mass_robot.toml --body 40x20x30cm --front 10x10x30cm -o robot.toml
  tmsopt convert problems/point_mass_robot.toml --inertia none

Lengths, widths and heights of solid boxes about the centres of mass. By default the rear frame is 1/2, 1/4 and 3/8 of
the wheelbase and the front assembly 1/8, 1/8 and 3/8, neither higher than twice the height of its centre of mass.
Wheels are left out; the comments of the new file say how to add them.

Exit status: 0 done, 2 bad input, such as what has no counterpart in the other model, or a file that is there already.
"""


@click.command(epilog=_EXAMPLES)
@file_argument
@click.option("--to", default="whipple", show_default=True, metavar="[whipple]", help="The other model.")
@click.option("--inertia", default="boxes", show_default=True, metavar="[boxes|none]", help="What a body is.")
@click.option("--body", help="Size of the rear frame, such as 40x20x30cm.")
@click.option("--front", help="Size of the front assembly, such as 10x10x30cm.")
@output_option(("toml",), "A new file (toml). [default: stdout]")
def convert(file: Path, to: str, inertia: str, body: str | None, front: str | None, output: Path | None) -> None:
    """Make a problem of Whipple's bicycle of the point masses of FILE (tms)."""
    from tmsopt.guide import converted_file

    text = converted_file(file, to, inertia, body, front)
    if output is None:
        click.echo(text, nl=False)
    else:
        write_with_companions("--output", output, text)
