"""What a page is about, read from the page itself: designs, ranges, curves, the file that it saves, and its text as text."""

import json
import math
import re
import tomllib
import webbrowser
from dataclasses import replace

import numpy as np
import pytest
from helpers.places import PROBLEMS

import tmsopt
from tmsopt import laws
from tmsopt.explorer import page_of
from tmsopt.roots import hurwitz_minors

PLAIN = [p for p in sorted(PROBLEMS.glob("*.toml")) if not p.name.startswith("study_")]
HOSTILE = "</script><script>alert(1)</script>&<b>"


def data_of(html):
    """What the page says of itself."""
    found = re.search(r"^const DATA = (.*);$", html, re.MULTILINE)
    return json.loads(found[1])


def design(data, name):
    known = next(d for d in data["designs"] if d["name"] == name)
    return dict(zip((p["name"] for p in data["parameters"]), known["values"], strict=True)), known


@pytest.fixture(scope="module")
def ep4():
    return tmsopt.explore(PROBLEMS / "ep4.toml")


def test_it_opens_at_the_optimum(ep4):
    data = data_of(ep4.html)
    values, optimum = design(data, "optimum")
    assert values == dict(ep4.solution.parameters)
    assert data["start"] == optimum["values"]
    point = laws.ep4_chi_H_1(values["zeta_B"], values["zeta_H"])
    assert values["lambda_s"] == pytest.approx(float(point.lambda_s), abs=1e-12)
    ((re, im, times),) = optimum["roots"]
    assert (re, im, times) == (pytest.approx(float(point.omega0), abs=1e-12), 0, 4)
    assert any(fact.startswith("proof: ") for fact in optimum["facts"])


def test_its_curves_are_the_boundaries(ep4):
    data = data_of(ep4.html)
    names = [p["name"] for p in data["parameters"]]
    held = dict(zip(names, data["start"], strict=True))
    found = [c for c in data["curves"] if c["kind"] == "weave"]
    assert found
    for curve in found:
        i, j = curve["axes"]
        held |= {names[i]: np.array(curve["x"]), names[j]: np.array(curve["y"])}
        minors = hurwitz_minors(tmsopt.models.tms.coefficients(held))
        beside = hurwitz_minors(tmsopt.models.tms.coefficients(held | {names[i]: 1.01 * np.array(curve["x"])}))
        assert np.all(
            np.abs(minors[2]) < 5e-2 * np.abs(beside[2])
        )  # five digits, of which the tangent of 80 degrees takes one


def test_the_benchmark_is_the_published_one(ep4):
    values, known = design(data_of(ep4.html), "benchmark")
    bench = laws.bench
    assert values["chi_B"] == pytest.approx(bench["x_B"] / bench["w"])
    assert values["mu"] == pytest.approx(bench["m_H"] / bench["m_B"])
    assert values["lambda_s"] == pytest.approx(bench["lambda_s"])
    assert "pair" in known["structure"]


def test_an_exceptional_point_is_found_beside_an_optimum_that_is_none():
    page = tmsopt.explore(PROBLEMS / "least_speed.toml")
    data = data_of(page.html)
    values, known = design(data, "EP4")
    a = tmsopt.models.tms.coefficients(values)
    r = known["roots"][0][0]
    assert [c / a[0] for c in a] == pytest.approx([math.comb(4, k) * (-r) ** k for k in range(5)], rel=1e-11)
    assert design(data, "optimum")[1]["structure"] != known["structure"]


@pytest.mark.parametrize("path", PLAIN, ids=lambda p: p.stem)
@pytest.mark.slow
def test_what_it_saves_is_the_same_system_and_sliders_reach_what_is_possible(path, tmp_path):
    problem = tmsopt.load(path)
    data = data_of(page_of(problem))
    values = {p["name"]: p["value"] for p in data["parameters"]}
    for p in data["parameters"]:
        assert p["low"] < p["high"]
        assert p["low"] <= p["value"] <= p["high"]
        possible = problem.posed.parameter_set[p["name"]].range
        low, high = problem.free.get(p["name"], (p["low"], p["high"]))
        assert possible.lower <= low == p["low"]
        assert p["high"] == high <= possible.upper
        assert p["one"] > 0
    lines = "".join(f"{p['name']} = {p['text']}\n" for p in data["parameters"])
    saved = tmp_path / "saved.toml"
    saved.write_text(data["toml"]["before"] + lines + data["toml"]["after"])
    again = tmsopt.load(saved)
    assert again.title == problem.title
    assert again.constraints == problem.constraints
    assert dict(again.fixed) == values
    assert again.model.statement == problem.model.statement
    if not problem.model.is_complex:  # which that of a complex system chooses for its ranges
        assert [*map(float, again.posed.values(values).coefficients)] == [
            *map(float, problem.posed.values(values).coefficients)
        ]


def test_a_front_is_left_for_its_first_objective():
    page = tmsopt.explore(PROBLEMS / "pareto.toml")
    asked = tmsopt.load(PROBLEMS / "pareto.toml").pareto
    assert data_of(page.html)["objective"] == f"minimize {asked[0]}"


def test_a_problem_that_asks_nothing_opens_in_the_middle():
    page = tmsopt.explore(PROBLEMS / "chart.toml")
    data = data_of(page.html)
    assert page.solution is None
    assert {p["name"]: p["value"] for p in data["parameters"] if p["free"]} == {
        name: (low + high) / 2 for name, (low, high) in page.problem.free.items()
    }
    assert data["shown"]


def test_titles_and_names_are_text():
    problem = replace(tmsopt.load(PROBLEMS / "chart.toml"), title=HOSTILE)
    page = tmsopt.explore(problem)
    assert "alert(1)" not in re.sub(r"^const DATA = .*;$|<title>.*?</title>", "", page.html, flags=re.MULTILINE)
    assert HOSTILE not in page.html
    assert data_of(page.html)["title"] == HOSTILE
    inside = page._repr_html_()
    assert inside.count("<") == 2  # an iframe, whose page is the text of an attribute
    assert 'sandbox="allow-scripts allow-downloads"' in inside


def test_it_is_saved_whole_under_a_name_of_a_page(ep4, tmp_path):
    ep4.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == ep4.html
    with pytest.raises(tmsopt.InputError, match="html"):
        ep4.save(tmp_path / "page.png")
    assert repr(ep4).startswith("Explorer(")


def test_a_solution_is_not_solved_again(ep4):
    again = tmsopt.explore(ep4.solution)
    assert again.solution is ep4.solution
    assert data_of(again.html)["designs"] == data_of(ep4.html)["designs"]


def test_the_command_writes_a_page_beside_you(tmp_path, monkeypatch, run):
    shown = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(webbrowser, "open", lambda url: bool(shown.append(url)) or True)
    assert run("explore", PROBLEMS / "chart.toml", "--open") == (0, "", "wrote chart.html\n")
    assert shown == [(tmp_path / "chart.html").as_uri()]
    assert data_of((tmp_path / "chart.html").read_text(encoding="utf-8"))["model"] == "tms"


def test_large_matrices_are_referred_to_another_command(tmp_path, run):
    rows = [["k" if abs(i - j) == 1 else f"{i + 1} - 1j" if i == j else 0 for j in range(7)] for i in range(7)]
    (tmp_path / "large.toml").write_text(f"[model]\nH = {rows}\n[parameters]\nk = {{min = 0, max = 1}}\n")
    status, _, err = run("explore", tmp_path / "large.toml")
    assert (status, "complex H and A up to 6 × 6" in err, "tmsopt sheets" in err) == (2, True, True)


def test_the_file_of_a_stated_model_is_kept_as_typed():
    page = tmsopt.explore(PROBLEMS / "coupled_pair.toml")
    typed = tomllib.loads((PROBLEMS / "coupled_pair.toml").read_text(encoding="utf-8"))["model"]
    assert tomllib.loads(data_of(page.html)["toml"]["before"])["model"] == typed


def test_a_limit_that_the_page_cannot_compute_is_named():
    problem = tmsopt.load(PROBLEMS / "benchmark.toml")
    page = page_of(
        replace(problem, constraints={"wide": "radius >= 0.9", "front": "load_front >= 0"}, weights={"v": 1.0})
    )
    data = data_of(page)
    assert ([c["name"] for c in data["constraints"]], data["others"]) == (["front"], ["wide"])
    assert tomllib.loads(data["toml"]["after"])["weights"] == {"v": 1.0}


def test_of_bands_the_page_shows_the_nominal_case_and_says_so():
    data = data_of(page_of(tmsopt.load(PROBLEMS / "speed_band.toml")))
    assert data["nominal"]
    assert "left out" in data["toml"]["before"]
    assert all(not known["proved"] for known in data["designs"])
