"""A description as data: the symbols of a model or problem, each with unit, meaning and range."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

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
