"""All commands as one group, which loads the module of a command when it is first used."""

import os
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from tmsopt import __version__
from tmsopt.cli.context import SPELLINGS, WORDS, colour_option
from tmsopt.cli.ending import BAD_INPUT, STATUSES, report_end
from tmsopt.errors import InputError

_COMMANDS = {
    "solve": ("solve", "Find the best design, or the front of the best ones."),
    "explore": ("explore", "Write a page with sliders that shows why a design is stable."),
    "compare": ("proofs", "Compare the optimum with the closed-form laws."),
    "prove": ("proofs", "Prove that the solution exists, and whether it is stable."),
    "diagnose": ("proofs", "Show how each multiple root splits."),
    "speeds": ("motion", "Find every weave and capsize speed."),
    "simulate": ("motion", "Show the motion after a lean, a push, or in noise."),
    "trace": ("trace", "Trace a root pattern through parameter space."),
    "chart": ("chart", "Chart stability over two or three parameters."),
    "study": ("study", "Solve a problem for every row of a table or sample."),
    "figure": ("paper", "Draw the figures of the paper."),
    "verify": ("paper", "Recompute every number of the paper."),
    "import": ("guide", "Make a problem file from a measured bicycle."),
    "convert": ("guide", "Make a bicycle with inertia from one of point masses."),
    "new": ("guide", "Write a commented problem to start from."),
    "example": ("guide", "List the examples that come with tmsopt, or write one here."),
    "describe": ("guide", "Show what a model or a file is made of."),
    "schema": ("guide", "Write the JSON Schema of problem files, for editors."),
}
"""Command → its module, which has a class of that name with `Command`, and its line in `tmsopt --help`."""

_FRONT = 'tmsopt solve FILE, with pareto = ["abscissa", "Fr"] under [objective] of FILE'
_HINTS = {
    **{"certify": "tmsopt solve FILE --certify", "pareto": _FRONT, "front": _FRONT},
    **dict.fromkeys(("growth", "plot"), "tmsopt solve FILE --plot growth.png"),
    **dict.fromkeys(("explain", "robustness"), "tmsopt solve FILE --full"),
}
"""Function of the library or option that is no command → the command that does it."""

_STATUSES = """
Exit status:
  0 done, 1 a fault of tmsopt itself, 2 bad input or a file that cannot be
  written, 3 infeasible or nothing found, 4 not converged or not proved, 130
  stopped by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP, 141 the reader is gone

More: docs/reference/commands.md
"""
_JSON = "tmsopt.version.json"


class _Commands(Mapping[str, click.Command]):
    """Every command by its name, built when it is first asked for."""

    def __getitem__(self, name: str) -> click.Command:
        return _load_command(_COMMANDS[name][0], name)

    def __iter__(self) -> Iterator[str]:
        return iter(_COMMANDS)

    def __len__(self) -> int:
        return len(_COMMANDS)


@cache
def _load_command(module: str, name: str) -> click.Command:
    from tmsopt.cli.command import build_command

    return build_command(getattr(import_module(f"tmsopt.cli.{module}"), f"{name.capitalize()}Command"), name)


class _Group(click.Group):
    """Commands that end with tmsopt's own messages, at work or while click reads the words."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def make_context(self, info_name: str | None, args: list[str], *more: Any, **extra: Any) -> click.Context:
        """Keep the words for a report, and refuse those that a program may give but no shell."""
        with report_end():
            for word in args:
                if "\0" in word or not _is_encodable(word):
                    accepted = "words without NUL, in the encoding of file names"
                    raise click.UsageError(f"found {word!r}; accepted: {accepted}")
            words = tuple(args)  # click takes them from the list
            context = super().make_context(info_name, args, *more, **extra)
            context.meta[WORDS] = words
            return context

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[Any, ...]:
        if args[0] in _HINTS and not ctx.resilient_parsing:
            ctx.fail(f"No such command {args[0]!r}; it is {_HINTS[args[0]]}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, summary) for name, (_, summary) in _COMMANDS.items()])

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        formatter.write(_STATUSES)

    def invoke(self, ctx: click.Context) -> Any:
        with report_end():
            try:
                return super().invoke(ctx)
            except InputError as error:
                click.echo(f"{error}{_offer_example(error)}", err=True)
                sys.exit(BAD_INPUT)
            except RuntimeError as error:
                from tmsopt import NotSolved

                if not isinstance(error, NotSolved):
                    raise
                problem, status = error.solution.problem, error.solution.status
                click.echo(f"{problem.title}: {status.replace('_', ' ')}; there is no design to look at", err=True)
                sys.exit(STATUSES[status])


def _offer_example(error: InputError) -> str:
    """How to get a missing file that has the name of an example; else empty."""
    fault = error.faults[0]
    if not fault.message.startswith("no such file"):
        return ""
    from tmsopt.guide import examples

    name = Path(fault.file).stem
    return f"; tmsopt example {name} writes it here" if name in examples() else ""


def _keep_json(ctx: click.Context, _: click.Parameter, given: bool) -> None:
    ctx.meta[_JSON] = given  # click reads it before --version, wherever it stands


def _show_version(ctx: click.Context, _: click.Parameter, given: bool) -> None:
    if ctx.resilient_parsing:
        return
    as_json = ctx.meta.get(_JSON, False)
    if given:
        from tmsopt.cli.answers import answer
        from tmsopt.versions import SCHEMA, environment

        data = {"schema": SCHEMA, "tmsopt": __version__}
        answer(as_json, f"tmsopt, version {__version__}", lambda: data | environment())
        ctx.exit()
    if as_json:
        raise click.NoSuchOption("--json", possibilities=["--version"], ctx=ctx)


def _is_encodable(word: str) -> bool:
    try:
        os.fsencode(word)
    except UnicodeEncodeError:
        return False
    return True


@click.group(
    "tmsopt", cls=_Group, commands=_Commands(), context_settings={"help_option_names": ["-h", "--help"], **SPELLINGS}
)
@click.option("--version", is_flag=True, expose_value=False, callback=_show_version, help="Show the version and exit.")
@click.option(
    "--json",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_keep_json,
    help="With --version: also those of Python and the libraries.",
)
def every() -> None:
    """Design self-stable bicycles under your own constraints, and find exceptional points.

    \b
    Examples:
      tmsopt new robot.toml && tmsopt solve robot.toml
      tmsopt example ep4 && tmsopt prove ep4.toml
      tmsopt chart problems/chart.toml --plot chart.png
    """
    import logging

    logging.getLogger("matplotlib").setLevel(
        logging.ERROR
    )  # it may find no folder for its cache: figures stay the same


every.params.append(colour_option())
