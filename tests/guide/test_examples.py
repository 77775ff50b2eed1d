"""Files to start from: new problems solve as they stand, examples come with the installed package."""

import tomllib
from importlib import import_module

import pytest
from helpers.places import ROOT

import tmsopt
from tmsopt.guide import TEMPLATES, companions, example, examples, new_problem


@pytest.fixture
def file_of(tmp_path):
    """Writes a file to be read."""

    def write(text):
        (tmp_path / "new.toml").write_text(text, encoding="utf-8")
        return tmp_path / "new.toml"

    return write


@pytest.mark.slow
@pytest.mark.parametrize("kind", TEMPLATES)
def test_a_new_problem_solves_as_it_stands(kind, file_of):
    design = tmsopt.solve(file_of(new_problem(kind)))
    assert design.status == "optimal"
    assert design.abscissa < 0
    assert max(map(len, new_problem(kind).splitlines())) <= 100


@pytest.mark.parametrize("kind", TEMPLATES)
def test_a_new_problem_solves_with_every_hint_taken(kind, file_of):
    """What its comments offer instead of the objective reads as well."""
    text = new_problem(kind)
    offered = [line[1:].split("  ")[1].strip() for line in text.splitlines() if line.startswith("#   ")]
    assert len(offered) >= 2
    for line in offered:
        file = file_of(text.replace('minimize = "abscissa"\n', f"{line}\n"))
        assert tmsopt.load(file).posed.sense == line.split(" = ")[0]


def test_the_tables_that_the_new_robot_offers_are_read(file_of):
    text = new_problem("tms")
    offer = text.index("# [scenarios]")
    uncommented = "\n".join(line.removeprefix("# ") for line in text[offer:].splitlines())
    kept = "\n".join(line for line in text[:offer].splitlines() if not line.startswith("v = "))
    problem = tmsopt.load(file_of(f"{kept}\n{uncommented}\n"))
    assert (set(problem.scenarios), set(problem.tolerances)) == ({"v"}, {"x_B", "lambda_s"})


def test_the_examples_are_those_of_the_checkout_with_their_titles():
    paths = {p.stem: p for p in (ROOT / "problems").glob("*.toml")}
    assert set(examples()) == set(paths)
    assert examples()["ep4"] == "EP4 of the chi_H = 1 bicycle"
    assert all(examples().values())
    assert all(example(name) == path.read_text(encoding="utf-8") for name, path in paths.items())
    assert example("ep4.toml") == example("ep4")
    with pytest.raises(tmsopt.InputError, match="did you mean 'ep4'"):
        example("epp4")


def test_the_examples_are_found_where_they_are_installed(tmp_path, monkeypatch):
    """By the record of the distribution, at the place that pyproject.toml gives them in every installation."""
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["data-files"]
    (place, patterns), (bicycles, ridden) = data.items()
    assert bicycles == f"{place}/bicycles"
    assert {path for pattern in ridden for path in ROOT.glob(pattern)} == set((ROOT / "problems/bicycles").iterdir())
    assert sorted(path for pattern in patterns for path in ROOT.glob(pattern)) == sorted(
        (ROOT / "problems").glob("*.toml")
    )
    site = tmp_path / "lib" / "site-packages"
    (site / "tmsopt-1.dist-info").mkdir(parents=True)
    (tmp_path / place).mkdir(parents=True)
    (tmp_path / place / "mine.toml").write_text('title = "Mine"\n')
    (site / "tmsopt-1.dist-info" / "METADATA").write_text("Name: tmsopt\nVersion: 1\n")
    (site / "tmsopt-1.dist-info" / "RECORD").write_text(f"tmsopt/a.toml,,\n../../{place}/mine.toml,,\n")
    room = import_module("tmsopt.guide.examples")
    room._find_files.cache_clear()
    with monkeypatch.context() as patched:
        patched.setattr(room, "__file__", str(site / "tmsopt" / "guide" / "examples.py"))
        patched.syspath_prepend(site)
        assert examples() == {"mine": "Mine"}
    room._find_files.cache_clear()
    assert "ep4" in examples()


def test_what_a_file_refers_to_comes_with_it():
    assert set(companions(example("ep4"))) == {"tmsopt.schema.json"}
    assert companions(example("study_built"))["ep4.toml"] == example("ep4")
    for name in examples():
        for key in ("problem", "bicycle"):
            refers = tomllib.loads(example(name)).get(key)
            assert not isinstance(refers, str) or refers in companions(example(name))


def test_a_problem_that_names_a_bicycle_comes_with_all_of_them(tmp_path, run):
    file = tmp_path / "mine.toml"
    status, _, said = run("example", "smallest_change", "--output", file)
    assert (status, said.count("wrote")) == (0, 3)  # the file, the schema, the folder
    written, kept = ({p.name for p in (folder / "bicycles").iterdir()} for folder in (tmp_path, ROOT / "problems"))
    assert written == kept
    assert tmsopt.load(file).fixed == tmsopt.load(ROOT / "problems/smallest_change.toml").fixed
    mine = tmp_path / "bicycles/fisher.txt"
    mine.write_text("mine")
    (tmp_path / "bicycles/silver.txt").unlink()
    assert run("example", "smallest_gains", "-o", tmp_path / "b.toml")[0] == 0
    assert mine.read_text() == "mine"
    assert (tmp_path / "bicycles/silver.txt").exists()
