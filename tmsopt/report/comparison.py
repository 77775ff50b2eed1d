"""A design beside the laws of the paper, and one formulation beside the other, as text."""

import textwrap
from collections.abc import Iterator, Mapping

from tmsopt.models import tms
from tmsopt.paper.compare import Comparison
from tmsopt.report.solution.design import branch_lines, headline
from tmsopt.report.text import WIDTH, columns, model_lines, number


def comparison_table(comparison: Comparison) -> str:
    """Law beside number where laws are known, then the two formulations beside each other.

    Example:
        >>> comparison = tmsopt.compare(tmsopt.solve("problems/ep4.toml"))
        >>> [line.split()[-1] for line in tmsopt.report.comparison_table(comparison).splitlines() if "tls" in line]
        ['agrees']

    More: docs/explanation/paper.md
    """
    design = comparison.design
    lines = [design.problem.title or "untitled problem", *headline(design), *model_lines(design.problem.model), ""]
    rows = [("law", "of", "numeric", "law says", "relative", "")]
    silent: dict[str, list[str]] = {}
    for row in comparison.laws:
        if row.applies:
            verdict = "agrees" if row.agrees else "DIFFERS"
            rows.append((row.label, row.subject, number(row.numeric), number(row.law), f"{row.relative:.1e}", verdict))
        else:
            silent.setdefault(row.reason, []).append(f"{row.label} ({row.subject})")
    known = design.problem.model is tms
    model = design.problem.model
    named = f"the {model.title}" if model.statement is None else f"'{model.title}'"
    of_skates = "" if model.carrier is not None else ", only of skates (tms)"
    lines += [*columns(rows), *_silent(silent)] if known else [f"no laws are known of {named}{of_skates}"]
    lines.append("")
    if comparison.other is None:
        lines.append(f"other formulation: none, {comparison.reason}")
    else:
        names = f"{comparison.other.formulation} minus {design.formulation}"
        rows2 = [("formulations", names)] + [(n, f"{d:.1e}") for n, d in comparison.differences.items()]
        lines += columns(rows2)
    lines += branch_lines(design)
    return "\n".join(line.rstrip() for line in lines).rstrip()


def _silent(laws: Mapping[str, list[str]]) -> Iterator[str]:
    """Laws that say nothing of a design, by the reason."""
    for reason, named in laws.items():
        yield from textwrap.wrap(f"say nothing here: {', '.join(named)}; {reason}", WIDTH, subsequent_indent="  ")
