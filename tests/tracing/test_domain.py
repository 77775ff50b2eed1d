"""Exact boundaries of stability and heavy damping against exact Routh tables and Sturm chains.

Both ways round: across every arc exactly one side belongs to the domain, and every change of the domain along random
lines lies on an arc.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from helpers.curves import certified, changes, damped, distance, equations, exact_polynomial, stable, sturm

import tmsopt
from tmsopt.models import Model, Parameter, ParameterSet, tms
from tmsopt.problem import Problem
from tmsopt.tracing import domain

pytestmark = pytest.mark.slow

BASE = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
SQRT2 = math.sqrt(2)
TAN_EP4 = 15 / 4 - 75 * SQRT2 / 32  # Table 1
FR_EP4 = 3 * math.sqrt(110 * SQRT2 - 120) / 8  # Table 1
W, G = 1.1, 9.81

CHORD = 2e-5
"""Distance of a curve to its polyline, in widths of the box: step²/8 times a curvature of 6 (step 0.005)."""

SI = {"w": W, "g": G, "m_B": 10.0, "m_H": 1.0, "x_B": 1.5, "z_B": -0.45, "x_H": 1.12, "z_H": -0.22}

PLANES = {
    "on the law": (BASE | {"chi_B": SQRT2}, {"Fr": (0.01, 5.0), "lambda_s": (0.01, 1.4)}),
    "off the law": (BASE | {"lambda_s": math.atan(TAN_EP4) - 0.18}, {"Fr": (0.01, 5.0), "chi_B": (0.5, 3.0)}),
    "above EP4": (BASE | {"Fr": FR_EP4 + 0.5}, {"chi_B": (0.5, 3.0), "lambda_s": (0.01, 1.4)}),
    "chi_H = 1.02": (BASE | {"chi_H": 1.02, "mu": 20.8, "Fr": 2.337}, {"chi_B": (1.0, 1.5), "lambda_s": (0.01, 1.4)}),
    "chi_H = 0.9": (BASE | {"chi_H": 0.9, "mu": 5.0, "Fr": 2.3}, {"chi_B": (1.3, 1.75), "lambda_s": (0.4, 0.6)}),
    "reversed": (
        {"chi_H": 1.0, "mu": 0.1, "chi_B": 0.75, "zeta_B": -0.2, "zeta_H": -0.4},
        {"Fr": (0.01, 5.0), "lambda_s": (-1.4, -0.01)},
    ),
    "heights": (
        {"chi_H": 1.05, "mu": 3.0, "chi_B": 1.5, "Fr": 3.0, "lambda_s": 0.4},
        {"zeta_B": (-1.0, -0.05), "zeta_H": (-1.0, -0.05)},
    ),
    "SI": (SI, {"v": (0.1, 15.0), "lambda_s": (0.01, 1.4)}),
}
"""plane → (fixed, free)."""

EVERY = PLANES | {
    "towards the axis": (
        {"chi_B": 1.2, "lambda_s": 0.1, "mu": 0.5, "zeta_B": -0.4, "zeta_H": -0.2},
        {"chi_H": (0.5, 1.5), "Fr": (0.5, 5.0)},
    ),
    "two roots to infinity": (
        {"Fr": 3.5559, "mu": 0.058, "chi_B": 2.8386, "chi_H": 1.1037, "zeta_B": -0.7215},
        {"lambda_s": (-1.4, 1.4), "zeta_H": (-1.2, -0.1)},
    ),
    "double roots at capsize": (
        {"Fr": 4.0897, "chi_B": 1.8803, "chi_H": 1.1371, "zeta_B": -0.9933, "lambda_s": 0.6301},
        {"mu": (0.01, 20), "zeta_H": (-1.2, -0.1)},
    ),
    "across the axis": (
        {"Fr": 0.4538, "mu": 0.0146, "zeta_B": -1.1496, "zeta_H": -0.8924, "chi_H": 1.0},
        {"chi_B": (0.2, 3.0), "lambda_s": (-1.4, 1.4)},
    ),
}
"""And planes where curves run into infinity or a root 0."""


def native(values):
    return tms.sets[1].native(values) if "w" in values else values


class Plane:
    """A domain with its arcs in widths of the box, and exact truths there."""

    def __init__(self, fixed, free, **options):
        self.fixed, self.free, self.names = fixed, free, list(free)
        self.low, high = np.array([free[n] for n in free]).T
        self.width = high - self.low
        self.found = domain(Problem(model=tms, fixed=fixed, free=free), **options)
        self.corners = np.array([self.unit(c.parameters) for c in self.found.corners]).reshape(-1, 2)

    def unit(self, values):
        return np.stack(
            [(np.asarray(values[n]) - lo) / w for n, lo, w in zip(self.names, self.low, self.width, strict=True)],
            axis=-1,
        )

    def polynomial(self, y):
        x = self.low + np.asarray(y) * self.width
        return exact_polynomial(native({**self.fixed, **dict(zip(self.names, map(float, x), strict=True))}))

    def arcs(self, which):
        return [self.unit(a.points) for a in getattr(self.found, which)]

    def sides(self, arc, count):
        """Pairs of exact polynomials 1e-7 widths to either side of points inside an arc, away from corners."""
        for k in np.unique(np.linspace(2, len(arc) - 3, count).astype(int)) if len(arc) > 5 else []:
            near = len(self.corners) and np.min(np.hypot(*(self.corners - arc[k]).T)) < 2e-3
            t = arc[k + 1] - arc[k - 1]
            if near or not np.hypot(*t) > 1e-6:
                continue
            normal = np.array([-t[1], t[0]]) / np.hypot(*t) * 1e-7
            yield self.polynomial(arc[k] + normal), self.polynomial(arc[k] - normal)


@pytest.fixture(scope="module")
def planes():
    return {name: Plane(fixed, free, starts=8) for name, (fixed, free) in EVERY.items()}


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize(("which", "inside"), [("stability", stable), ("heavy_damping", damped)])
def test_exactly_one_side_of_every_arc_is_inside(planes, name, which, inside):
    plane = planes[name]
    seen = 0
    for arc in plane.arcs(which):
        for left, right in plane.sides(arc, 12):
            assert inside(left) != inside(right)
            seen += 1
    # two have no heavily damped design in their box, and one a sliver at a corner
    expected = which == "stability" or name not in ("chi_H = 1.02", "chi_H = 0.9", "across the axis")
    assert (seen > 5) == expected


@pytest.mark.parametrize("name", EVERY)
def test_every_change_along_random_lines_lies_on_an_arc(planes, name):
    plane = planes[name]
    rng = np.random.default_rng(5)
    for which, inside in (("stability", stable), ("heavy_damping", damped)):
        arcs = plane.arcs(which)
        middles = [arc[len(arc) // 2] for arc in arcs] or [np.array([0.5, 0.5])]
        found = 0
        for number in range(4):
            begin, end = rng.random(2), rng.random(2)
            if number >= 2:  # small domains are missed by most lines: aim at them
                begin = np.clip(middles[number % len(middles)] + rng.uniform(-0.15, 0.15, 2), 0, 1)
            for point in changes(lambda y, truth=inside: truth(plane.polynomial(y)), begin, end, 50):
                assert distance(point, arcs) <= CHORD
                found += 1
        if which == "stability" and name not in ("reversed", "across the axis"):  # slivers
            assert found > 0


@pytest.mark.parametrize("name", PLANES)
def test_arcs_cross_a_line_as_often_as_the_domain_changes(planes, name):
    """No arc is drawn twice, as on the law, where two double roots at once belong to one arc; and none is spurious."""
    plane = planes[name]
    for which, inside in (("stability", stable), ("heavy_damping", damped)):
        for height in (0.1537, 0.2211):
            line = np.array([[0.0, height], [1.0, height]])
            truly = list(changes(lambda y, truth=inside: truth(plane.polynomial(y)), *line, 70))
            drawn = sum(np.count_nonzero(np.diff(arc[:, 1] > height)) for arc in plane.arcs(which))
            assert drawn == len(truly)


@pytest.mark.parametrize("name", EVERY)
def test_arcs_that_part_capsize_from_weave_do_so(planes, name):
    """Both sides are unstable, and on one of them alone is there a positive real root."""
    plane = planes[name]
    seen = 0
    for arc in plane.arcs("parting"):
        for left, right in plane.sides(arc, 6):
            assert not stable(left)
            assert not stable(right)
            assert (sturm(left)[2] > 0) != (sturm(right)[2] > 0)
            seen += 1
    assert seen > 0 or name in ("off the law", "above EP4", "chi_H = 0.9", "reversed", "heights")


@pytest.mark.parametrize("name", EVERY)
def test_every_arc_ends_at_another_or_at_the_edge(planes, name):
    """No gap: boundaries turn only at cusps, meet in a point, and leave only through the edge of the box."""
    plane = planes[name]
    for which in ("stability", "heavy_damping"):
        arcs = plane.arcs(which)
        beyond = plane.arcs("parting") if which == "stability" else []
        ends = np.array([arc[k] for arc in arcs for k in (0, -1)]).reshape(-1, 2)
        for k, end in enumerate(ends):
            at_edge = np.any(np.abs(end) < 1e-9) or np.any(np.abs(end - 1) < 1e-9)
            others = [*np.delete(ends, k, axis=0), *(arc[m] for arc in beyond for m in (0, -1))]
            assert at_edge or min(np.abs(other - end).max() for other in others) < 1e-9


SYSTEMS = {
    "EP3": equations("EP3"),
    "2EP2": equations("2EP2"),
    "double zero": equations("double zero"),
    "capsize and weave": [*equations("capsize"), *equations("weave")],
    "EP2 and capsize": [*equations("capsize"), *equations("EP2")],
}
"""Corners of two conditions, in the parameters and at most the multiple root or factor."""


@pytest.mark.parametrize("name", [n for n in PLANES if n not in ("SI", "on the law")])
def test_corners_are_certified_solutions(planes, name):
    plane = planes[name]
    for corner in plane.found.corners:
        system = SYSTEMS[corner.name]
        start = dict(corner.parameters)
        values = native({**plane.fixed, **start})
        if corner.name in ("EP3", "EP2 and capsize"):
            start["s"] = multiple_root(values)
        if corner.name == "2EP2":
            a = [float(c) for c in exact_polynomial(values)]
            start |= {"b": a[1] / a[0] / 2, "c": math.sqrt(a[4] / a[0])}
        true = certified(system, start, plane.fixed)
        for n in plane.names:
            exact = true.lambda_s if n == "lambda_s" else true[n]
            assert corner.parameters[n] == pytest.approx(float(exact), abs=1e-11)


def multiple_root(values):
    """The real root of p″ or p′ where |p| is least."""
    a = [float(c) for c in exact_polynomial(values)]
    candidates = [z.real for m in (1, 2) for z in np.roots(np.polyder(a, m)) if abs(z.imag) < 1e-3 and abs(z) > 1e-3]
    return min(candidates, key=lambda z: abs(np.polyval(a, z)) + abs(np.polyval(np.polyder(a), z)))


def test_corners_of_the_papers_planes(planes):
    def names(plane):
        return sorted(c.name for c in planes[plane].found.corners)

    assert names("on the law") == ["EP4"]
    (ep4,) = planes["on the law"].found.corners
    assert ep4.parameters["Fr"] == pytest.approx(FR_EP4, abs=1e-12)
    assert math.tan(ep4.parameters["lambda_s"]) == pytest.approx(TAN_EP4, abs=1e-12)
    assert names("off the law") == ["2EP2", "EP3", "EP3"]
    assert names("above EP4") == ["2EP2"]
    assert names("chi_H = 1.02") == ["double zero"]
    (zero,) = planes["chi_H = 1.02"].found.corners
    assert zero.parameters["chi_B"] == pytest.approx(1.02, abs=1e-12)
    assert math.tan(zero.parameters["lambda_s"]) == pytest.approx(1.04, abs=1e-12)
    assert names("SI") == ["EP3"]


def test_a_root_through_infinity_bounds_stability_at_a0_zero(planes):
    """chi_H = 0.9: a0 = 0 where tan(lambda_s) = (chi_H − 1)/zeta_H = 1/2."""
    arcs = [a for a in planes["chi_H = 0.9"].found.stability if a.kind == "infinity"]
    assert arcs
    for arc in arcs:
        assert np.tan(arc.points["lambda_s"]) == pytest.approx(0.5, abs=1e-14)


def test_a_root_through_infinity_bounds_heavy_damping():
    plane = Plane(
        {"mu": 3.0, "Fr": 3.0, "lambda_s": 0.4, "zeta_B": -0.4, "zeta_H": -0.2},
        {"chi_H": (0.8, 1.1), "chi_B": (1.5, 2.0)},
        starts=12,
    )
    edge = plane.unit({"chi_H": 1 - 0.2 * math.tan(0.4), "chi_B": 1.8})
    away = np.array([1e-6, 0.0])
    assert damped(plane.polynomial(edge + away))  # so it is: exact
    assert not damped(plane.polynomial(edge - away))
    assert distance(edge, plane.arcs("heavy_damping")) <= 1e-5


@pytest.mark.parametrize("sign", [1, -1])
def test_where_a0_and_a4_vanish_together_it_matters_whether_in_turn(sign):
    """x s⁴ + s³ + 3 s² + s ± x: at x = 0 its other roots are stable; one side of it is stable only for +."""
    parameters = (Parameter("x", "1", "", "x"), Parameter("y", "1", "", "y"))
    model = Model(
        name="toy",
        title="toy",
        degree=4,
        sets=(ParameterSet("native", parameters, dict),),
        algebraic=dict,
        polynomial=lambda x, y: [x, 1 + 0 * y, 3 + 0 * y, 1 + 0 * y, sign * x],
    )
    found = domain(Problem(model=model, fixed={}, free={"x": (-0.1, 0.1), "y": (0.0, 1.0)}), starts=8)
    assert [a.kind for a in found.stability] == (["infinity"] if sign > 0 else [])
    for x in (0.001, -0.001):
        assert stable([Fraction(c) for c in (x, 1, 3, 1, sign * x)]) == (sign > 0 and x > 0)


def test_a_boundary_that_runs_into_infinity_ends_on_a0_zero():
    """a0 = 0 and a1 = 0: tan(lambda_s) = 1/2 and chi_B = zeta_B chi_H/zeta_H = 1.8; a double root at infinity."""
    plane = Plane(PLANES["chi_H = 0.9"][0], {"chi_B": (1.3, 2.0), "lambda_s": (0.4, 0.6)}, starts=8)
    near = [c for c in plane.found.corners if abs(c.parameters["chi_B"] - 1.8) < 2e-3]
    assert len(near) == 1
    assert near[0].name != "double zero"
    assert near[0].parameters["chi_B"] == pytest.approx(1.8, abs=1e-9)
    assert math.tan(near[0].parameters["lambda_s"]) == pytest.approx(0.5, abs=1e-9)


def test_a_root_0_and_one_at_infinity_meet_in_a_corner():
    """At chi_H = 1 and lambda_s = 0 both a0 and a4 are 0; stability ends there from two sides."""
    plane = Plane(
        {"Fr": 0.3595, "mu": 0.1115, "chi_B": 1.0798, "zeta_B": -0.5598, "zeta_H": -0.1054},
        {"lambda_s": (-1.4, 1.4), "chi_H": (0.7, 1.3)},
    )
    corner = next(c for c in plane.found.corners if {"infinity", "capsize"} <= set(c.name.split(" and ")))
    assert corner.parameters["lambda_s"] == pytest.approx(0.0, abs=1e-12)
    assert corner.parameters["chi_H"] == pytest.approx(1.0, abs=1e-12)
    kinds = {
        a.kind
        for a in plane.found.stability
        if np.abs(plane.unit(a.points) - plane.unit(corner.parameters)).sum(1).min() < 1e-9
    }
    assert kinds == {"capsize", "infinity"}


def _absorber(**free):
    """A damped mass on an undamped one: stable wherever the damper is, its force does no work only at c = 0."""
    k = "0.1*w**2"
    model = tmsopt.models.from_matrices(
        [[1, 0], [0, 0.1]], [["c", "-c"], ["-c", "c"]], [[f"1 + {k}", f"-{k}"], [f"-{k}", k]]
    )
    return tmsopt.Problem(model, free=free)


def test_a_boundary_in_an_edge_of_the_box_is_that_edge():
    """Without damper, c = 0, both pairs lie on the axis: no boundary inside, no noise along the edge."""
    found = domain(_absorber(c=(0.0, 1.0), w=(0.2, 2.0)), starts=12)
    assert found.stability == ()
    assert not [corner for corner in found.corners if corner.parameters["c"] < 1e-9]


def test_the_same_boundary_inside_the_box_is_drawn():
    found = domain(_absorber(c=(-0.5, 1.0), w=(0.2, 2.0)), starts=12)
    (line,) = found.stability
    assert line.kind == "weave"
    assert np.abs(line.points["c"]).max() < 1e-12
    assert sorted((line.points["w"][0], line.points["w"][-1])) == [0.2, 2.0]
    assert not found.corners


def test_a_line_on_which_both_sides_are_unstable_bounds_nothing():
    """Pairs of two oscillators with dampings c and −c: on c = 0 both lie on the axis, beside it one is unstable."""
    model = tmsopt.models.from_matrices([[1, 0], [0, 1]], [["c", 0], [0, "-c"]], [[1, 0], [0, "w*w"]])
    found = domain(tmsopt.Problem(model, free={"c": (-0.5, 1.0), "w": (1.2, 2.0)}), starts=12)
    assert found.stability == ()
