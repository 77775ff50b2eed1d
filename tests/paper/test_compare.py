"""Comparison with the laws: agreement where they apply, and the reason where they do not."""

import math
from dataclasses import replace

import pytest
from helpers.oracles import abscissa_60, polynomial_60
from matplotlib.figure import Figure

import tmsopt
from tmsopt import laws
from tmsopt.dynamics import growth
from tmsopt.plots import draw_frequencies, draw_growth, growth_figure, save


@pytest.fixture(scope="module")
def ep4():
    return tmsopt.solve(tmsopt.load("problems/ep4.toml"))


@pytest.fixture(scope="module")
def benchmark():
    return tmsopt.solve(tmsopt.load("problems/benchmark.toml"))


def test_every_applicable_law_agrees_at_ep4(ep4):
    comparison = tmsopt.compare(ep4)
    rows = {row.label: row for row in comparison.laws}
    agreeing = "w0 4poly chib a2 w01 chib1 tls frep4 epset lscf flus Frc1 frm"
    assert {r.label for r in comparison.laws if r.agrees} >= {*agreeing.split()}
    assert not [r for r in comparison.laws if r.agrees is False]
    assert all(abs(r.relative) < 1e-12 for r in comparison.laws if r.applies)
    assert rows["tls"].law == pytest.approx(15 / 4 - 75 * math.sqrt(2) / 32, rel=1e-14)  # printed radical
    assert comparison.other.formulation == "matching"
    assert max(map(abs, comparison.differences.values())) < 1e-12


def test_laws_for_chi_H_1_do_not_apply_elsewhere():
    comparison = tmsopt.compare(tmsopt.load("problems/optimised_benchmark.toml"))
    rows = {(row.label, row.subject): row for row in comparison.laws}
    special = [row for (label, _), row in rows.items() if label in ("w01", "chib1", "tls", "frep4", "epset", "Frc1")]
    assert len(special) == 6
    assert all("chi_H = 1.02" in row.reason and row.agrees is None for row in special)
    general = [row for (label, _), row in rows.items() if label in ("w0", "chib", "a1a3, a2, w0", "flus")]
    assert len(general) == 6
    assert all(row.agrees for row in general)
    assert comparison.other.formulation == "abscissa"


@pytest.mark.slow
def test_binding_constraint_is_the_reason_why_a_law_does_not_apply():
    problem = replace(tmsopt.load("problems/ep4.toml"), constraints={"tilt": "lambda_s <= 0.3"})
    comparison = tmsopt.compare(problem)
    chib = next(row for row in comparison.laws if row.label == "chib")
    assert chib.agrees is None
    assert "tilt" in chib.reason


def test_a_wrong_number_is_told_from_the_law(ep4):
    """The comparison must be able to fail: a design a millionth off the law differs from it."""
    wrong = replace(ep4, dimensionless={**ep4.dimensionless, "chi_B": ep4.dimensionless["chi_B"] * (1 + 1e-6)})
    rows = {row.label: row for row in tmsopt.compare(wrong).laws}
    assert rows["chib"].agrees is False
    assert rows["chib1"].relative == pytest.approx(1e-6, rel=1e-6)


def test_evaluation_has_no_other_formulation(benchmark):
    comparison = tmsopt.compare(benchmark)
    assert comparison.other is None
    assert comparison.reason == "nothing is free"
    flus = next(row for row in comparison.laws if row.label == "flus")
    assert flus.agrees
    assert flus.numeric == pytest.approx(0.90706414955081164, rel=1e-14)


# Growth over speed


def test_growth_bands_of_the_benchmark_begin_at_the_critical_speed(benchmark):
    data = growth(benchmark, over="Fr")
    assert len(data.stable) == 1
    assert data.stable[0][0] == pytest.approx(0.90706414955081164, rel=1e-12)
    assert data.stable[0][1] == data.values[-1]
    assert data.critical == pytest.approx(0.90706414955081164, rel=1e-14)


def test_growth_roots_are_those_of_the_stored_design(benchmark):
    data = growth(benchmark, over="Fr")
    for k in range(0, len(data.values), 211):
        p = {**benchmark.dimensionless, "Fr": float(data.values[k])}
        assert data.roots[k].real.max() == pytest.approx(float(abscissa_60(polynomial_60(**p))), rel=1e-9, abs=1e-11)


def test_heavily_damped_band_ends_on_the_ep_set():
    """At χ_B = √2 and a tilt below EP4, heavy damping ends where two double roots meet: 2EP2 (equation epset)."""
    tilt = math.atan(15 / 4 - 75 * math.sqrt(2) / 32) - 0.05  # Table 1, second row
    fixed = {"Fr": 2.2, "mu": 1.0, "chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2}
    problem = tmsopt.Problem(tmsopt.models.tms, fixed={**fixed, "chi_B": math.sqrt(2), "lambda_s": tilt})
    data = growth(tmsopt.solve(problem))
    assert len(data.heavily_damped) == 1
    assert data.heavily_damped[0][1] == pytest.approx(float(laws.epset(-0.4, -0.2, tilt)), rel=1e-12)
    assert data.stable[0][0] == pytest.approx(float(laws.Fr_c(1.0, math.sqrt(2), 1.0, -0.4, -0.2, tilt)), rel=1e-12)


@pytest.mark.slow
def test_figures_draw_the_data(ep4, tmp_path):
    data = growth(ep4)
    upper, lower = Figure().subplots(2, 1)
    draw_growth(data, upper)
    draw_frequencies(data, lower)
    labels = [text.get_text() for text in upper.get_legend().get_texts()]
    assert "weave at 1.593" in labels  # sqrt(30 sqrt(2) + 120)/8, Table 1
    assert "design at 2.236 (EP4)" in labels
    assert "stable" in labels
    path = tmp_path / "x.png"
    save(growth_figure(data, "title", 3.13), path)
    assert path.stat().st_size > 20_000
    assert [p.name for p in tmp_path.iterdir()] == ["x.png"]
