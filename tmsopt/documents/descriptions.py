"""Documents of descriptions: what a model or a problem consists of."""

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


def write_description(description: Description, level: Level) -> Parts:
    """Write the model, its sign conventions, the question, symbols, patterns and functions, each under a heading."""
    sizes = " or ".join(count_things(parameter_set.parameters, "parameter") for parameter_set in description.sets)
    yield description.model, f"degree {description.degree}", sizes
    about = description.model
    if description.meaning != description.model:
        about += f": {description.meaning}, degree {description.degree}"
    yield Sentence(about, tone="answer")
    if description.omits:
        yield f"the model is {description.omits}"
    if description.sketch:
        yield Chapter("sketch")
        yield Verbatim(description.sketch.strip("\n"), "sketch of the model, not to scale")
    for number, (title, blocks) in enumerate(_write_parts(description)):
        yield Chapter(f"part-{number}", title.capitalize(), "wide")
        if level == "brief":
            yield Sentence(title, tone="answer")
        yield from blocks


def _write_parts(description: Description) -> Iterator[tuple[str, Iterable[Block | str]]]:
    if description.conventions:
        yield "signs", description.conventions
    if description.matrices:
        yield "matrices", [Verbatim(_format_matrix(n, rows), n) for n, rows in description.matrices.items()]
    for section, keys in description.asked.items():
        yield section, [Listing(tuple(keys.items()))]
    # a quantity of one set may be a parameter of another
    names = {p.name for parameter_set in description.sets for p in parameter_set.parameters}
    for parameter_set in description.sets:
        suffix = "" if parameter_set.name == "stated" else f", {parameter_set.name}"
        yield f"parameters{suffix}", [_tabulate_symbols(parameter_set.parameters)]
        new_quantities = [q for q in parameter_set.quantities if q.name not in names]
        names |= {q.name for q in new_quantities}
        yield f"quantities{suffix}", [_tabulate_symbols(new_quantities)]
    for parameter_set in description.feedback:
        symbols = (*parameter_set.parameters, *parameter_set.quantities)
        yield f"[feedback], {parameter_set.name}", [_tabulate_symbols(symbols)]
    roots = "eigenfrequencies" if "H" in description.matrices else "roots"
    yield f"patterns of {roots}, for locate", [Listing(tuple(description.patterns.items()))]
    yield "expressions", [f"+ - * / **   {' '.join(COMPARISONS.values())}   {' '.join(description.functions)}"]


def _tabulate_symbols(symbols: Iterable[Symbol]) -> Block | str:
    rows = [(w.name, "" if w.unit == "1" else w.unit, w.given, w.range, w.meaning) for w in symbols]
    return TableBlock((("",) * 5, *rows)) if rows else "none"


def _format_matrix(name: str, rows: Sequence[Sequence[str]]) -> str:
    """Write a matrix with aligned columns."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    prefix = f"{name} = "
    return "\n".join(
        f"{prefix if k == 0 else ' ' * len(prefix)}[{'  '.join(e.rjust(w) for e, w in zip(row, widths, strict=True))}]"
        for k, row in enumerate(rows)
    )
