"""The layers of the Petermann factor and of the phase rigidity against closed forms, and their picture."""

import numpy as np
import pytest
from matplotlib.colors import LogNorm

import tmsopt
from tmsopt.charts import chart, plan_survey
from tmsopt.models import from_coefficients, from_hamiltonian, from_matrices
from tmsopt.problem import Problem

LAYERS = ("petermann", "phase_rigidity")
DIMER = Problem(
    from_hamiltonian([["d - 1j*g1", "k"], ["k", "-1j*g2"]]),
    fixed={"g1": 1.0, "g2": 0.2},
    free={"d": (-1, 1), "k": (0.05, 2)},
)


def charted(problem, points, layers=LAYERS):
    return chart(problem, points=points, layers=layers, boundaries=False)


def test_two_lossy_modes():
    """K = (1 + (|a|² + k²)/|a² + k²|)/2 for H₀ = [[a, k], [k, −a]], a = (d − i (g1 − g2))/2."""
    found = charted(DIMER, (11, 8))
    d, k = np.meshgrid(*found.grid)
    a = (d - 0.8j) / 2
    wanted = (1 + (abs(a) ** 2 + k**2) / abs(a**2 + k**2)) / 2
    assert found.petermann == pytest.approx(wanted, rel=1e-11)
    assert found.phase_rigidity == pytest.approx(wanted**-0.5, rel=1e-11)
    assert found.shares == {}


SWINGS = {
    "matrices": from_matrices(M=[["m"]], D=[["c"]], K=[["k"]]),
    "states": from_matrices(A=[[0, 1], ["-k/m", "-c/m"]]),
    "coefficients": from_coefficients(["m", "c", "k"]),
}


@pytest.mark.parametrize("stated", SWINGS)
def test_one_oscillator(stated):
    """K = 1 + (‖A‖² − |s₁|² − |s₂|²)/|s₁ − s₂|² for every 2 × 2 matrix, of the state (q, q′) if none is stated."""
    m = 0.5
    found = charted(Problem(SWINGS[stated], fixed={"m": m}, free={"c": (-1, 2.5), "k": (-1.1, 2)}), (9, 14))
    c, k = (x / m for x in np.meshgrid(*found.grid))
    s = np.stack([(-c + sign * np.sqrt(c**2 - 4 * k + 0j)) / 2 for sign in (1, -1)])
    wanted = 1 + (1 + k**2 + c**2 - (abs(s) ** 2).sum(axis=0)) / abs(s[0] - s[1]) ** 2
    assert found.petermann == pytest.approx(wanted, rel=1e-10)


def test_identical_oscillators_do_not_merge():
    """Two equal eigenvalues with two eigenvectors: K is that of one oscillator, on the whole line of equal stiffness."""
    c = 0.2
    model = from_matrices(M=[[1, 0], [0, 1]], D=[["c", 0], [0, "c"]], K=[["k1", 0], [0, "k2"]])
    found = charted(Problem(model, fixed={"c": c}, free={"k1": (1, 3), "k2": (1, 3)}), (5, 5))
    single = charted(Problem(SWINGS["matrices"], fixed={"m": 1.0}, free={"c": (c, 2 * c), "k": (1, 3)}), (2, 5))
    line = single.petermann[:, 0]
    assert found.petermann == pytest.approx(np.maximum(*np.meshgrid(line, line)), rel=1e-10)


def test_an_exceptional_point_of_the_grid_and_one_without_mass():
    """(s + 1)² in double precision, and a mass that vanishes at one end of the grid."""
    found = charted(Problem(SWINGS["matrices"], fixed={"k": 1.0}, free={"m": (0, 2), "c": (0, 4)}), (3, 3))
    assert np.isnan(found.petermann[:, 0]).all()
    assert np.isfinite(found.petermann[:, 1:]).all()
    assert found.petermann[1, 1] > 1e12
    assert found.phase_rigidity[1, 1] < 1e-6


def test_coefficients_are_computed_only_for_layers_that_need_them():
    names = set(DIMER.posed.model.coefficient_names())
    assert not names & set(plan_survey(DIMER, layers=LAYERS).formulas.names)
    assert names <= set(plan_survey(DIMER, layers=("kind",)).formulas.names)


def test_the_scale_is_logarithmic_and_begins_at_one():
    picture = tmsopt.plots.draw_chart(charted(DIMER, (30, 20)), layer="petermann").collections[0]
    assert isinstance(picture.norm, LogNorm)
    assert picture.norm.vmin == 1
    normal = Problem(from_hamiltonian([["d", "k"], ["k", "-d"]]), free={"d": (1, 2), "k": (1, 2)})  # a Hermitian H
    found = charted(normal, (4, 4))
    assert found.petermann == pytest.approx(np.ones((4, 4)), rel=1e-14)
    assert tmsopt.plots.draw_chart(found, layer="petermann").collections[0].norm.vmax == 10


@pytest.mark.parametrize("axes", [2, 3])
def test_the_command_draws_the_layer(axes, tmp_path, run):
    gain = "{ min = 0.1, max = 0.3 }" if axes == 3 else "0.2"
    file, figure = tmp_path / "dimer.toml", tmp_path / "petermann.png"
    file.write_text(f"""
[model]
H = [["d - 1j*g1", "k"], ["k", "-1j*g2"]]
[parameters]
g1 = 1.0
g2 = {gain}
d = {{ min = -1, max = 1 }}
k = {{ min = 0.05, max = 2 }}
""")
    options = ("--points", 12, "--layer", "petermann", "--plot", figure, *(("--slice", "g2=0.2") if axes == 3 else ()))
    assert run("chart", file, *options)[::2] == (0, f"wrote {figure}\n")
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_the_command_writes_the_arrays(tmp_path, run):
    arrays = tmp_path / "plane.npz"
    words = (
        "chart",
        "problems/chart.toml",
        "--points",
        "9x7",
        "--layers",
        "petermann",
        "--output",
        arrays,
        "--no-boundaries",
    )
    assert run(*words)[0] == 0
    assert np.array_equal(np.load(arrays)["petermann"], charted("problems/chart.toml", (9, 7)).petermann)
