"""The ledger of the paper as a text table and as a Markdown page."""

import textwrap
from itertools import groupby

from tmsopt.paper.ledger import Entry, Ledger

_WIDTH = 100
_INDENT = "    "

_ABOUT = (
    "This page is what `tmsopt verify --markdown problems/paper.md` writes: every number and every statement that can "
    "be verified, computed anew by a route that does not use the printed formula. Numbers are balls that contain the "
    "true value, shown to 40 digits; general statements are proved by exact algebra, or refuted by a counterexample in "
    "small fractions. Statements are read in their context: λ_s > 0 and the conditions `lscf`, where the section "
    "assumes them. A statement about the literature is judged only where it can be computed."
)


def ledger_table(ledger: Ledger) -> str:
    """Every entry under its section, wrapped, with the number of entries per verdict at the end.

    Example:
        >>> print(tmsopt.report.ledger_table(tmsopt.verify(only=["lscf-*"])).splitlines()[0])
        O. N. Kirillov, Localizing EP sets in dissipative systems and the self-stability of bicycles (2018)

    More: docs/explanation/paper.md
    """
    lines: list[str] = [ledger.source, ""]
    for title, entries in groupby(ledger.entries, key=lambda entry: entry.section):
        lines += [title, "=" * len(title), ""]
        for entry in entries:
            lines += [*_entry(entry), ""]
    return "\n".join([*lines, *verdict_lines(ledger)])


def verdict_lines(ledger: Ledger) -> list[str]:
    """The number of entries per verdict, and of all."""
    counts = [*ledger.counts.items(), ("entries", len(ledger.entries))]
    return [f"{count:4d}  {verdict}" for verdict, count in counts]


def ledger_page(ledger: Ledger) -> str:
    """The ledger as a Markdown page: a summary, then every entry under its section.

    Example:
        >>> ledger = tmsopt.verify(only=["lscf-*"])
        >>> f"| all | {len(ledger.entries)} |" in tmsopt.report.ledger_page(ledger)
        True

    More: docs/explanation/paper.md
    """
    lines = [
        "# The paper, recomputed",
        "",
        f"Source: {ledger.source}.",
        "",
        *textwrap.wrap(_ABOUT, _WIDTH + 20),
        "",
        "| verdict | entries |",
        "|---|---:|",
        *(f"| {verdict} | {count} |" for verdict, count in ledger.counts.items()),
        f"| all | {len(ledger.entries)} |",
    ]
    for title, entries in groupby(ledger.entries, key=lambda entry: entry.section):
        lines += ["", f"## {title}"]
        for entry in entries:
            head = f"**`{entry.key}`** {_escaped(entry.statement)} ({_escaped(entry.place)}): **{entry.verdict}**"
            lines += ["", head, "", *(f"- {name}: {_escaped(text)}" for name, text in _rows(entry))]
    return "\n".join(lines) + "\n"


def _rows(entry: Entry) -> list[tuple[str, str]]:
    said = {"printed": entry.printed, "computed": entry.computed, "route": entry.route, "remark": entry.remark}
    return [(name, text) for name, text in said.items() if text]


def _entry(entry: Entry) -> list[str]:
    head = _wrapped(f"{entry.key}: {entry.statement} ({entry.place})", "", _INDENT)
    body = [_wrapped(f"{name:9}{text}", _INDENT, _INDENT + " " * 9) for name, text in _rows(entry)]
    return [*head, f"{_INDENT}{'verdict':9}{entry.verdict.upper()}", *(line for part in body for line in part)]


def _wrapped(text: str, first: str, rest: str) -> list[str]:
    return textwrap.wrap(
        text, _WIDTH, initial_indent=first, subsequent_indent=rest, break_long_words=False, break_on_hyphens=False
    )


def _escaped(text: str) -> str:
    """Text in which Markdown reads no markup."""
    for sign in ("\\", "*", "_", "|", "<", "^"):
        text = text.replace(sign, f"\\{sign}")
    return text
