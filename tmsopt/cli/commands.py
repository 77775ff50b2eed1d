"""The commands as one, and what all of their helps share."""

import logging
import os
from typing import Any

import click

from tmsopt import __version__
from tmsopt.cli.chart import chart
from tmsopt.cli.common import TYPED, answer, bad_input
from tmsopt.cli.ending import STATUS, ended
from tmsopt.cli.explore import explore
from tmsopt.cli.guide.convert import convert
from tmsopt.cli.guide.describe import describe, schema
from tmsopt.cli.guide.files import example, new
from tmsopt.cli.guide.import_ import import_
from tmsopt.cli.motion.simulate import simulate
from tmsopt.cli.motion.speeds import speeds
from tmsopt.cli.paper.figure import figure
from tmsopt.cli.paper.verify import verify
from tmsopt.cli.prove import prove
from tmsopt.cli.solve import compare, solve
from tmsopt.cli.study import study
from tmsopt.cli.trace import trace
from tmsopt.versions import SCHEMA, environment

_FRONT = 'tmsopt solve FILE, with pareto = ["abscissa", "Fr"] under [objective] of FILE'
_MEANT = {
    **{"certify": "tmsopt solve FILE --certify", "pareto": _FRONT, "front": _FRONT},
    **dict.fromkeys(("growth", "plot"), "tmsopt solve FILE --plot growth.png"),
    **dict.fromkeys(("explain", "robustness", "diagnose"), "tmsopt solve FILE --full"),
}
"""Words that are functions of the library or options, and no commands → what they are here."""


_JSON = "tmsopt.version.json"


class _Commands(click.Group):
    """Commands that end with words of ours where click has others, be it while words are read or at work."""

    def make_context(self, info_name: str | None, args: list[str], *more: Any, **extra: Any) -> click.Context:
        """Read the words of the command line; a shell gives none that could not be a file's name, a program may."""
        with ended():
            for word in args:
                if "\0" in word or _unknown(word):
                    raise click.UsageError(
                        f"found {word!r}; accepted: words without NUL, in the encoding of file names"
                    )
            words = tuple(args)  # which are taken from the list as they are read
            context = super().make_context(info_name, args, *more, **extra)
            context.meta[TYPED] = words
            return context

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[Any, ...]:
        """The command that is named; for a word that means a part of another one, that instead of a near name."""
        if args[0] in _MEANT and not ctx.resilient_parsing:
            ctx.fail(f"No such command {args[0]!r}; it is {_MEANT[args[0]]}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        with ended(), bad_input():
            return super().invoke(ctx)


def _version_as_json(ctx: click.Context, _: click.Parameter, given: bool) -> None:
    ctx.meta[_JSON] = given  # which is read before --version, wherever it stands


def _version(ctx: click.Context, _: click.Parameter, given: bool) -> None:
    if ctx.resilient_parsing:
        return
    as_json = ctx.meta.get(_JSON, False)
    if given:
        data = {"schema": SCHEMA, "tmsopt": __version__}
        answer(as_json, lambda: data | environment(), lambda: f"tmsopt, version {__version__}")
        ctx.exit()
    if as_json:
        raise click.NoSuchOption("--json", possibilities=["--version"], ctx=ctx)


def _unknown(word: str) -> bool:
    try:
        os.fsencode(word)
    except UnicodeEncodeError:
        return True
    return False


@click.group("tmsopt", cls=_Commands, epilog=STATUS, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, expose_value=False, callback=_version, help="Show the version and exit.")
@click.option(
    "--json",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_version_as_json,
    help="With --version: also those of Python and the libraries, for a report of a bug.",
)
def every() -> None:
    """Design self-stable bicycles under your own constraints, and localise exceptional points.

    \b
    Examples:
      tmsopt new robot.toml
      tmsopt describe tms
      tmsopt solve problems/ep4.toml
      tmsopt solve problems/pareto.toml --plot front.png
      tmsopt explore problems/ep4.toml --open
      tmsopt compare problems/ep4.toml
      tmsopt prove problems/ep4.toml
      tmsopt speeds problems/whipple_benchmark.toml
      tmsopt simulate problems/whipple_benchmark.toml --lean 5 --plot motion.png
      tmsopt trace problems/ep_set.toml --plot ep_set.png
      tmsopt chart problems/chart.toml --plot chart.png
      tmsopt study problems/study_heights.toml
      tmsopt figure all --output figures
      tmsopt verify
    """
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # that it finds no folder for its cache changes no figure


for _command in (
    solve,
    explore,
    compare,
    prove,
    speeds,
    simulate,
    trace,
    chart,
    study,
    figure,
    verify,
    import_,
    convert,
    new,
    example,
    describe,
    schema,
):
    _command.epilog = f"{_command.epilog}{STATUS}"
    every.add_command(_command)
