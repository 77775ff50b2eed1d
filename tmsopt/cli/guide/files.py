"""The commands that write files to start from."""

from pathlib import Path

import click

from tmsopt.cli.common import check_output, file_argument, output_option, saving, write_json
from tmsopt.errors import input_error
from tmsopt.files import write_text

_OF_NEW = """
\b
Examples:
  tmsopt new robot.toml && tmsopt solve robot.toml
  tmsopt new bicycle.toml --model whipple
  tmsopt new absorber.toml --model own

The file has a comment at each line and solves as it stands. tmsopt.schema.json is written beside it unless it is there:
editors explain and complete by it, and it may be removed.

Exit status: 0 done, 2 bad input, such as a FILE that is there already.
"""

_OF_EXAMPLE = """
\b
Examples:
  tmsopt example
  tmsopt example ep4 && tmsopt solve ep4.toml
  tmsopt example delivery_robot --output mine.toml

What a file refers to is written beside it, unless it is there: tmsopt.schema.json for editors, the problem of a study,
bicycles/ where it names a bicycle.

Exit status: 0 done, 2 bad input, such as a file that is there already.
"""


def write_new(option: str, path: Path, text: str) -> None:
    """Write a file that is not there; where one is, or none can be, say so and end with exit status 2."""
    with saving(option, path):
        write_text(path, text, new=True)


def write_with_companions(option: str, path: Path, text: str) -> None:
    """Write a new file, and beside it what it refers to, unless that is there."""
    from tmsopt.guide import companions

    beside = {path.parent / name: other for name, other in companions(text).items()}
    for file, content in {path: text, **beside}.items():
        if file == path or (file.parent == path.parent and not file.exists()):
            write_new(option, file, content)
    for folder in {file.parent for file in beside} - {path.parent}:
        with saving(option, folder):
            folder.mkdir(exist_ok=True)
            for file, content in beside.items():
                if file.parent == folder and not file.exists():
                    write_text(file, content, new=True)


@click.command(epilog=_OF_NEW)
@file_argument
@click.option("--model", default="tms", show_default=True, metavar="[tms|whipple|own]", help="What it is about.")
def new(file: Path, model: str) -> None:
    """Write FILE, a commented problem to start from."""
    from tmsopt.guide import new_problem

    check_output("FILE", file, ("toml",))
    write_with_companions("FILE", file, new_problem(model))


def _names(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[str]:
    from tmsopt.guide import examples

    return [name for name in examples() if name.startswith(incomplete)]


@click.command(epilog=_OF_EXAMPLE)
@click.argument("name", required=False, shell_complete=_names)
@output_option(("toml",), "Another file (toml). [default: NAME.toml]")
@click.option("--json", "as_json", is_flag=True, help="Write the list as JSON.")
def example(name: str | None, output: Path | None, as_json: bool) -> None:
    """Write the example NAME here; without a name, list all that come with tmsopt."""
    from tmsopt.guide import example as text_of, examples

    if name is not None:
        path = output or Path(f"{name.removesuffix('.toml')}.toml")
        write_with_companions("NAME" if output is None else "--output", path, text_of(name))
    elif output is not None:
        raise input_error("found no NAME; tmsopt example lists all", "NAME")
    elif as_json:
        write_json(examples())
    else:
        width = max(map(len, examples()), default=0)
        click.echo("\n".join(f"{name.ljust(width)}  {title}" for name, title in examples().items()))
