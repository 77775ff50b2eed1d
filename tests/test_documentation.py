"""The front door: what README, docs/ and CONTRIBUTING say is there, runs, and gives the answers printed."""

import inspect
import math
import re
import tomllib
from importlib import import_module

import pytest
from helpers import pages
from helpers.pages import NUMBER, agrees, lines_of
from helpers.places import ROOT

import tmsopt
from tmsopt.cli import main

PAGES = sorted([*ROOT.glob("*.md"), *pages.PAGES])
README, CONTRIBUTING = (ROOT / name for name in ("README.md", "CONTRIBUTING.md"))


def blocks(page, language):
    """The fenced blocks of a page in one language."""
    return [block.text for block in pages.blocks_of(page) if block.language == language]


def prose(page):
    """A page without its fenced blocks."""
    return re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


def anchors(page):
    """What a link may name after #: a heading in lower case, spaces as hyphens, other signs left out."""
    headings = re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def answer(text):
    """The lines of a printed answer, spaces and what is left out aside."""
    return [line for line in lines_of(text) if line != "…"]


def solved(file, capsys):
    """What the command prints."""
    with pytest.raises(SystemExit) as stop:
        main(args=["solve", str(file)], prog_name="tmsopt")
    assert stop.value.code == 0
    return answer(capsys.readouterr().out)


def test_the_pages_are_there():
    """So that nothing below passes because nothing was read."""
    assert {"README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "index.md"} <= {p.name for p in PAGES}


def test_the_readme_is_one_page():
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 150


def test_the_two_commands_stand_between_the_markers():
    """One a line, as the gate reads and runs them."""
    inside = re.findall(r"<!-- commands -->\n```sh\n(.*?)\n```\n<!-- /commands -->", README.read_text(), re.DOTALL)
    assert len(inside) == 1
    install, test = inside[0].splitlines()
    assert install == 'pip install ".[certify]" && tmsopt solve problems/ep4.toml'
    assert test.startswith('pip install -e ".[test]" && pytest')


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page):
    text = re.sub(r"`[^`\n]*`", "", prose(page))
    assert re.findall(r"\]\(<|^ *\[[^]]+\]:|<a |<img ", text, re.MULTILINE) == [], (
        "links are written as [words](target)"
    )
    targets = re.findall(r"\]\(([^)\s]+)(?:\s+\"[^\"]*\")?\)", prose(page))
    assert len(targets) == text.count("](")
    for target in (t for t in targets if not re.match(r"[a-z]+:", t)):
        name, _, anchor = target.partition("#")
        found = (page.parent / name).resolve() if name else page
        assert found.exists(), target
        assert not anchor or anchor in anchors(found), target


def test_every_problem_is_listed():
    linked = set(re.findall(r"\]\(\.\./problems/([\w.]+)\)", (ROOT / "docs" / "problems.md").read_text()))
    found = {p.name for suffix in ("toml", "py") for p in (ROOT / "problems").glob(f"*.{suffix}")}
    assert linked == found


def test_pictures_are_small():
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", README.read_text(encoding="utf-8"))
    assert "docs/explorer.png" in pictures
    assert all((ROOT / p).stat().st_size < 200_000 for p in pictures)


def test_every_command_is_documented():
    rows = re.findall(r"^\| `tmsopt (\w+)", (ROOT / "docs" / "reference" / "commands.md").read_text(), re.MULTILINE)
    assert set(rows) == set(import_module("tmsopt.cli.commands").command_group.commands)


@pytest.mark.parametrize("page", [p for p in PAGES if p.name != "CHANGELOG.md"], ids=lambda p: p.name)
def test_public_names_exist(page):
    """What a page calls tmsopt.something is public; the change log names what is gone, too."""
    text = "\n".join(
        line for line in page.read_text(encoding="utf-8").splitlines() if not line.startswith(("$ ", ".. click::"))
    )
    for name, inner in re.findall(r"(?<![\w/.])tmsopt\.([A-Za-z_]\w*)(?:\.(\w+))?", text):
        assert name in {*tmsopt.__all__, "__all__", "__version__"}, name
        found = getattr(tmsopt, name)
        if inner and (inspect.ismodule(found) or inspect.isclass(found)):
            assert hasattr(found, inner) or inner in getattr(found, "__annotations__", {}), f"{name}.{inner}"


def test_options_exist():
    """What a page calls `--something` is an option of a command, or of the benchmarks."""
    commands = import_module("tmsopt.cli.commands").command_group
    options = {
        word for c in (commands, *commands.commands.values()) for p in c.params for word in (*p.opts, *p.secondary_opts)
    }
    known = options | {"--help", "--quick"}
    texts = {page.name: page.read_text(encoding="utf-8") for page in [README, *pages.PAGES]}
    named = {name: set(re.findall(r"(?:`|tmsopt [^\n`]* )(--[a-z][a-z-]*)", text)) for name, text in texts.items()}
    assert len(set().union(*named.values())) > 30
    assert {name: found - known for name, found in named.items() if found - known} == {}


# CONTRIBUTING


def tree():
    """The packages of CONTRIBUTING's tree, in its order, with the path that the indentation gives them."""
    (drawn,) = (block for block in blocks(CONTRIBUTING, "text") if block.startswith("tmsopt/"))
    found = []
    above = []
    for indent, name in re.findall(r"^( *)(\w+)/", drawn, re.MULTILINE):
        above = [*above[: len(indent) // 2], name]
        found.append("/".join(above))
    return found[1:]


def test_the_tree_has_every_package():
    packages = {str(p.parent.relative_to(ROOT)) for p in (ROOT / "tmsopt").rglob("__init__.py")} - {"tmsopt"}
    assert sorted(tree()) == sorted(packages)


def test_the_tree_is_in_the_order_of_the_floors():
    from test_architecture import FLOOR

    floors = [FLOOR[path.split("/")[1]] for path in tree()]
    assert floors == sorted(floors)


def test_files_that_contributing_names_exist():
    named = re.findall(r"`([\w./]+/[\w./]*\.\w+)`", prose(CONTRIBUTING))
    assert len(named) > 20
    assert [path for path in named if not (ROOT / path).is_file()] == []


def test_the_table_has_the_changes_that_a_maintainer_makes():
    rows = re.findall(r"^\| (?:an? |the |another )([^|]+) \|", prose(CONTRIBUTING), re.MULTILINE)
    assert len(rows) == 14
    assert {
        "derived quantity",
        "kind of number",
        "root pattern",
        "model",
        "line or a table of the report",
        "constraint type",
    } <= set(rows)


def test_one_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert cited is not None
    assert {tmsopt.__version__, cited[1]} == {project["version"]}


# What the README shows


def test_the_examples_are_problem_files(tmp_path):
    robot, absorber = blocks(README, "toml")
    file = tmp_path / "absorber.toml"
    file.write_text(absorber, encoding="utf-8")
    assert tmsopt.load(file).minimize == "abscissa"
    whole = tomllib.loads((ROOT / "problems" / "delivery_robot.toml").read_text(encoding="utf-8"))
    for table, shown in tomllib.loads(robot).items():
        assert shown.items() <= whole[table].items()
        free = {name for name, value in whole[table].items() if table != "parameters" or isinstance(value, dict)}
        assert shown.keys() == free, "all but what is fixed"


def test_the_robot_has_the_answer_that_is_printed(capsys):
    printed = blocks(README, "text")[0]
    command, *lines = answer(printed)
    assert command == "$ tmsopt solve problems/delivery_robot.toml"
    now = iter(solved(ROOT / "problems" / "delivery_robot.toml", capsys))
    for line in lines:  # in this order, others between them
        assert any(agrees(line, other) for other in now), line


def test_the_absorber_has_the_answer_that_is_printed(tmp_path, capsys):
    """And its closed form: (s² + bs + k)² has k = w = 1/(1 + mu), b² = mu/(1 + mu), c = 2 b mu/(1 + mu)."""
    file = tmp_path / "absorber.toml"
    file.write_text(blocks(README, "toml")[1], encoding="utf-8")
    now, (command, *printed) = solved(file, capsys), answer(blocks(README, "text")[1])
    assert command == "$ tmsopt solve absorber.toml"
    assert all(any(agrees(line, other) for other in now) for line in printed)
    share = 0.1 / 1.1
    abscissa, c, w = -math.sqrt(share) / 2, 2 * share**1.5, 1 / 1.1
    for line, value in zip(printed[:3], (abscissa, c, w), strict=True):  # five digits of parameters are shown
        assert any(math.isclose(float(n), value, rel_tol=5e-5) for n in NUMBER.findall(line)), line


def test_the_figures_stand_in_the_results():
    """Solved, proved and tried: the counts of the table are those of the benchmarks."""
    results = (ROOT / "benchmarks" / "results.md").read_text(encoding="utf-8")
    counts = re.findall(r"\d+ of \d+", README.read_text(encoding="utf-8"))
    assert len(counts) >= 6
    assert [c for c in counts if c not in results] == []


def test_the_times_stand_in_the_results():
    """Medians of a solve, of its rival and of a proof: those of the benchmarks, to the digits shown."""
    results = (ROOT / "benchmarks" / "results.md").read_text(encoding="utf-8")
    table = {row[0]: row[1] for row in re.findall(r"^\| (.*?) +\| (.*) \|$", README.read_text(), re.MULTILINE)}
    finds, proves = (
        next(cells for row, cells in table.items() if row.startswith(word)) for word in ("finds the", "proves that")
    )
    medians = [
        *(
            re.search(rf"^\| {row} \|.* (\d+) ms \|$", results, re.MULTILINE)
            for row in ("default solve", "DE, vectorised")
        ),
        re.search(r"^\| median time of a proof \| (\d+) ms \|$", results, re.MULTILINE),
    ]
    shown = re.findall(r", ([\d.]+) s", finds) + re.findall(r", ([\d.]+) s", proves)
    assert len(shown) == len(medians)
    for printed, median in zip(shown, medians, strict=True):
        assert median is not None
        assert f"{int(median[1]) / 1000:.{len(printed.partition('.')[2])}f}" == printed


@pytest.mark.parametrize("name", ["measured", "proofs"])
def test_counts_and_medians_of_a_page_stand_in_the_results(name):
    text = prose(ROOT / "docs" / "explanation" / f"{name}.md")
    results = (ROOT / "benchmarks" / "results.md").read_text(encoding="utf-8")
    found = re.findall(r"\d+ of \d+\b|\b\d{3,} ms\b|\d+\.\d(?= %\))", text)
    assert found
    assert [one for one in found if one not in results] == []


def test_the_first_python_example_runs(monkeypatch):
    monkeypatch.chdir(ROOT)
    names = {}
    exec(blocks(ROOT / "docs" / "reference" / "python.md", "python")[0], names)
    design = names["design"]
    assert isinstance(design, tmsopt.Solution)
    assert design.structure == "EP4"
    assert design.parameters["chi_B"] == pytest.approx(math.sqrt(2), abs=1e-12)


@pytest.mark.parametrize(
    ("line", "constants"),
    [
        ("problem, study and bicycle files", "files.MAX_FILE_BYTES problem.toml.MAX_DEPTH problem.toml.MAX_KEY_PARTS"),
        ("errors that are listed", "errors.MAX_LISTED"),
        (
            "expressions",
            "models.expression._MAX_LENGTH models.expression._MAX_DEPTH models.stated.degree.LARGEST_EXPONENT models.stated.degree.LARGEST_DEGREE",
        ),
        ("quantities of a model", "models.stated.texts.MAX_QUANTITIES"),
        ("numbers of parameters", "models.exact.MAX_DIGITS problem.units.text.MAX_LENGTH"),
        (
            "CSV files of rows",
            "studies.files.MAX_CSV_BYTES studies.files.MAX_CSV_LINE studies.files.MAX_CSV_COLUMNS studies.sampling.MAX_ROWS studies.sampling.MAX_NUMBERS",
        ),
        ("a store from another person", "files.MAX_JSON_CHARACTERS studies.store.MAX_VALUE_BYTES"),
        ("a chart", "charts.survey.MAX_DESIGNS charts.survey.MAX_TILES"),
    ],
)
def test_limits_of_what_is_read_are_those_in_force(line, constants):
    page = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| {line}.*\|$", page, re.MULTILINE)
    stated = {float(n) for n in NUMBER.findall(re.sub(r"(?<=\d) (?=\d{3})", "", row))}
    for constant in constants.split():
        module, _, name = f"tmsopt.{constant}".rpartition(".")
        assert getattr(import_module(module), name) in stated, constant
