"""Optima over the designs with a pattern of matrices: the EP2 of a dimer lies at k = |g1 − g2|/2 and d = 0."""

import pytest

import tmsopt

FREE = {"d": (-1, 1), "k": (0.1, 2), "g1": (0, 3), "g2": (0, 0.7)}


def dimer(others=0):
    """Two lossy modes, and others that are coupled to nothing, too many for a polynomial."""
    n = 2 + others
    H = [[f"{i} - 0.1j*{i}" if i == j else 0 for j in range(n)] for i in range(n)]
    H[0][:2], H[1][:2] = ["d - 1j*g1", "k"], ["k", "-1j*g2"]
    return tmsopt.models.from_hamiltonian(H)


@pytest.mark.parametrize("others", [0, 6])
@pytest.mark.parametrize(
    ("asked", "expected", "active"),
    [
        # (g1 − g2)/2 − (g1 − 1)²/10 rises by 1/2 − (g1 − 1)/5 = 0.1 in g1 at its limit 3, and by −1/2 in g2
        ({"maximize": "k - 0.1*(g1-1)**2"}, {"k": 1.5, "g1": 3.0, "g2": 0.0}, {"g1.max": 0.1, "g2.min": 0.5}),
        # on g2 = c − g1 the sum falls to g1 = 2 and then rises; with c it grows by 1 − 1/2
        (
            {"minimize": "abs(g1-2) + abs(g2-0.3) + k", "constraints": {"c": "g1 + g2 == 2.5"}},
            {"k": 0.75, "g1": 2.0, "g2": 0.5},
            {"c": 0.5},
        ),
    ],
)
def test_the_best_exceptional_point(others, asked, expected, active):
    found = tmsopt.solve(tmsopt.Problem(dimer(others), free=FREE, locate="EP2", **asked))
    assert found.formulation == "chains"
    assert dict(found.parameters) == pytest.approx({"d": 0.0, **expected}, abs=1e-9)
    assert dict(found.active) == pytest.approx(active, abs=1e-7)


def test_the_nearest_exceptional_point_within_an_active_limit():
    """The start (k, g1) = (1, 1.2) with g2 = 0 is nearest to the line k = g1/2 beyond the limit k >= 0.9."""
    free, start = {"d": (-1, 1), "k": (0.1, 2), "g1": (0, 3)}, {"d": 0.0, "k": 0.7, "g1": 1.2}
    problem = tmsopt.Problem(
        dimer(), fixed={"g2": 0.0}, free=free, start=start, locate="EP2", constraints={"c": "k >= 0.9"}
    )
    assert dict(tmsopt.solve(problem).parameters) == pytest.approx({"g2": 0.0, "d": 0.0, "k": 0.9, "g1": 1.8}, abs=1e-9)
