"""The group of all commands; the module of a command is loaded when the command is first used."""

import logging
import os
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from tmsopt import __version__
from tmsopt.cli.answers import WORDS_KEY, answer
from tmsopt.cli.command import build_command, colour_option
from tmsopt.cli.ending import BAD_INPUT, STATUSES, report_end
from tmsopt.errors import InputError

_MODULES: Mapping[str, Mapping[str, str]] = {
    "designs": {
        "solve": "Find the best design, or a Pareto front.",
        "explore": "Write a page with sliders that shows why a design is stable.",
        "compare": "Compare the optimum with the closed-form laws.",
        "prove": "Prove that the solution exists, and decide if it is stable.",
        "diagnose": "Show how each multiple root splits.",
        "speeds": "Find every weave and capsize speed.",
        "simulate": "Show the motion after a lean or a push, or under noise.",
        "trace": "Trace a root pattern through parameter space.",
    },
    "spectra": {
        "encircle": "Follow eigenvalues around exceptional points.",
        "sheets": "Compute the Riemann sheets over two parameters.",
    },
    "chart": {"chart": "Chart stability over two or three parameters."},
    "study": {"study": "Solve a problem for every row of a table or sample."},
    "guide": {
        "figure": "Draw the figures of the paper.",
        "verify": "Recompute every number of the paper.",
        "import": "Make a problem file from a measured bicycle.",
        "convert": "Make bodies with moments of inertia from point masses.",
        "new": "Write a commented problem to start from.",
        "example": "List the examples that come with tmsopt, or write one here.",
        "describe": "Show the symbols and units of a model or a file.",
        "schema": "Write the JSON Schema of problem files, for editors.",
    },
}
"""Module → its commands, with their lines in `tmsopt --help`. The class of ``solve`` is ``SolveCommand``."""

_MODULE_OF_COMMAND = {name: module for module, names in _MODULES.items() for name in names}

_FRONT_HINT = 'tmsopt solve FILE, with pareto = ["abscissa", "Fr"] under [objective] of FILE'
_HINTS = {
    **{"certify": "tmsopt solve FILE --certify", "pareto": _FRONT_HINT, "front": _FRONT_HINT},
    **dict.fromkeys(("growth", "plot"), "tmsopt solve FILE --plot growth.png"),
    **dict.fromkeys(("explain", "robustness"), "tmsopt solve FILE --full"),
}
"""Name of a function of the library, or of an option, but not of a command → the command that does the same."""

_STATUSES = """
Exit status:
  0 done, 1 an error in tmsopt itself, 2 bad input or a file that cannot be
  written, 3 infeasible or nothing found, 4 not converged or not proved, 130
  stopped by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP, 141 the program that
  reads the output has ended

More: docs/reference/commands.md
"""


@cache
def _load_command(name: str) -> click.Command:
    module = import_module(f"tmsopt.cli.{_MODULE_OF_COMMAND[name]}")
    return build_command(getattr(module, f"{name.capitalize()}Command"), name)


class _Commands(Mapping[str, click.Command]):
    """Name → command, which is built when it is first used."""

    def __getitem__(self, name: str) -> click.Command:
        return _load_command(name)

    def __iter__(self) -> Iterator[str]:
        return iter(_MODULE_OF_COMMAND)

    def __len__(self) -> int:
        return len(_MODULE_OF_COMMAND)


class _Group(click.Group):
    """Commands that end with tmsopt's own messages, whether they run or click still reads the command line."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def make_context(self, info_name: str | None, args: list[str], *arguments: Any, **extra: Any) -> click.Context:
        """Save the words for a report, and refuse words that only a program can pass, not a shell."""
        with report_end():
            for word in args:
                try:
                    is_accepted = b"\0" not in os.fsencode(word)
                except UnicodeEncodeError:
                    is_accepted = False
                if not is_accepted:
                    accepted = "words without NUL, in the encoding of file names"
                    raise click.UsageError(f"found {word!r}; accepted: {accepted}")
            words = tuple(args)  # copied, because click removes them from the list
            context = super().make_context(info_name, args, *arguments, **extra)
            context.meta[WORDS_KEY] = words
            return context

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[Any, ...]:
        if args[0] in _HINTS and not ctx.resilient_parsing:
            ctx.fail(f"No such command {args[0]!r}; use {_HINTS[args[0]]}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([line for lines in _MODULES.values() for line in lines.items()])

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
                solution = getattr(error, "solution", None)  # of NotSolved; importing that class takes long
                if solution is None:
                    raise
                status = solution.status.replace("_", " ")
                click.echo(
                    f"{solution.problem.title}: {status}; there is no {solution.problem.posed.model.noun} to examine",
                    err=True,
                )
                sys.exit(STATUSES[solution.status])


def _offer_example(error: InputError) -> str:
    """Say how to get a missing file if it has the name of an example; else empty."""
    fault = error.faults[0]
    if not fault.message.startswith("no such file"):
        return ""
    from tmsopt.guide import examples

    name = Path(fault.file).stem
    return f"; tmsopt example {name} writes it here" if name in examples() else ""


@click.group(
    "tmsopt",
    cls=_Group,
    commands=_Commands(),
    context_settings={
        "help_option_names": ["-h", "--help"],
        "token_normalize_func": lambda word: "color" if word == "colour" else word,
    },
    invoke_without_command=True,
    no_args_is_help=True,
    subcommand_metavar="COMMAND [ARGS]...",
)
@click.option("--version", is_flag=True, help="Show the version and exit.")
@click.option("--json", is_flag=True, help="With --version: also show the versions of the libraries.")
@click.pass_context
def command_group(ctx: click.Context, version: bool, json: bool) -> None:
    """Design self-stable bicycles under your own constraints, and find exceptional points.

    \b
    Examples:
      tmsopt new robot.toml && tmsopt solve robot.toml
      tmsopt example ep4 && tmsopt prove ep4.toml
      tmsopt chart problems/chart.toml --plot chart.png
    """
    if version:
        from tmsopt.versions import SCHEMA, environment

        data = {"schema": SCHEMA, "tmsopt": __version__}
        answer(json, f"tmsopt, version {__version__}", lambda: data | environment())
        ctx.exit()
    if json:
        raise click.NoSuchOption("--json", possibilities=["--version"], ctx=ctx)
    if ctx.invoked_subcommand is None:
        ctx.fail("Missing command.")
    # Matplotlib warns if it finds no folder for its cache, which does not change figures.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


command_group.params.append(colour_option())
