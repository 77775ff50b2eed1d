"""Files and words from strangers: whatever they hold, the answer is an InputError in printable words, or a result.

By default the same cases on every run; ``TMSOPT_FUZZ=2000 pytest -m long tests/test_hostile.py`` draws 2000 new ones of
each kind. A crash of the interpreter, or a reader that never ends, ends the run.
"""

import json
import os
import shutil
import sqlite3
from contextlib import closing, suppress
from datetime import timedelta

import pytest
from helpers.places import ROOT
from hypothesis import HealthCheck, given, settings, strategies as st

import tmsopt
from tmsopt.cli import main

pytestmark = pytest.mark.long

FILES = sorted((ROOT / "problems").glob("*.toml"))
PROBLEMS = [p for p in FILES if not p.name.startswith("study_")]
STUDIES = [p for p in FILES if p.name.startswith("study_")]
PLANE = """[parameters]\nchi_H = 1.0\nzeta_H = -0.2\nzeta_B = -0.4\nmu = 0.1\nchi_B = 1.41
Fr = { min = 0.5, max = 5 }\nlambda_s = { min = 0.01, max = 1.4 }\n"""
ROWS = f'[problem]\n{PLANE.replace("[", "[problem.")}[problem.objective]\nminimize = "abscissa"\n[study]\nstarts = 1\n[vary]\nmu = [0.1, 0.2]\n'
BICYCLE = """w = 1.02\nc = 0.08\nlam = 0.31\ng = 9.81\nrR = 0.3+/-0.01\nmR = 2\nIRxx = 0.06\nIRyy = 0.12\nxB = 0.3\nzB = -0.9
mB = 85\nIBxx = 9.2\nIByy = 11\nIBzz = 2.8\nIBxz = 2.4\nxH = 0.9\nzH = -0.7\nmH = 4\nIHxx = 0.059\nIHyy = 0.06\nIHzz = 0.0071
IHxz = -0.0076\nrF = 0.35\nmF = 3\nIFxx = 0.14\nIFyy = 0.28\n"""

DRAWN = os.environ.get("TMSOPT_FUZZ")
FUZZ = settings(
    max_examples=int(DRAWN or 150),
    derandomize=DRAWN is None,
    deadline=timedelta(seconds=20),  # of what is read at once; a hundred times as long is a hang
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    print_blob=True,
)

NUMBERS = ["nan", "-inf", "1e309", "5e-324", "1e-400", "-0.0", "0", "9" * 5000, "0x" + "f" * 4000, "1_0", "true"]
TEXTS = [
    "",
    "1e-99999999 cm",
    "5 m  m  m  m?",
    "5 m**99999999",
    "EP4",
    "2EP2+EP9",
    "\x1b[31m",
    "\u202e",
    "=1+1",
    "a\nb",
    "/dev/zero",
]
FORMULAS = [
    "Fr**-99999999999",
    "Fr**9223372036854775808",
    "9**9**9**9*Fr",
    "(Fr**99)**99",
    "1/0",
    "0**-1*Fr",
    "0*Fr",
    "Fr <= Fr",
    "exp(exp(exp(9*Fr)))",
    "tan(1e300*Fr)",
    "log(-1)*Fr",
    "sqrt(Fr-9)",
    "min(Fr)",
    "(" * 400 + "Fr" + ")" * 400,
    "-" * 1500 + "Fr",
    "+".join(["Fr"] * 400),
    "Fr.real",
    "Fr[0]",
    "lambda: 1",
    "__import__('os')",
    "Fr\u200b",
    "1e308*1e308*Fr",
]
TABLES = [
    "[]",
    "{}",
    "[[[]]]",
    "{ min = 1, max = 0 }",
    "{ min = 1e-300, max = 1e300 }",
    "{ min = nan, max = 1 }",
    "[" * 5000 + "]" * 5000,
    "{ min = 0, max = 1, points = 1000000000 }",
    "1979-05-27",
]
VALUES = st.sampled_from([*NUMBERS, *TABLES]) | st.sampled_from([*TEXTS, *FORMULAS]).map(json.dumps)
BYTES = st.sampled_from(
    [
        b"\0",
        b"\xff",
        b"\xed\xa0\x80",
        b"\xef\xbb\xbf",
        b"\r",
        b"\x1b]0;x\x07",
        b"'''",
        b'"',
        b"[[",
        b"}",
        b"\n.\n",
        b"\xe2\x80\xae",
    ]
)


@st.composite
def spoiled(draw, text):
    """A text with values, keys or bytes exchanged, lines twice or missing, or without its end."""
    for _ in range(draw(st.integers(1, 3))):
        lines = text.splitlines(keepends=True) or [""]
        k = draw(st.integers(0, len(lines) - 1))
        key, equals, _ = lines[k].partition("=")
        match draw(st.sampled_from(["value", "value", "value", "key", "twice", "gone"])):
            case "value" if equals:
                lines[k] = f"{key}= {draw(VALUES)}\n"
            case "key":
                lines[k] = lines[k].replace(
                    key,
                    draw(st.sampled_from(["x", '"a b"', "Fr", "__class__", "a" + ".a" * 1500, '"\\u001b"', "min"])),
                    1,
                )
            case "twice":
                lines.append(lines[k])
            case _:
                del lines[k]
        text = "".join(lines)
    raw = text.encode("utf-8", "surrogatepass")
    if draw(st.integers(0, 3)) == 0:
        at = draw(st.integers(0, len(raw)))
        raw = raw[:at] + draw(BYTES) + (raw[at:] if draw(st.booleans()) else b"")
    return raw


def answered(ask):
    """A question is answered, or refused in printable words that do not flood a screen."""
    try:
        ask()
    except tmsopt.InputError as error:
        said = str(error)
        assert said.replace("\n", "").isprintable(), said
        assert len(said) < 50_000


@FUZZ
@given(data=st.data())
def test_problem_files_are_read_or_refused(data, tmp_path):
    file = tmp_path / "p.toml"
    file.write_bytes(data.draw(spoiled(data.draw(st.sampled_from(PROBLEMS)).read_text(encoding="utf-8"))))
    answered(lambda: tmsopt.load(file))


@FUZZ
@given(data=st.data())
def test_study_files_are_read_or_refused(data, tmp_path):
    for beside in PROBLEMS:
        shutil.copy(beside, tmp_path)
    (tmp_path / "rows.csv").write_bytes(data.draw(spoiled("mu,zeta_B\n0.1,-0.4\n0.2,-0.5\n")))
    given_rows = 'problem = "ep4.toml"\n[study]\nmethod = "csv"\ncsv = "rows.csv"\nstarts = 1\n'
    texts = [given_rows, given_rows, ROWS, *(p.read_text(encoding="utf-8") for p in STUDIES)]
    text = data.draw(st.sampled_from(texts))
    (tmp_path / "s.toml").write_bytes(text.encode() if text == given_rows else data.draw(spoiled(text)))
    answered(lambda: tmsopt.load_study(tmp_path / "s.toml"))


@FUZZ
@given(data=st.data(), ending=st.sampled_from(["txt", "yml"]))
def test_bicycle_files_are_read_or_refused(data, ending, tmp_path):
    text = BICYCLE if ending == "txt" else "values:\n  " + BICYCLE.replace(" =", ":").replace("\n", "\n  ")
    (file := tmp_path / f"b.{ending}").write_bytes(data.draw(spoiled(text)))
    answered(lambda: tmsopt.read_bicycle(file))


@FUZZ
@given(
    text=st.recursive(
        st.sampled_from(["Fr", "mu", "2", "1e308", "5e-324", "0", "abscissa", "a4", "pi"]),
        lambda part: (
            st.builds("({} {} {})".format, part, st.sampled_from(["+", "-", "*", "/", "**"]), part)
            | st.builds("{}({})".format, st.sampled_from(["sin", "exp", "log", "sqrt", "abs", "-"]), part)
        ),
        max_leaves=12,
    )
    | st.sampled_from(FORMULAS),
    sense=st.sampled_from(["minimize", "maximize"]),
)
def test_formulas_are_computed_or_refused(text, sense):
    def ask():
        problem = tmsopt.Problem(
            model=tmsopt.models.tms,
            fixed={"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1},
            free={"Fr": (0.01, 10), "chi_B": (1.01, 5), "lambda_s": (0.01, 1.5)},
            constraints={"c": f"{text} <= 3"},
            **{sense: text},
        )
        values = problem.posed.values({**problem.fixed, "Fr": 2.0, "chi_B": 1.5, "lambda_s": 0.3})
        float(problem.posed.objective(values))

    answered(ask)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A finished chart and a finished study."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "c.toml").write_text(PLANE)
    (folder / "s.toml").write_text(ROWS)
    tmsopt.chart(folder / "c.toml", points=(6, 5), folder=folder / "c.chart")
    tmsopt.run_study(folder / "s.toml", store=folder / "s.sqlite", workers=1)
    return folder


@FUZZ
@given(data=st.data())
def test_charts_are_opened_or_refused(data, tmp_path, made):
    shutil.rmtree(tmp_path / "c.chart", ignore_errors=True)
    shutil.copytree(made / "c.chart", tmp_path / "c.chart")
    file = data.draw(st.sampled_from(sorted(p for p in (tmp_path / "c.chart").rglob("*") if p.is_file())))
    raw = file.read_bytes()
    if file.suffix in (".json", ".jsonl") and data.draw(st.booleans()):
        pieces = json.loads(raw.splitlines()[0] if file.suffix == ".jsonl" else raw)
        junk = [None, -1, 10**30, 1e308, "x", [], {}, [[]], True, ["x"] * 5, "../../etc/passwd"]
        pieces[data.draw(st.sampled_from(sorted(pieces)))] = data.draw(st.sampled_from(junk))
        raw = json.dumps(pieces).encode() + b"\n"
    else:
        at = data.draw(st.integers(0, len(raw)))
        raw = raw[:at] + data.draw(BYTES) + data.draw(st.sampled_from([raw[at:], raw[at + 1 :], b"", raw]))
    file.write_bytes(raw)

    def ask():
        opened = tmsopt.open_chart(tmp_path / "c.chart")
        assert all(layer.sum() is not None for layer in opened.layers.values())
        opened.to_json()

    answered(ask)


@FUZZ
@given(data=st.data())
def test_stores_are_read_or_refused(data, tmp_path, made):
    for left in tmp_path.glob("s.*"):
        left.unlink()
    shutil.copy(made / "s.toml", tmp_path)
    shutil.copy(made / "s.sqlite", tmp_path)
    if data.draw(st.booleans()):
        raw = bytearray((tmp_path / "s.sqlite").read_bytes())
        for _ in range(data.draw(st.integers(1, 5))):
            raw[data.draw(st.integers(0, len(raw) - 1))] ^= 1 << data.draw(st.integers(0, 7))
        (tmp_path / "s.sqlite").write_bytes(raw)
    else:
        with closing(sqlite3.connect(tmp_path / "s.sqlite")) as connection:
            tables = {
                n: [c[1] for c in connection.execute(f"PRAGMA table_info({n})")]
                for (n,) in connection.execute(
                    "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite%'"
                ).fetchall()
            }
            table = data.draw(st.sampled_from(sorted(tables)))
            column = data.draw(st.sampled_from(sorted(tables[table])))
            junk = data.draw(
                st.sampled_from([None, -1, 10**18, 1.5, "x", "", "[" * 9999, "{}", "[]", "NaN", b"\xff", "x" * 99_999])
            )
            with suppress(sqlite3.IntegrityError):
                connection.execute(f"UPDATE OR REPLACE {table} SET {column} = ?", (junk,))
            connection.commit()
    answered(lambda: tmsopt.run_study(tmp_path / "s.toml", store=tmp_path / "s.sqlite", workers=1))


@FUZZ
@given(data=st.data())
def test_the_command_ends_with_a_status_that_is_promised(data, tmp_path):
    (tmp_path / "p.toml").write_bytes(data.draw(spoiled((ROOT / "problems" / "ep4.toml").read_text(encoding="utf-8"))))
    asked = st.tuples(
        st.sampled_from(["--wheelbase", "--over", "--plot", "--starts", "--certify"]),
        st.sampled_from([*TEXTS[:-1], *NUMBERS[:4]]),
    )
    words = data.draw(st.sampled_from([(), ("--json",)]) | asked)
    with pytest.raises(SystemExit) as stop:
        main(args=["solve", str(tmp_path / "p.toml"), "--starts", "1", *words], prog_name="tmsopt")
    assert stop.value.code in (0, 2, 3, 4)
