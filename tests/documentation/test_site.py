"""The site: built as CONTRIBUTING says, every problem in its gallery, every public name in its reference, every link led."""

import re
import shutil
import subprocess
import sys
import tomllib
from html import unescape
from html.parser import HTMLParser
from urllib.parse import unquote

import pytest
from helpers.places import ROOT

import tmsopt

pytestmark = pytest.mark.slow
RUN = "ep4", "three_masses", "whipple_ep4"  # all of them run where the site is built for readers


class Page(HTMLParser):
    """What a page links to, loads, and can be linked to."""

    def __init__(self, path):
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("id", "name") and value:
                self.anchors.add(value)
            if name == "href" and value and tag == "a":
                self.links.append(value)
            if value and ((name == "src") or (name == "href" and tag == "link")):
                self.loads.append(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, of a copy of what it is made from, with a few of its scripts run; a warning is an error."""
    pytest.importorskip("sphinx")
    root = tmp_path_factory.mktemp("site")
    unwanted = shutil.ignore_patterns("generated", "gallery", "build", "__pycache__", ".git", ".*_cache", "*.egg-info")
    shutil.copytree(ROOT, root, ignore=unwanted, dirs_exist_ok=True)
    command = [sys.executable, "-m", "sphinx", "-nW", "--keep-going", "docs", "build/docs"]
    command += ["-D", f"sphinx_gallery_conf.filename_pattern=/({'|'.join(RUN)})\\."]
    ended = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False, timeout=600)
    assert ended.returncode == 0, ended.stderr[-4000:]
    return root / "build" / "docs"


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path) for path in site.rglob("*.html") if "_static" not in path.parts}


def test_every_link_leads_somewhere(site, pages):
    """Within the site; elsewhere only by https, for what is elsewhere cannot be asked without a network."""
    led = 0
    for path, page in pages.items():
        for link in page.links:
            if re.match(r"[a-z]+:", link):
                assert link.startswith(("https://", "mailto:")), (path, link)
                continue
            name, _, anchor = unquote(link).partition("#")
            target = (path.parent / name).resolve() if name else path
            target = target / "index.html" if target.is_dir() else target
            assert target.is_file(), (path, link)
            assert not anchor or target not in pages or anchor in pages[target].anchors, (path, link)
            led += 1
    assert len(pages) > 90
    assert led > 5000


def test_nothing_is_loaded_from_elsewhere(pages):
    for path, page in pages.items():
        for load in page.loads:
            assert not re.match(r"(https?:)?//", load), (path, load)
            assert load.startswith(("data:", "#")) or (path.parent / unquote(load).split("?")[0]).resolve().is_file(), (
                load
            )


def test_every_problem_is_in_the_gallery(site):
    """Those that are run with their picture, explorer and answer."""
    for file in (*ROOT.glob("problems/*.toml"), *ROOT.glob("problems/*.py")):
        name = file.stem if file.suffix == ".toml" else f"{file.stem}_script"
        (page,) = (site / "gallery").rglob(f"{name}.html")
        text = page.read_text(encoding="utf-8")
        if name not in RUN:
            continue
        assert f"sphx_glr_{name}_001.png" in text, name
        printed = re.findall(r"sphx-glr-script-out.*?<pre>(.*?)</pre>", text, re.DOTALL)
        answer = unescape(re.sub(r"<[^>]+>", "", "\n".join(printed)))
        assert len(answer) > 60, name
        assert not re.search("not converged|infeasible", answer), name
        assert file.suffix == ".py" or tomllib.loads(file.read_text(encoding="utf-8"))["title"] in answer, name
        assert file.suffix == ".py" or "<iframe" in text, name


def test_every_public_name_is_in_the_reference(site):
    text = "".join(path.read_text(encoding="utf-8") for path in (site / "generated" / "api").glob("*.html"))
    documented = set(re.findall(r'id="(tmsopt\.[\w.]+)"', text))
    modules = {"laws", "models", "plots", "report", "roots"}
    assert {f"tmsopt.{name}" for name in tmsopt.__all__ if name not in modules | {"__version__"}} <= documented


def test_symbols_and_keys_are_the_programs_own(site):
    quantities = (site / "reference" / "quantities.html").read_text(encoding="utf-8")
    for model in ("tms", "whipple"):
        for words in tmsopt.describe(model).sets:
            for word in (*words.parameters, *words.quantities):
                assert f">{word.name}<" in quantities, word.name
    keys = (site / "reference" / "problem_file.html").read_text(encoding="utf-8")
    assert {"objective.locate", "constraints", "tolerances"} <= set(re.findall(r'class="pre">([\w.]+)<', keys))
    commands = (site / "reference" / "commands.html").read_text(encoding="utf-8")
    assert all(f"tmsopt-{name}" in commands for name in ("solve", "prove", "study", "explore", "verify"))
