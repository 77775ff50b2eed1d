"""What a model is made of, or a problem: signs, what is asked, symbols, patterns, functions."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from tmsopt.documents.blocks import Badge, Block, Chapter, Level, Listing, Sentence, TableBlock, Verbatim, count_things
from tmsopt.documents.maker import Maker
from tmsopt.guide import Description, Word as Symbol
from tmsopt.models.expression import COMPARISONS


def summarise_description(found: Description) -> Iterator[Badge]:
    """The model, and of how many parameters."""
    yield Badge(found.model)
    yield Badge(f"degree {found.degree}")
    yield Badge(" or ".join(count_things(len(of.parameters), "parameter") for of in found.sets))


def write_description(found: Description, level: Level) -> Iterator[Chapter]:
    """The model, its signs, what is asked, symbols, patterns and functions, each under its name."""
    about = f"{found.model}: {found.meaning}, degree {found.degree}" if found.meaning != found.model else found.model
    answer: list[Block] = [Sentence(about, tone="answer")]
    answer += [Sentence(f"the model is {found.omits}")] if found.omits else []
    yield Chapter("answer", tuple(answer))
    if found.sketch:
        yield Chapter("sketch", (Verbatim(found.sketch.strip("\n"), "sketch of the model, not to scale"),))
    for number, (title, blocks) in enumerate(_write_parts(found)):
        heading = (Sentence(title, tone="answer"),) if level == "brief" else ()
        yield Chapter(f"part-{number}", (*heading, *blocks), title.capitalize(), "wide")


def _write_parts(found: Description) -> Iterator[tuple[str, Sequence[Block]]]:
    if found.conventions:
        yield "signs", [Sentence(text) for text in found.conventions]
    if found.matrices:
        yield "matrices", [Verbatim(_format_matrix(n, rows), n) for n, rows in found.matrices.items()]
    for section, keys in found.asked.items():
        yield section, [Listing(tuple(keys.items()))]
    shown: set[str] = set()
    for of in found.sets:
        alone = "" if of.name == "stated" else f", {of.name}"
        yield f"parameters{alone}", [_tabulate_symbols(of.parameters)]
        new = [q for q in of.quantities if q.name not in shown and not _is_parameter(q, found)]
        shown |= {q.name for q in new}
        yield f"quantities{alone}", [_tabulate_symbols(new)]
    for of in found.feedback:
        yield f"[feedback], {of.name}", [_tabulate_symbols((*of.parameters, *of.quantities))]
    roots = "eigenfrequencies" if "H" in found.matrices else "roots"
    yield f"patterns of {roots}, for locate", [Listing(tuple(found.patterns.items()))]
    yield "expressions", [Sentence(f"+ - * / **   {' '.join(COMPARISONS.values())}   {' '.join(found.functions)}")]


def _is_parameter(quantity: Symbol, found: Description) -> bool:
    """Whether a quantity of one set, in a table of its own, is a parameter of another."""
    return any(quantity.name == p.name for of in found.sets for p in of.parameters)


def _tabulate_symbols(listed: Iterable[Symbol]) -> Block:
    rows = [(w.name, "" if w.unit == "1" else w.unit, w.given, w.range, w.meaning) for w in listed]
    return TableBlock((("", "", "", "", ""), *rows)) if rows else Sentence("none")


def _format_matrix(name: str, rows: Sequence[Sequence[str]]) -> str:
    """Columns under each other."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lead = f"{name} = "
    return "\n".join(
        f"{lead if k == 0 else ' ' * len(lead)}[{'  '.join(e.rjust(w) for e, w in zip(row, widths, strict=True))}]"
        for k, row in enumerate(rows)
    )


MAKERS: Mapping[str, Maker] = {"Description": Maker(summarise_description, write_description)}
