"""The commands that say what a model or a file is made of, to readers and to editors."""

from pathlib import Path

import click

import tmsopt
from tmsopt.cli.common import answer, json_option, output_option
from tmsopt.cli.guide.files import write_new

_EXAMPLES = """
\b
Examples:
  tmsopt describe tms
  tmsopt describe whipple --json
  tmsopt describe problems/delivery_robot.toml

Of a file: its values and bounds in the units in which they were typed, its limits, and everything that an expression in
it may name; of a system of your own also its matrices.

Exit status: 0 done, 2 bad input.
"""

_OF_SCHEMA = """
\b
Examples:
  tmsopt schema --output tmsopt.schema.json
  tmsopt schema | less

Editors with Taplo, such as VS Code with Even Better TOML, complete and explain names and mark what is wrong in a file
whose first line is: #:schema ./tmsopt.schema.json

Exit status: 0 done, 2 bad input.
"""


@click.command(epilog=_EXAMPLES)
@click.argument("what", metavar="NAME|FILE")
@json_option
def describe(what: str, as_json: bool) -> None:
    """Show symbols, units, signs and meanings of a model, or of the problem or study in FILE."""
    found = tmsopt.describe(what)
    answer(as_json, found.to_json, found.report)


@click.command(epilog=_OF_SCHEMA)
@output_option(("json",), "Write a new file (json), never over one. [default: stdout]")
def schema(output: Path | None) -> None:
    """Write the JSON Schema of problem and study files, by which editors complete, explain and check them."""
    from tmsopt.guide import schema_text

    if output is None:
        click.echo(schema_text(), nl=False)
    else:
        write_new("--output", output, schema_text())
