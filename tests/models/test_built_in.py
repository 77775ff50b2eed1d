"""What every model that comes with tmsopt keeps to: names of its own, one polynomial by two routes, one object."""

import pickle
from collections import Counter

import numpy as np
import pytest

from tmsopt.models import MODELS, TAKEN, controlled, tms, whipple

LEAN, RATES = ("k_phi", "lean_phidot", "k_deltadot_v"), ("k_phidot", "lean_delta_v")
CONTROLLED = [
    controlled(model, gains) for model in (tms, whipple) for gains in (LEAN, (*RATES, "lag"), ("k_delta", "lag"))
]
pytestmark = pytest.mark.parametrize("model", [*MODELS.values(), *CONTROLLED], ids=lambda model: model.name)


def test_no_name_means_two_things(model):
    for of in model.sets:
        names = [*of.names, *model.quantity_names(of)]
        assert [n for n, count in Counter(names).items() if count > 1] == []
        assert set(names) & set(TAKEN) == set()


def test_the_polynomial_is_the_determinant_of_the_matrices(model):
    """Up to a factor; both in doubles, the determinant by NumPy at points on a circle."""
    assert model.pencil is not None
    of, rng = model.sets[0], np.random.default_rng(7)
    at = 0.7 * np.exp(2j * np.pi * np.arange(9) / 9)
    for _ in range(20):
        p = {}
        for parameter in of.parameters:
            lower, upper = max(parameter.range.lower, -1.2), min(parameter.range.upper, 1.2)
            p[parameter.name] = float(rng.uniform(lower + 0.05, upper - 0.05))
        matrices = [np.array(m, dtype=float) for m in model.pencil(p)]
        power = len(matrices) - 1
        values = [np.linalg.det(sum(m * s ** (power - k) for k, m in enumerate(matrices))) for s in at]
        ratios = np.array(values) / np.polyval(np.array(model.coefficients(p), dtype=float), at)
        np.testing.assert_allclose(ratios, ratios[0], rtol=1e-9)  # 1e6 roundings: some draws nearly cancel


def test_a_copy_is_the_model_itself(model):
    assert pickle.loads(pickle.dumps(model)) is model
