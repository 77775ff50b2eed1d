"""The command that recomputes the source paper."""

import sys
from pathlib import Path

import click

from tmsopt.cli.common import DONE, answer, bad_input, check_output, saving
from tmsopt.cli.terminal import shown
from tmsopt.disk import write_text

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
@click.option("--json", "as_json", is_flag=True, help="Write JSON to stdout instead of a table.")
@click.option("--markdown", type=click.Path(path_type=Path), help="Write the ledger as a Markdown page (md).")
@click.option("--only", multiple=True, metavar="KEY", help="Compute these entries only; * and ? stand for any text.")
def verify(as_json: bool, markdown: Path | None, only: tuple[str, ...]) -> None:
    """Recompute every number and statement of the source paper, with a verdict on each."""
    with bad_input():
        import tmsopt

        check_output("--markdown", markdown, ("md",))
        ledger = tmsopt.verify(shown(), only)
    answer(as_json, ledger.to_json, lambda: tmsopt.report.ledger_table(ledger))
    if markdown is not None:
        with saving("--markdown", markdown):
            write_text(markdown, tmsopt.report.ledger_page(ledger))
    sys.exit(DONE)
