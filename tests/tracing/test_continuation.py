"""Continuation on plane curves whose shape is known in closed form."""

import math

import casadi as ca
import numpy as np
import pytest

from tmsopt.tracing import End, compile_curve, compute_tangent, walk, walk_both_ways

ROUNDING = 1e-14
"""A corrected point is a solution to a few units of rounding of numbers of order 1."""

INFINITE = np.array([np.inf, np.inf])


def plane(equation, lower=-INFINITE, upper=INFINITE, scale=(1.0, 1.0)):
    x = ca.SX.sym("x", 2)
    return compile_curve(x, equation(x[0], x[1]), np.array(scale), np.array(lower, float), np.array(upper, float))


def circle(x, y):
    return x * x + y * y - 1


def follow_from(on, start, step):
    """The whole curve through a point."""
    return walk_both_ways(on, np.array(start), step, 10**5)


def angles(walked):
    return np.unwrap(np.arctan2(walked.y[:, 1], walked.y[:, 0]))


def lengths(walked):
    return np.hypot(*np.diff(walked.y, axis=0).T)


def signed_area(y):
    return 0.5 * float(np.sum(y[:-1, 0] * y[1:, 1] - y[1:, 0] * y[:-1, 1]))


# Closed curves


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("step", [0.05, 0.002])
def test_circle_closes_in_either_sense(sense, step):
    on = plane(circle)
    walked = walk(on, np.array([1.0, 0.0]), np.array([0.0, sense]), step, 10**5)
    assert walked.closed
    assert np.array_equal(walked.y[0], walked.y[-1])
    assert np.array_equal(walked.t[0], walked.t[-1])
    assert np.abs(np.hypot(*walked.y.T) - 1).max() <= ROUNDING
    turned = np.diff(angles(walked))
    assert np.all(sense * turned > 0)  # never back, and the last point not beyond the first
    assert abs(float(turned.sum()) - sense * 2 * math.pi) <= 1e-12  # once around
    true = sense * np.stack([-walked.y[:, 1], walked.y[:, 0]], axis=1)
    assert np.abs(walked.t - true).max() <= ROUNDING


def test_lemniscate_is_followed_straight_through_its_crossing():
    """(x² + y²)² = x² − y² has length 2ϖ = 5.24411510858 (lemniscate constant), its lobes opposite areas ±1/2."""
    on = plane(lambda x, y: (x * x + y * y) ** 2 - x * x + y * y)
    walked = follow_from(on, [1.0, 0.0], 0.002)
    assert walked.closed
    h = lengths(walked).max()
    # chords are short by no more than h² κ²/24 of the length, κ ≤ 3
    assert abs(lengths(walked).sum() - 5.244115108584239) <= 5.25 * h * h * 9 / 24
    assert abs(signed_area(walked.y)) <= 5.25 * h * h
    right = walked.y[:, 0].max()
    assert right == pytest.approx(1.0, abs=h * h)
    assert walked.y[:, 0].min() == pytest.approx(-1.0, abs=h * h * 3)


def test_a_neighbouring_curve_is_not_jumped_to():
    """Circles of radius 1 and 1.01: prediction errors of a longer step are as large as the gap."""
    on = plane(lambda x, y: (x * x + y * y - 1) * (x * x + y * y - 1.01**2))
    for radius in (1.0, 1.01):
        walked = follow_from(on, [radius, 0.0], 0.05)
        assert walked.closed
        assert np.abs(np.hypot(*walked.y.T) - radius).max() <= 1e-12  # the equation is flatter by the gap


# Turning points and limits


def test_folds_are_passed_and_limits_met_exactly():
    """x = y³ − y turns back in x at y = ±1/√3."""
    on = plane(lambda x, y: y**3 - y - x, lower=[-6, -2], upper=[6, 2], scale=(12.0, 4.0))
    walked = follow_from(on, [0.0, 0.0], 0.002)
    assert not walked.closed
    x, y = (walked.y * on.scale).T
    assert np.abs(y**3 - y - x).max() <= 10 * ROUNDING
    assert np.all(np.diff(y) > 0) or np.all(np.diff(y) < 0)
    assert {round(v, 12) for v in (x[0], x[-1])} == {-6.0, 6.0}
    turns = np.flatnonzero(np.diff(np.sign(walked.t[:, 0])))
    assert len(turns) == 2
    assert sorted(y[turns]) == pytest.approx([-1 / math.sqrt(3), 1 / math.sqrt(3)], abs=0.01)


def test_a_limit_is_reached_exactly():
    on = plane(circle, lower=[-2, -2], upper=[0.5, 2], scale=(2.5, 4.0))
    walked = follow_from(on, [-1.0 / 2.5, 0.0], 0.01)
    assert walked.ends == (End("max", 0), End("max", 0))
    ends = walked.y[[0, -1]] * on.scale
    assert np.array_equal(ends[:, 0], [0.5, 0.5])
    assert sorted(ends[:, 1]) == pytest.approx([-math.sqrt(0.75), math.sqrt(0.75)], abs=ROUNDING)
    assert np.all(walked.y <= on.upper)


def test_of_two_limits_within_one_step_the_first_is_taken():
    """On the line y = x the limit y ≤ 0.99 comes before x ≤ 1, both within a step of 0.1."""
    on = plane(lambda x, y: y - x, lower=[-1, -1], upper=[1, 0.99])
    walked = walk(on, np.array([0.98, 0.98]), np.array([1.0, 1.0]) / math.sqrt(2), 0.1, 100)
    assert walked.ends[1] == End("max", 1)
    assert walked.y[-1] == pytest.approx([0.99, 0.99], abs=ROUNDING)


def test_a_start_on_the_limit_walks_inward_only():
    on = plane(circle, lower=[0, -2], upper=[2, 2])
    walked = follow_from(on, [0.0, 1.0], 0.01)
    assert np.all(walked.y[:, 0] >= 0)
    assert walked.y[[0, -1], 0].tolist() == [0.0, 0.0]
    assert abs(angles(walked)[-1] - angles(walked)[0]) == pytest.approx(math.pi, abs=1e-12)


# Where a curve ends otherwise


def test_a_cusp_is_a_singular_end():
    on = plane(lambda x, y: y * y - x**3, lower=[-1, -1], upper=[1, 1])
    walked = walk(on, np.array([0.25, 0.125]), np.array([-1.0, -0.75]) / 1.25, 0.01, 10**5)
    assert walked.ends[1].reason.startswith("singular")
    assert walked.ends[1].variable is None
    assert np.hypot(*walked.y[-1]) < 1e-3
    assert np.all(walked.y[:, 1] >= -1e-7)  # not onto the other half; at the cusp y is right to the root of rounding


def test_most_points_and_infinity():
    on = plane(circle)
    walked = walk(on, np.array([1.0, 0.0]), np.array([0.0, 1.0]), 0.001, 17)
    assert len(walked.y) == 17
    assert walked.ends[1].reason == "stopped after 17 points"
    hyperbola = follow_from(plane(lambda x, y: x * y - 1), [1.0, 1.0], 0.01)
    assert all("infinity" in end.reason for end in hyperbola.ends)
    assert np.abs(hyperbola.y[:, 0] * hyperbola.y[:, 1] - 1).max() <= 1e-10  # 1e4 · rounding of 1e-4
    assert np.all(hyperbola.y > 0)  # not across to the other half


def test_a_point_where_the_equations_leave_more_than_a_curve_is_no_start():
    x = ca.SX.sym("x", 3)
    twice = compile_curve(x, ca.vertcat(x[0], 2 * x[0]), np.ones(3), np.full(3, -np.inf), np.full(3, np.inf))
    with pytest.raises(ValueError, match="direction"):
        compute_tangent(twice, np.zeros(3))
    assert walk_both_ways(twice, np.zeros(3), 0.01, 100) is None


# Its parts


def test_a_curve_in_an_edge_of_the_box_is_followed():
    """y (1 + x²) = 0 with y ≥ 0: rounding on the wrong side of the edge does not end it."""
    on = plane(lambda x, y: y * (1 + x**2), lower=[-1, 0], upper=[1, 1])
    walked = follow_from(on, [0.1, -1e-17], 0.05)
    assert sorted(walked.y[[0, -1], 0]) == [-1, 1]
    assert np.abs(walked.y[:, 1]).max() < 1e-15
