"""The gallery: every file of `problems/` as an example that is run when the site is built.

What is there, in which section, and which command answers it, is the table of `problems.md`; what a problem is about
stands at the head of its file. Scripts are examples as they are.
"""

import ast
import re
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx_gallery.scrapers import figure_rst

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "build" / "examples"

_HEAD = """Gallery
=======

This gallery shows every problem that comes with tmsopt: its file, its answer, its picture and the explorer. The
problems were solved when this page was made.
"""

_ASKED = {
    "solve": ("design", 'solve("{path}", throw=False)'),
    "front": ("design", 'pareto("{path}")'),
    "all": ("every", 'solve_all("{path}")'),
    "trace": ("curve", 'trace("{path}")'),
    "chart": ("chart", 'chart("{path}")'),
    "study": ("results", 'run_study("{path}")'),
    "speeds": ("speeds", 'speeds("{path}")'),
}
"""What answers a verb: the name of the answer, and how it is asked for."""


def listed() -> Iterator[tuple[str, Path, str, str]]:
    """Section, file, question and verb of everything in the table of problems."""
    section = ""
    for line in (ROOT / "docs" / "problems.md").read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            section = line[3:]
        if line.startswith("| ["):
            _, names, question, _ = line.split("|")
            for name in re.findall(r"\[([\w.]+)\]", names):
                verb = re.search(r"\((?:`--)?(trace|chart|study|speeds|all)`?\)$", question.strip())
                path = ROOT / "problems" / name
                yield section, path, question.strip(), verb[1] if verb else _verb(path)


def _verb(path: Path) -> str:
    asked = tomllib.loads(path.read_text(encoding="utf-8")).get("objective", {}) if path.suffix == ".toml" else {}
    return "front" if "pareto" in asked else "solve"


def _plain(text: str) -> str:
    """Words of a comment as reStructuredText that means no more than them."""
    return re.sub(r"([\\*`|])|_(?=\W|$)", r"\\\g<0>", text)


def _titled(title: str, text: str) -> str:
    return f'r"""\n{title}\n{"=" * len(title)}\n\n{text}\n"""\n\n'


def _problem(path: Path, verb: str) -> str:
    """An example of a problem file."""
    text = path.read_text(encoding="utf-8")
    head = "\n".join(line[2:] for line in text.splitlines() if line.startswith("# ") or not line.strip())
    about = _plain(" ".join(head.split("\n\n", maxsplit=1)[0].split()))
    title = tomllib.loads(text)["title"]
    name = f"problems/{path.name}"
    body = "\n".join(line for line in text.splitlines() if not line.startswith("#"))
    shown = "\n".join(f"#     {line}".rstrip() for line in body.strip().splitlines())
    answer, asked = _ASKED[verb]
    parts = [f"import tmsopt\n\n{answer} = tmsopt.{asked.format(path=name)}\nprint({answer})"]
    parts.append(f"picture = {answer}.plot()")
    explored = {"solve": "design", "all": "every.solutions[0]", "study": "results.study.problem"}.get(verb, f'"{name}"')
    parts.append(f"tmsopt.explore({explored})")
    return (
        _titled(_plain(title), about)
        + f"# %%\n# :download:`{path.name} </../problems/{path.name}>`:\n#\n# .. code-block:: toml\n#\n{shown}\n\n"
        + "\n\n# %%\n\n".join(parts)
        + "\n"
    )


def _script(path: Path) -> str:
    """An example of a script, with a picture of the last design that it found."""
    text = path.read_text(encoding="utf-8")
    first, rest = re.split(r"(?<=[.?])\s", ast.get_docstring(ast.parse(text)) or "", maxsplit=1)
    code = text.split('"""', 2)[2].strip()
    drawn = "picture = design.plot()"
    if "def draw(" in code:
        drawn = 'draw("unfold.png")\npicture = Path("unfold.png")'
    return _titled(_plain(first.rstrip(".")), _plain(rest)) + f"{code}\n\n# %%\n\n{drawn}\n"


def write_examples(_: Sphinx) -> None:
    """The examples, in a folder of each section, beside the files that they read."""
    shutil.rmtree(EXAMPLES, ignore_errors=True)
    sections: list[str] = []
    for section, path, _question, verb in listed():
        if section not in sections:
            sections.append(section)
        name = re.sub(r"\W+", "_", section).lower()
        folder = EXAMPLES / f"{len(sections)}_{name}"
        if not folder.exists():
            shutil.copytree(ROOT / "problems", folder / "problems", ignore=shutil.ignore_patterns("*.py", "*.png"))
            (folder / "GALLERY_HEADER.rst").write_text(f"{section}\n{'-' * len(section)}\n", encoding="utf-8")
        text = _problem(path, verb) if path.suffix == ".toml" else _script(path)
        (folder / f"{_named(path)}.py").write_text(text, encoding="utf-8")
    (EXAMPLES / "GALLERY_HEADER.rst").write_text(_HEAD, encoding="utf-8")


def place(name: str) -> int:
    """Where an example stands in its section: as in the table."""
    return [_named(path) for _, path, _, _ in listed()].index(Path(name).stem)


def _named(path: Path) -> str:
    """Name of an example; some scripts are called as a problem is."""
    return f"{path.stem}_script" if path.suffix == ".py" else path.stem


def drawn(_block: object, variables: dict[str, Any], conf: dict[str, Any]) -> str:
    """The picture that an example has just drawn, for they are not figures of pyplot."""
    picture = variables["example_globals"].pop("picture", None)
    if picture is None:
        return ""
    path = Path(next(variables["image_path_iterator"]))
    if isinstance(picture, Path):
        shutil.copy(picture, path)
    else:
        picture.figure.savefig(path, dpi=110)
    return figure_rst([str(path)], conf["src_dir"])


def setup(app: Sphinx) -> dict[str, bool]:
    """Examples are there before sphinx-gallery looks for them."""
    app.connect("builder-inited", write_examples, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
