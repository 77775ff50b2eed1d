"""Rows that solve nothing: judged at once they are those of one by one, whatever block they are in."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from helpers.places import PROBLEMS
from helpers.rows import assert_same, numbers_in

from tmsopt import Problem, Sampling, Study, load, models, monte_carlo, over_grid, run_study, solve
from tmsopt.documents import describe_row
from tmsopt.errors import InputError
from tmsopt.evaluation import LAWS, evaluate_columns, law_rows
from tmsopt.plots import draw_histogram
from tmsopt.studies import RowTable, Solver, batch_rows, open_store, solve_row, summarise

judge = import_module("tmsopt.studies.solving")
SOLVES = import_module("tmsopt.studies.monte_carlo")
SPREAD = {"chi_B": 0.005, "lambda_s": 0.0087, "Fr": 0.02}
OWN = models.from_coefficients(["m", "a", "b + 0.1", "c*a", "d/k"], name="own quartic")
FIXED = {"m": 1.0, "a": 4.0, "b": 6.0, "c": 1.0, "d": 1.0, "k": 1.0}


def built(rows, share=1.0, **more):
    return monte_carlo(PROBLEMS / "ep4.toml", rows, 1, "normal", {n: share * x for n, x in SPREAD.items()}, **more)


def whipple():
    design = solve(PROBLEMS / "whipple_ep4.toml")
    return monte_carlo(design, 20, 2, tolerances={n: abs(x) / 100 for n, x in design.parameters.items() if x})


def limited():
    problem = solve(PROBLEMS / "realistic.toml").problem
    design = solve(problem)
    return monte_carlo(design, 30, 3, tolerances={n: abs(x) / 500 for n, x in design.parameters.items() if x})


def own(limits=None, **asked):
    rng = np.random.default_rng(4)
    problem = Problem(model=OWN, fixed=FIXED, constraints=limits or {}, **(asked or {"minimize": "abscissa"}))
    drawn = {n: x * (1 + 0.3 * rng.uniform(-1, 1, 60)) for n, x in FIXED.items()}
    drawn["k"][:3], drawn["m"][3:5], drawn["d"][5] = 0.0, 0.0, 0.0  # no coefficient, no root, a root at 0
    drawn["a"][6:9], drawn["b"][6:9], drawn["c"][6:9], drawn["d"][6:9] = 4, 5.9, 1, 1  # EP4, and beside it
    drawn["m"][6:9], drawn["k"][6:9] = (1, 1 + 1e-13, 1 + 1e-9), 1
    return Study(problem, drawn)


def constant():
    """The trace, 0.1 + 0.7, is no double: one in its place would move nearly double roots, at k = 0.09, by 1e-14."""
    model = models.from_matrices(A=[["-0.1", "1"], ["-k", "-0.7"]], name="a trace that is no double")
    problem = Problem(model=model, fixed={"k": 0.01}, minimize="abscissa")
    return Study(problem, {"k": 0.09 + np.geomspace(1e-7, 1e-3, 40) * (-1.0) ** np.arange(40)})


STUDIES = {
    "EP4 as built": lambda: built(30),
    "very near EP4": lambda: built(20, 1e-6),
    "wheels": whipple,
    "limits": limited,
    "constants": constant,
    "own": own,
    "own, stable": lambda: own({"decay": "abscissa <= -0.3", "size": "a*b >= 20"}),
    "own, another objective": lambda: own(maximize="damping_ratio**2 + sin(a)/3 - exp(-b)"),
    "own, one of two has no value": lambda: own(maximize="max(log(k - 0.8), abscissa)"),
    "own, nothing asked": lambda: own({"size": "a*b/k <= 30"}, minimize=None),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_rows_judged_at_once_are_those_of_one_by_one(name):
    study = STUDIES[name]()
    assert judge.can_evaluate(study)
    at_once = RowTable(study, list(judge.evaluate_rows(study, np.arange(len(study)))))
    assert len(at_once) > 0.4 * len(study) or name == "very near EP4"  # where doubles settle nothing
    solver = Solver(study)
    assert_same(at_once, [solver((row.number,))[0] for row in at_once])
    assert [row.number for row in run_study(study, workers=1).rows] == list(range(len(study)))


def test_rows_do_not_depend_on_others():
    study = replace(built(300), report=["sin(Fr) + exp(chi_B)/tan(lambda_s)", "Fr**0.3", "abscissa*log(Fr)"])
    whole = run_study(study).rows
    for size in (1, 7, 64):
        for first in range(0, 300, 100 if size == 1 else size):
            numbers = np.arange(first, min(first + size, 300))
            some = RowTable(study, list(judge.evaluate_rows(study, numbers)))
            assert_same(some, [whole[row.number] for row in some])
    assert_same([solve_row(study, 17).row], [whole[17]])


def test_what_is_searched_or_listed_is_not_judged_at_once():
    study = built(2)
    for problem in (
        replace(
            study.problem,
            scenarios={"mu": (0.1, 0.2)},
            fixed={n: x for n, x in study.problem.fixed.items() if n != "mu"},
        ),
        replace(study.problem, tolerances={"mu": 0.01}),
        replace(study.problem, minimize=None, maximize="radius"),
    ):
        assert not judge.can_evaluate(Study(problem, {"Fr": [2.0, 2.1]}))
    assert evaluate_columns(study.problem.posed, {"Fr": np.array([2.0])}) is not None


def test_columns_and_summary_are_those_of_the_rows():
    """Whether parameters and causes follow from the study, or are kept with every row."""
    for study in (own({"decay": "abscissa <= -0.3", "size": "a*b >= 20"}), built(50, report=["Fr_c"])):
        quick = run_study(study).rows
        slow = RowTable(study, [batch_rows(list(quick))])
        assert quick == slow == tuple(quick)
        for name in quick.headers:
            one, other = quick.column(name), slow.column(name)
            np.testing.assert_array_equal(one.mask, other.mask, name)
            np.testing.assert_array_equal(one.compressed(), other.compressed(), name)
            assert one.dtype == other.dtype
        assert str(summarise(quick)) == str(summarise(slow))
        assert quick[3:5] == (quick[3], quick[4])
        assert quick[-1].number == len(study) - 1


def test_a_store_gives_back_the_same_rows(tmp_path):
    study, path = own({"decay": "abscissa <= -0.3"}), tmp_path / "own.sqlite"
    kept, plain = run_study(study, path, workers=1), run_study(study, workers=1)
    again = run_study(study, path)
    assert (kept.solved, again.solved, again.found) == (60, 0, 60)
    for rows in (kept.rows, again.rows):
        assert_same(rows, plain.rows)
    with open_store(path, study) as store:
        assert numbers_in(store) == list(range(60))
        assert sum(session["rows"] for session in store.sessions()) == 60
    with pytest.raises(InputError, match="another study"):
        run_study(replace(study, seed=5), path)


@pytest.mark.parametrize("study", [own(), built(12)], ids=["own", "drawn"])
def test_what_is_judged_is_called_feasible_and_not_optimal(study):
    """Also where it is not stable: it is as given, and nobody looked for a better one."""
    results, row = run_study(study), solve_row(study, 9)
    assert row.row.status == "optimal"
    assert row.solution is not None
    told = [
        results.report(),
        describe_row(study, row.row),
        row.solution.report(),
        repr(results),
        repr(row.solution),
    ]
    if study.method != "monte_carlo":
        told.append(draw_histogram(results).get_title())
    assert not any(word in text for text in told for word in ("optimal", "minimize"))
    assert all("feasible" in text or "as given" in text for text in told)


DRAWN = Sampling(load(PROBLEMS / "ep4.toml"), 20, 1, "normal", SPREAD)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    path = tmp_path_factory.mktemp("drawn") / "s.sqlite"
    run_study(DRAWN, path)
    return path


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        ({"rows": 30}, "columns.Fr: 20 values in the store, 30 in the file"),
        ({"seed": 2}, "seed: 1 in the store, 2 in the file"),
        ({"tolerances": SPREAD | {"Fr": 0.03}}, "columns.Fr: 20 of 20 values differ"),
        ({"problem": replace(DRAWN.problem, fixed={**DRAWN.problem.fixed, "mu": 0.2})}, "problem.fixed.mu: 0.1"),
    ],
    ids=lambda given: next(iter(given)) if isinstance(given, dict) else "is",
)
def test_a_changed_study_is_refused_before_its_design_is_solved(drawn, changed, line, monkeypatch):
    monkeypatch.setattr(SOLVES, "solve", lambda *_, **__: pytest.fail("a design was solved"))
    with pytest.raises(InputError) as refused:
        run_study(replace(DRAWN, **changed), drawn)
    assert line in str(refused.value)
    assert ("30 in the file" in str(refused.value)) == ("rows" in changed)
    assert "--fresh" in str(refused.value)


@pytest.mark.slow
def test_a_study_whose_design_alone_may_have_changed_is_solved_and_goes_on_where_it_has_not(drawn):
    narrower = replace(DRAWN.problem, free={**DRAWN.problem.free, "chi_B": (1.5, 5.0)})
    assert run_study(DRAWN, drawn).solved == 0
    with pytest.raises(InputError, match=r"problem\.fixed\.chi_B"):
        run_study(replace(DRAWN, problem=narrower), drawn)
    assert run_study(replace(DRAWN, seed=2), drawn, fresh=True).solved == 20


def test_the_columns_of_a_study_are_those_of_its_file_whatever_is_drawn(tmp_path):
    """At tilts of either sign, designs on and off the weave boundary, feasible or not, other laws and limits apply."""
    heads = set()
    for seed, chi_H in ((1, 1.0), (2, 1.0), (3, 1.1)):
        problem = replace(DRAWN.problem, fixed={**DRAWN.problem.fixed, "chi_H": chi_H}, constraints={"slow": "Fr <= 9"})
        wide = {"chi_B": 0.3, "lambda_s": 0.4, "Fr": 1.5}
        results = run_study(
            Sampling(problem, 3, seed, tolerances=wide) if seed < 3 else over_grid(problem, {"mu": [1]})
        )
        heads.add(tuple(name for name in results.to_frame() if name.startswith(("law.", "violation."))))
        results.export(tmp_path / f"{seed}.csv")
        written = (tmp_path / f"{seed}.csv").read_text().splitlines()[0]
        assert "law.frm," in written
        assert "violation.slow," in written
        for row in results.rows:
            assert {f"law.{name}" for name in row.laws} <= set(results.to_frame())
    assert len(heads) == 1


def test_laws_have_the_names_of_their_columns():
    design = solve(DRAWN.problem)
    assert tuple(row.name for row in law_rows(design)) == LAWS
