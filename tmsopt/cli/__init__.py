"""The tmsopt command: thin commands over the library; heavy imports stand inside them."""

import sys

import click

from tmsopt import __version__
from tmsopt.cli.chart import chart
from tmsopt.cli.figure import figure
from tmsopt.cli.solve import compare, solve
from tmsopt.cli.trace import trace
from tmsopt.cli.verify import verify


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="tmsopt")
def main() -> None:
    """Design self-stable bicycles under your own constraints, and localise exceptional points.

    \b
    Examples:
      tmsopt solve problems/ep4.toml
      tmsopt compare problems/ep4.toml
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a narrow terminal encoding must not lose a result


for _command in (solve, compare, trace, chart, figure, verify):
    main.add_command(_command)
