"""The reference, written from the program's own data when the site is built, and links that lead to pages of the site.

Models say what their symbols are, the schema what a file may say, the faces what is public, docstrings the rest. Files
of the repository that are pages too (change log, ledger, results …) are taken over with their links.
"""

import inspect
import os
import re
import shutil
from collections.abc import Iterator, Mapping, Sized
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

import tmsopt
from extensions.gallery import EXAMPLES, ROOT
from tmsopt.records import Printable

DOCS = ROOT / "docs"
GENERATED = DOCS / "generated"
COPIED = {
    "CHANGELOG.md": "changelog",
    "CONTRIBUTING.md": "contributing",
    "SECURITY.md": "security",
    "benchmarks/results.md": "results",
    "problems/paper.md": "ledger",
}
FACES = {
    "tmsopt": "Everything reached as ``tmsopt.…``, by the package it comes from.",
    "laws": "The closed forms of the paper, each named after its equation; they import nothing of tmsopt.",
    "models": "Bicycles, and systems of your own.",
    "roots": "Polynomials, their roots, and which of them meet.",
    "plots": "Pictures, drawn into given Axes of Matplotlib.",
}
_EXAMPLES = "Examples run at the root of the repository, after ``import tmsopt``."
_LINK = re.compile(r"(?<=\]\()(?![a-z]+:)([^)#\s]*)(#[^)\s]*)?(?=\))")


# What is public


def names_of(module: ModuleType) -> list[str]:
    """The public names of a face, in their order."""
    listed = getattr(module, "__all__", None)
    if listed is not None:
        return list(listed)
    own = (n for n, x in vars(module).items() if getattr(x, "__module__", None) == module.__name__)
    return [n for n in own if not n.startswith("_")]


def _entry(face: str, module: ModuleType, name: str) -> str:
    found = getattr(module, name)
    path = name if face == "tmsopt" else f"{face}.{name}"
    if face != "tmsopt" and name in tmsopt.__all__:
        return f"See `tmsopt.{name}`.\n"
    if inspect.isclass(found):
        return f".. autoclass:: tmsopt.{path}\n   :members:\n"
    if callable(found):
        return f".. autofunction:: tmsopt.{path}\n"
    size = f" of {len(found)}" if isinstance(found, Sized) else ""
    text = repr(found) if len(repr(found)) < 90 else f"{type(found).__name__}{size}"
    return f".. py:data:: tmsopt.{path}\n\n   ``{text}``\n"


def _package(found: object) -> str:
    """Where a name is at home: the package right below tmsopt."""
    return getattr(found, "__module__", "tmsopt").split(".")[1]


def _api(face: str) -> str:
    """A page of one face."""
    module = tmsopt if face == "tmsopt" else getattr(tmsopt, face)
    title = face if face == "tmsopt" else f"tmsopt.{face}"
    text = f"{title}\n{'=' * len(title)}\n\n{FACES[face]} {_EXAMPLES}\n\n"
    names = [n for n in names_of(module) if not inspect.ismodule(getattr(module, n)) and not n.startswith("__")]
    if face != "tmsopt":
        return text + "\n".join(_entry(face, module, n) for n in names)
    packages: dict[str, list[str]] = {}
    for name in names:
        packages.setdefault(_package(getattr(module, name)), []).append(name)
    for package, inside in packages.items():
        about = inspect.getdoc(import_module(f"tmsopt.{package}")) or ""
        heading = package.replace("_", " ").capitalize()
        entries = "\n".join(_entry(face, module, n) for n in inside)
        text += f"{heading}\n{'-' * len(heading)}\n\n{about.splitlines()[0]}\n\n{entries}\n"
    return text


# What files may say


def _cell(text: object) -> str:
    return str(text).replace("|", "\\|").replace("\n", " ").replace("<", "&lt;")


def _table(head: tuple[str, ...], rows: Iterator[tuple[object, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(_cell(c) for c in line) + " |" for line in lines) + "\n"


def _keys(schema: Mapping[str, Any], path: str = "") -> Iterator[tuple[object, ...]]:
    """The keys of a file, with what the schema says of them."""
    for name, inside in schema["properties"].items():
        key = f"{path}{name}"
        words = inside.get("description", "")
        accepted = inside.get("enum") or next((a["enum"] for a in inside.get("anyOf", ()) if "enum" in a), ())
        named = f" Such as {', '.join(f'`{a}`' for a in accepted)}." if accepted else ""
        default = f" Left out: `{inside['default']}`." if inside.get("default", "") != "" else ""
        yield f"`{key}`", f"{words}{named}{default}"
        tables = inside if "properties" in inside else inside.get("else", {})
        if "properties" in tables and name != "parameters":
            yield from _keys(tables, f"{key}.")


def _files(kind: str) -> str:
    return _table(("key", "means"), _keys(tmsopt.schema()["$defs"][kind]))


def _quantities() -> Iterator[str]:
    """Parameters, quantities, patterns of the models, from their own tables."""
    for model in ("tms", "whipple"):
        described = tmsopt.describe(model)
        yield f"\n## `{model}`: {described.meaning}\n"
        if described.sketch:
            yield f"```text\n{described.sketch}\n```\n"
        yield "\n".join(f"- {line}" for line in described.conventions) + "\n"
        for words in described.sets:
            yield f"### {words.name} parameters of {model}\n"
            rows = ((f"`{p.name}`", p.unit, p.meaning, p.range, p.given) for p in words.parameters)
            yield _table(("symbol", "unit", "means", "range", "default"), rows)
            yield f"### Quantities of {model}, {words.name}\n"
            yield _table(("symbol", "unit", "means"), ((f"`{q.name}`", q.unit, q.meaning) for q in words.quantities))
        for words in described.feedback:
            yield f"### Gains of {model} in [feedback], {words.name}\n"
            rows = (
                (f"`{p.name}`", p.unit, p.meaning, p.range, p.given) for p in (*words.parameters, *words.quantities)
            )
            yield _table(("symbol", "unit", "means", "range", "default"), rows)
    described = tmsopt.describe("tms")
    yield "\n## Patterns of roots\n"
    yield _table(("pattern", "means"), ((f"`{n}`", m) for n, m in described.patterns.items()))
    yield "\n## Functions and numbers in expressions\n\n" + ", ".join(f"`{f}`" for f in described.functions) + "\n"


def write_reference(_: Sphinx) -> None:
    """All that is generated."""
    shutil.rmtree(GENERATED, ignore_errors=True)
    (GENERATED / "api").mkdir(parents=True)
    for face in FACES:
        (GENERATED / "api" / f"{face}.rst").write_text(_api(face), encoding="utf-8")
    parts = {
        "problem_keys": _files("problem"),
        "study_keys": _files("study_file"),
        "quantities": "\n".join(_quantities()),
    }
    for name, text in parts.items():
        (GENERATED / f"{name}.inc").write_text(text, encoding="utf-8")
    for origin, name in COPIED.items():
        text = (ROOT / origin).read_text(encoding="utf-8")
        (GENERATED / f"{name}.md").write_text(relinked(text, (ROOT / origin).parent, GENERATED), encoding="utf-8")


# Links


def _pages() -> dict[Path, Path]:
    """Files of the repository → pages of the site that show them."""
    found = {ROOT / "README.md": DOCS / "index.md"}
    found |= {ROOT / origin: GENERATED / f"{name}.md" for origin, name in COPIED.items()}
    for path in EXAMPLES.rglob("*.py"):
        name = path.stem.removesuffix("_script") + (".py" if path.stem.endswith("_script") else ".toml")
        found[ROOT / "problems" / name] = (DOCS / "gallery" / path.relative_to(EXAMPLES)).with_suffix(".rst")
    return found


def relinked(text: str, origin: Path, there: Path) -> str:
    """A text whose links are relative to `origin`, with links relative to `there`, to pages where there are such."""
    pages = _pages()

    def replaced(link: re.Match[str]) -> str:
        if not link[1]:
            return link[0]
        target = Path(os.path.normpath(origin / link[1]))
        return os.path.relpath(pages.get(target, target), there) + (link[2] or "")

    return _LINK.sub(replaced, text)


def _read(app: Sphinx, name: str, source: list[str]) -> None:
    """A page by hand is about to be parsed."""
    path = Path(app.env.doc2path(name))
    if path.suffix == ".md" and GENERATED not in path.parents:
        source[0] = relinked(source[0], path.parent, path.parent)


_COLON = "\x1a"  # in the place of a colon that begins no field


def _before_napoleon(_app: Sphinx, what: str, _name: str, _found: object, _options: object, lines: list[str]) -> None:
    """What napoleon would misread: a colon in the line of a property, and several fields in one line."""
    if what in ("property", "attribute") and lines:
        lines[0] = lines[0].replace(":", _COLON)
    text = "\n".join(lines)
    several = re.compile(r"^( +)(\w+(?:, \w+)+): (.*(?:\n\1 +.*)*)", re.MULTILINE)
    lines[:] = several.sub(lambda m: "\n".join(f"{m[1]}{n}: {m[3]}" for n in m[2].split(", ")), text).split("\n")


def _signature(
    _app: Sphinx, what: str, _name: str, found: object, _options: object, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Names without the modules that they are from; results, which nobody makes, without arguments."""
    if inspect.isclass(found) and Printable in inspect.getmro(found):
        return "", None
    short = re.compile(r"~?\b(?:[a-z_]\w*\.)+(?=[A-Za-z_]\w*)")
    return signature and short.sub("", signature).replace("~", ""), returned and short.sub("", returned)


def _docstring(_app: Sphinx, _what: str, _name: str, _found: object, _options: object, lines: list[str]) -> None:
    """A docstring is about to be rendered: its last line leads to a page, public names to themselves, `x` is code."""
    for number, line in enumerate(line.replace(_COLON, ":") for line in list(lines)):
        lines[number] = line
        page = re.fullmatch(r"More: docs/(.*)\.md", line.strip())
        if page:
            lines[number] = f"More: :doc:`/{page[1]}`"
        elif not line.lstrip().startswith((">>>", "...")):
            pieces = re.split(r"(``[^`]*``|(?<!:)`[^`]*`)", line)
            pieces[::2] = [re.sub(r"(?<!\\)([|]|\*(?=\*?\w))", r"\\\1", piece) for piece in pieces[::2]]
            pieces[1::2] = [piece if piece.startswith("``") else _code(piece[1:-1]) for piece in pieces[1::2]]
            lines[number] = "".join(pieces)


def _code(text: str) -> str:
    name = text.removeprefix("tmsopt.")
    return f":py:obj:`tmsopt.{name}`" if name in tmsopt.__all__ else f"``{text}``"


def _help(_app: Sphinx, _context: object, lines: list[str]) -> None:
    """The help of a command is about to be rendered: what stands as it is typed is code."""
    found: list[str] = []
    for line in lines:
        if not line.startswith("| "):
            found.append(re.sub(r"([*`])", r"\\\1", line))
        elif line.endswith(":") and not line.startswith("|  "):
            found += [line[2:], ""]
        else:
            if not found or not found[-1].startswith("    "):
                found += ["", ".. code-block:: text", ""]
            found.append("    " + line[2:])
    lines[:] = found


def _dashes(_app: Sphinx, doctree: nodes.document) -> None:
    """Between a field and what it is stands a dash: smart quotes are off, for they would spoil `--json`."""
    for text in list(doctree.findall(nodes.Text)):
        if text == " -- ":
            text.parent.replace(text, nodes.Text(" – "))


def setup(app: Sphinx) -> dict[str, bool]:
    """Before anything is read; after the examples are written."""
    app.connect("builder-inited", write_reference, priority=200)
    app.connect("source-read", _read)
    app.connect("autodoc-process-docstring", _before_napoleon, priority=400)
    app.connect("autodoc-process-docstring", _docstring, priority=900)
    app.connect("autodoc-process-signature", _signature)
    app.connect("doctree-read", _dashes)
    for part in ("description", "epilog"):
        app.connect(f"sphinx-click-process-{part}", _help)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
