"""Folders of large charts: killed and resumed, refused, damaged, and from the command line."""

import dataclasses
import json
import os
import shutil
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from helpers.charts import EXTRA, PLANE, SPACE, charted, files

from tmsopt.charts import LAYERS, chart, open_chart
from tmsopt.errors import InputError
from tmsopt.plots import chart_figure
from tmsopt.problem import load

DATA = Path(__file__).parent / "data"


def tiles(path):
    """Rows of the recorded ones."""
    lines = (path / "tiles.jsonl").read_text().split("\n")[:-1]
    return [json.loads(line)["row"] for line in lines]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return charted(tmp_path_factory.mktemp("whole") / "whole.chart")


@pytest.fixture
def small(tmp_path):
    """The folder of a chart of 20 designs."""
    return charted(tmp_path / "a.chart", points=(5, 4)).path


# Killed and resumed


KILLED = """
import os, signal, sys
from helpers.charts import charted
from tmsopt.charts import folder
left, folder._SYNC_INTERVAL = int(sys.argv[2]), 0.0
real = os.fsync
def fsync(descriptor):
    global left
    left -= 1
    if left == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    real(descriptor)
folder.os.fsync = fsync
charted(sys.argv[1], tile=97)
"""


@pytest.mark.slow
def test_a_killed_process_loses_no_recorded_tile(whole, tmp_path):
    """Killed as it is about to bring a layer, or the record, to the disk; then the same call goes on."""
    path = tmp_path / "killed.chart"
    place = Path(__file__).parents[1]
    recorded = []
    for moment in (30, 44):
        command = [sys.executable, "-c", KILLED, str(path), str(moment)]
        ended = subprocess.run(command, cwd=place, env=None, capture_output=True, check=False, timeout=60)
        assert ended.returncode < 0, ended.stderr
        with pytest.raises(InputError, match=r"not finished: \d+ of 851 designs; run its command again"):
            open_chart(path)
        lines = (path / "tiles.jsonl").read_bytes().splitlines()
        assert lines[: len(recorded)] == recorded
        assert len(lines) > len(recorded)
        recorded = lines
    seen = []
    found = charted(path, tile=97, progress=lambda told: seen.append(told.done))
    assert seen[1] == 74 * len(recorded)  # from where it was left
    assert (path / "tiles.jsonl").read_bytes().splitlines()[: len(recorded)] == recorded
    assert files(path) == files(whole.path)
    assert found.counts.designs == 851
    assert found.run["designs"] == 851 - 74 * len(recorded)


@pytest.mark.parametrize("kept", [0, 1, 300, -1])
def test_whatever_was_not_recorded_is_done_again(kept, whole, tmp_path):
    """A record cut anywhere, as when a line was being written, over numbers that never reached the disk."""
    path = charted(tmp_path / "torn.chart", tile=97).path
    record = (path / "tiles.jsonl").read_bytes()
    (path / "tiles.jsonl").write_bytes(record[:kept])
    done = tiles(path)
    for name in (*LAYERS, *EXTRA):
        array = np.load(path / "layers" / f"{name}.npy", mmap_mode="r+")
        for row in range(23):
            if row - row % 2 not in done:
                array[row] = 1
        array.flush()
    found = charted(path, tile=97)
    assert files(path) == files(whole.path)
    assert found.counts.designs == 851
    assert len(tiles(path)) == 12


def test_a_finished_chart_is_not_charted_again(tmp_path):
    path = tmp_path / "done.chart"
    charted(path)
    before = {p: p.stat().st_mtime_ns for p in path.rglob("*.npy")}
    again = charted(path, tile=50)
    assert again.run["designs"] == 0
    assert {p: p.stat().st_mtime_ns for p in path.rglob("*.npy")} == before


def test_memory_does_not_grow_with_the_grid(tmp_path):
    """Five times the designs, the same tiles: the same peak, but for the record of the tiles, 1 kB each.

    Threads may or may not compute at once what others wait to be written: a fifth either way.
    """
    peaks = []
    for rows in (40, 200):
        tracemalloc.start()
        charted(tmp_path / f"{rows}.chart", points=(200, rows), tile=4000)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0] + 8 * 1000


def test_a_folder_of_version_1_1_opens_and_goes_on(tmp_path):
    """Written by 1.1.0: finished it opens; with one tile on record and nothing else written it is completed."""
    asked = {"points": (6, 5), "quantities": {"T": "tan(lambda_s)"}, "boundaries": False}
    kept = open_chart(DATA / "version_1_1")
    path = tmp_path / "old.chart"
    shutil.copytree(kept.path, path)
    (path / "tiles.jsonl").write_text((path / "tiles.jsonl").read_text().splitlines(keepends=True)[0] + '{"row": 2, ')
    for name in kept.layers:
        np.load(path / "layers" / f"{name}.npy", mmap_mode="r+")[2:] = 0
    with pytest.raises(InputError, match="not finished: 12 of 30 designs"):
        open_chart(path)
    found = chart("problems/chart.toml", folder=path, **asked)
    assert found.run["designs"] == 18
    small = chart("problems/chart.toml", **asked)
    assert open_chart(path).shares == found.shares == kept.shares == small.shares
    for name, layer in kept.layers.items():
        for other in (found, small):  # last digits are not promised from version to version
            assert other.layers[name] == pytest.approx(layer, rel=1e-12, abs=1e-14)


def test_an_opened_chart_is_the_one_that_was_charted(whole, tmp_path):
    """Its problem too, but for the equality constraint, which no grid has; so that it is drawn and saved alike."""
    again = open_chart(whole.path)
    assert again.problem == dataclasses.replace(PLANE, constraints=again.problem.constraints)
    assert again.problem.constraints.keys() == PLANE.constraints.keys() - {"law"}
    assert (again.axes, again.counts, again.shares) == (whole.axes, whole.counts, whole.shares)
    assert again.quantities.keys() == EXTRA.keys()
    assert isinstance(again.abscissa, np.memmap)
    chart_figure(again, "excess")
    again.save(tmp_path / "again.npz", ("kind", "T"))
    with np.load(tmp_path / "again.npz") as data:
        assert set(data) == {"Fr", "lambda_s", "kind", "T", "about"}
        assert np.array_equal(data["T"], again.layers["T"])


# What is refused


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"problem": dataclasses.replace(PLANE, fixed=PLANE.fixed | {"mu": 0.2})},
            "problem.fixed.mu: 0.1 there, 0.2 asked",
        ),
        ({"problem": dataclasses.replace(PLANE, free=PLANE.free | {"Fr": (0.01, 4.0)})}, "axes.Fr.max: 5.0 there, 4.0"),
        ({"problem": dataclasses.replace(PLANE, constraints={"trail": "nu_H >= 0.03"})}, 'trail: "nu_H >= 0.02" there'),
        ({"points": (37, 24)}, "axes.lambda_s.points: 23 there, 24 asked for"),
        ({"axes": ("lambda_s", "Fr"), "points": (23, 37)}, 'dimensions[0]: "lambda_s" there, "Fr" asked for'),
        ({"layers": ("kind",)}, 'layers.abscissa: {"dtype": "<f8"} there, none asked for'),
        ({"quantities": EXTRA | {"T": "lambda_s"}}, 'layers.T.expression: "tan(lambda_s)" there, "lambda_s" asked for'),
        ({"single": True}, 'layers.margin.dtype: "<f8" there, "<f4" asked for'),
    ],
)
def test_another_chart_of_that_name_is_refused(change, words, whole):
    before = files(whole.path)
    with pytest.raises(InputError) as refused:
        charted(whole.path, **change)
    assert words in str(refused.value)
    assert "--fresh" in str(refused.value)
    assert files(whole.path) == before


def test_fresh_moves_the_old_one_aside(small):
    old = files(small)
    new = charted(small, points=(6, 4), fresh=True)
    assert new.layers["kind"].shape == (4, 6)
    assert files(small.with_name("a.1.chart")) == old
    charted(small, points=(7, 4), fresh=True)
    assert open_chart(small.with_name("a.2.chart")).layers["kind"].shape == (4, 6)


def test_one_process_writes_at_a_time(small):
    tried = []
    for fresh in (False, True):

        def write(told, fresh=fresh):
            if told.most == 20:
                with pytest.raises(InputError, match="written by another process"):
                    charted(small, points=(5, 4), fresh=fresh)
                tried.append(fresh)

        charted(small, points=(5, 4), progress=write)
    assert set(tried) == {False, True}
    assert [*small.parent.iterdir()] == [small]


def _cut(name, size):
    return lambda p: (p / name).write_bytes((p / name).read_bytes()[:size])


def _written(name, content):
    return lambda p: (p / name).write_bytes(content)


def _said(name, **changes):
    """JSON of one line or more with other values."""

    def change(path):
        data = json.loads((path / name).read_text()) | changes
        (path / name).write_text(json.dumps(data) + "\n")

    return change


def _gone(name):
    return lambda p: (p / name).unlink()


BROKEN = {"model": "tms", "fixed": dict(PLANE.fixed), "constraints": {"trail": "Fr <= <= 2"}}
DAMAGE = {
    "no about": (_gone("about.json"), "about.json"),
    "no JSON": (_cut("about.json", 50), "about.json"),
    "another schema": (_said("about.json", schema=7), "schema"),
    "no list": (_written("about.json", b"[]"), "about.json"),
    "nothing said": (_said("about.json", title=None), "title"),
    "a head in about": (_said("about.json", title="\x1b[31m"), "title"),
    "layers that are none": (_said("about.json", layers=["kind"]), "layers"),
    "a layer elsewhere": (_said("about.json", layers={"../../kind": {"dtype": "|i1"}}), "layers"),
    "a layer of objects": (_said("about.json", layers={"kind": {"dtype": "|O"}}), "layers/kind.npy"),
    "a tile of nothing": (_said("about.json", tile=0), "tile"),
    "axes without an end": (_said("about.json", axes={"Fr": {"min": 0.0}, "mu": {}}), "axes.Fr.max"),
    "a constraint that is none": (_said("about.json", problem=BROKEN), "trail"),
    "nested": (_written("about.json", b"[" * 100_000 + b"]" * 100_000), "more than 100 deep"),
    "a long about": (_written("about.json", b"[" + b"0," * 9_000_000 + b"0]"), "larger than 16000000 bytes"),
    "no layer": (_gone("layers/kind.npy"), "layers/kind.npy"),
    "a short layer": (_cut("layers/abscissa.npy", 200), "layers/abscissa.npy"),
    "an empty layer": (_cut("layers/abscissa.npy", 0), "layers/abscissa.npy"),
    "another layer": (lambda p: np.save(p / "layers" / "kind.npy", np.zeros((4, 5))), "shape (4, 5) and type |i1"),
    "a pickle": (_written("layers/kind.npy", b"cposix\nsystem\n(S'true'\ntR."), "layers/kind.npy"),
    "a pickle in an array": (lambda p: np.save(p / "layers" / "kind.npy", np.array([{}])), "layers/kind.npy"),
    "no record": (_gone("tiles.jsonl"), "tiles.jsonl"),
    "another record": (_written("tiles.jsonl", b'{"row": 0}\n{}\n'), "tiles.jsonl"),
    "a record of another grid": (_said("tiles.jsonl", designs=9), "tiles.jsonl"),
    "a tile's classes as texts": (_said("tiles.jsonl", classes=["x"] * 5), "tiles.jsonl"),
    "a tile of another row": (_said("tiles.jsonl", row=3), "tiles.jsonl"),
    "a least one elsewhere": (_said("tiles.jsonl", place=10**9), "tiles.jsonl"),
    "a record without an end": (_written("tiles.jsonl", bytes(10**7)), "tiles.jsonl"),
    "no folder": (lambda p: p.rename(p.with_name("moved")), "is no chart"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damage_is_seen_and_said(name, small):
    damage, words = DAMAGE[name]
    damage(small)
    with pytest.raises(InputError) as seen:
        open_chart(small)
    assert words in str(seen.value)
    if small.exists():
        assert charted(small, points=(5, 4), fresh=True).counts.designs == 20


@pytest.mark.skipif(os.name != "posix", reason="links and pipes of POSIX")
@pytest.mark.parametrize("make", ["link", "loop", "pipe"])
@pytest.mark.parametrize("name", ["about.json", "tiles.jsonl", "layers", "layers/kind.npy"])
def test_nothing_is_written_through_a_link(name, make, small):
    """Of a folder that is begun: what the link leads to stays as it is, and the link is named."""
    (small / "tiles.jsonl").write_bytes(b"")
    place = small / name
    kept = place.rename(small.with_name("elsewhere"))
    if make == "pipe":
        os.mkfifo(place)
    else:
        place.symlink_to(kept if make == "link" else place.name)
    before = {p: p.read_bytes() for p in (kept, *kept.rglob("*")) if p.is_file()}
    with pytest.raises(InputError, match=r"a\.chart"):
        charted(small, points=(5, 4))
    assert {p: p.read_bytes() for p in before} == before


def test_a_folder_that_is_no_chart_is_left_alone(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is no chart"):
        charted(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_no_chart_has_more_tiles_than_are_read(tmp_path):
    with pytest.raises(InputError, match="found 1, which makes 2000000 tiles; accepted: 1000000"):
        charted(tmp_path / "a.chart", SPACE, points=(2, 2000, 1000), layers=("kind",), quantities={}, tile=1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"points": (5.9, 5)}, "accepted: two whole numbers"),
        ({"points": (5, 1)}, "each from 2 to 1000000"),
        ({"points": (10**5, 10**5)}, "1e+09 or less"),
        ({"points": 7}, "found 7"),
        ({"axes": "Fr,lambda_s"}, "found 'Fr,lambda_s'; accepted: Fr and lambda_s"),
        ({"layers": ("kinds",)}, "did you mean 'kind'?"),
        ({"layers": (), "quantities": {}}, "found none"),
        ({"quantities": {"x": "Frr"}}, "quantities.x: 'Frr' uses the unknown name"),
        ({"quantities": {"x": "2 * radius"}}, "quantities.x: found radius"),
        ({"quantities": {"kind": "Fr"}}, "found the name 'kind'"),
        ({"quantities": {"a/b": "Fr"}}, "found the name 'a/b'"),
        ({"workers": 0}, "a whole number from 1"),
    ],
)
def test_bad_input_leaves_nothing_behind(options, words, tmp_path):
    with pytest.raises(InputError) as refused:
        charted(tmp_path / "a.chart", **options)
    assert words in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_a_disk_that_fills_up_keeps_what_is_recorded(tmp_path, monkeypatch, run):
    path = tmp_path / "a.chart"
    arguments = ["problems/chart.toml", "--points", "20x10", "-o", path, "--no-boundaries"]

    def full(descriptor):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("tmsopt.charts.folder.os.fsync", full)
        status, _, err = run("chart", *arguments)
    assert status == 2
    assert "cannot be written: No space left on device; the same command will continue" in err
    with pytest.raises(InputError, match="not finished: 0 of 200"):
        open_chart(path)
    assert run("chart", *arguments)[0] == 0
    assert open_chart(path).counts.designs == 200


def test_a_disk_without_room_is_said_before_any_work(tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.disk_usage", lambda path: type("usage", (), {"free": 10_000}))
    with pytest.raises(InputError, match=r"takes .* GB, and 0\.0 GB are free"):
        charted(tmp_path / "a.chart")
    assert not list(tmp_path.iterdir())


# The command line


def test_a_folder_from_the_command_line(tmp_path, run):
    path, figure = tmp_path / "big.chart", tmp_path / "big.png"
    arguments = ["problems/chart.toml", "--points", "60x40", "-o", path, "--quantity", "tilt=tan(lambda_s)"]
    status, out, err = run("chart", *arguments, "--json", "--workers", 2, "--engine", "numpy")
    assert status == 0
    assert "--engine is no longer needed" in err
    assert f"wrote {path}" in err
    data = json.loads(out, parse_constant=pytest.fail)
    assert (data["engine"], data["designs"], data["fallbacks"]) == ("numpy", 2400, 0)
    assert data["per_second"] == pytest.approx(2400 / data["seconds"])
    assert data["layers"] == ["kind", "abscissa", "damping_ratio", "real_roots", "satisfied", "tilt"]
    small = chart(load("problems/chart.toml"), points=(60, 40), boundaries=False)
    assert data["classes"] == small.shares
    assert data["least_abscissa"] == small.to_json()["least_abscissa"]
    status, out, err = run("chart", *arguments, "--plot", figure, "--no-boundaries", "--layer", "tilt")
    assert status == 0
    assert "heavily damped" in out
    assert f"{data['least_abscissa']['value']:.6g}" in out
    assert figure.read_bytes().startswith(b"\x89PNG")
    status, _, err = run("chart", *arguments[:2], "50x40", *arguments[3:])
    assert status == 2
    assert "axes.Fr.points: 60 there, 50 asked for" in err
    status, _, _ = run(
        "chart", *arguments[:2], "50x40", *arguments[3:], "--fresh", "--layers", "kind,margin", "--single"
    )
    assert status == 0
    assert {n: a.dtype for n, a in open_chart(path).layers.items()} == {"kind": "i1", "margin": "f4", "tilt": "f4"}


@pytest.mark.parametrize("ending", ["npz", "nc"])
def test_three_axes_in_one_file(ending, tmp_path, run):
    path, figure = tmp_path / f"space.{ending}", tmp_path / "slice.svg"
    arguments = ["problems/ep_set.toml", "--points", "7x6x5", "--axes", "Fr,lambda_s,chi_B", "--quantity", "x=Fr*chi_B"]
    status, out, err = run(
        "chart", *arguments, "-o", path, "--plot", figure, "--slice", "lambda_s=20 deg", "--no-boundaries"
    )
    assert status == 0, err
    assert "7 × 6 × 5 designs over Fr, lambda_s, chi_B" in out
    assert figure.read_bytes().startswith(b"<?xml")
    problem = load("problems/ep_set.toml")
    asked = {"points": (7, 6, 5), "quantities": {"x": "Fr*chi_B"}}
    wanted = chart(problem, ("Fr", "lambda_s", "chi_B"), folder=tmp_path / "space.chart", **asked)
    if ending == "npz":
        with np.load(path) as data:
            found = dict(data)
        assert json.loads(str(found["about"]))["dimensions"] == ["chi_B", "lambda_s", "Fr"]
    else:
        xarray = pytest.importorskip("xarray")
        with xarray.open_dataset(path) as data:
            assert data["kind"].dims == ("chi_B", "lambda_s", "Fr")
            assert data["lambda_s"].attrs["units"] == "rad"
            found = {n: data[n].values for n in data.variables}
    for name, array in wanted.layers.items():
        assert np.array_equal(found[name], array, equal_nan=array.dtype == float)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("trace problems/ep_set.toml --pattern EP9", "unknown pattern 'EP9'"),
        ("trace problems/ep_set.toml --pattern EP2", "2 free parameters"),
        ("trace problems/chart.toml", "no pattern to trace"),
        ("trace problems/ep_set.toml --plot x.png --axes Fr,mu", "accepted: two of the free parameters"),
        ("trace problems/ep_set.toml --csv no/such/x.csv", "does not exist"),
        ("trace problems/ep_set.toml --csv x.txt", "ending in csv"),
        ("trace problems/ep_set.toml --step 0.5", "--step"),
        ("trace nothing.toml", "nothing.toml"),
        ("problems/chart.toml --axes Fr,Fr", "accepted: Fr and lambda_s"),
        ("problems/chart.toml --points 1", "--points: found (1, 1); accepted: two whole numbers, each from 2"),
        ("problems/chart.toml --points 40by30", "of at least 2"),
        ("problems/chart.toml --output problems/x.csv", "ending in npz"),
        (f"problems/chart.toml --points 5 -o {'x' * 300}.npz", "--output"),
        ("problems/realistic.toml", "two or three free parameters"),
        ("problems/chart.toml --points 10000x10000", "give a folder x.chart"),
        ("problems/chart.toml --quantity Fr*2", "accepted: NAME=VALUE"),
        ("problems/chart.toml --quantity x=Frr", "unknown name 'Frr'"),
        ("problems/chart.toml --layers kind,gamma", "found 'gamma'; accepted: kind"),
        ("problems/chart.toml --layer colour", "--layer: found 'colour'; accepted: kind"),
        ("problems/chart.toml --workers 0", "--workers"),
        ("problems/chart.toml --slice Fr=1", "nothing to fix"),
        ("problems/ep_set.toml --plot x.png", "fix one, as in --slice"),
        ("problems/ep_set.toml --slice mu=1 --plot x.png", "--slice: found 'mu'"),
        ("problems/ep_set.toml --slice Fr=99 --plot x.png", "--slice.Fr: found 99; accepted: "),
        ("problems/ep_set.toml --slice Fr=fast --plot x.png", "--slice.Fr: found 'fast'"),
        ("problems/ep_set.toml --axes Fr,mu", "accepted: Fr and chi_B and lambda_s"),
        ("problems/chart.toml -o no/such/x.chart", "does not exist"),
    ],
)
def test_bad_input_ends_with_2_and_says_what_is_accepted(arguments, words, run):
    status, out, err = run(*arguments.split()) if arguments.startswith("trace") else run("chart", *arguments.split())
    assert (status, out) == (2, "")
    assert words in " ".join(err.split())
