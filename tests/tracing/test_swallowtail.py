"""The swallowtail surface, its edges and its patches, and the figures of the planes, by their data."""

import itertools
import math
from importlib import import_module

import numpy as np
import pytest

from tmsopt import InputError, Problem, laws, models
from tmsopt.models import copo
from tmsopt.plots import new_figure
from tmsopt.plots.paper import draw_plane, draw_swallowtail, quadrilaterals
from tmsopt.tracing import swallowtail

pytestmark = pytest.mark.slow

planes = import_module("tmsopt.paper.planes")

FIXED = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
BOX = {"Fr": (2.0, 3.0), "chi_B": (1.1, 1.8), "lambda_s": (0.02, 0.7)}
EP4 = (3 * math.sqrt(110 * math.sqrt(2) - 120) / 8, math.sqrt(2), math.atan(15 / 4 - 75 * math.sqrt(2) / 32))
"""Table 1 of the paper."""


@pytest.fixture(scope="module")
def surface():
    return swallowtail(Problem(models.tms, fixed=FIXED, free=BOX), rows=16, across=10)


def coefficients(Fr, chi_B, lambda_s):
    a = copo(Fr, 0.1, chi_B, 1.0, -0.4, -0.2, np.tan(lambda_s))
    return np.stack(np.broadcast_arrays(*a), axis=-1)


def of_patch(patch):
    return coefficients(*(patch.points[n] for n in BOX))


def relative_value(a, r):
    """|p(r)| over the sum of its terms: rounding alone leaves a few 1e-16."""
    powers = r[..., None] ** np.arange(a.shape[-1] - 1, -1, -1)
    return np.abs((a * powers).sum(-1)) / np.abs(a * powers).sum(-1)


def derivative(a):
    return a[..., :-1] * np.arange(a.shape[-1] - 1, 0, -1)


def quotient(a, r):
    """q with p = a0 (s − r)² (s² + b s + c), from the first coefficients: b = a1/a0 + 2r, c = a2/a0 + 2rb − r²."""
    b = a[..., 1] / a[..., 0] + 2 * r
    return b, a[..., 2] / a[..., 0] + 2 * r * b - r * r


def test_every_point_of_the_surface_has_its_double_root(surface):
    assert len(surface.patches) > 6
    for patch in surface.patches:
        a = of_patch(patch)
        # tan(atan(T)) and Cramer's rule each cost some digits of the parameters
        assert relative_value(a, patch.r).max() < 1e-11
        assert relative_value(derivative(a), patch.r).max() < 1e-11


def test_patches_bound_heavy_damping_exactly_where_the_other_roots_are_real_and_negative(surface):
    seen = set()
    for patch in surface.patches:
        b, c = quotient(of_patch(patch), patch.r)
        inner = np.s_[1:-1, 1:-1]  # on an edge the other roots coincide, with each other or with r
        damped = (b > 0) & (c > 0) & (b * b > 4 * c) & (patch.r < 0)
        assert np.all(damped[inner] == patch.heavily_damped)
        seen.add(patch.heavily_damped)
    assert seen == {True, False}


def test_patches_meet_where_a_root_is_triple_or_a_second_pair_double(surface):
    met = 0
    for patch in surface.patches:
        b, c = quotient(of_patch(patch), patch.r)
        r = patch.r
        # both vanish like the square of the distance in r, and np.roots gives r to 1e-7 beside EP4
        off = np.minimum(np.abs(r * r + b * r + c), np.abs(b * b - 4 * c)) / (r * r)
        ends = ((patch.points[n], np.array(BOX[n])) for n in ("chi_B", "lambda_s"))
        on_box = np.any([np.abs(x[..., None] - limits).min(axis=-1) < 1e-6 for x, limits in ends], axis=0)
        for column in (0, -1):
            assert np.all((off < 1e-6) | on_box, axis=0)[column]
            met += not on_box[:, column].all()
    assert met >= 8


def test_nothing_is_drawn_through(surface):
    """In a row of constant Fr the patches are curves in (chi_B, lambda_s) that meet at their ends alone."""
    pairs = 0
    for first, second in itertools.combinations(surface.patches, 2):
        for i, Fr in enumerate(first.points["Fr"][:, 0]):
            for j in np.flatnonzero(second.points["Fr"][:, 0] == Fr):
                pairs += 1
                assert not crossing(curve(first, i), curve(second, j)), (Fr, first.r[i], second.r[j])
    assert pairs > 50


def curve(patch, row):
    return np.stack([patch.points["chi_B"][row], patch.points["lambda_s"][row]], axis=-1)


def crossing(p, q):
    """Whether two polylines cross properly, their end segments left out: there they may touch."""
    a, b, c, d = p[1:-2, None], p[2:-1, None], q[1:-2], q[2:-1]
    return np.any((side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0))


def side(a, b, c):
    u, v = b - a, c - a
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def test_edges_meet_in_the_EP4_of_table_1(surface):
    for edge in (surface.cusps, surface.crossing):
        found = [e for e in edge.events if e.name == "EP4"]
        assert len(found) == 1
        assert [found[0].parameters[n] for n in BOX] == pytest.approx(EP4, abs=1e-12)


def test_there_are_two_cuspidal_edges_and_one_self_intersection_that_end_in_EP4(surface):
    """EP3 runs through EP4 as one curve of two arms, both below Fr_EP4; 2EP2 leaves EP4 on one side only."""
    assert len(surface.cusps.branches) == 1
    assert surface.cusps.branches[0].parameters["Fr"].max() == pytest.approx(EP4[0], abs=1e-12)
    crossing = surface.crossing.branches[0]
    double = crossing.kinds == "2EP2"
    assert np.all(crossing.parameters["lambda_s"][double] < EP4[2])
    assert np.all(crossing.parameters["lambda_s"][crossing.kinds == "CEP2"] > EP4[2])


def test_only_affine_coefficients_are_accepted():
    box = {"chi_B": (1.1, 1.8), "Fr": (2.0, 3.0), "lambda_s": (0.02, 0.7)}  # a1 has Fr², and Fr chi_B
    with pytest.raises(InputError, match="not affine in Fr and lambda_s"):
        swallowtail(Problem(models.tms, fixed=FIXED, free=box))
    with pytest.raises(InputError, match="found 1 free parameters; accepted: 3"):
        swallowtail(Problem(models.tms, fixed={**FIXED, "chi_B": 1.4, "lambda_s": 0.4}, free={"Fr": (1, 2)}))


def test_the_drawn_faces_are_those_of_the_patches(surface):
    ax = new_figure(4, 4).add_subplot(projection="3d", computed_zorder=False)
    draw_swallowtail(surface, ax)
    (collection,) = ax.collections
    faces = sum((p.r.shape[0] - 1) * (p.r.shape[1] - 1) for p in surface.patches)
    assert len(collection.get_facecolor()) == faces  # one collection: matplotlib sorts its faces by depth
    grid = np.arange(24.0).reshape(2, 4, 3)
    grid[0, 0] = np.nan
    assert len(quadrilaterals(grid)) == 2  # of three, where a corner is missing


# The planes of the paper


@pytest.fixture(scope="module")
def on_law():
    return planes.tilt_plane(points=(5, 5))


def test_heavy_damping_on_the_law_is_bounded_by_the_EP_set_and_a_double_root_omega0(on_law):
    """At chi_B = sqrt(2) the polynomial is reciprocal about |omega0|, so a double root is omega0 or one of two."""
    epset, omega0 = [], []
    for arc in on_law.chart.domain.heavy_damping:
        Fr, tilt = arc.points["Fr"], arc.points["lambda_s"]
        on_set = np.abs(Fr - laws.epset(-0.4, -0.2, tilt)) < 1e-12
        at_omega0 = relative_value(coefficients(Fr, math.sqrt(2), tilt), np.full(Fr.shape, -(12.5**0.25))) < 1e-14
        assert np.all(on_set | at_omega0)
        epset.append(on_set.mean() > 0.9)
        omega0.append(at_omega0.mean() > 0.9)
    assert sorted(epset) == sorted(omega0) == [False, True]


def test_the_EP_set_is_drawn_solid_below_EP4_and_dashed_above(on_law):
    ax = new_figure(4, 4).subplots()
    draw_plane(ax, on_law)
    dashed = [line for line in ax.get_lines() if line.get_linestyle() == "--"]
    assert len(dashed) == 1
    x, y = dashed[0].get_data()
    assert y.min() == pytest.approx(EP4[2], abs=1e-12)
    # the dashed part is the whole of the law above EP4, at the drawn tilts
    assert np.abs(x - laws.epset(-0.4, -0.2, y)).max() < 1e-11
    solid = [line for line in ax.get_lines() if line.get_label() == "2EP2"]
    assert len(solid) == 1
    assert solid[0].get_ydata().max() == pytest.approx(EP4[2], abs=1e-12)


def test_the_least_critical_speed_is_marked_on_the_boundary():
    plane = planes.chi_B_plane(points=(5, 5))
    Fr, chi_B = plane.marked_points["least Fr_c"]
    arcs = plane.chart.domain.stability
    traced = np.concatenate([a.points["Fr"] for a in arcs])
    assert chi_B == pytest.approx(math.sqrt(2), abs=1e-15)
    assert Fr * (1 - 1e-15) <= traced.min() < Fr + 1e-4  # the fold of the curve is one of its points or beside one


@pytest.mark.parametrize("offset", planes.SECTIONS)
def test_sections_have_the_weave_boundary_highest_on_the_law(offset):
    """tan lambda_s at the onset of weaving is Fr² (chi_B − 1)(2 − chi_B)/chi_B at these heights: maximal at sqrt(2)."""
    plane = planes.section(offset, points=(5, 5))
    arcs = plane.chart.domain.stability
    chi_B = np.concatenate([a.points["chi_B"] for a in arcs])
    tilt = np.concatenate([a.points["lambda_s"] for a in arcs])
    Fr = plane.chart.problem.fixed["Fr"]
    assert np.abs(np.tan(tilt) - Fr**2 * (chi_B - 1) * (2 - chi_B) / chi_B).max() < 1e-12
    assert abs(chi_B[np.argmax(tilt)] - math.sqrt(2)) < 5e-3  # one step of the curve
