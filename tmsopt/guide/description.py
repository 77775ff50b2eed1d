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
        unit: unit of its numbers; empty if it has none.
        range: physically possible values of a parameter, such as ``> 0``.
        given: in a problem, the value or the bounds with the unit as typed; in a model, the default.
    """

    name: str
    unit: str
    meaning: str
    range: str = ""
    given: str = ""


@dataclass(frozen=True)
class Words:
    """The names of one parameter set, which is one way to state a design.

    Attributes:
        name: name of the set, such as ``SI``.
        quantities: further names that an expression may use.
    """

    name: str
    parameters: tuple[Word, ...]
    quantities: tuple[Word, ...]


@dataclass(frozen=True, repr=False)
class Description(Printable):
    """The names of a model or of a problem, with their meanings.

    Attributes:
        model: name of the model.
        meaning: title of the model.
        title: title of a problem; otherwise empty.
        sets: the parameter sets of the model, or the one that the problem uses.
        patterns: name of a root pattern that can be located → meaning.
        functions: functions and constants of expressions.
        omits: what the model leaves out, as a warning to builders; may be empty.
        conventions: sentences on signs.
        sketch: side view of a bicycle; empty for other systems.
        matrices: M, D, K, A or coefficients of a user's system → rows of entries.
        asked: what a problem asks for: section → key → text.
        feedback: what [feedback] adds to each parameter set of a bicycle.

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
