"""Documents laid out as text: at any width no line is too long and no word is broken; colours and letters as asked."""

import re
from dataclasses import replace

import pytest
from test_results import RESULTS, made

import tmsopt
from tmsopt.documents import Cell, Chapter, Document, Listing, Sentence, TableBlock, document_of, to_text
from tmsopt.problem import Unit

LIGHT = ("Solution", "Solution, not stable", "Speeds", "Simulation", "Trace", "Chart", "Description", "Domain")
CODES = re.compile(r"\x1b\[[\d;]*m")


def page(*blocks, level="brief"):
    return Document("Solution", "a title", (), level, (Chapter("answer", blocks=blocks),))


def lines(*blocks, width=100, **options):
    return to_text(page(*blocks), width, **options).splitlines()


@pytest.mark.parametrize("name", [n if n in LIGHT else pytest.param(n, marks=pytest.mark.slow) for n in RESULTS])
@pytest.mark.parametrize("level", ["brief", "full"])
def test_no_line_is_too_long_and_no_word_is_broken(name, level):
    document = document_of(made(name), level)
    words = set(to_text(document, 10_000).split())
    for width in (80, 100, 120):
        text = to_text(document, width)
        kept = re.sub(r"^  … (?:.|\n    )*", "", text, flags=re.MULTILINE)  # without what counts the rest
        assert set(kept.split()) <= words
        for line in text.splitlines():
            assert len(line) <= width or len(max(line.split(), key=len)) > width // 2, line


@pytest.mark.parametrize("name", LIGHT)
def test_colours_change_nothing_but_colours(name):
    document = document_of(made(name))
    coloured = to_text(document, 80, colour=True)
    assert CODES.sub("", coloured) == to_text(document, 80)


@pytest.mark.parametrize("name", RESULTS)
def test_letters_are_those_of_every_encoding_where_asked(name):
    assert to_text(document_of(made(name)), 80, ascii_only=True).isascii()


@pytest.mark.parametrize(
    ("tone", "code"), [("good", "32"), ("doubt", "33"), ("bad", "31"), ("answer", "1"), ("dim", "2")]
)
def test_a_verdict_has_its_colour(tone, code):
    assert lines(Sentence("stable", tone=tone), colour=True)[-1] == f"\x1b[{code}mstable\x1b[0m"


def test_what_follows_a_first_line_is_indented():
    told = lines(Sentence("one two three four five six", "note"), width=20)
    assert told[1:] == ["note: one two three", "  four five six"]


def test_a_number_stays_with_its_unit():
    for width in range(24, 40):
        told = lines(Sentence("the battery at 25 cm and 0.005 kg m^2, chi_T <= 1"), width=width)
        assert not any(re.search(r"(\b25|0\.005|kg|<=)$", line) for line in told)


ROWS = (
    ("speed", "found by", "abscissa", "remark"),
    *((str(k), "a long name", Cell(k / 3), "two words") for k in range(9)),
)


def test_a_narrow_screen_loses_the_least_needed_column_and_says_so():
    grid = TableBlock(ROWS, priorities=(9, 1, 8, 5))
    assert "found by" in lines(grid, width=60)[1]
    told = lines(grid, width=40)
    assert told[1].split() == ["speed", "abscissa", "remark"]
    assert told[-1] == "  … more columns: found by (--full)"


def test_rows_that_are_left_out_are_counted():
    told = lines(TableBlock(ROWS, max_rows=3))
    assert len(told) == 1 + 1 + 3 + 1
    assert "6 more rows" in told[-1]
    kept = lines(TableBlock(ROWS, max_rows=4, kept_rows=frozenset({8})))
    assert any(line.split()[0] == "8" for line in kept[2:-1])


def test_a_full_document_has_every_column_whatever_the_width():
    document = page(TableBlock([("name", *map(str, range(30))), ("x", *["12345"] * 30)]), level="full")
    for width in (60, 100):
        text = to_text(document, width)
        assert text.count("12345") == 30
        assert max(map(len, text.splitlines())) <= width


def test_many_rows_without_headings_stand_side_by_side():
    rows = [("", ""), *((f"p{k}", Cell(k, Unit("cm", 0.01), with_unit=True)) for k in range(10))]
    told = lines(TableBlock(rows, fold=5))
    assert told[1].split() == ["p0", "0", "cm", "p5", "500", "cm"]
    assert len(told) == 6


def test_labels_stand_above_each_other():
    told = lines(Listing((("printed", "1.2"), ("route", "a sentence that goes on and on, and on again"))), width=40)
    assert {line.index(word) for line, word in zip(told[1:3], ("1.2", "a sentence"), strict=True)} == {11}
    assert told[3].startswith(" " * 11)


def test_what_a_terminal_would_obey_is_shown_as_a_mark():
    assert "\x1b" not in to_text(replace(page(Sentence("\x1b[31mred\u202e")), title="\x07"), colour=False)


def test_a_solution_is_green_only_where_it_is_stable_and_no_limit_is_violated():
    stable, unstable = made("Solution"), made("Solution, not stable")
    swing = tmsopt.models.from_coefficients([1, "c", 1])  # ± i for c = 0
    edge = tmsopt.solve(tmsopt.Problem(swing, fixed={"c": 0.0}))
    cases = ((stable, "good"), (unstable, "bad"), (edge, "doubt"), (replace(stable, status="not_converged"), "bad"))
    for solution, tone in cases:
        document = document_of(solution)
        first = document.chapters[0].blocks[0]
        assert (first.tone, document.badges[-1].tone) == (tone, tone), first.text
