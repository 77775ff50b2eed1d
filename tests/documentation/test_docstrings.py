"""Every public name explains itself: an example that runs, and the page of the documentation that has the rest."""

import doctest
import inspect
import math
import re
from importlib import import_module

import matplotlib.pyplot
import numpy as np
import pytest
from helpers.places import ROOT

import tmsopt

FACES = ("tmsopt", "tmsopt.models", "tmsopt.roots", "tmsopt.laws", "tmsopt.plots")
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
NEEDS = {"tmsopt.certify": "pyscipopt"}
"""Names whose examples take what an extra brings."""

_PAGE = re.compile(r"^\s*More: (docs/[\w/]+\.md)$", re.MULTILINE)


def is_ours(face, name):
    """Whether a name of a module without `__all__` is defined there for others."""
    return not name.startswith("_") and getattr(getattr(face, name), "__module__", None) == face.__name__


def public():
    """Public functions and classes, each once, by the first name under which it is found."""
    seen = set()
    for face in map(import_module, FACES):
        names = getattr(face, "__all__", None) or [n for n in vars(face) if is_ours(face, n)]
        for name in names:
            value = getattr(face, name)
            if (inspect.isclass(value) or inspect.isroutine(value)) and id(value) not in seen:
                seen.add(id(value))
                yield f"{face.__name__}.{name}", value


PUBLIC = dict(public())


def text_of(value):
    """Its own docstring, and not that of a class above it."""
    return (vars(value).get("__doc__") if inspect.isclass(value) else value.__doc__) or ""


def example_of(name):
    known = {"tmsopt": tmsopt, "math": math, "np": np}
    return doctest.DocTestParser().get_doctest(text_of(PUBLIC[name]), known, name, name, 0)


def test_the_names_are_there():
    """So that nothing below passes because nothing was found: of each module something, decorated or not, by its kind."""
    expected = {"tmsopt.solve", "tmsopt.Solution", "tmsopt.models.Model", "tmsopt.roots.roots", "tmsopt.laws.tls"}
    assert expected | {"tmsopt.laws.EP4", "tmsopt.plots.draw_chart"} <= set(PUBLIC)
    assert not {"tmsopt.laws", "tmsopt.laws.bench", "tmsopt.laws.Callable", "tmsopt.roots.PATTERNS"} & set(PUBLIC)
    assert len(PUBLIC) > 150


def test_every_name_has_an_example():
    examples = {name: example_of(name).examples for name in PUBLIC}
    assert [name for name, found in examples.items() if not found] == []
    assert [name for name, found in examples.items() if any(one.options for one in found)] == []  # none is skipped


def test_every_name_has_a_page():
    """One that is there, in the last line."""
    pages = {name: _PAGE.findall(text_of(value)) for name, value in PUBLIC.items()}
    assert {name for name, found in pages.items() if len(found) != 1} == set()
    assert {page for found in pages.values() for page in found if not (ROOT / page).is_file()} == set()


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLIC)
def test_the_example_is_so(name, monkeypatch):
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    monkeypatch.chdir(ROOT)
    matplotlib.use("agg")
    said = []
    ended = doctest.DocTestRunner(optionflags=FLAGS, verbose=False).run(example_of(name), out=said.append)
    matplotlib.pyplot.close("all")
    assert ended.attempted
    assert not ended.failed, "".join(said)
