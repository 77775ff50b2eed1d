"""The command that recomputes the source paper."""

from pathlib import Path

import click

import tmsopt
from tmsopt.cli.common import answer, json_option, output_option, write_file
from tmsopt.cli.terminal import shown
from tmsopt.files import write_text

_EXAMPLES = """
\b
Examples:
  tmsopt verify
  tmsopt verify --only 'tab1-*' --only epset
  tmsopt verify --json > ledger.json
  tmsopt verify --markdown problems/paper.md

Exit status: 0 when the ledger was computed, whatever the verdicts; 2 bad input.
"""


@click.command(epilog=_EXAMPLES)
@json_option
@output_option(("md",), "Write the ledger as a Markdown page (md).", "--markdown")
@click.option("--only", multiple=True, metavar="KEY", help="Compute these entries only; * and ? stand for any text.")
def verify(as_json: bool, markdown: Path | None, only: tuple[str, ...]) -> None:
    """Recompute every number and statement of the source paper, with a verdict on each."""
    ledger = tmsopt.verify(shown(), only)
    answer(as_json, ledger.to_json, lambda: tmsopt.report.ledger_table(ledger))
    write_file("--markdown", markdown, lambda path: write_text(path, tmsopt.report.ledger_page(ledger)))
