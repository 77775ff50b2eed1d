"""What a model is made of, or a problem: signs, what is asked, symbols, patterns, functions."""

from collections.abc import Iterable, Iterator, Sequence

from tmsopt.documents.blocks import (
    Block,
    Chapter,
    Level,
    Listing,
    Parts,
    Sentence,
    TableBlock,
    Verbatim,
    count_things,
)
from tmsopt.guide import Description, Word as Symbol
from tmsopt.models.expression import COMPARISONS


def write_description(found: Description, level: Level) -> Parts:
    """The model, its signs, what is asked, symbols, patterns and functions, each under its name."""
    sizes = " or ".join(count_things(of.parameters, "parameter") for of in found.sets)
    yield found.model, f"degree {found.degree}", sizes
    about = f"{found.model}: {found.meaning}, degree {found.degree}" if found.meaning != found.model else found.model
    yield Sentence(about, tone="answer")
    if found.omits:
        yield f"the model is {found.omits}"
    if found.sketch:
        yield Chapter("sketch")
        yield Verbatim(found.sketch.strip("\n"), "sketch of the model, not to scale")
    for number, (title, blocks) in enumerate(_write_parts(found)):
        yield Chapter(f"part-{number}", title.capitalize(), "wide")
        if level == "brief":
            yield Sentence(title, tone="answer")
        yield from blocks


def _write_parts(found: Description) -> Iterator[tuple[str, Iterable[Block | str]]]:
    if found.conventions:
        yield "signs", found.conventions
    if found.matrices:
        yield "matrices", [Verbatim(_format_matrix(n, rows), n) for n, rows in found.matrices.items()]
    for section, keys in found.asked.items():
        yield section, [Listing(tuple(keys.items()))]
    shown = {p.name for of in found.sets for p in of.parameters}  # a quantity of one set may be a parameter of another
    for of in found.sets:
        alone = "" if of.name == "stated" else f", {of.name}"
        yield f"parameters{alone}", [_tabulate_symbols(of.parameters)]
        new = [q for q in of.quantities if q.name not in shown]
        shown |= {q.name for q in new}
        yield f"quantities{alone}", [_tabulate_symbols(new)]
    for of in found.feedback:
        yield f"[feedback], {of.name}", [_tabulate_symbols((*of.parameters, *of.quantities))]
    roots = "eigenfrequencies" if "H" in found.matrices else "roots"
    yield f"patterns of {roots}, for locate", [Listing(tuple(found.patterns.items()))]
    yield "expressions", [f"+ - * / **   {' '.join(COMPARISONS.values())}   {' '.join(found.functions)}"]


def _tabulate_symbols(listed: Iterable[Symbol]) -> Block | str:
    rows = [(w.name, "" if w.unit == "1" else w.unit, w.given, w.range, w.meaning) for w in listed]
    return TableBlock((("",) * 5, *rows)) if rows else "none"


def _format_matrix(name: str, rows: Sequence[Sequence[str]]) -> str:
    """Columns under each other."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lead = f"{name} = "
    return "\n".join(
        f"{lead if k == 0 else ' ' * len(lead)}[{'  '.join(e.rjust(w) for e, w in zip(row, widths, strict=True))}]"
        for k, row in enumerate(rows)
    )
