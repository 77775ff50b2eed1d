"""What surrounds the code: citation, change log, forms for reports, hooks and the workflow of the gate."""

import datetime
import os
import re
import shlex
import subprocess
import sys
import tomllib

import pytest
from helpers.places import ROOT

import tmsopt

yaml = pytest.importorskip("yaml")

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PYTHONS = [c.rpartition(" ")[2] for c in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", c)]
FORMS = sorted(p for p in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml") if p.name != "config.yml")
CHANGES = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def read(*names):
    """A file of YAML as plain data."""
    return yaml.safe_load(ROOT.joinpath(*names).read_text(encoding="utf-8"))


# How to cite it


CITED = read("CITATION.cff")


def test_the_citation_has_what_the_format_asks_for():
    """Citation File Format 1.2.0: keys that a software and a reference must have, and no others than it knows."""
    assert CITED["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= set(CITED)
    assert CITED["type"] == "software"
    known = """abstract authors cff-version commit contact date-released doi identifiers keywords license license-url
        message preferred-citation references repository repository-artifact repository-code title type url version"""
    assert set(CITED) <= set(known.split())
    assert len(set(CITED["keywords"])) == len(CITED["keywords"]) > 0
    assert all(set(author) == {"name"} for author in CITED["authors"])


@pytest.mark.parametrize("reference", CITED["references"], ids=lambda r: r["title"][:30])
def test_a_reference_can_be_found(reference):
    assert {"authors", "title", "type", "year"} <= set(reference)
    assert reference["type"] == "article"
    assert all(set(author) == {"family-names", "given-names"} for author in reference["authors"])
    if "journal" in reference:
        assert re.fullmatch(r"10\.\d{4,}/\S+", reference["doi"])
        assert 0 < reference["start"] < reference["end"]


def test_the_citation_agrees_with_the_project():
    assert CITED["version"] == tmsopt.__version__ == PROJECT["version"]
    assert CITED["license"] == PROJECT["license"]
    assert CITED["keywords"] == PROJECT["keywords"]


def test_the_page_cites_the_same():
    page = (ROOT / "docs" / "explanation" / "cite.md").read_text(encoding="utf-8")
    plain = re.sub("[{}]", "", page)
    for entry in (CITED, *CITED["references"]):
        assert entry["title"] in plain
        for key in ("doi", "version", "volume", "journal"):
            assert str(entry.get(key, "")) in plain
    assert f"{CITED['date-released']}" in page


# What changed


def test_the_change_log_keeps_its_form():
    """Newest first, this version, each once, with its date, and its changes by their kind, in one order."""
    heads = re.findall(r"^## (.*)$", CHANGES, re.MULTILINE)
    assert heads[0] == "[Unreleased]"
    versions = [re.fullmatch(r"\[(\d+)\.(\d+)\.(\d+)\] - (\d{4}-\d\d-\d\d)", head) for head in heads[1:]]
    assert all(versions)
    numbers = [tuple(int(v[n]) for n in (1, 2, 3)) for v in versions if v]
    dates = [datetime.date.fromisoformat(v[4]) for v in versions if v]
    assert numbers == sorted(set(numbers), reverse=True)
    assert dates == sorted(dates, reverse=True)
    kinds = ("Added", "Changed", "Deprecated", "Removed", "Fixed", "Security")
    for part in re.split(r"^## .*$", CHANGES, flags=re.MULTILINE)[1:]:
        found = re.findall(r"^### (.*)$", part, re.MULTILINE)
        assert set(found) <= set(kinds)
        assert len(set(found)) == len(found)
    newest = re.findall(r"^## \[(\d\S*)\] - (\S+)$", CHANGES, re.MULTILINE)[0]
    assert newest == (tmsopt.__version__, str(CITED["date-released"]))


# Reports


def test_the_forms_are_there():
    assert [form.stem for form in FORMS] == ["bug", "idea", "wrong_answer"]
    assert isinstance(read(".github", "ISSUE_TEMPLATE", "config.yml")["blank_issues_enabled"], bool)


@pytest.mark.parametrize("form", FORMS, ids=lambda p: p.stem)
def test_a_form_is_one_that_a_code_host_takes(form):
    """Names and types of GitHub's syntax of issue forms."""
    data = read(".github", "ISSUE_TEMPLATE", form.name)
    assert set(data) <= {"name", "description", "title", "labels", "body", "assignees", "projects", "type"}
    assert all(data[key] for key in ("name", "description", "body"))
    fields = [entry for entry in data["body"] if entry["type"] != "markdown"]
    assert fields
    names = [entry["id"] for entry in fields]
    assert len(set(names)) == len(names)
    for entry in data["body"]:
        assert entry["type"] in {"markdown", "textarea", "input", "dropdown", "checkboxes"}
        assert set(entry) <= {"type", "id", "attributes", "validations"}
        assert entry["attributes"]["value" if entry["type"] == "markdown" else "label"]
        if entry["type"] == "dropdown":
            assert len(entry["attributes"]["options"]) > 1


@pytest.mark.parametrize("name", ["bug", "wrong_answer"])
def test_a_report_has_what_it_takes_to_run_it(name):
    entries = {e["id"]: e for e in read(".github", "ISSUE_TEMPLATE", f"{name}.yml")["body"] if "id" in e}
    assert entries["versions"]["attributes"]["label"] == "tmsopt --version --json"
    assert {"versions", "problem", "command"} <= {n for n, e in entries.items() if e["validations"]["required"]}


def test_files_that_forms_name_exist():
    texts = [p.read_text(encoding="utf-8") for p in [*FORMS, ROOT / ".github" / "pull_request_template.md"]]
    named = set(re.findall(r"(?:docs/[\w/]+|[A-Z]{4,})\.md|problems/[\w.]+", "\n".join(texts)))
    assert {"SECURITY.md", "CHANGELOG.md", "docs/how_to/report_a_bug.md"} <= named
    assert [name for name in named if not (ROOT / name).is_file()] == []


# The gate


GATE = read(".github", "workflows", "gate.yml")


def test_the_gate_runs_on_every_python_that_is_promised():
    assert PROJECT["requires-python"] == f">={PYTHONS[0]}"
    gate = GATE["jobs"]["gate"]
    assert gate["strategy"]["matrix"]["python"] == PYTHONS
    assert gate["strategy"]["fail-fast"] is False
    (asked,) = (s["with"]["python-version"].split() for s in gate["steps"] if "setup-python" in s.get("uses", ""))
    assert asked[:2] == [PYTHONS[0], PYTHONS[-1]]
    assert " ".join(asked[2:]) == "${{ matrix.python }}"  # the last is the one that is python3
    page = (ROOT / "docs" / "reference" / "versions.md").read_text(encoding="utf-8")
    assert all(python in page for python in PYTHONS)


def test_the_gate_is_the_one_that_is_run_here():
    """Also the build of the documentation, which is as CONTRIBUTING says."""
    assert GATE["jobs"]["gate"]["steps"][-1] == {"run": ".ci/run"}
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    command = "sphinx-build -nW docs build/docs"
    assert f'pip install -e ".[docs]" && {command}' in [step.get("run") for step in GATE["jobs"]["docs"]["steps"]]
    assert command in (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_the_gate_may_do_no_harm():
    """It reads only, ends in time, and takes actions by their major version."""
    assert GATE["permissions"] == {"contents": "read"}
    for job in GATE["jobs"].values():
        assert job["timeout-minutes"] <= 120
        for step in job["steps"]:
            assert ("uses" in step) != ("run" in step)
            assert re.fullmatch(r"actions/[\w-]+@v\d+", step.get("uses", "actions/checkout@v4"))


# Hooks


HOOKS = [hook for repo in read(".pre-commit-config.yaml")["repos"] for hook in repo["hooks"]]


def test_hooks_need_no_network():
    assert [repo["repo"] for repo in read(".pre-commit-config.yaml")["repos"]] == ["local"]
    assert {hook["language"] for hook in HOOKS} == {"system"}
    assert {"ruff-check", "ruff-format", "mypy", "notebooks"} <= {hook["id"] for hook in HOOKS}


def test_hooks_run_what_the_extra_dev_brings():
    brought = " ".join([*PROJECT["optional-dependencies"]["dev"], *PROJECT["optional-dependencies"]["test"]])
    for hook in HOOKS:
        command = shlex.split(hook["entry"])[0]
        assert command == "python" or re.search(rf"\b{command}\b", brought), command


@pytest.mark.parametrize("text", ["a\n", "", "a\n\nb\n", "\tb\n", "a", "a \n", "a\n\n", "a\r\n", "a\t\n"])
def test_blanks_are_found(tmp_path, text):
    status = int(text not in ("a\n", "", "a\n\nb\n", "\tb\n"))
    (entry,) = (hook["entry"] for hook in HOOKS if hook["id"] == "blanks")
    file = tmp_path / "a.txt"
    file.write_bytes(text.encode())
    _, *words = shlex.split(entry)
    ended = subprocess.run([sys.executable, *words, str(file)], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout.strip(), ended.stderr) == (status, str(file) if status else "", "")
