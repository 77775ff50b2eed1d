"""The public functions: a problem, its file and its solution are the same question, and what else is given is refused."""

import inspect
import math
import pickle
import re
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from helpers.places import PROBLEMS

import tmsopt
from tmsopt.studies import read_results

EP4, PLANE = PROBLEMS / "ep4.toml", PROBLEMS / "chart.toml"

ASKED = {
    "solve": lambda given: tmsopt.solve(given).parameters,
    "compare": lambda given: [row.numeric for row in tmsopt.compare(given).laws],
    "prove": lambda given: tmsopt.prove(given).parameters,
    "certify": lambda given: tmsopt.certify(given, seconds=20).bound,
    "speeds": lambda given: tmsopt.speeds(given).found,
    "explain": lambda given: tmsopt.explain(given).summary,
    "optimality": lambda given: tmsopt.optimality(given).verdict,
    "diagnose": tmsopt.diagnose,
    "eigenvalues": tmsopt.eigenvalues,
    "growth": lambda given: tmsopt.growth(given).stable,
    "simulate": lambda given: tmsopt.simulate(given, lean=5).columns,
}
"""Verbs about a design: a problem is solved first."""

DRAWN = {
    "chart": lambda given: tmsopt.chart(given, points=(12, 9), boundaries=False).kind.tolist(),
    "trace": lambda given: len(tmsopt.trace(given, "capsize", starts=4).branches),
    "encircle": lambda given: tmsopt.encircle(given, 1e-3, starts=0).permutation,
    "sheets": lambda given: tmsopt.sheets(given, grid=(3, 3)).values.tolist(),
    "domain": lambda given: tmsopt.domain(given, starts=4).to_json(),
}
"""Verbs about a box: nothing need be asked."""


@pytest.mark.long
@pytest.mark.parametrize("verb", ASKED)
def test_a_design_may_be_given_as_problem_file_or_solution(verb):
    if verb == "certify":
        pytest.importorskip("pyscipopt")
    asked = ASKED[verb]
    answer = asked(EP4)
    assert asked(str(EP4)) == answer
    assert asked(tmsopt.load(EP4)) == answer
    assert asked(tmsopt.solve(EP4)) == answer


@pytest.mark.parametrize("verb", DRAWN)
def test_a_box_may_be_given_as_problem_or_file(verb):
    assert DRAWN[verb](PLANE) == DRAWN[verb](tmsopt.load(PLANE))


@pytest.mark.parametrize("verb", [*ASKED, *DRAWN])
@pytest.mark.parametrize("wrong", [3, None, ["Fr"], b"problems/ep4.toml"], ids=repr)
def test_anything_else_is_refused_in_words(verb, wrong):
    if verb == "certify":
        pytest.importorskip("pyscipopt")
    with pytest.raises(tmsopt.InputError, match="accepted: a Problem, the path of a problem file, or a Solution"):
        (ASKED | DRAWN)[verb](wrong)


@pytest.mark.parametrize("reader", ["load", "load_study", "open_chart", "read_bicycle"])
@pytest.mark.parametrize("wrong", [3, None, ["Fr"], b"problems/ep4.toml"], ids=repr)
def test_what_is_no_path_is_refused_in_words(reader, wrong):
    with pytest.raises(tmsopt.InputError, match="accepted: the path of a"):
        getattr(tmsopt, reader)(wrong)


@pytest.mark.parametrize("wrong", [5, b"x"], ids=repr)
def test_what_is_no_file_to_write_is_refused_in_words(wrong):
    study = tmsopt.over_grid(tmsopt.load(EP4), {"mu": [0.1]})
    calls = [
        lambda: tmsopt.run_study(study, wrong),
        lambda: tmsopt.run_study(study, workers=1).export(wrong),
        lambda: tmsopt.chart(PLANE, points=(4, 4), folder=wrong),
    ]
    for call in calls:
        with pytest.raises(tmsopt.InputError, match=r"path: found .*; accepted: the path of"):
            call()


@pytest.mark.parametrize(
    ("name", "wrong"),
    [("starts", x) for x in (0, "5", 2.5, True, 10**30)] + [("seed", -1), ("seed", "a"), ("near", 5)],
)
def test_an_option_says_what_it_accepts(name, wrong):
    with pytest.raises(tmsopt.InputError, match=f"{name}: found .*accepted: a"):
        tmsopt.solve(EP4, **{name: wrong})  # type: ignore[arg-type]


def test_a_near_design_may_be_given_in_part():
    assert tmsopt.solve(EP4, near={"Fr": 2.0}).structure == "EP4"
    with pytest.raises(tmsopt.InputError, match=r"near: unknown parameter 'bogus'(.|\n)*near\.Fr: found nan"):
        tmsopt.solve(EP4, near={"bogus": 1.0, "Fr": math.nan})


@pytest.mark.slow
def test_whole_numbers_of_numpy_are_whole_numbers(tmp_path):
    assert tmsopt.solve(EP4, starts=np.int64(8), seed=np.int32(3)).structure == "EP4"
    assert tmsopt.prove(EP4, digits=np.int64(20)).proved
    study = replace(tmsopt.over_grid(tmsopt.load(EP4), {"mu": [0.1]}), starts=np.int64(8))
    assert tmsopt.run_study(study, tmp_path / "s.sqlite", workers=1).rows[0].structure == "EP4"


@pytest.mark.parametrize("name", ["ep4", "physical_machine", "chocolate"])
def test_a_solution_can_be_pickled(name):
    design = tmsopt.solve(PROBLEMS / f"{name}.toml")
    assert repr(pickle.loads(pickle.dumps(design))) == repr(design)  # a growth time that is nan equals nothing


def test_a_complete_store_is_read_without_its_engine(tmp_path):
    study = tmsopt.over_grid(tmsopt.load(EP4), {"mu": [0.1, 0.2]})
    rows = tmsopt.run_study(study, tmp_path / "s.sqlite", workers=1).rows
    again = tmsopt.run_study(study, tmp_path / "s.sqlite", scheduler="tcp://127.0.0.1:1")
    assert (again.rows, again.solved, again.found, again.engine) == (rows, 0, 2, "")
    assert read_results(study, tmp_path / "s.sqlite").rows == rows
    with pytest.raises(tmsopt.InputError, match="no such file"):
        read_results(study, tmp_path / "none.sqlite")


def test_parameters_of_a_design_must_be_numbers_and_all_there():
    problem = tmsopt.load(EP4)
    with pytest.raises(tmsopt.InputError, match=r"chi_B: missing(.|\n)*lambda_s: found 'steep'; accepted: a finite"):
        tmsopt.speeds({"Fr": 1.0, "lambda_s": "steep"}, problem=problem)  # type: ignore[dict-item]
    assert set(tmsopt.speeds({"chi_B": 1.4, "lambda_s": 0.4}, problem=EP4).parameters) == {
        *problem.fixed,
        "chi_B",
        "lambda_s",
    }
    own = {"chi_B": Fraction(45, 32), "lambda_s": np.float32(0.5)}  # the speed is what varies; any real numbers do
    doubles = {"Fr": 2.0, "chi_B": 1.40625, "lambda_s": 0.5}
    assert tmsopt.speeds(own, problem=EP4).found == tmsopt.speeds(doubles, problem=problem).found  # type: ignore[arg-type]


def test_a_file_must_ask_where_the_verb_needs_a_question():
    """At the line of the file where there is one."""
    assert not tmsopt.load(PLANE).minimize
    with pytest.raises(tmsopt.InputError, match=r"chart\.toml:\d+: .*no objective"):
        tmsopt.solve(PLANE)
    with pytest.raises(tmsopt.InputError, match="no objective"):
        tmsopt.solve(tmsopt.load(PLANE))
    with pytest.raises(tmsopt.InputError, match="asks for a front"):
        tmsopt.prove(PROBLEMS / "pareto.toml")


def test_what_arguments_and_results_are_made_of_is_public():
    with pytest.raises(tmsopt.InputError) as caught:
        tmsopt.load(PROBLEMS / "nothing.toml")
    assert all(isinstance(fault, tmsopt.Fault) for fault in caught.value.faults)
    assert all(isinstance(band, tmsopt.Band) for band in tmsopt.load(PROBLEMS / "speed_band.toml").scenarios.values())


WRONG = [
    (lambda: posed(constraints=["nu_H >= 0.02"]), r"constraints: found \['nu_H.*such as \{'trail': 'nu_H >= 0.02'\}"),
    (lambda: posed(constraints="nu_H >= 0.02"), r"constraints: found 'nu_H"),
    (lambda: posed(constraints={"trail": 3}), "constraints.trail: found 3; accepted: an expression in quotes"),
    (lambda: posed(fixed=5), "fixed: found 5; accepted: names with their values"),
    (lambda: posed(free={"Fr": 3}), "parameters.Fr: found 3; accepted: a pair"),
    (lambda: posed(free=[("Fr", 1, 2)]), "free: found"),
    (lambda: posed(free={1: (2, 3)}), "free: found"),
    (lambda: posed(start=["Fr"]), "start: found"),
    (lambda: posed(scenarios=3), "scenarios: found 3"),
    (lambda: posed(tolerances="Fr"), "tolerances: found 'Fr'"),
    (lambda: posed(weights=[0.1]), "weights: found"),
    (lambda: posed(title=3), "title: found 3; accepted: a text"),
    (lambda: posed(model="tms"), "model: found str; accepted: a model"),
    (lambda: tmsopt.solve("robot.toml"), "robot.toml: no such file"),
    (lambda: tmsopt.solve(EP4, starts=10.5), "starts: found 10.5; accepted: a whole number"),
    (lambda: tmsopt.solve(EP4, linear_solver=3), "linear_solver: found 3; accepted: mumps spral"),
    (lambda: tmsopt.solve(EP4, progress=3), "progress: found 3; accepted: a function"),
    (lambda: tmsopt.solve_all(EP4, seconds="long"), "seconds: found 'long'; accepted: a number"),
    (lambda: tmsopt.pareto(PROBLEMS / "pareto.toml", points=10.5), "points: found 10.5; accepted: a whole number"),
    (lambda: tmsopt.prove(EP4, exact=3), "exact: found 3; accepted: names"),
    (lambda: tmsopt.speeds(EP4, between=3), "between: found 3; accepted"),
    (lambda: tmsopt.speeds(EP4, 3), "parameter: unknown parameter '3'"),
    (lambda: tmsopt.growth(EP4, end="far"), "end: found 'far'; accepted: a number"),
    (lambda: tmsopt.trace(PLANE, "EP2", seed=10.5), "seed: found 10.5; accepted: a whole number"),
    (lambda: tmsopt.trace(PLANE, "EP2", through={"Fr": 1}), "through: found .*accepted: a list"),
    (lambda: tmsopt.trace(PLANE, "EP2", through=[3]), "through: found 3; accepted: names"),
    (lambda: tmsopt.chart(PLANE, layers="abscissa"), "layers: found 'abscissa'; accepted: a list"),
    (lambda: tmsopt.chart(PLANE, layers=[["kind"]]), "layers: found .*accepted: kind"),
    (lambda: tmsopt.chart(PLANE, axes=3), "axes: found 3; accepted: Fr and lambda_s"),
    (lambda: tmsopt.chart(PLANE, points=10.5), "points: found 10.5; accepted: two whole numbers"),
    (lambda: tmsopt.chart(PLANE, quantities="nu_H"), "quantities: found 'nu_H'; accepted: names"),
    (
        lambda: tmsopt.chart(PLANE, quantities={"trail": 3}),
        "quantities.trail: found 3; accepted: an expression in quotes",
    ),
    (lambda: tmsopt.encircle(EP4, "wide"), "radius: found 'wide'; accepted: a positive number"),
    (lambda: tmsopt.encircle(EP4, plane=3), "plane: found 3; accepted: two of"),
    (lambda: tmsopt.sheets(EP4, over="Fr"), "over: found 'Fr'; accepted: two of"),
    (lambda: tmsopt.sheets(EP4, grid=81), "grid: found 81; accepted: two whole numbers"),
    (lambda: tmsopt.nearest(EP4, ["weave"]), "pattern: unknown boundary"),
    (lambda: tmsopt.robustness(EP4, parameters=["Fr"]), "parameters: found"),
    (lambda: tmsopt.robustness(EP4, weights=3), "weights: found 3"),
    (lambda: tmsopt.over_grid(EP4, [0.1]), "axes: found"),
    (lambda: tmsopt.latin_hypercube([0.1], 5), "ranges: found"),
    (lambda: tmsopt.verify(only="lscf-1"), "only: found 'lscf-1'; accepted: a list"),
]


def posed(**changed):
    """The EP4 problem with some of its arguments changed."""
    return replace(tmsopt.load(EP4), **changed)


@pytest.mark.parametrize(("call", "said"), WRONG, ids=[said for _, said in WRONG])
def test_a_wrong_type_is_answered_in_words(call, said):
    with pytest.raises(tmsopt.InputError, match=said):
        call()


@pytest.mark.parametrize("verb", ["solve", "prove", "compare", "solve_all", "pareto"])
def test_the_options_of_a_verb_are_in_its_signature(verb):
    """With their defaults: what `help` and the completion of a notebook read."""
    parameters = inspect.signature(getattr(tmsopt, verb)).parameters
    assert {"starts", "seed", "linear_solver", "progress"} <= set(parameters)
    assert all(p.kind is not p.VAR_KEYWORD for p in parameters.values())
    assert inspect.signature(tmsopt.solve).parameters["stability"].default == 5


def test_help_begins_with_the_verbs():
    verbs = re.findall(r"^    (\w+)  .*tmsopt\.(\w+)\(", tmsopt.__doc__ or "", re.MULTILINE)
    assert len(verbs) == 8
    assert all(name == called and callable(getattr(tmsopt, name)) for name, called in verbs)


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="solves"):
        _ = tmsopt.solves  # type: ignore[attr-defined]


def test_names_are_functions_whatever_was_imported_before():
    """`tmsopt.search.solve` is a room and a function; the public name is the function, in any order of imports."""
    script = (
        "import tmsopt.search.solve, tmsopt.charts.chart; import tmsopt; assert callable(tmsopt.solve); tmsopt.chart"
    )
    subprocess.run([sys.executable, "-c", script], check=True, cwd=PROBLEMS.parent)


@pytest.mark.slow
def test_a_study_may_be_given_by_its_file(tmp_path):
    file = tmp_path / "two.toml"
    file.write_text(f'problem = "{EP4}"\n[vary]\nmu = [0.1, 0.2]\n')
    results = tmsopt.run_study(file, workers=1)
    same = pytest.approx(tmsopt.solve(EP4).abscissa, abs=1e-14)  # chi_H = 1: mu plays no part
    assert [row.abscissa for row in results.rows] == [same] * 2
    with pytest.raises(tmsopt.InputError, match="accepted: a Study"):
        tmsopt.run_study(3)  # type: ignore[arg-type]


def test_names_of_the_last_version_still_answer():
    """With a warning that names the new one."""
    branch = tmsopt.trace("problems/ep_set.toml", starts=4).branches[0]
    with pytest.warns(DeprecationWarning, match="pattern_unknowns"):
        assert branch.told == branch.pattern_unknowns
    pattern = tmsopt.roots.pattern("EP4", 4)
    with pytest.warns(DeprecationWarning, match="distinct_factors"):
        assert pattern.counted([-1.0]) == pattern.distinct_factors([-1.0])
    with pytest.warns(DeprecationWarning, match=r"call \.report\(\)"):
        assert tmsopt.report.trace_table(branch) == branch.report()
