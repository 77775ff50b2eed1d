"""Chromium for tests of pages: found, or the test is skipped with a reason; pages that are watched."""

import os
import shutil
from contextlib import contextmanager

import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome")
_PATIENCE = 10_000  # ms
_OWN = ("about:", "data:", "blob:")
"""Addresses that are part of a page."""


@contextmanager
def chromium():
    """A headless browser, by Playwright."""
    play = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    found = next(filter(None, map(shutil.which, _NAMES)), None)
    if found is None:
        pytest.skip(f"none of {', '.join(_NAMES)} is installed")
    root = hasattr(os, "geteuid") and os.geteuid() == 0  # whose Chromium has no sandbox
    with play.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=found, args=["--disable-gpu"] + ["--no-sandbox"] * root)
        yield browser
        browser.close()


@contextmanager
def opened(
    browser,
    path,
    *,
    width=1280,
    height=900,
    link="",
    faults=None,
    **context,
):
    """A page of a file, drawn. In the end it must have been without faults and without requests.

    Args:
        link: the fragment of its address.
        faults: where errors, warnings, dialogs and requests are noted; a list that is given is the caller's to judge.
        context: options of Playwright's `new_context`, such as ``color_scheme="dark"``.
    """
    noted = [] if faults is None else faults
    address = path.resolve().as_uri()
    with browser.new_context(viewport={"width": width, "height": height}, **context) as surroundings:

        def watched(route):
            if route.request.url.split("#")[0] == address or route.request.url.startswith(_OWN):
                route.continue_()
            else:
                noted.append(f"request: {route.request.url}")
                route.abort()

        def heard(message):
            if message.type in ("error", "warning"):
                noted.append(f"{message.type}: {message.text}")

        surroundings.route("**/*", watched)
        page = surroundings.new_page()
        page.set_default_timeout(_PATIENCE)
        page.on("console", heard)
        page.on("pageerror", lambda error: noted.append(f"error: {error.message}"))
        page.on("dialog", lambda dialog: (noted.append(f"dialog: {dialog.message}"), dialog.dismiss()))
        page.goto(address + (f"#{link}" if link else ""))
        drawn(page)
        yield page
    assert faults is not None or not noted, noted


def drawn(page):
    """Wait until all that was asked for is drawn."""
    page.evaluate(
        "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done))))"
    )


def press(page, name):
    """Press the button of a name, and wait."""
    page.get_by_role("button", name=name, exact=True).click()
    drawn(page)
