"""The tmsopt command: one thin room per command, over the public functions of the library.

In: words of a command line. Out: text or JSON on stdout, progress and diagnostics on stderr, an exit status. Heavy
imports stand inside commands. Open `common` first: what they share.
"""

import errno
import sys
from typing import Any

import click

from tmsopt import __version__
from tmsopt.cli.chart import chart
from tmsopt.cli.common import BAD_INPUT, INTERRUPTED
from tmsopt.cli.figure import figure
from tmsopt.cli.guide.describe import describe, schema
from tmsopt.cli.guide.files import example, new
from tmsopt.cli.import_ import convert
from tmsopt.cli.prove import prove
from tmsopt.cli.solve import compare, solve
from tmsopt.cli.speeds import speeds
from tmsopt.cli.study import study
from tmsopt.cli.trace import trace
from tmsopt.cli.verify import verify


class _Commands(click.Group):
    """Commands whose answer may meet a full disk."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; what cannot be written, and Ctrl-C, end it with a message."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            click.echo("stopped; what was printed before stands", err=True)
            sys.exit(INTERRUPTED)
        except OSError as error:
            if error.errno == errno.EPIPE:  # the reader has enough: click ends quietly
                raise
            click.echo(f"the answer cannot be written: {error}; give a file or a device with room", err=True)
            sys.exit(BAD_INPUT)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="tmsopt")
def main() -> None:
    """Design self-stable bicycles under your own constraints, and localise exceptional points.

    \b
    Examples:
      tmsopt new robot.toml
      tmsopt describe tms
      tmsopt solve problems/ep4.toml
      tmsopt solve problems/pareto.toml --plot front.png
      tmsopt compare problems/ep4.toml
      tmsopt prove problems/ep4.toml
      tmsopt speeds problems/whipple_benchmark.toml
      tmsopt trace problems/ep_set.toml --plot ep_set.png
      tmsopt chart problems/chart.toml --plot chart.png
      tmsopt study problems/study_heights.toml
      tmsopt figure all --output figures
      tmsopt verify
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a narrow terminal encoding must not lose a result


for _command in (
    solve,
    compare,
    prove,
    speeds,
    trace,
    chart,
    study,
    figure,
    verify,
    convert,
    new,
    example,
    describe,
    schema,
):
    main.add_command(_command)
