"""Typical uses are understood by type checkers, hence by editors, and run; so does the notebook."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
USAGE, NOTEBOOK = ROOT / "tests" / "helpers" / "usage.py", ROOT / "docs" / "notebooks" / "first_bicycle.ipynb"
CHECKERS = {
    "mypy": ["--strict", "--no-error-summary"],
    "basedpyright": ["--level", "error", "--pythonpath", sys.executable],  # pyright, whose Node comes with pip
}


def said(checker: str, *paths: Path) -> tuple[int, str]:
    pytest.importorskip(checker)
    command = [sys.executable, "-m", checker, *CHECKERS[checker], *map(str, paths)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return ended.returncode, ended.stdout + ended.stderr


@pytest.mark.slow
@pytest.mark.parametrize("checker", CHECKERS)
def test_type_checkers_understand_the_usual(checker: str) -> None:
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
def test_type_checkers_find_what_is_wrong(checker: str, line: str, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.py"
    wrong.write_text(f"import tmsopt\n\nproblem = tmsopt.load('a.toml')\ndesign = tmsopt.solve(problem)\n{line}\n")
    code, words = said(checker, wrong)
    assert code == 1
    assert "wrong.py:5" in words


@pytest.mark.slow
def test_the_usual_runs() -> None:
    ended = subprocess.run([sys.executable, str(USAGE)], cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr


def test_the_notebook_is_kept_without_answers() -> None:
    """Small, and the same whoever ran it."""
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells if cell["cell_type"] == "code")
    assert NOTEBOOK.stat().st_size < 10_000


@pytest.mark.slow
def test_the_notebook_runs() -> None:
    """Each result that ends a cell has its page, of which the picture and the text that `print` gives are parts."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(ROOT)}}).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not [output for output in outputs if output.output_type == "error"]
    pages = [output.data["text/html"] for output in outputs if "text/html" in output.get("data", {})]
    assert len(pages) >= 3
    assert any('class="tmsopt"' in page for page in pages)
