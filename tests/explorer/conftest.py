"""Pages of problems, each made once, and opened in Chromium."""

from functools import cache
from pathlib import Path

import pytest
from helpers.browser import opened
from helpers.places import PROBLEMS

import tmsopt


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """The explorer of a problem file, by its name, and the file of its page."""
    folder = tmp_path_factory.mktemp("pages")

    @cache
    def make(name):
        explorer, path = tmsopt.explore(PROBLEMS / f"{name}.toml"), folder / f"{name}.html"
        explorer.save(path)
        return explorer, path

    return make


@pytest.fixture
def show(browser, made, tmp_path):
    """Opens the page of a problem file: of its name, of its text, or a page that was made; options as of `opened`."""

    def show(what, **options):
        if isinstance(what, Path):
            return opened(browser, what, **options)
        if "\n" not in what:
            return opened(browser, made(what)[1], **options)
        (tmp_path / "stated.toml").write_text(what)
        tmsopt.explore(tmp_path / "stated.toml").save(tmp_path / "stated.html")
        return opened(browser, tmp_path / "stated.html", **options)

    return show
