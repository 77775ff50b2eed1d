"""The tables of docs/how_to/real_bicycles.md, recomputed by NumPy from the matrices of Meijaard et al. (2007), appendix A.

Nothing of tmsopt has a part in it but the reading of the files.
"""

import math

import numpy as np
import pytest
from helpers.bicycles import abscissa
from helpers.places import ROOT

import tmsopt

PAGE = (ROOT / "docs/how_to/real_bicycles.md").read_text(encoding="utf-8")
DECAY = -0.01  # 1/s, as the page asks


def table(head):
    """Rows of a table of the page by their first cell."""
    lines = PAGE[PAGE.index(head) :].partition("\n\n")[0].splitlines()[2:]
    return {cells[0]: cells[1:] for cells in ([c.strip() for c in line.strip("|").split("|")] for line in lines)}


CHANGES, GAINS = table("| bicycle | self-stable"), table("| bicycle | norm at 4 m/s")
NAMES = list(CHANGES)


def bicycle(name):
    return tmsopt.read_bicycle(ROOT / f"problems/bicycles/{name}.txt").parameters


def test_the_tables_have_every_bicycle():
    assert set(NAMES) == set(GAINS) == {p.stem for p in (ROOT / "problems/bicycles").glob("*.txt")}


def test_what_is_published_of_speeds():
    """Meijaard et al. (2007), Kooijman et al. (2008), and section 4.1 of Moore, Hubbard and Hess (2016)."""
    assert CHANGES["benchmark"][0] == "4.29 to 6.02"
    assert CHANGES["silver"][0] == "3.99 to 7.90"  # 4.0 and 7.9 m/s in the paper
    assert [n for n in NAMES if CHANGES[n][0] == "nowhere"] == ["optimal-4", "optimal-5", "optimal-10"]
    assert all(abscissa(bicycle(f"optimal-{v}"), v) > 0 for v in (2, 4, 5, 6, 8, 10))


@pytest.mark.parametrize("name", NAMES)
def test_self_stable_speeds(name):
    """Eigenvalues at 4000 speeds up to 20 m/s; limits are rounded to 0.01 m/s."""
    written = CHANGES[name][0]
    speeds = np.linspace(0.005, 19.995, 4000)
    if written == "nowhere":
        low = high = 0.0
    elif written.startswith("from"):
        low, high = float(written.split()[1]), math.inf
    else:
        low, high = map(float, written.split(" to "))
    clear = (np.abs(speeds - low) > 0.0051) & (np.abs(speeds - high) > 0.0051)
    stable = abscissa(bicycle(name), speeds) < 0
    assert (stable == ((speeds > low) & (speeds < high)))[clear].all()


def changed(own, x):
    """The design a change away: trail and wheelbase by the wheelbase, tilt in rad, I_Fyy by itself."""
    more = {"c": own["c"] + x[..., 0] * own["w"], "w": own["w"] * (1 + x[..., 1])}
    return {**own, **more, "lambda_s": own["lambda_s"] + x[..., 2], "I_Fyy": own["I_Fyy"] * (1 + x[..., 3])}


def shorter(x, size, seed=0):
    """40000 rows that are 2 % smaller than that, half of them near x."""
    way = np.random.default_rng(seed).normal(size=(40000, 4))
    way[::2] = x / np.linalg.norm(x) + 0.1 * way[::2]
    return 0.98 * size * way / np.linalg.norm(way, axis=1)[:, None]


@pytest.mark.parametrize("name", [n for n in NAMES if CHANGES[n][1] not in ("0", "none")])
@pytest.mark.slow
def test_the_change_is_enough_and_no_smaller_one_is(name):
    """Rounding moves the abscissa by up to 0.012 (optimal-2)."""
    own = bicycle(name)
    size, trail, base, tilt, spin = (float(cell.rstrip(" %")) for cell in CHANGES[name][1:])
    x = np.array([trail / 1e3 / own["w"], base / 1e3 / own["w"], math.radians(tilt), spin / 100])
    assert np.linalg.norm(x) == pytest.approx(size / 100, abs=6e-5)
    assert abscissa(changed(own, x), 4.0) == pytest.approx(DECAY, abs=0.013)
    assert abscissa(own, 4.0) > DECAY
    nearer = shorter(x, size / 100)
    hoop = own["I_Fyy"] * (1 + nearer[:, 3]) <= max(own["I_Fyy"], 2 * own["I_Fxx"])
    assert (abscissa(changed(own, nearer), 4.0) > DECAY)[hoop].all()


@pytest.mark.parametrize("name", [n for n in NAMES if CHANGES[n][1] == "0"])
def test_what_needs_no_change_needs_no_gains(name):
    assert abscissa(bicycle(name), 4.0) <= DECAY
    assert GAINS[name][0] == "0"


@pytest.mark.parametrize("name", [n for n in NAMES if GAINS[n][0] != "0"])
@pytest.mark.slow
def test_the_gains_are_enough_and_no_smaller_ones_are(name):
    """At 3 m/s only the norm is printed, of gains that are not far from those at 4 m/s."""
    own, gains = bicycle(name), np.array([float(cell) for cell in GAINS[name][1:5]])
    assert np.linalg.norm(gains) == pytest.approx(float(GAINS[name][0]), abs=1.5e-3)
    assert abscissa(own, 4.0, gains) == pytest.approx(DECAY, abs=0.02)  # of gains with three digits
    for v, cell in ((4.0, GAINS[name][0]), (3.0, GAINS[name][5])):
        lost = abscissa(own, v, shorter(gains, float(cell))) > DECAY
        assert lost.all() if float(cell) else not lost.any()
