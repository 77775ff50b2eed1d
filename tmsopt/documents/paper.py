"""Documents of a comparison with the laws of the paper, and of the recomputed paper."""

import re
import textwrap
from itertools import groupby

from tmsopt.documents.blocks import (
    Badge,
    Cell,
    Chapter,
    Level,
    Listing,
    Parts,
    Row,
    Sentence,
    TableBlock,
    Tone,
    count_things,
)
from tmsopt.documents.solution import list_branches, write_headline
from tmsopt.models import tms
from tmsopt.paper.compare import Comparison
from tmsopt.paper.ledger import Entry, Ledger

_ABOUT = (
    "This page is what `tmsopt verify --markdown problems/paper.md` writes: every number and every statement that can "
    "be verified, computed anew by a route that does not use the printed formula. Numbers are balls that contain the "
    "true value, shown to 40 digits; general statements are proved by exact algebra, or refuted by a counterexample in "
    "small fractions. Statements are read in their context: λ_s > 0 and the conditions `lscf`, where the section "
    "assumes them. A statement about the literature is judged only where it can be computed."
)


def write_comparison(comparison: Comparison, _level: Level) -> Parts:
    """Write laws and computed numbers side by side if the model has laws, then the difference of the formulations."""
    applicable_laws = [row for row in comparison.laws if row.applies]
    agreements = sum(row.agrees is True for row in applicable_laws)
    tone: Tone = "doubt" if not applicable_laws else "good" if agreements == len(applicable_laws) else "bad"
    badge_text = f"solved as {comparison.other.formulation} too" if comparison.other else "no other formulation"
    yield Badge(f"{agreements} of {len(applicable_laws)} laws agree", tone), badge_text
    design = comparison.design
    model = design.problem.model
    yield from write_headline(design)
    yield Sentence(model.omits, "model")
    if model is tms:
        yield Chapter("laws", width="wide")
        yield from _write_laws(comparison)
    else:
        yield Chapter("laws")
        model_name = f"the {model.title}" if model.statement is None else f"'{model.title}'"
        of_skates = "" if model.is_complex else ", only for skates (tms)"
        yield f"no laws are known for {model_name}{of_skates}"
    yield Chapter("formulations")
    if comparison.other is None:
        yield Sentence(f"none, {comparison.reason}", "other formulation")
    else:
        heading = f"{comparison.other.formulation} minus {design.formulation}"
        differences = ((n, f"{d:.1e}") for n, d in comparison.differences.items())
        yield TableBlock((("formulations", heading), *differences), "Differences of the formulations")
    yield from list_branches(design)


def _write_laws(comparison: Comparison) -> Parts:
    rows: list[Row] = [("law", "quantity", "numeric", "law says", "relative", "verdict")]
    inapplicable_laws: dict[str, list[str]] = {}
    for row in comparison.laws:
        if row.applies:
            verdict = "agrees" if row.agrees else "DIFFERS"
            rows.append((row.label, row.subject, Cell(row.numeric), Cell(row.law), f"{row.relative:.1e}", verdict))
        else:
            inapplicable_laws.setdefault(row.reason, []).append(f"{row.label} ({row.subject})")
    yield TableBlock(rows, "Laws and numbers", priorities=(9, 6, 7, 7, 5, 8))
    for reason, labels in inapplicable_laws.items():
        yield Sentence(f"{', '.join(labels)}; {reason}", "not applicable to this design")


def write_ledger(ledger: Ledger, level: Level) -> Parts:
    """Write every entry under its section, then the number of entries per verdict."""
    verdict_counts = (f"{count} {verdict}" for verdict, count in ledger.counts.items() if count)
    yield count_things(ledger.entries, "entry", "entries"), *verdict_counts
    if level == "brief":
        yield ledger.source
    for number, (title, entries) in enumerate(groupby(ledger.entries, key=lambda entry: entry.section)):
        yield Chapter(f"part-{number}", title, "wide")
        if level == "brief":
            yield Sentence(title, tone="answer")
        for entry in entries:
            verdict = ("verdict", entry.verdict.upper())
            yield Listing((verdict, *_list_entry(entry)), f"{entry.key}: {entry.statement} ({entry.place})")
    yield Chapter("verdicts")
    counts = [*ledger.counts.items(), ("entries", len(ledger.entries))]
    yield TableBlock((("", ""), *((str(count), verdict) for verdict, count in counts)), "Entries per verdict")


def _list_entry(entry: Entry) -> list[tuple[str, str]]:
    facts = {"printed": entry.printed, "computed": entry.computed, "route": entry.route, "remark": entry.remark}
    return [(name, text) for name, text in facts.items() if text]


def write_ledger_page(ledger: Ledger) -> str:
    """Write the ledger as a Markdown page: a summary, then every entry under its section."""
    lines = [
        "# The paper, recomputed",
        "",
        f"Source: {ledger.source}.",
        "",
        *textwrap.wrap(_ABOUT, 120),
        "",
        "| verdict | entries |",
        "|---|---:|",
        *(f"| {verdict} | {count} |" for verdict, count in ledger.counts.items()),
        f"| all | {len(ledger.entries)} |",
    ]
    for title, entries in groupby(ledger.entries, key=lambda entry: entry.section):
        lines += ["", f"## {title}"]
        for entry in entries:
            head = f"**`{entry.key}`** {_escape(entry.statement)} ({_escape(entry.place)}): **{entry.verdict}**"
            lines += ["", head, "", *(f"- {name}: {_escape(text)}" for name, text in _list_entry(entry))]
    return "\n".join(lines) + "\n"


def _escape(text: str) -> str:
    """Escape a text, so that Markdown finds no markup in it."""
    return re.sub(r"([\\*_|<^])", r"\\\1", text)
