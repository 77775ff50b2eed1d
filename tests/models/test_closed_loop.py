"""A stated system with a controller, B, C and G, against matrices closed by NumPy."""

import numpy as np
import pytest

import tmsopt

RNG = np.random.default_rng(22)
ENOUGH = 1e-12  # of coefficients: some hundred roundings of products near 1


def lists(matrix):
    return np.asarray(matrix).tolist()


def named(G):
    """The gains, the first of them as a parameter."""
    return [["k", *G[0, 1:].tolist()], *G[1:].tolist()]


def agree(model, G, expected):
    found = model.coefficients({"k": float(G[0, 0])})
    assert np.allclose(found, expected, rtol=0, atol=ENOUGH * np.abs(expected).max())


@pytest.mark.parametrize(("n", "inputs", "measured"), [(2, 1, 2), (3, 2, 1), (4, 4, 4)])
def test_first_order(n, inputs, measured):
    A, B, C, G = (RNG.normal(size=s) for s in ((n, n), (n, inputs), (measured, n), (inputs, measured)))
    model = tmsopt.models.from_matrices(A=lists(A), B=lists(B), C=lists(C), G=named(G))
    agree(model, G, np.poly(A - B @ G @ C))


@pytest.mark.parametrize(("n", "inputs", "damped"), [(1, 1, True), (2, 1, False), (3, 2, True)])
def test_second_order(n, inputs, damped):
    K, D, B, G = (RNG.normal(size=s) for s in ((n, n), (n, n), (n, inputs), (inputs, 2 * n)))
    given = {"D": lists(D)} if damped else {}
    model = tmsopt.models.from_matrices(M=lists(2 * np.eye(n)), **given, K=lists(K), B=lists(B), G=named(G))
    closed = damped * D + B @ G[:, n:], K + B @ G[:, :n]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-closed[1] / 2, -closed[0] / 2]])
    agree(model, G, 2.0**n * np.poly(A))
    _, *pencil = model.pencil({"k": float(G[0, 0])})
    assert np.allclose(np.array(pencil, dtype=float), closed, rtol=0, atol=ENOUGH * 10)


def test_a_file_states_it(tmp_path):
    """A pendulum held upright: s² + kd s + kp − a has its double root at −√(kp − a) for kd = 2 √(kp − a)."""
    path = tmp_path / "upright.toml"
    path.write_text(
        '[model]\nM = [["1"]]\nK = [["-a"]]\nB = [["1"]]\nG = [["kp", "kd"]]\n'
        "[parameters]\na = 9.0\nkp = { min = 0, max = 25 }\nkd = { min = 0, max = 20 }\n"
        '[objective]\nminimize = "abscissa"\n'
    )
    design = tmsopt.solve(path)
    assert design.structure == "EP2"
    assert design.abscissa == pytest.approx(-4.0, abs=1e-12)
    assert design.parameters["kd"] == pytest.approx(8.0, abs=1e-12)
    assert tmsopt.prove(design).proved


@pytest.mark.parametrize(
    ("given", "key", "said"),
    [
        ({"B": [[1], [0]]}, "G", "missing"),
        ({"G": [["k", 0]]}, "B", "missing"),
        ({"B": [[1], [0]], "G": [["k"]]}, "G", "1 × 1; accepted: 1 × 2"),
        ({"B": [[1], [0]], "G": [["k"]], "C": [[1]]}, "C", "accepted: 2"),
        ({"B": [[1], [0, 1]], "G": [["k", 0]]}, "B", "rows of equal length"),
        ({"B": [[1], [0]], "G": [["k", float("nan")]]}, "G", "row 1, column 2"),
    ],
)
def test_what_does_not_fit(given, key, said):
    with pytest.raises(tmsopt.models.Unfit) as caught:
        tmsopt.models.from_matrices(A=[["a", 1], [0, 1]], **given)
    assert caught.value.key == key
    assert said in caught.value.message
