"""The page of a complex H, run by Node: its eigenfrequencies, its words, and the file that it saves."""

import math

import numpy as np
import pytest
from helpers.javascript import said_by
from helpers.places import PROBLEMS

import tmsopt
from tmsopt.explorer import page_of
from tmsopt.models import from_hamiltonian

ASK = "{get: window.tmsopt.get(), texts: rootTexts(drawingOf()), verdict: verdictOf(drawingOf()), saved: problemText()}"
RING = [["-0.9j", "r", "l"], ["l", "-0.9j", "r"], ["r", "l", "-0.9j"]]
CASES = (
    ([["d - 1j", "k"], ["k", "-0.2j"]], {"d": 0.0, "k": 0.4}, ["−0.6i (2-fold)"], "stable"),
    ([["w + 1j*g", 1], [1, "w - 1j*g"]], {"w": 5.0, "g": 1.0}, ["5 (2-fold)"], "growing"),
    ([["w + 1j*g", 1], [1, "w - 1j*g"]], {"w": 5.0, "g": 0.6}, ["5.8", "4.2"], "marginally stable"),
    ([["w - 0.1j", 0], [0, "2 + 0.3j"]], {"w": -200.0}, ["2 + 0.3i", "−200 − 0.1i"], "gain"),
    (RING, {"r": 1.2, "l": 0.4}, ["−0.8 − 0.20718i", "1.6 − 0.9i", "−0.8 − 1.5928i"], "stable"),
)
"""H, a design, ω by a quadratic or by discrete waves, r e^(iq) + l e^(−iq) − 0.9i, the greatest Im ω first."""


@pytest.mark.parametrize(("H", "design", "texts", "kind"), CASES)
def test_it_shows_eigenfrequencies(H, design, texts, kind, tmp_path):
    """At the design that it was given and at one that it computes itself, and in the file that it saves."""
    solution = tmsopt.solve(tmsopt.Problem(from_hamiltonian(H), fixed=design))
    html = page_of(solution)
    elsewhere = f"(change({{x: [[0, state.x[0] + 1]]}}), change({{x: [[0, {next(iter(design.values()))}]]}}), {ASK})"
    for asked in (ASK, elsewhere, f"(DATA.designs = [], {ASK})"):
        said = said_by(html, asked)
        assert sorted(said["texts"]) == sorted(texts)
        # Without a solved design nobody has counted eigenvectors.
        assert said["get"]["kind"] == (kind.replace("growing", "marginal") if "DATA" in asked else kind)
        omega = np.array(said["get"]["eigenfrequencies"]) @ [1, 1j]
        assert np.allclose(-1j * omega, np.array(said["get"]["roots"]) @ [1, 1j])
    saved = tmp_path / "saved.toml"
    saved.write_text(said["saved"], encoding="utf-8")
    again = tmsopt.solve(saved)
    assert (again.structure, again.stable) == (solution.structure, solution.stable)
    assert again.eigenfrequencies == solution.eigenfrequencies


@pytest.mark.parametrize(
    ("name", "omega"),
    [("pt_trimer", 0), pytest.param("bose_hubbard", 0, marks=pytest.mark.slow), ("loss_only_dimer", -0.6j)],
)
def test_a_file_saved_at_an_exceptional_point_solves_to_it(name, omega, tmp_path):
    """The numbers of the file are rounded, and the carrier is that of a point; the EP is still recognised."""
    solution = tmsopt.solve(PROBLEMS / f"{name}.toml")
    said = said_by(page_of(solution), ASK)
    saved = tmp_path / "saved.toml"
    saved.write_text(said["saved"], encoding="utf-8")
    again = tmsopt.solve(saved)
    assert again.structure == solution.structure
    (z,) = again.eigenfrequencies
    assert abs(complex(z.re, z.im) - omega) < 1e-12
    assert (again.stable, said["get"]["abscissa"] < 0) == (solution.stable, solution.stable)
    assert not {"weave", "carrier", "roots"} & set(" ".join(said["verdict"]).replace(":", "").split())


def test_a_size_below_what_files_take_is_0(tmp_path):
    pair = from_hamiltonian([["a - 1j", 1], [1, "b - 1j"]])
    text = said_by(page_of(tmsopt.Problem(pair, fixed={"a": 1.0, "b": 2.0})), "(state.x[0] = -1e-62, problemText())")
    (tmp_path / "saved.toml").write_text(text, encoding="utf-8")
    assert dict(tmsopt.load(tmp_path / "saved.toml").fixed) == {"a": 0.0, "b": 2.0}


def test_the_plane_is_around_the_frequencies():
    """A path of size 1e-14 about an EP at 0 is no picture of it, nor is one of 200 about frequencies 1 apart."""
    solution = tmsopt.solve(PROBLEMS / "pt_trimer.toml")
    reach = said_by(page_of(solution), "planeReach([[0, 0, 3]], [{re: 1, im: 1}, {re: -1, im: 0.5}], null).reach")
    assert reach["right"] - reach["left"] > 0.5
    assert math.isfinite(reach["top"])
