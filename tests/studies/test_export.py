"""Rows as tables in files: the same doubles, blanks where a row has none, and what the rows are of."""

import csv
import json
import math
import struct
import sys
from dataclasses import replace
from importlib import import_module

import pytest
from helpers.rows import faults

from tmsopt import Problem, load, models
from tmsopt.files import format_header, write_csv
from tmsopt.records import Table
from tmsopt.studies import FORMATS, Row, RowTable, Study, batch_rows, check_export, export, header

SPECIAL = (
    0.1,
    math.nan,
    math.inf,
    -math.inf,
    -0.0,
    0.0,
    5e-324,
    -2.2250738585072011e-308,
    1.7976931348623157e308,
    1 / 3,
)
METADATA = {"definition": {"title": "χ"}, "versions": {"tmsopt": "0.1.0"}, "long": "x" * 1_000_000}


PROBLEM = load("problems/ep4.toml")
LIMITED = replace(PROBLEM, constraints={"trail": "nu_H >= 0.02"})


def table_of(*rows):
    """Rows of a study that has them, in which the same varies."""
    columns = {name: [row.varied[name] for row in rows] for name in (rows[0].varied if rows else ())}
    return RowTable(Study(LIMITED, columns or {"mu": [0.1]}, report=["Fr / Fr_c"]), [batch_rows(rows)])


def solved(number, x=0.1, **varied):
    return Row(
        number,
        0,
        Table(varied or {"mu": 0.1}),
        "optimal",
        objective=x,
        structure="EP4",
        parameters=Table({"Fr": x}),
        reports=Table({"Fr / Fr_c": x}),
        bound=x,
        proven=number % 2 == 0,
        laws=Table({"chib": x}),
        host="here",
    )


def broken(number, **given):
    return Row(number, 0, Table({"mu": 0.2}), "failed", **{"cause": 'two\nlines, "quoted"'} | given)


ROWS = table_of(*(solved(n, x) for n, x in enumerate(SPECIAL)), broken(len(SPECIAL), violations=Table({"trail": 0.5})))


def read_csv(path):
    with path.open(newline="", encoding="utf-8") as stream:
        header, *lines = csv.reader(stream)
    return {name: list(values) for name, values in zip(header, zip(*lines, strict=True), strict=True)}


def read_parquet(path):
    return pytest.importorskip("pyarrow.parquet").read_table(path).to_pydict()


def read_netcdf(path, group=None):
    with pytest.importorskip("xarray").open_dataset(path, engine="netcdf4", group=group) as opened:
        return {v.attrs.get("long_name", name): v.values.tolist() for name, v in opened.load().variables.items()}


READERS = {"csv": read_csv, "parquet": read_parquet, "nc": read_netcdf}


def bits(value):
    """Of a double; a blank is nan."""
    return struct.pack("<d", math.nan if value in ("", None) else float(value))


@pytest.mark.parametrize("ending", FORMATS)
def test_every_double_comes_back_bit_by_bit(ending, tmp_path):
    path = tmp_path / f"rows.{ending}"
    export(ROWS, path, METADATA)
    found = READERS[ending](path)
    for name in ("objective", "Fr", "report.Fr / Fr_c", "law.chib"):
        assert [bits(v) for v in found[name]] == [bits(x) for x in (*SPECIAL, math.nan)]
    assert [bits(v) for v in found["bound"]] == [bits(x) for x in (*SPECIAL, -math.inf)]
    assert [bits(v) for v in found["violation.trail"]] == [bits(math.nan)] * len(SPECIAL) + [bits(0.5)]
    assert [float(v) for v in found["varied.mu"]] == [0.1] * len(SPECIAL) + [0.2]
    assert [int(v) for v in found["number"]] == list(range(len(ROWS)))
    assert found["status"] == ["optimal"] * len(SPECIAL) + ["failed"]
    assert found["cause"][-1] == 'two\nlines, "quoted"'
    assert [str(v).lower() in ("true", "1") for v in found["proven"]] == [row.proven for row in ROWS]
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_the_headers():
    """In the order of a row's fields; a table's names have a prefix, but for parameters."""
    heads = list(ROWS.headers)
    assert ",".join(heads[:11]) == (
        "number,seed,varied.mu,status,cause,objective,abscissa,abscissa_realised,damping_ratio,structure,stable"
    )
    assert heads[11:18] == list(PROBLEM.posed.parameter_set.names)
    assert heads[18:23] == ["report.Fr / Fr_c", "bound", "gap", "proven", "method"]
    laws = [name for name in heads if name.startswith("law.")]
    after = ["violation.trail", "violation.a0", "violation.coefficients", "starts", "warm", "seconds", "host"]
    assert heads[23:] == laws + after
    assert header("parameters", "seed") == "parameter.seed"


def test_whether_a_row_is_stable(tmp_path):
    """Ideal and as stored; of a row without a design, and of one with a root at infinity, that is not known."""
    ends = [(-1.0, -1.0), (1.0, 1.0), (-1e-6, 1e-4), (0.0, 0.0), (math.nan, math.nan), (math.inf, math.inf)]
    rows = table_of(*(replace(solved(k), abscissa=a, abscissa_realised=b) for k, (a, b) in enumerate(ends)))
    truth = [True, False, False, False, None, None]
    assert [row.to_json()["stable"] for row in rows] == truth
    assert [Row.from_json(row.to_json()).stable for row in rows] == truth
    export(rows, tmp_path / "rows.csv")
    assert read_csv(tmp_path / "rows.csv")["stable"] == ["true", "false", "false", "false", "", ""]
    export(rows, tmp_path / "rows.parquet")
    assert read_parquet(tmp_path / "rows.parquet")["stable"] == truth


def test_what_the_rows_are_of(tmp_path):
    """And in Parquet, absent and nan differ."""
    parquet, xarray = pytest.importorskip("pyarrow.parquet"), pytest.importorskip("xarray")
    for ending in ("parquet", "nc"):
        export(ROWS, tmp_path / f"rows.{ending}", METADATA)
    found = read_parquet(tmp_path / "rows.parquet")["Fr"]
    assert math.isnan(found[1])
    assert found[-1] is None
    assert json.loads(parquet.read_schema(tmp_path / "rows.parquet").metadata[b"tmsopt"]) == METADATA
    with xarray.open_dataset(tmp_path / "rows.nc", engine="netcdf4") as opened:
        assert json.loads(opened.attrs["tmsopt"]) == METADATA
        assert opened["Fr"].dims == ("row",)
        assert opened["Fr"].sel(row=3).item() == -math.inf


GRID = [(mu, fr) for mu in (0.3, 0.1) for fr in (1.0, 2.0, 3.0)]


def test_a_full_grid_has_its_own_dimensions_too(tmp_path):
    xarray = pytest.importorskip("xarray")
    path, given = tmp_path / "rows.nc", [{"mu": mu, "Fr.min": fr, "zeta_B": -0.4} for mu, fr in GRID]
    export(table_of(*(solved(n, 10 * v["mu"] + v["Fr.min"], **v) for n, v in enumerate(given))), path)
    assert len(read_netcdf(path)["objective"]) == 6
    with xarray.open_dataset(path, engine="netcdf4", group="grid") as opened:
        assert dict(opened.sizes) == {"varied.mu": 2, "varied.Fr.min": 3}
        assert opened["status"].dims == opened["objective"].dims == ("varied.mu", "varied.Fr.min")
        for n, (mu, fr) in enumerate(GRID):
            at = opened.sel({"varied.mu": mu, "varied.Fr.min": fr})
            assert (at["number"].item(), at["objective"].item()) == (n, 10 * mu + fr)


@pytest.mark.parametrize(
    "points",
    [
        GRID[:-1],
        [*GRID[:-1], GRID[0]],
        [(0.1 * n, 1.0 + n) for n in range(4)],
        [(0.1, 1.0)],
    ],
)
def test_rows_that_fill_no_grid_have_none(points, tmp_path):
    pytest.importorskip("xarray")
    path = tmp_path / "rows.nc"
    export(table_of(*(solved(n, **{"mu": mu, "Fr.min": fr}) for n, (mu, fr) in enumerate(points))), path)
    with pytest.raises(OSError, match="grid"):
        read_netcdf(path, "grid")


@pytest.mark.parametrize("ending", FORMATS)
def test_no_rows_are_a_table_too(ending, tmp_path):
    path = tmp_path / f"rows.{ending}"
    export(table_of(), path)
    if ending != "csv":
        assert READERS[ending](path)["objective"] == []
    else:
        assert path.read_text().startswith("number,seed,varied.mu,status")


@pytest.mark.parametrize(("ending", "module"), [("parquet", "pyarrow"), ("nc", "xarray"), ("nc", "netCDF4")])
def test_a_missing_package_is_named(ending, module, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    message = faults(export, ROWS, tmp_path / f"rows.{ending}")
    assert f'{module} is not installed; pip install "tmsopt[data]"' in message
    assert list(tmp_path.iterdir()) == []


def test_files_that_cannot_be_written(tmp_path):
    assert "accepted: a file name ending in .csv, .parquet, .nc" in faults(export, ROWS, tmp_path / "rows.xls")
    assert "does not exist" in faults(check_export, tmp_path / "no" / "rows.csv")
    (tmp_path / "folder.csv").mkdir()
    assert "not a regular file" in faults(export, ROWS, tmp_path / "folder.csv")


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_file_is_replaced_as_a_whole_or_not_at_all(ending, tmp_path, monkeypatch):
    path = tmp_path / f"rows.{ending}"
    path.write_text("before")

    def interrupt(now):
        if now.done:
            raise KeyboardInterrupt

    monkeypatch.setattr("tmsopt.progress.PAUSE", 0.0)
    with pytest.raises(KeyboardInterrupt):
        export(ROWS, path, progress=interrupt)
    assert path.read_text() == "before"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("first", ["=", "+", "-", "@", "\t", "\r", "\n"])
def test_no_cell_of_a_csv_is_a_formula(first, tmp_path):
    """Texts get an apostrophe, heads too; numbers, negative ones first of all, stay numbers."""
    name = f"{first}cmd|' /C calc'!A0"
    model = models.from_coefficients(["1", "mu"])
    study = Study(Problem(model, {"mu": 1.0}, minimize="mu"), {"mu": [0.2]})
    one = broken(0, cause=name, structure=name, objective=-1.5, host=name, abscissa=-2.0)
    export(RowTable(study, [batch_rows([one])]), tmp_path / "rows.csv")
    found, quoted = read_csv(tmp_path / "rows.csv"), f"'{name}".replace("\r", "\n")
    assert found["cause"] == found["structure"] == found["host"] == [quoted]
    assert (found["objective"], found["abscissa"]) == (["-1.5"], ["-2.0"])
    write_csv(tmp_path / "points.csv", [{name: -1.0, "label": name, "none": None}], {name: "m"})
    assert read_csv(tmp_path / "points.csv") == {f"{quoted} (m)": ["-1.0"], "label": [quoted], "none": [""]}


def test_heads_of_csv_name_units():
    """Of a parameter, what varies, a report and a violation; of an end or a limit those of its name."""
    bare = import_module("tmsopt.studies.export")._strip_header
    names = ("v", "varied.lambda_s.max", "varied.arm.limit", "report.u_H", "violation.arm", "law.w0")
    assert [bare(name) for name in names] == ["v", "lambda_s", "arm", "u_H", "arm", "law.w0"]
    assert (format_header("v", "m/s"), format_header("mu", "")) == ("v (m/s)", "mu")


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_rows_are_counted_while_they_are_written(ending, tmp_path, monkeypatch):
    monkeypatch.setattr(import_module("tmsopt.studies.export"), "CHUNK_ROWS", 2)
    monkeypatch.setattr("tmsopt.progress.PAUSE", 0.0)
    told = []
    export(table_of(*map(solved, range(5))), tmp_path / f"x.{ending}", progress=told.append)
    assert [(p.done, p.most) for p in told][1:] == [(2, 5), (4, 5), (5, 5)]
    assert {(p.what, p.unit) for p in told} == {(f"writing x.{ending}", "row")}
    assert len(READERS[ending](tmp_path / f"x.{ending}")["number"]) == 5
