"""A description as data: the symbols of a model or problem, each with unit, meaning and range."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from tmsopt.guide.text import matrix, table, wrapped
from tmsopt.models.expression import COMPARISONS
from tmsopt.records import Printable, Table, plain
from tmsopt.versions import SCHEMA


@dataclass(frozen=True)
class Word:
    """A parameter or quantity.

    Attributes:
        unit: of its numbers; empty where it has none.
        range: physically possible values of a parameter, such as ``> 0``.
        given: of a problem, the value or the bounds, in the unit in which they were typed; of a model, the default.
    """

    name: str
    unit: str
    meaning: str
    range: str = ""
    given: str = ""


@dataclass(frozen=True)
class Words:
    """What may be written in one of the ways to state a design.

    Attributes:
        name: e.g. ``SI``.
        quantities: all that an expression may use beside the parameters.
    """

    name: str
    parameters: tuple[Word, ...]
    quantities: tuple[Word, ...]


@dataclass(frozen=True, repr=False)
class Description(Printable):
    """What a model is made of, or a problem.

    Attributes:
        model: its name, and `meaning` what it is.
        title: of a problem; else empty.
        sets: of a problem, the one in which it is written.
        patterns: name of a root pattern that can be located → meaning.
        functions: of expressions.
        omits: what the model leaves out, for a builder; empty where nothing need be said.
        conventions: sentences on signs.
        sketch: side view of a bicycle; empty for other systems.
        matrices: of a stated system, M, D, K, A or coefficients → rows of entries.
        asked: of a problem, section → key → text.
        feedback: of a bicycle, what [feedback] adds to each of its sets.

    Example:
        >>> tmsopt.describe("tms").patterns["EP4"]
        '4-fold real root'

    More: docs/reference/quantities.md
    """

    model: str
    meaning: str
    degree: int
    sets: tuple[Words, ...]
    patterns: Mapping[str, str]
    functions: tuple[str, ...]
    omits: str = ""
    conventions: tuple[str, ...] = ()
    sketch: str = ""
    title: str = ""
    matrices: Mapping[str, tuple[tuple[str, ...], ...]] = Table()
    asked: Mapping[str, Mapping[str, str]] = Table()
    feedback: tuple[Words, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        names = "title model meaning degree omits sets patterns functions conventions sketch matrices asked feedback"
        return {"schema": SCHEMA} | plain(self, names)


def description_text(found: Description) -> str:
    """Title, sketch, signs, what is asked, symbols, patterns and functions, at most 100 columns wide."""
    name = f"{found.title}\n{found.model}" if found.title else found.model
    parts = [f"{name}: {found.meaning}, degree {found.degree}" if found.meaning != found.model else name]
    if found.omits:
        parts.append(f"the model is {found.omits}")
    if found.sketch:
        parts.append(found.sketch.strip("\n"))
    if found.conventions:
        parts.append("\n".join(["signs", *wrapped(found.conventions)]))
    if found.matrices:
        parts.append("\n".join(line for n, rows in found.matrices.items() for line in matrix(n, rows)))
    parts += ["\n".join([section, *table(list(keys.items()))]) for section, keys in found.asked.items()]
    shown: set[str] = set()
    for of in found.sets:
        alone = "" if of.name == "stated" else f", {of.name}"
        parts.append("\n".join([f"parameters{alone}", *_words(of.parameters)]))
        new = [q for q in of.quantities if q.name not in shown and not _is_parameter(q, found)]
        shown |= {q.name for q in new}
        parts.append("\n".join([f"quantities{alone}", *_words(new)]))
    for of in found.feedback:
        parts.append("\n".join([f"[feedback], {of.name}", *_words((*of.parameters, *of.quantities))]))
    roots = "eigenfrequencies" if "H" in found.matrices else "roots"
    parts.append("\n".join([f"patterns of {roots}, for locate", *table(list(found.patterns.items()))]))
    parts.append(
        "\n".join(
            ["expressions", *wrapped([f"+ - * / **   {' '.join(COMPARISONS.values())}   {' '.join(found.functions)}"])]
        )
    )
    return "\n\n".join(parts)


def _is_parameter(quantity: Word, found: Description) -> bool:
    """Whether a quantity of one set, in a table of its own, is a parameter of another."""
    return any(quantity.name == p.name for of in found.sets for p in of.parameters)


def _words(words: Iterable[Word]) -> Iterator[str]:
    return table([(w.name, "" if w.unit == "1" else w.unit, w.given, w.range, w.meaning) for w in words])
