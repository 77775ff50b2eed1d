"""Every page of the documentation runs: files are read, commands and Python executed, what is printed compared."""

import doctest
import re
import shutil
import tomllib

import matplotlib
import pytest
from helpers.pages import PAGES, ROOT, agrees, blocks_of, exchanges, may_install, missing, run

import tmsopt

LANGUAGES = {"toml", "console", "python", "pycon", "sh", "text", "bibtex"}
DIRECTIVES = {"{glossary}", "{toctree}", "{include}", "{eval-rst}"}


def part_of(part, whole):
    """Whether every entry of a table is in another one, with the same value."""
    if isinstance(part, dict) and isinstance(whole, dict):
        return all(key in whole and part_of(value, whole[key]) for key, value in part.items())
    return part == whole


def written(block, folder):
    """A file that the page shows, or the part of one that it says it is."""
    first, _, rest = block.text.partition("\n")
    if first.startswith("# part of "):
        whole = tomllib.loads((folder / first.removeprefix("# part of ").split()[0]).read_text(encoding="utf-8"))
        assert part_of(tomllib.loads(rest), whole), first
        return
    assert first.startswith("# "), f"line {block.line}: what file is this?"
    assert first.endswith(".toml"), f"line {block.line}: what file is this?"
    file = folder / first.removeprefix("# ")
    file.write_text(block.text, encoding="utf-8")
    study = {"study", "vary"} & set(tomllib.loads(block.text))
    _ = tmsopt.load_study(file) if study else tmsopt.load(file)


def compared(block, names, page):
    """A session of Python prints what the page says."""
    test = doctest.DocTestParser().get_doctest(block.text, names, page.name, str(page), block.line)
    assert test.examples, f"line {block.line}: no line begins with >>>"
    assert not any(example.options for example in test.examples), f"line {block.line}: nothing is left out or loosened"
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    said = []
    doctest.DocTestRunner(optionflags=flags, verbose=False).run(test, out=said.append, clear_globs=False)
    assert not said, "".join(said)
    names.update(test.globs)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}-{page.stem}")
def test_what_a_page_shows_is_so(page, tmp_path, monkeypatch):
    shutil.copytree(ROOT / "problems", tmp_path / "problems")
    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    names = {"__name__": "page"}
    for block in blocks_of(page):
        assert block.language in LANGUAGES | DIRECTIVES, f"line {block.line}: {block.language}"
        if block.language == "toml":
            written(block, tmp_path)
        elif block.language == "console":
            for command, printed in exchanges(block):
                now = run(command, tmp_path, ROOT)
                line = missing(printed, now)
                assert line is None, f"line {block.line}, {command}: {line!r} is not in\n" + "\n".join(now)
        elif block.language == "python":
            exec(compile(block.text, f"{page.name}, line {block.line}", "exec"), names)
        elif block.language == "pycon":
            compared(block, names, page)
        elif block.language == "sh":
            assert may_install(block), f"line {block.line}: commands that can be run belong in `console`"
        else:
            runs = re.search(r"^(\$ |>>> |\[\w+\]$)", block.text, re.MULTILINE)
            assert runs is None, f"line {block.line}: {runs} belongs in a block that is run or read"


def test_the_pages_are_there():
    """So that nothing above passes because nothing was read."""
    assert len(PAGES) >= 15
    assert sum(block.language == "console" for page in PAGES for block in blocks_of(page)) >= 10


@pytest.mark.parametrize(
    ("printed", "now", "same"),
    [
        ("w 0.90909", "w 0.90909", True),
        ("w 0.90909", "w 0.90908", False),
        ("w 0.90909", "v 0.90909", False),
        ("proved; 146 boxes, 0.62 s", "proved; 146 boxes, 1.3 s", True),
        ("proved; 146 boxes, 0.62 s", "proved; 147 boxes, 0.62 s", False),
        ("proved; … s", "proved; 1 box, 3 s", True),
        ("proved; …", "found; 1 box", False),
        ("a … c", "a b c", True),
        ("a … c", "a b c d", False),
        ("a … c", "a c", True),
        ("at most -3.337…, proved", "at most -3.33745, proved", True),
        ("at most -3.337…, proved", "at most -3.33845, proved", False),
        ("decay time 0.5492 s; 3 s", "decay time 0.5492 s; 4 s", True),
        ("decay time 0.5492 s", "decay time 0.5493 s", False),
        ("decay_time <= 0.5 s by 0.1 s", "decay_time <= 0.7 s by 0.1 s", False),
        ("1.414213562373095048801", "1.414213562373095048802", False),
        ("± 2.7e-35", "± 3.1e-35", True),
        ("± 2.7e-35", "± 2.7e-33", False),
        ("off by 0", "off by 3e-16", True),
    ],
)
def test_lines_are_compared_by_words_and_numbers(printed, now, same):
    assert agrees(printed, now) is same


@pytest.mark.parametrize(
    ("printed", "line"),
    [
        (["a", "b"], None),
        (["b", "…", "d"], None),
        (["a", "c"], "c"),
        (["…", "d", "a"], "a"),
        (["…", "c", "…", "b"], "b"),
    ],
)
def test_lines_are_looked_for_in_their_order(printed, line):
    assert missing(printed, ["a", "b", "c", "d"]) == line


@pytest.mark.parametrize(
    "text",
    [
        "```console\ntmsopt solve a.toml\noptimal\n```",
        "```console\nbefore\n$ true\n```",
        "```console\n$ true\n",
        "- item\n\n  ```toml\n  a = [\n  ```",
        "~~~console\n$ false\n~~~",
        "```{python}\n1/0\n```",
        "```json\n{,}\n```",
        "```pycon\n1 + 1\n3\n```",
        "```pycon\n>>> 1 + 1  # doctest: +SKIP\n3\n```",
        "```text\nFirst\n$ tmsopt solve a.toml\n```",
        "```text\n[parameters]\nFr = 1\n```",
    ],
)
def test_a_block_that_would_not_be_run_is_found(text, tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    page.write_text(f"# Title\n\n{text}\n", encoding="utf-8")
    with pytest.raises(AssertionError):
        test_what_a_page_shows_is_so(page, tmp_path, monkeypatch)
