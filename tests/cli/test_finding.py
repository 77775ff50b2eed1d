"""The commands by which one finds one's way, by their contract: streams, exit status, files never written over."""

import json
import re
from pathlib import Path

import pytest

import tmsopt
from tmsopt.cli import main
from tmsopt.guide import example, examples, new_problem, schema_text


@pytest.mark.parametrize("what", ["tms", "whipple", "problems/ep4.toml", "problems/coupled_pair.toml"])
def test_describe_writes_the_report_or_json(run, what):
    found = tmsopt.describe(what)
    assert run("describe", what) == (0, f"{found}\n", "")
    status, out, err = run("describe", what, "--json")
    assert (status, err) == (0, "")
    assert json.loads(out) == found.to_json()


def test_describe_answers_a_wrong_word(run):
    status, out, err = run("describe", "bicycle")
    assert (status, out) == (2, "")
    assert "models: tms whipple" in err


def test_schema_is_written_once(run, tmp_path):
    assert run("schema") == (0, schema_text(), "")
    file = tmp_path / "s.json"
    assert run("schema", "-o", file)[0] == 0
    assert file.read_text(encoding="utf-8") == schema_text()
    file.write_text("mine")
    status, _, err = run("schema", "-o", file)
    assert status == 2
    assert "exists already" in err
    assert file.read_text() == "mine"


def test_a_new_problem_is_written_with_its_schema(run, tmp_path):
    file = tmp_path / "robot.toml"
    status, out, err = run("new", file)
    assert (status, out) == (0, "")
    assert "robot.toml" in err
    assert file.read_text(encoding="utf-8") == new_problem("tms")
    assert {p.name for p in tmp_path.iterdir()} == {"robot.toml", "tmsopt.schema.json"}
    assert run("new", tmp_path / "bicycle.toml", "--model", "whipple")[0] == 0
    assert tmsopt.load(tmp_path / "bicycle.toml").model is tmsopt.models.whipple


@pytest.mark.parametrize("arguments", [["new"], ["example", "ep4", "--output"]])
def test_a_file_that_is_there_stays_as_it_is(run, tmp_path, arguments):
    file, beside = tmp_path / "mine.toml", tmp_path / "tmsopt.schema.json"
    file.write_text("mine")
    status, _, err = run(*arguments, file)
    assert status == 2
    assert "exists already" in err
    assert [p.name for p in tmp_path.iterdir()] == ["mine.toml"]
    assert file.read_text() == "mine"
    beside.write_text("mine too")
    assert run(*arguments, tmp_path / "other.toml")[0] == 0
    assert beside.read_text() == "mine too"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["new", "robot.txt"], "accepted: a file name ending in toml"),
        (["new", "nowhere/robot.toml"], "does not exist"),
        (["new", "robot.toml", "--model", "wipple"], "did you mean 'whipple'"),
        (["example", "epp4"], "did you mean 'ep4'"),
        (["example", "-o", "x.toml"], "tmsopt example lists all"),
    ],
)
def test_bad_input_is_answered(run, tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert said in err
    assert list(tmp_path.iterdir()) == []


def test_a_missing_file_names_three_close_ones_at_most(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ["robot1", "robot2", "robot3", "robot4", "robots", "absorber"]:
        (tmp_path / f"{name}.toml").write_text("")
    status, out, err = run("solve", "robot.toml")
    assert (status, out) == (2, "")
    assert 1 <= len(set(re.findall(r"'(\w+\.toml)'", err))) <= 3
    assert "absorber" not in err
    assert "accepted" not in err
    assert "tmsopt example ep4" in run("solve", "ep4.toml")[2]
    assert "example" not in run("solve", "nothing_like_it.toml")[2]


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("certify", "; use tmsopt solve FILE --certify\n"),
        ("pareto", '; use tmsopt solve FILE, with pareto = ["abscissa", "Fr"] under [objective] of FILE\n'),
        ("growth", "; use tmsopt solve FILE --plot growth.png\n"),
    ],
)
def test_a_word_that_is_no_command_is_answered_by_what_it_means(run, word, meant):
    status, out, err = run(word, "problems/ep4.toml")
    assert (status, out) == (2, "")
    assert err.endswith(f"No such command '{word}'{meant}")


def test_examples_are_listed_and_written(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, _ = run("example")
    assert status == 0
    assert [line.split()[0] for line in out.splitlines()] == list(examples())
    assert json.loads(run("example", "--json")[1]) == examples()
    assert run("example", "ep4") == (0, "", "wrote ep4.toml\nwrote tmsopt.schema.json\n")
    assert Path("ep4.toml").read_text(encoding="utf-8") == example("ep4")
    assert run("example", "ep4.toml")[0] == 2  # never over a file that is there
    assert run("example", "study_built", "-o", "built.toml") == (0, "", "wrote built.toml\n")
    assert {p.name for p in tmp_path.iterdir()} == {"built.toml", "ep4.toml", "tmsopt.schema.json"}
    assert isinstance(tmsopt.load_study(tmp_path / "built.toml"), tmsopt.Sampling)


@pytest.mark.parametrize(
    ("shell", "words", "expected"),
    [
        ("bash", "tmsopt example study_h", "plain,study_heights"),
        ("zsh", "tmsopt example study_h", "plain\nstudy_heights\n_"),
        ("fish", "tmsopt sol", "plain,solve"),
        ("bash", "tmsopt solve --cert", "plain,--certify"),
    ],
)
def test_shells_complete_as_the_documentation_says(monkeypatch, capsys, shell, words, expected):
    documented = (Path(__file__).parents[2] / "docs" / "reference" / "commands.md").read_text(encoding="utf-8")
    assert f"_TMSOPT_COMPLETE={shell}_source tmsopt" in documented
    last = words.rsplit(maxsplit=1)[-1] if shell == "fish" else str(len(words.split()) - 1)
    for name, value in {"_TMSOPT_COMPLETE": f"{shell}_complete", "COMP_WORDS": words, "COMP_CWORD": last}.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(SystemExit) as stop:
        main(prog_name="tmsopt")
    assert stop.value.code in (0, None)
    assert expected in capsys.readouterr().out
