"""Files are written as a whole or not at all, whoever writes them and whatever happens meanwhile."""

import json
import os
from pathlib import Path

import pytest
from helpers.works import little_room

import tmsopt
from tmsopt.errors import InputError
from tmsopt.files import from_json, write_atomic, write_csv, write_text
from tmsopt.plots import chart_figure, save
from tmsopt.records import Table
from tmsopt.studies import FORMATS, Row, RowTable, batch_rows, export

posix = pytest.mark.skipif(os.name != "posix", reason="devices, pipes and limits of POSIX")


@pytest.fixture(scope="module")
def plane():
    return tmsopt.chart("problems/chart.toml", points=(60, 50), boundaries=False)


FAILED = [Row(k, 0, Table({"mu": 0.1}), "failed", cause=f"{k} " * 500) for k in range(100)]
ROWS = RowTable(tmsopt.over_grid("problems/ep4.toml", {"mu": [0.1] * 100}), [batch_rows(FAILED)])
WRITERS = {
    "a.txt": lambda path, _: write_text(path, "a line\n" * 10_000),
    "a.csv": lambda path, _: write_csv(path, [{"x": k, "y": 0.1} for k in range(10_000)], {"x": "m"}),
    "a.npz": lambda path, plane: plane.save(path),
    "a.nc": lambda path, plane: plane.save(path),
    "a.png": lambda path, plane: save(chart_figure(plane), path),
    **{f"rows.{ending}": lambda path, _: export(ROWS, path) for ending in FORMATS},
}


@posix
@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_the_earlier_file(name, plane, tmp_path):
    """One error with the name of the file; nothing else stays there, no temporary one either."""
    if name.endswith((".nc", ".parquet")):
        pytest.importorskip("netCDF4"), pytest.importorskip("pyarrow")
    path = tmp_path / name
    path.write_text("before")
    with pytest.raises((OSError, InputError)) as refused, little_room(5000):
        WRITERS[name](path, plane)
    assert str(path) in str(refused.value)
    assert not isinstance(refused.value, OSError) or refused.value.strerror
    assert path.read_text() == "before"
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device")
@pytest.mark.parametrize("name", [name for name in WRITERS if not name.startswith("rows")])
def test_a_device_without_room_is_named(name, plane, tmp_path):
    (tmp_path / name).symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left") as refused:
        WRITERS[name](tmp_path / name, plane)
    assert refused.value.filename == str(tmp_path / name)


def test_an_interruption_leaves_the_earlier_file(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("before")

    def write():
        with write_atomic(path) as place:
            place.write_text("after")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write()
    assert path.read_text() == "before"
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]


@posix
def test_a_pipe_gets_what_is_finished(tmp_path):
    """The whole text, and the pipe stays one; a link to a file stays one too, and a new file is for all to read."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_text(pipe, "text\r\nas it is\n")
    assert os.read(reader, 100) == b"text\r\nas it is\n"
    os.close(reader)
    assert pipe.is_fifo()
    link, file, other = (tmp_path / name for name in ("link", "file", "other"))
    link.symlink_to(file)
    write_text(link, "text")
    other.touch()
    assert link.is_symlink()
    assert file.read_text() == "text"
    assert file.stat().st_mode == other.stat().st_mode


@pytest.mark.parametrize("there", ["file", "link to nothing"])
def test_a_new_file_takes_no_other_ones_place(there, tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("mine") if there == "file" else path.symlink_to(tmp_path / "nothing")
    with pytest.raises(FileExistsError) as refused:
        write_text(path, "other", must_be_new=True)
    assert refused.value.filename == str(path)
    assert [p.name for p in tmp_path.iterdir()] == ["a.toml"]


@posix
def test_links_in_a_circle_lead_nowhere(plane, tmp_path):
    for name in ("a.npz", "a.chart"):
        (tmp_path / name).symlink_to(name)
    with pytest.raises(OSError, match=r"a\.npz"):
        plane.save(tmp_path / "a.npz")
    with pytest.raises(InputError, match=r"a\.chart"):
        tmsopt.chart("problems/chart.toml", points=(4, 4), folder=tmp_path / "a.chart")


@posix
def test_what_a_folder_is_made_under_is_no_link(tmp_path):
    kept = tmp_path / "kept"
    kept.mkdir()
    (tmp_path / ".a.chart.unfinished").symlink_to(kept)
    with write_atomic(tmp_path / "a.chart", is_locked=True) as place:
        place.mkdir(parents=True)
        (place / "file").touch()
    assert list(kept.iterdir()) == []
    assert [p.name for p in (tmp_path / "a.chart").iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000 + "]" * 100_000, "more than 100 deep"),
        ('{"a":' * 101 + "[]" + "}" * 101, "more than 100 deep"),
        (f"[{'[],' * 10**6}0]", "1000000 lists, tables and texts"),
        ("[" + "0," * 20 + "0]", "more than 40 characters"),
        ("[1,", "Expecting value"),
        ("1" * 5000, "integer string conversion"),
    ],
)
def test_json_from_anybody_has_limits(text, words):
    with pytest.raises(ValueError, match=words):
        from_json(text, 40) if "40" in words else from_json(text)


def test_json_within_the_limits_is_read():
    nested = json.loads("[" * 100 + "]" * 100)
    assert from_json(json.dumps(nested)) == nested
    assert from_json('{"a": [1, "x[[{", null, NaN]}')["a"][:3] == [1, "x[[{", None]
