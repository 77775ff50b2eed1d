"""The benchmark command: what is measured, that a failure costs one section, and that nobody is credited unduly."""

import ast
import inspect
import math
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import click
import numpy as np
import pytest
from click.testing import CliRunner

import tmsopt
from benchmarks import command, timing
from benchmarks.command import SECTIONS, Section, chosen
from benchmarks.reports.designs import details, overview
from benchmarks.rivals import OWN, Heat, Moment, Reduced, Run, Seeker, median_ratio, own, run, slopes
from benchmarks.suites import random_problem
from benchmarks.timing import best, exponent
from tmsopt import Problem, models

HEIGHTS = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
OPTIMUM = -((0.4 * 0.2) ** -0.25)
"""Least abscissa at these heights, at the EP4 of the paper."""
EP4 = {
    "Fr": 3 * math.sqrt(110 * math.sqrt(2) - 120) / 8,
    "chi_B": math.sqrt(2),
    "lambda_s": math.atan(15 / 4 - 75 * math.sqrt(2) / 32),
}
BOX = {"Fr": (0.01, 10.0), "chi_B": (1.01, 5.0), "lambda_s": (0.02, 1.4)}
PROBLEM = Problem(models.tms, fixed=HEIGHTS, free=BOX, minimize="abscissa")
GOAL = OPTIMUM * (1 - 1e-3)  # double roots of a rounded EP4 scatter by 4e-4


def test_sections_have_letters_names_and_a_report():
    assert [s.letter for s in SECTIONS] == sorted(s.letter for s in SECTIONS)
    assert len({s.name for s in SECTIONS}) == len(SECTIONS)
    for section in SECTIONS:
        assert list(inspect.signature(section.report()).parameters) == ["asked"]


def test_packages_have_faces():
    """As in the package: a docstring that says what it is for."""
    room = Path(command.__file__).parent
    lines = {path: path.read_text(encoding="utf-8").splitlines() for path in room.rglob("*.py")}
    for folder in {path.parent for path in lines}:
        face = ast.get_docstring(ast.parse("\n".join(lines[folder / "__init__.py"]))) or ""
        assert 2 <= len([line for line in face.splitlines() if line]) <= 5


def test_benchmarks_open_packages_by_their_faces():
    """Rooms of the package may be rebuilt and benchmarks stay."""
    package = Path(tmsopt.__file__).parent
    for path in Path(command.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("tmsopt."):
                place = package.joinpath(*str(node.module).split(".")[1:])
                assert place.is_dir() or place.parent == package, f"{path.name} line {node.lineno}: {node.module}"


def test_sections_are_chosen_by_letter_or_name():
    assert [s.name for s in chosen("", SECTIONS)] == [s.name for s in SECTIONS if not s.long]
    assert [s.name for s in chosen("solve, b", SECTIONS)] == ["charts", "kernels", "solve"]
    assert [s.name for s in chosen("growth, a", SECTIONS)] == ["solving", "growth"]
    with pytest.raises(click.BadParameter, match="found 'x'; accepted: a or solving"):
        chosen("x", SECTIONS)


def test_a_section_that_fails_says_so_and_the_others_go_on(monkeypatch, tmp_path):
    def fails(asked):
        raise RuntimeError("out of luck")

    fakes = {"fails": fails, "works": lambda a: f"## Works\n\n`{a.command}`\n"}
    for name, report in fakes.items():
        monkeypatch.setitem(sys.modules, f"fake_{name}", SimpleNamespace(report=report))
    names = ("fails", "absent", "works")
    made = tuple(Section(letter, n, f"fake_{n}", "about") for letter, n in zip("abc", names, strict=True))
    monkeypatch.setattr(command, "SECTIONS", made)
    path = tmp_path / "kept.md"
    answer = CliRunner().invoke(command.main, ["--quick", "--output", str(path)])
    assert answer.exit_code == 1
    kept = path.read_text(encoding="utf-8")
    assert "failed: RuntimeError: out of luck" in kept
    assert "not installed: fake_absent" in kept
    assert "`python -m benchmarks --only works --quick`" in kept
    assert kept.index("<!-- fails -->") < kept.index("<!-- absent -->") < kept.index("<!-- works -->")


def test_quick_numbers_are_kept_nowhere_by_default(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "fake_works", SimpleNamespace(report=lambda asked: "## Works\n"))
    monkeypatch.setattr(command, "SECTIONS", (Section("a", "works", "fake_works", "about"),))
    monkeypatch.chdir(tmp_path)
    answer = CliRunner().invoke(command.main, ["--quick"])
    assert answer.exit_code == 0
    assert "## Works" in answer.output
    assert not list(tmp_path.iterdir())


def test_methods_take_turns_and_the_least_time_counts(monkeypatch):
    clock = [0.0]
    turns = []

    def work(name, seconds):
        def one():
            turns.append(name)
            clock[0] += seconds.pop(0)

        return one

    monkeypatch.setattr(timing.time, "perf_counter", lambda: clock[0])
    assert best({"a": work("a", [5, 2, 3]), "b": work("b", [4, 8, 6])}, 3) == {"a": 2, "b": 4}
    assert turns == ["a", "b"] * 3


def test_exponent_of_a_power():
    assert exponent([1, 10, 1000], [3.0, 300.0, 3e6]) == pytest.approx(2, abs=1e-12)
    assert exponent([1, 10, 100], [5.0, 50.0, math.nan]) == pytest.approx(1, abs=1e-12)
    assert math.isnan(exponent([1], [3.0]))


def seen(*designs):
    """A rival that evaluates some designs and claims an abscissa of −100 for each."""

    def search(problem, watch):
        for design in designs:
            watch(np.array([[design[n]] for n in problem.free]), np.array([-100.0]))

    return Seeker(search)


FAR = {"Fr": 2.0, "chi_B": 1.4, "lambda_s": 0.4}


def test_a_rival_is_credited_with_what_it_saw_and_not_with_what_it_claims():
    found = run("fake", seen(FAR, EP4, FAR), PROBLEM, GOAL, math.inf)
    assert [m.evaluations for m in found.moments] == [1, 2]  # the third was never asked for: the goal was seen
    assert found.moments[0].value == pytest.approx(Reduced(PROBLEM).abscissa(np.array(list(FAR.values()))), abs=1e-12)
    assert found.moments[1].value == pytest.approx(OPTIMUM, abs=1e-3)


def test_designs_that_violate_something_are_not_credited():
    narrow = replace(PROBLEM, constraints={"c": "Fr >= 3"})
    assert run("fake", seen(FAR, EP4), narrow, GOAL, math.inf).moments == ()
    outside = run("fake", seen({**EP4, "lambda_s": -0.4}), PROBLEM, GOAL, math.inf)  # judged at the end of its range
    assert outside.best > GOAL


def test_time_ends_a_rival_and_an_error_keeps_what_it_had():
    assert len(run("fake", seen(FAR, EP4), PROBLEM, GOAL, 0.0).moments) == 1

    def search(problem, watch):
        seen(FAR).search(problem, watch)
        raise ArithmeticError("lost")

    found = run("fake", Seeker(search), PROBLEM, GOAL, math.inf)
    assert (len(found.moments), found.note) == (1, "failed: ArithmeticError('lost')")
    absent = run("fake", Seeker(search, ("no_such_package",)), PROBLEM, GOAL, math.inf)
    assert (absent.moments, absent.note) == ((), "not installed: no_such_package")


def test_ratios_compare_two_sides_at_equal_accuracy():
    """Ours is there after 2 s; a rival within 1e-3 after 6 s, within 1e-6 after 20 s, and never within 1e-8."""

    def moment(error, seconds):
        return Moment(-1 + error, seconds, int(10 * seconds), EP4)

    ours = Run(OWN, (moment(0, 2.0),), 2.0, 20)
    rival = Run("rival", (moment(1e-4, 6.0), moment(1e-7, 20.0)), 30.0, 300)
    never = Run("never", (moment(0.5, 1.0),), 30.0, 300)
    absent = Run("absent", (), 0.0, 0, "not installed: it")
    heat = Heat("fake", PROBLEM, -1.0, "closed form", EP4, (ours, rival, never, absent), 30.0)
    assert [heat.ratio(rival, t) for t in (1e-3, 1e-6, 1e-8)] == [3, 10, math.inf]
    assert heat.error(rival) == pytest.approx(1e-7, rel=1e-6)
    slower = replace(heat, runs=(replace(ours, moments=(moment(0, 4.0),)), rival, never, absent))
    assert median_ratio([heat, slower], "rival", 1e-3) == (2, pytest.approx((6 / 2 + 6 / 4) / 2), True)
    assert median_ratio([heat], "never", 1e-3) == (0, 30 / 2, False)  # its 30 s were not enough
    assert "| absent | not installed: it |" in overview([heat])
    assert "| never | 0 of 1 | ≥ 15 | 0 of 1 | ≥ 15 | 0 of 1 | ≥ 15 | 5e-01 |" in overview([heat])
    assert details([heat]).count("never: best error 1e-07") == 1
    assert details([heat]).count("never: best error 5e-01") == 3


def test_ours_is_as_good_as_it_says():
    """The optimum in closed form, with IPOPT's evaluations counted."""
    found = own(PROBLEM)
    assert found.best == pytest.approx(OPTIMUM, rel=1e-12)
    assert found.evaluations > 0


@pytest.mark.parametrize("index", [3, 39])
def test_gradients_given_to_rivals(index):
    """Against differences of numpy.roots at a design with simple roots: 1e-7 steps leave 1e-7 of the slope."""
    reduced = Reduced(random_problem(index))
    x = 0.3 * reduced.lower + 0.7 * reduced.upper
    step = 1e-7 * (reduced.upper - reduced.lower)
    slope, rows = slopes(reduced, x)
    for k, unit in enumerate(np.eye(len(x))):
        up, down = x + step * unit, x - step * unit
        assert slope[k] == pytest.approx((reduced.abscissa(up) - reduced.abscissa(down)) / (2 * step[k]), abs=1e-5)
        assert rows[:, k] == pytest.approx((reduced.rows(up) - reduced.rows(down)) / (2 * step[k]), abs=1e-5)
