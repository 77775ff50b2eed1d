"""What --help says: on one screen, nothing cut, every exit status on one page."""

import re
from pathlib import Path

import pytest

from tmsopt.cli import command_group

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "commands.md").read_text(encoding="utf-8")
STATUSES = (0, 1, 2, 3, 4, 130, 143, 129, 141)


@pytest.fixture(autouse=True)
def _eighty_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


@pytest.mark.parametrize("name", command_group.commands)
def test_the_help_of_a_command_fits_a_screen(run, name):
    status, out, err = run(name, "--help")
    lines = out.splitlines()
    assert (status, err) == (0, "")
    assert len(lines) <= 30
    assert max(map(len, lines)) <= 80
    assert lines[0].startswith(f"Usage: tmsopt {name} ")
    shown = out[out.index("Examples:") : out.index("Exit status:")]
    assert 1 <= shown.count(f"tmsopt {name}") <= 4
    assert re.search(r"^Exit status: 0 .*2 bad input", out, re.MULTILINE)
    assert lines[-1] == "More: docs/reference/commands.md"


@pytest.mark.parametrize("name", command_group.commands)
def test_the_help_names_every_option(run, name):
    out = run(name, "--help")[1]
    options = [p for p in command_group.commands[name].params if p.param_type_name == "option" and not p.hidden]
    assert "--color" in out
    assert [p.name for p in options if not (p.help and re.search(rf"^  .*{p.opts[0]}\b", out, re.MULTILINE))] == []


def test_the_help_of_all_lists_each_command_on_a_line(run):
    status, out, _ = run("--help")
    lines = out.splitlines()
    listed = re.findall(r"^  ([a-z]+)  +[A-Z].*\.$", out[out.index("Commands:") :], re.MULTILINE)
    assert status == 0
    assert listed == list(command_group.commands)
    assert max(map(len, lines)) <= 80
    assert "..." not in out.replace("[ARGS]...", "")
    assert "…" not in out


def test_every_exit_status_is_on_the_page_and_in_the_help_of_all(run):
    shown = " ".join(run("--help")[1].split("Exit status:")[1].split())
    assert [n for n in STATUSES if not re.search(rf"\b{n}\b", shown)] == []
    table = PAGE[PAGE.index("## Exit status") :]
    assert [n for n in STATUSES if not re.search(rf"^\|[^|]*\b{n}\b[^|]*\|", table, re.MULTILINE)] == []
