"""Typical uses are understood by type checkers, hence by editors, and run; so do the notebooks."""

import json
import shutil
import subprocess
import sys

import pytest
from helpers.places import ROOT

USAGE = ROOT / "tests" / "helpers" / "usage.py"
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
each_notebook = pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
CHECKERS = {
    "mypy": ["--strict", "--no-error-summary"],
    "basedpyright": ["--level", "error", "--pythonpath", sys.executable],  # pyright, whose Node comes with pip
}


def said(checker, *paths):
    pytest.importorskip(checker)
    command = [sys.executable, "-m", checker, *CHECKERS[checker], *map(str, paths)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return ended.returncode, ended.stdout + ended.stderr


@pytest.mark.slow
@pytest.mark.parametrize("checker", CHECKERS)
def test_type_checkers_understand_the_usual(checker):
    assert said(checker, USAGE)[0] == 0, said(checker, USAGE)[1]


@pytest.mark.slow
@pytest.mark.parametrize("checker", CHECKERS)
@pytest.mark.parametrize(
    "line",
    [
        "tmsopt.solve(problem, startz=4)",
        "tmsopt.solve(problem, starts='many')",
        "design.parameters['Fr'].real()",
        "design.plots()",
    ],
)
def test_type_checkers_find_what_is_wrong(checker, line, tmp_path):
    wrong = tmp_path / "wrong.py"
    wrong.write_text(f"import tmsopt\n\nproblem = tmsopt.load('a.toml')\ndesign = tmsopt.solve(problem)\n{line}\n")
    code, words = said(checker, wrong)
    assert code == 1
    assert "wrong.py:5" in words


@pytest.mark.slow
def test_the_usual_runs():
    ended = subprocess.run([sys.executable, str(USAGE)], cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr


def test_the_notebooks_are_there():
    """So that nothing below passes because nothing was read."""
    assert {"first_bicycle", "exceptional_point", "lesson"} <= {path.stem for path in NOTEBOOKS}


@each_notebook
def test_a_notebook_is_kept_without_answers(notebook):
    """Small, and the same whoever ran it; it says by itself whether what it found is true."""
    data = json.loads(notebook.read_text(encoding="utf-8"))
    code = [cell for cell in data["cells"] if cell["cell_type"] == "code"]
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in code)
    assert all(set(cell["metadata"]) <= {"tags", "jupyter"} for cell in data["cells"])
    assert data["metadata"]["kernelspec"]["name"] == "python3"
    assert notebook.stat().st_size < 14_000
    assert any("assert " in cell["source"] for cell in code)


@pytest.mark.slow
@pytest.mark.parametrize(
    "alone", [False, pytest.param(True, marks=pytest.mark.long)], ids=["from the root", "in a folder of its own"]
)
@each_notebook
def test_a_notebook_runs(notebook, alone, tmp_path):
    """Each result that ends a cell has its page, of which the picture and the text that `print` gives are parts.

    So it does in its own folder, where `jupyter lab` runs it, and where nothing else was fetched.
    """
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    read = nbformat.read(shutil.copy(notebook, tmp_path), as_version=4)
    nbformat.validate(read)
    folder = str(tmp_path if alone else ROOT)
    nbclient.NotebookClient(read, timeout=300, resources={"metadata": {"path": folder}}).execute()
    outputs = [output for cell in read.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not [output for output in outputs if output.output_type == "error"]
    pages = [output.data["text/html"] for output in outputs if "text/html" in output.get("data", {})]
    assert any('class="tmsopt"' in page for page in pages)
    folded = [cell for cell in read.cells if cell.metadata.get("jupyter", {}).get("source_hidden")]
    assert not [cell for cell in folded if cell.outputs]  # an answer stays unseen when all is run
