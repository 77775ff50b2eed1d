"""A picture inside a page, without anything from elsewhere."""

import base64
import io
import warnings
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tmsopt.display.markup import words

_LARGEST = 500_000  # bytes of a drawing; one with more, such as of thousands of marks, is an image of dots
_DOTS = 160  # an inch
_HOLDERS = ("problem", "asked", "study", "design")


def picture(draw: Callable[[], Figure | Axes], caption: str) -> str:
    """A figure with its caption; empty where it cannot be drawn, for the rest of the page says what there is.

    Letters are outlines, and a drawing is an image apart from the page: nothing in it is markup of the page.
    """
    try:
        drawn = draw()
        figure = drawn.figure.figure if isinstance(drawn, Axes) else drawn
        data, kind = _image(figure, "svg"), "svg+xml"
        if len(data) > _LARGEST:
            data, kind = _image(figure, "png"), "png"
    except Exception:  # whatever it was: of a design without roots, of a chart over three parameters, …
        return ""
    said, coded = words(caption), base64.b64encode(data).decode()
    return f'<figure><img alt="{said}" src="data:image/{kind};base64,{coded}"><figcaption>{said}</figcaption></figure>'


def _image(figure: Any, kind: str) -> bytes:
    """The same bytes for the same figure, whenever it is drawn."""
    image = io.BytesIO()
    about = {"Date": None} if kind == "svg" else {}
    with rc_context({"svg.hashsalt": "tmsopt", "svg.fonttype": "path"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph", UserWarning)  # of letters that no font here has: boxes show that
        figure.savefig(image, format=kind, dpi=_DOTS, bbox_inches="tight", metadata=about)
    return image.getvalue()


def untitled(result: Any) -> Any:
    """A result without its titles, which stand above its pictures already."""
    names = {f.name for f in fields(result) if f.init}
    held = {n: untitled(v) for n in _HOLDERS if n in names and is_dataclass(v := getattr(result, n))}
    return replace(result, **held, **({"title": ""} if "title" in names else {}))
