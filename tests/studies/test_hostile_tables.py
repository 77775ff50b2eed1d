"""Tables of studies from strangers: CSV files and [vary], refused within the limits that they state."""

import time
import tracemalloc
from pathlib import Path

import pytest

import tmsopt
from tmsopt.studies import Sampling, Study, load_study, read_csv

SECONDS = 5.0
"""Of the processor; a few times what reading takes on one that others use as well."""

MEGABYTE = 2**20
STUDY = """\
problem = "p.toml"
[study]
{study}
[vary]
{vary}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "p.toml").write_bytes(Path("problems/ep4.toml").read_bytes())
    return tmp_path


def refused(read, *given):
    began = time.process_time()
    with pytest.raises(tmsopt.InputError) as caught:
        read(*given)
    assert time.process_time() - began < SECONDS
    return str(caught.value)


TABLES = {
    "a cell of 3 MB": ("mu\n" + "1" * 3_000_000, 2, "is longer than 1000000 characters"),
    "a head of 3 MB": ("m" * 3_000_000, 1, "is longer than 1000000 characters"),
    "no ends of lines": ("0.1," * 1_000_000, 1, "is longer than 1000000 characters"),
    "100 000 columns": (
        ",".join(f"a{k}" for k in range(100_000)) + "\n",
        1,
        "found 100000 columns; accepted: up to 1000",
    ),
    "a quote that is not closed": ('mu\n"' + "1\n" * 1_000_000, None, "not CSV: field larger than field limit"),
    "a fault in every cell": ("mu\n" + "x\n" * 1_000_000, 2, "mu: found 'x'"),
    "characters of a terminal": ("mu\n\x1b[2J\n", 2, r"mu: found '\x1b[2J'"),
    "zeros": ("\0" * 500_000, 1, "not CSV"),
    "bytes far below": ("mu\n" + "0.1\n" * 10_000 + "\udcff\n", 10_002, "byte 0xff is not UTF-8"),
}


@pytest.mark.parametrize("kind", TABLES)
def test_a_csv_file_is_read_line_by_line(tmp_path, kind):
    """In a few MB of memory, whatever its size."""
    text, line, words = TABLES[kind]
    path = tmp_path / "rows.csv"
    path.write_text(text, encoding="utf-8", errors="surrogateescape")
    del text
    tracemalloc.start()
    found = refused(read_csv, path, lambda name: "")
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 8 * MEGABYTE
    assert f"{path}:{line}: " in found if line else f"{path}:" in found
    assert words in found
    assert "\x1b" not in found


def test_numbers_of_a_csv_file_take_eight_bytes_each(tmp_path):
    """Not the 32 of Python's; the columns of a study are made of them one after the other."""
    path, rows = tmp_path / "rows.csv", 20_000
    path.write_text("mu,chi_H\n" + "0.25,1.5\n" * rows, encoding="utf-8")
    tracemalloc.start()
    columns = read_csv(path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert [len(column) for column in columns.values()] == [rows, rows]
    assert most < 8 * rows * 5 + MEGABYTE  # two columns twice, one of them over-allocated


@pytest.mark.parametrize(
    ("study", "vary", "words"),
    [
        (
            "",
            "mu = { min = 0.1, max = 1, points = 100000 }\nzeta_H = { min = -1, max = 1, points = 100000 }",
            "10000000000",
        ),
        ("", f"mu = {{ min = 0.1, max = 1, points = 0x{'F' * 900} }}", "about 1084 digits"),
        ("", f"mu = [0x{'F' * 900}]", "about 1084 digits"),
        ("", "\n".join(f"x{k} = [1]" for k in range(20_000)), "and 19950 more"),
        (
            "",
            '"lambda_s.max" = [' + ", ".join(f'"1 q{chr(97 + k % 26)}x"' for k in range(20_000)) + "]",
            "and 19950 more",
        ),
        (
            "report = [" + ", ".join(f'"x{k}"' for k in range(20_000)) + "]",
            "mu = [0.1]",
            "20000 expressions; accepted: up to 1000",
        ),
        (
            'method = "sobol"\nrows = 10000000',
            "\n".join(f"{n} = {{ min = 0.1, max = 0.2 }}" for n in ("mu", "chi_H", "zeta_H", "zeta_B", "Fr.min")),
            "from 1 to 8000000",
        ),
    ],
    ids=["rows", "points", "number", "names", "units", "report", "numbers"],
)
def test_a_study_larger_than_studies_are(folder, study, vary, words):
    path = folder / "s.toml"
    path.write_text(STUDY.format(study=study, vary=vary), encoding="utf-8")
    found = refused(load_study, path)
    assert words in found
    assert len(found.splitlines()) <= 51


def test_no_rows_are_made_for_a_study_that_is_refused(folder):
    """Ten million take 80 MB and more."""
    path = folder / "s.toml"
    path.write_text(STUDY.format(study="seed = -1", vary="mu = { min = 0.1, max = 1, points = 10000000 }"), "utf-8")
    refused(load_study, path)  # what is imported and kept at the first time
    tracemalloc.start()
    found = refused(load_study, path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert "seed: found -1" in found
    assert most < 4 * MEGABYTE


@pytest.mark.parametrize("text", ["a\x1b[31m", "a\nb", "\u202eb"])
def test_titles_and_notes_are_shown_on_one_line(folder, text):
    """Of studies too, from Python and from files."""
    problem = tmsopt.load("problems/ep4.toml")
    for make in (
        lambda: Study(problem, {"mu": [0.1]}, title=text),
        lambda: Study(problem, {"mu": [0.1]}, notes=[text]),
        lambda: Sampling(problem, 5, tolerances={"mu": 0.01}, title=text),
    ):
        found = refused(make)
        assert "control character" in found
        assert text not in found
    quoted = '"' + "".join(f"\\u{ord(c):04x}" for c in text) + '"'
    (folder / "s.toml").write_text(f"title = {quoted}\n" + STUDY.format(study="", vary="mu = [0.1]"), encoding="utf-8")
    assert "s.toml:1: title: found the control character" in refused(load_study, folder / "s.toml")
