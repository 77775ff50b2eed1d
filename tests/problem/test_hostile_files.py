"""Files from strangers: each is refused in words, at its line, in about the time that it takes to read it once."""

import os
import time
from fractions import Fraction
from functools import partial
from pathlib import Path

import casadi as ca
import pytest

import tmsopt
from tmsopt import errors, files
from tmsopt.models import from_coefficients, from_matrices

HEAD = "[parameters]\nchi_H = 1\nzeta_H = -0.2\nzeta_B = -0.4\nchi_B = 2\nFr = 1\nlambda_s = 0.3\n"
GOOD = f"{HEAD}mu = 0.1\n"
SECONDS = 5.0
"""Of the processor. What is linear takes 0.01 to 1; what was quadratic or exponential took 20 and more, or no end."""


def refused(path, text, read=tmsopt.load):
    """The lines of the message for a file of that text, which is all that may happen."""
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    began = time.process_time()
    with pytest.raises(tmsopt.InputError) as caught:
        read(path)
    assert time.process_time() - began < SECONDS
    assert all(len(line) < 5000 for line in str(caught.value).splitlines())
    return str(caught.value).splitlines()


BLANKS, ESCAPED = " " * 400_000, '\\"' * 200_000
TOO_LARGE = {
    "quoted key": (f'{GOOD}"a{BLANKS}b" = 1\n', 9, "unknown parameter 'a "),
    "escaped quotes": (f"{GOOD}z = '''\n\"{ESCAPED}\n'''\n", 9, "parameters.z: unknown parameter"),
    "quotes that are not closed": ('"\\' * 200_000, 1, "not TOML"),
    "integer of 5000 digits": (f"{HEAD}mu = {'1' * 5000}\n", 8, "found 5000 characters, '1111"),
    "dotted key": (f"{HEAD}mu{'.a' * 1500} = 1\n", 8, "more than 10 parts"),
    "lists in lists": (f"{HEAD}mu = {'[' * 100_000}{']' * 100_000}\n", 8, "more than 50 deep"),
    "tables in tables": (f"{HEAD}mu = {'{a=' * 100_000}\n", 8, "more than 50 deep"),
    "values of a scenario": (f"{GOOD}[scenarios]\nmu = [{'0.1,' * 90_000}]\n", 10, "found 90000; accepted: up to 100"),
    "constraints": (GOOD + "[constraints]\n" + "".join(f'c{k} = "Fr >= 0"\n' for k in range(20_000)), 9, "up to 1000"),
    "line that is not TOML": (f"x = {'1' * 400_000} %\n", 1, "found 400000 characters"),
    "pattern": (f'{GOOD}[objective]\nlocate = "{"EP2+" * 90_000}"\n', 10, "is no pattern"),
}


@pytest.mark.parametrize("kind", TOO_LARGE)
def test_a_file_larger_than_files_need_is_refused_at_its_line(tmp_path, kind):
    text, line, words = TOO_LARGE[kind]
    path = tmp_path / "p.toml"
    (first, *_) = refused(path, text)
    assert first.startswith(f"{path}:{line}: ")
    assert words in first


@pytest.mark.parametrize(
    ("entry", "line"), {"b{} = 1": "unknown parameter 'b0'", "b{} = []": "found []", "b{0} = {{x = 1}}": "b0"}.items()
)
def test_the_first_faults_are_listed_and_the_rest_is_counted(tmp_path, entry, line):
    text = GOOD + "".join(entry.format(k) + "\n" for k in range(4_000))
    found = refused(tmp_path / "p.toml", text)
    assert line in found[0]
    assert len(found) == errors.MAX_LISTED + 1
    assert int(found[-1].removeprefix("and ").removesuffix(" more")) + errors.MAX_LISTED >= 4_000


def test_a_text_of_several_lines_and_a_list_do_not_move_the_lines(tmp_path):
    """Lines counted by hand; what looks like a section or a key in a text, a list or a comment is none."""
    text = f'title = """\n[a]\nb = 1\n"""  # [c]\n{HEAD}mu = [\n  "x", # ]\n  \'d = 1\',\n]\n\n"e" = []\n[f]\n'
    found = [line.split(": ")[0].rsplit(":", 1)[1] for line in refused(tmp_path / "p.toml", text)]
    assert found == ["1", "12", "17", "18"]


UNSHOWN = ["\x1b[31m", "\n", "\x07", "\x9b", "\x7f", "\u2028", "\u202e", "\u2066"]


@pytest.mark.parametrize("sign", UNSHOWN, ids=ascii)
def test_what_a_terminal_obeys_is_neither_accepted_nor_written(tmp_path, sign):
    """In titles and names, from a file and from Python; the message has it as an escape."""
    path, written = tmp_path / "p.toml", f"a{sign}b".encode("unicode_escape").decode()
    quoted = '"a' + "".join(f"\\u{ord(c):04x}" for c in sign) + 'b"'
    for text in (
        f"title = {quoted}\n{GOOD}",
        f'{GOOD}[constraints]\n{quoted} = "Fr >= 0"\n',
        f"{GOOD}{quoted} = 1\n",
        f"{quoted} = 1\n{GOOD}",
        f"model = {quoted}\n{GOOD}",
        f'[model]\nname = {quoted}\ncoefficients = ["1", "k"]\n',
    ):
        found = "\n".join(refused(path, text))
        assert written.replace("\\\\", "\\") in found
        assert sign == "\n" or sign[0] not in found
    values = {"model": tmsopt.models.tms, "fixed": tmsopt.load("problems/ep4.toml").fixed, "free": {"Fr": (1, 2)}}
    with pytest.raises(tmsopt.InputError, match="control character"):
        tmsopt.Problem(**values, title=f"a{sign}b")
    with pytest.raises(tmsopt.InputError, match="control character"):
        tmsopt.Problem(**values, constraints={f"a{sign}b": "Fr >= 0"})
    for make in (partial(from_coefficients, ["1", "k"]), partial(from_matrices, A=[["k"]])):
        with pytest.raises(ValueError, match="one line"):
            make(name=f"a{sign}b")
    with pytest.raises(ValueError, match="is no name"):
        from_coefficients([1, ca.SX.sym(f"a{sign}b")])


def test_expressions_are_kept_without_the_ends_of_their_lines(tmp_path):
    path = tmp_path / "p.toml"
    free = GOOD.replace("Fr = 1", "Fr = { min = 1, max = 2 }")
    path.write_text(
        f"{free}[objective]\nminimize = '''\nFr\n'''\n[constraints]\nc = '''Fr >= 0\n'''\n", encoding="utf-8"
    )
    problem = tmsopt.load(path)
    assert (problem.minimize, problem.constraints["c"]) == ("Fr", "Fr >= 0")


DIGITS = "1" * 200_000
BICYCLES = {
    "digits, a point and a letter": (f"rF = {DIGITS}.{DIGITS}x\n", "rF: found '1111"),
    "blanks before no uncertainty": (f"rF = 1{BLANKS}+/-x\n", "rF: found '1 "),
    "blanks in brackets": (f"rF = ({BLANKS}x\n", "rF: found '( "),
    "uncertainties": ("rF = " + "1+/-" * 100_000 + "\n", "rF: found '1+/-"),
    "unknown names": ("".join(f"r{k} = 1\n" for k in range(20_000)), "unknown name 'r0'"),
    "an escape sequence": ("\x1b[2J = 1\n", r"unknown name '\x1b[2J'"),
}


@pytest.mark.parametrize("ending", [".txt", ".yml"])
@pytest.mark.parametrize("kind", BICYCLES)
def test_a_bicycle_file_from_a_stranger(tmp_path, kind, ending):
    text, words = BICYCLES[kind]
    if ending == ".yml":
        text = "values:\n" + "".join(f"  {line}\n" for line in text.replace("=", ":").splitlines())
    path = tmp_path / f"b{ending}"
    found = refused(path, text, tmsopt.read_bicycle)
    assert found[0].startswith(f"{path}:{2 if ending == '.yml' else 1}: ")
    assert words in found[0]
    assert "\x1b" not in "".join(found)


def test_yaml_that_refers_to_itself_is_no_number(tmp_path):
    text = "a: &a [1]\nb: &b [*a, *a]\nvalues:\n  rF: *b\n  rR: !!python/object/apply:os.getcwd []\n"
    found = refused(tmp_path / "b.yml", text, tmsopt.read_bicycle)
    assert "rF: found '*b'" in found[0]
    assert "rR: found '!!python" in found[1]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names are of POSIX")
@pytest.mark.parametrize("read", [tmsopt.load, tmsopt.load_study, tmsopt.read_bicycle, tmsopt.studies.read_csv])
def test_what_is_no_file_is_not_opened(tmp_path, read):
    """A pipe would wait for ever, a device has no end, a link to itself none either."""
    pipe, circle, odd = tmp_path / "pipe", tmp_path / "circle", tmp_path / "a\n\x1b[31m"
    os.mkfifo(pipe)
    circle.symlink_to(circle.name)
    for path, words in (
        (pipe, "is not a regular file"),
        (Path("/dev/zero"), "is not a regular file"),
        (tmp_path, "is a directory"),
        (circle, "is a link to no file"),
        (tmp_path / ("a" * 5000), "cannot be read"),
        (odd, r"a\n\x1b[31m: no such file"),
        (tmp_path / "a\0b", r"a\x00b: "),
    ):
        with pytest.raises(tmsopt.InputError) as caught:
            read(path)
        assert words in str(caught.value)
        assert str(caught.value).isprintable()


def test_a_file_that_names_itself(tmp_path):
    study, bicycle = tmp_path / "s.toml", tmp_path / "p.toml"
    assert "is a study" in refused(study, 'problem = "s.toml"\n[vary]\nmu = [1]\n', tmsopt.load_study)[0]
    assert refused(bicycle, f'bicycle = "p.toml"\n{GOOD}')[0].startswith(f"{bicycle}:1: ")


def test_the_limit_of_a_file_is_stated(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text(GOOD + "#" * (files.MAX_FILE_BYTES - len(GOOD)), encoding="utf-8")
    assert tmsopt.load(path).fixed
    assert refused(path, path.read_bytes() + b"#") == [
        f"{path}: is larger than {files.MAX_FILE_BYTES} bytes; accepted: a smaller TOML problem file"
    ]


def test_a_title_from_the_name_of_a_file_is_shown_as_it_is(tmp_path):
    path = tmp_path / "a\n\x1b[31m.toml"
    path.write_text(GOOD, encoding="utf-8")
    assert tmsopt.load(path).title == r"a\n\x1b[31m"


def deep(layers):
    found = []
    for _ in range(layers):
        found = [found]
    return found


LARGE = {
    "integer": 10**5000,
    "integers": [10**5000] * 9,
    "lists": deep(100_000),
    "texts": ["x" * 10**6] * 1000,
    "tables": {"a": {"b": 10**5000}},
}


@pytest.mark.parametrize("kind", LARGE)
def test_any_value_is_shown_in_a_few_words(kind):
    """Python writes no integer of more than 4300 digits and no list that is 1000 deep."""
    value = LARGE[kind]
    assert len(errors.short(value)) <= 60
    with pytest.raises(tmsopt.InputError):
        tmsopt.Problem(model=tmsopt.models.tms, fixed={"mu": value})


@pytest.mark.parametrize(
    "value", [1.5, "it's", "a\nb", (1,), [], {}, {"a": [1, (2, "b")]}, None, True, b"x", Fraction(1, 3)]
)
def test_a_short_value_is_shown_as_python_writes_it(value):
    assert errors.short(value) == repr(value)
