"""The tables of docs/how_to/real_bicycles.md, recomputed by NumPy from the matrices of Meijaard et al. (2007), appendix A.

Nothing of tmsopt has a part in it but the reading of the files.
"""

import math

import numpy as np
import pytest
from helpers.bicycles import abscissa, matrices
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


@pytest.mark.parametrize("name", [n for n in NAMES if CHANGES[n][1] not in ("0", "none")])
@pytest.mark.slow
def test_the_change_is_enough_and_no_smaller_one_is(name):
    """Of 40000 changes 2 % smaller, half of them near this one, none is. Rounding moves the abscissa by up to 0.012 (optimal-2)."""
    own = bicycle(name)
    size, trail, base, tilt, spin = (float(cell.rstrip(" %")) for cell in CHANGES[name][1:])
    x = np.array([trail / 1e3 / own["w"], base / 1e3 / own["w"], math.radians(tilt), spin / 100])
    assert np.linalg.norm(x) == pytest.approx(size / 100, abs=6e-5)
    assert abscissa(changed(own, x), 4.0) == pytest.approx(DECAY, abs=0.013)
    assert abscissa(own, 4.0) > DECAY
    draw = np.random.default_rng(0)
    way = draw.normal(size=(40000, 4))
    way[::2] = x / np.linalg.norm(x) + 0.1 * way[::2]
    nearer = 0.98 * size / 100 * way / np.linalg.norm(way, axis=1)[:, None]
    hoop = own["I_Fyy"] * (1 + nearer[:, 3]) <= max(own["I_Fyy"], 2 * own["I_Fxx"])
    assert (abscissa(changed(own, nearer), 4.0) > DECAY)[hoop].all()


@pytest.mark.parametrize("name", [n for n in NAMES if CHANGES[n][1] == "0"])
def test_what_needs_no_change_needs_no_gains(name):
    assert abscissa(bicycle(name), 4.0) <= DECAY
    assert GAINS[name][0] == "0"


def least_gains(own, v):
    """The least norm of gains with none beyond the edge and on it a real root, a pair DECAY ± iω, or both.

    Each is linear in the gains for an ω; then the least over ω, refined twice.
    """
    if abscissa(own, v) <= DECAY:
        return 0.0
    M, C1, gK0, K2 = matrices(own)

    def condition(s):
        A = M * s**2 + v * C1 * s + gK0 + v**2 * K2
        return np.array([-A[0, 1], -A[0, 1] * s, A[0, 0], A[0, 0] * s]), -np.linalg.det(A)

    def least(points):
        found = [condition(s) for s in points]
        rows = [part for row, _ in found for part in (row.real, row.imag) if part.any()]
        rights = [
            part for (row, right) in found for part, of in ((right.real, row.real), (right.imag, row.imag)) if of.any()
        ]
        return np.linalg.lstsq(np.array(rows), np.array(rights), rcond=None)[0]

    def norms(gains):
        """Infinite where they are not enough; three roots that meet part by the cube root of rounding, 1e-5."""
        return np.where(abscissa(own, v, gains) < DECAY + 1e-4, np.linalg.norm(gains, axis=-1), math.inf)

    edge = complex(DECAY)
    best = float(norms(least([edge])))
    for more in ([], [edge]):
        omegas = np.linspace(1e-3, 12, 1200)
        for _ in range(3):
            sizes = norms(np.array([least([edge + 1j * omega, *more]) for omega in omegas]))
            best, omega, step = min(best, sizes.min()), omegas[sizes.argmin()], omegas[1] - omegas[0]
            omegas = np.linspace(max(omega - step, 1e-3), omega + step, 41)
    return best


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.slow
def test_the_gains_are_the_least(name):
    for v, cell in ((4.0, GAINS[name][0]), (3.0, GAINS[name][5])):
        assert float(cell) == pytest.approx(least_gains(bicycle(name), v), abs=6e-4)
    if GAINS[name][0] != "0":
        gains = np.array([float(cell) for cell in GAINS[name][1:5]])
        assert np.linalg.norm(gains) == pytest.approx(float(GAINS[name][0]), abs=1.5e-3)
        assert abscissa(bicycle(name), 4.0, gains) == pytest.approx(DECAY, abs=0.02)  # of gains with three digits
