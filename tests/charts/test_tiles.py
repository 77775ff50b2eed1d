"""Charts in tiles: equal to the one in memory to the bit however they are cut, over two and three axes."""

import dataclasses
import os

import numpy as np
import pytest
from helpers.charts import EXTRA, FIXED, PLANE, POINTS, SPACE, charted, files

from tmsopt.charts import LAYERS, chart, open_chart, plan_survey
from tmsopt.errors import InputError
from tmsopt.models import Model, Parameter, ParameterSet, Quantity
from tmsopt.problem import Problem


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return charted(tmp_path_factory.mktemp("whole") / "whole.chart")


# However it is cut


@pytest.mark.parametrize(("tile", "workers"), [(1, 1), (97, 2), (10**6, 1)])
def test_tiles_are_the_chart_in_memory_to_the_bit(tile, workers, whole, tmp_path):
    found = charted(tmp_path / "cut.chart", tile=tile, workers=workers)
    small = chart(PLANE, points=POINTS, layers=tuple(LAYERS), quantities=EXTRA, boundaries=False)
    assert list(found.layers) == list(small.layers)
    for name, wanted in small.layers.items():
        assert found.layers[name].shape == (23, 37)
        assert found.layers[name].dtype == LAYERS.get(name, float)
        assert found.layers[name].tobytes() == wanted.tobytes()
    assert files(found.path) == files(whole.path)
    assert found.shares == small.shares == whole.shares
    data, wanted = found.to_json(), small.to_json()
    assert all(data[n] == wanted[n] for n in ("axes", "classes", "least_abscissa", "satisfied", "fallbacks"))


def test_quantities_are_those_of_every_design(whole):
    Fr, tilt = np.meshgrid(*whole.grid)
    assert np.array_equal(whole.layers["T"], np.tan(tilt))
    assert np.array_equal(whole.layers["settled"], whole.layers["abscissa"] * Fr, equal_nan=True)
    assert np.all(whole.layers["one"] == 1)
    for i, j in ((0, 0), (22, 36), (11, 5)):
        one = PLANE.posed.values(PLANE.posed.ordered({"Fr": float(Fr[i, j]), "lambda_s": float(tilt[i, j])}))
        wanted = float(Fr[i, j]) - float(one["Fr_c"])
        assert whole.layers["second"][i, j] == one["a2"]
        assert whole.layers["excess"][i, j] == wanted or (np.isnan(wanted) and np.isnan(whole.layers["excess"][i, j]))


def test_three_axes_are_planes_one_above_the_other(tmp_path):
    axes, points = ("chi_B", "lambda_s", "Fr"), (9, 7, 5)
    found = chart(SPACE, axes, folder=tmp_path / "space.chart", points=points, tile=31)
    assert found.layers["kind"].shape == (5, 7, 9)
    assert found.about["dimensions"] == ["Fr", "lambda_s", "chi_B"]
    for k, Fr in enumerate(found.grid[2]):
        plane = dataclasses.replace(
            SPACE,
            fixed=FIXED | {"Fr": float(Fr)},
            free={n: SPACE.free[n] for n in ("chi_B", "lambda_s")},
        )
        flat = chart(plane, axes[:2], points=points[:2], boundaries=False)
        for name in ("kind", "abscissa", "damping_ratio", "real_roots", "satisfied"):
            assert found.layers[name][k].tobytes() == getattr(flat, name).tobytes()
    best = found.to_json()["least_abscissa"]
    assert best["value"] == found.layers["abscissa"].min()
    place = np.unravel_index(np.argmin(found.layers["abscissa"]), (5, 7, 9))
    assert [best[n] for n in axes] == [v[k] for v, k in zip(found.grid, place[::-1], strict=True)]


def test_single_precision_is_the_double_rounded(whole, tmp_path):
    found = charted(tmp_path / "single.chart", single=True)
    for name in ("abscissa", "damping_ratio", "margin", "excess"):
        assert found.layers[name].dtype == np.float32
        assert np.array_equal(found.layers[name], whole.layers[name].astype(np.float32), equal_nan=True)
    assert found.layers["kind"].tobytes() == whole.layers["kind"].tobytes()


def test_only_what_is_asked_for_is_kept(tmp_path):
    found = charted(tmp_path / "kind.chart", layers=("kind",), quantities={})
    assert list(found.layers) == ["kind"]
    data = found.to_json()
    assert data["least_abscissa"] is data["satisfied"] is None
    assert sum(data["classes"].values()) == pytest.approx(1)
    other = charted(tmp_path / "other.chart", layers=(), quantities={"x": "Fr"})
    assert list(other.layers) == ["x"]
    assert other.shares == {}


OSCILLATOR = Model(
    name="oscillator",
    title="s² + d s + k",
    degree=2,
    sets=(ParameterSet("plain", (Parameter("d", "1", "damping", "d"), Parameter("k", "1", "stiffness", "k")), dict),),
    algebraic=dict,
    polynomial=lambda d, k: [1 + 0 * d, d, k],
)


def test_a_constraint_that_does_not_exist_is_not_satisfied():
    """log(lambda_s) is no number for reversed rake, whatever the other constraints say."""
    problem = dataclasses.replace(
        PLANE, constraints={"one": "Fr <= 100", "log": "log(lambda_s) <= 5", "two": "Fr >= -100"}
    )
    asked = plan_survey(problem, points=POINTS, layers=("satisfied", "margin"))
    layers, _ = asked.compute(range(POINTS[1]))
    forward = np.broadcast_to(asked.grid.values[1][:, None] > 0, asked.grid.shape)
    assert np.array_equal(layers["satisfied"], forward)
    assert np.array_equal(np.isnan(layers["margin"]), ~forward)


def test_a_model_of_another_degree(tmp_path):
    """s² + d s + k: stable where d, k > 0, heavily damped where d² > 4k too; k ≤ 0 has a root ≥ 0."""
    problem = Problem(model=OSCILLATOR, free={"d": (-1.9, 3.0), "k": (-0.4, 2.0)})
    found = charted(tmp_path / "o.chart", problem, points=(50, 25), tile=200, quantities={})
    d, k = np.meshgrid(*found.grid)
    real = d * d > 4 * k
    kind = np.where((d > 0) & (k > 0), np.where(real, 4, 3), np.where((k <= 0) | ((d <= 0) & real), 1, 2))
    regular = np.abs(d * d - 4 * k) > 1e-9  # a double root is one root, and rounding decides where it is
    assert np.array_equal(found.layers["kind"][regular], kind[regular])
    alpha = np.where(real, (-d + np.sqrt(np.maximum(d * d - 4 * k, 0))) / 2, -d / 2)
    assert found.layers["abscissa"][regular] == pytest.approx(alpha[regular], abs=1e-12)
    again = open_chart(found.path)
    assert again.to_json() | found.run == found.to_json()
    with pytest.raises(InputError, match="does not hold its model 'oscillator'"):
        assert again.problem


def test_an_engine_is_no_longer_needed():
    with pytest.warns(DeprecationWarning, match="engine= is no longer needed"):
        assert chart(PLANE, points=(3, 3), boundaries=False, engine="numpy").run["engine"] == "numpy"


class Fatal(str):
    """Ends a process that unpickles it."""

    def __reduce__(self):
        return os.abort, ()


@pytest.mark.slow
def test_a_worker_that_crashes_ends_the_chart(tmp_path):
    fatal = Quantity("fatal", "1", Fatal("ends a process that it is handed to"), "", lambda v: v["k"])
    problem = Problem(
        model=dataclasses.replace(OSCILLATOR, quantities=(fatal,)), free={"d": (-1.0, 1.0), "k": (-1.0, 1.0)}
    )
    path = tmp_path / "o.chart"
    with pytest.raises(InputError, match=r"workers: .*signal 6"):
        charted(path, problem, points=(4, 6), tile=4, workers=2, quantities={"x": "fatal"})
    with pytest.raises(InputError, match="not finished"):
        open_chart(path)
