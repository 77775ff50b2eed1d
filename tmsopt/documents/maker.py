"""How a class of results is shown: who writes its words and its sections, and who draws it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from tmsopt.documents.blocks import Badge, Chapter

_HOLDERS = ("problem", "asked", "study", "design")


@dataclass(frozen=True)
class Maker:
    """Makes the document of a result.

    Attributes:
        words: what it is and how it ended, a few words each; takes no time.
        sections: of a result and a level, and options by their names.
        picture: the name in `tmsopt.plots` of what draws it; empty where nothing does.
    """

    words: Callable[[Any], Iterable[Badge]]
    sections: Callable[..., Iterable[Chapter]]
    picture: str = ""


def remove_titles(result: Any) -> Any:
    """A result without its titles, which stand above its pictures already."""
    names = {f.name for f in fields(result) if f.init}
    held = {n: remove_titles(v) for n in _HOLDERS if n in names and is_dataclass(v := getattr(result, n))}
    return replace(result, **held, **({"title": ""} if "title" in names else {}))
