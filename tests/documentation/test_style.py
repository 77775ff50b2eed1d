"""The habits of style that a machine can see; CONTRIBUTING has the page of style."""

import ast
import io
import re
import tokenize

from helpers.places import ROOT

MODULES = sorted((ROOT / "tmsopt").rglob("*.py"))
WRITTEN = sorted(p for p in (ROOT / "docs").rglob("*.md") if p.parent.name not in ("generated", "gallery"))
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *WRITTEN]

BARE = re.compile(
    r"above|along|among|around|at|before|behind|below|beside|between|beyond|by|for|from|in|into|near|of|off|on|onto|"
    r"outside|over|past|than|through|toward|under|until|with|within|without|"
    r"\w+ed|\w+ing|begun|bound|built|done|drawn|found|given|gone|heard|held|kept|known|left|lost|"
    r"made|meant|met|put|said|seen|shown|spent|split|spread|stood|taken|thought|told|written"
)
"""Prepositions, and participles alone."""
USUAL = {"need", "feed", "seed", "string", "spring", "bring", "sing", "ring", "embed", "speed", "heading", "rounding"}
"""Nouns and verbs that look like participles."""
PUBLIC = re.compile(
    r"posed|located|typed|ordered|of|allowed|computed|within|named|controlled|found|applied|at|varied|varying|satisfied|"
    r"closed|predicted|without|left|meaning|split|reseed"
)
"""Attributes that versions promise, and words that are nouns or verbs too."""

HABIT = re.compile(
    r"(?:^|(?<=[.!?:;] )|(?<=\n\n))(?:Of (?:a|an|the|two|each|every|all|those|which|what|whom|it|them)\b|That of\b|"
    r"What (?:is|was)\b(?![^.]*\?)|Likewise\b)"
)
"""A sentence whose subject does not come first."""


def functions(path):
    """Functions, methods and properties that a module defines, with their lines."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name.strip("_"), node.lineno


def is_bare(name):
    """Whether a name is a preposition or a participle alone."""
    return name not in USUAL and not PUBLIC.fullmatch(name) and "_" not in name and bool(BARE.fullmatch(name))


def test_names_are_no_bare_participles_or_prepositions():
    bare = [f"{p.relative_to(ROOT)}:{line}: {name}" for p in MODULES for name, line in functions(p) if is_bare(name)]
    assert bare == []


def sentences(path):
    """Docstrings, comments and texts of a module, with their lines."""
    text = path.read_text(encoding="utf-8")
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.string.lstrip("# "), token.start[0]
        elif token.type == tokenize.STRING:
            yield re.sub(r"^[rRbBfF]*(\"\"\"|'''|\"|')|(\"\"\"|'''|\"|')$", "", token.string), token.start[0]


def test_sentences_of_modules_begin_with_their_subject():
    told = ((p, text, line) for p in MODULES for text, line in sentences(p))
    assert [f"{p.relative_to(ROOT)}:{n}: {m[0]}" for p, text, n in told for m in HABIT.finditer(text)] == []


def test_sentences_of_pages_begin_with_their_subject():
    prose = {page: re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL) for page in PAGES}
    found = [(p.name, m[0]) for p, text in prose.items() for m in HABIT.finditer(re.sub(r"\s*\n", " ", text))]
    assert found == []
