"""Traced patterns and domains of models of any degree against closed forms, exact arithmetic and eigenvalues."""

import math
from fractions import Fraction
from itertools import pairwise
from math import comb

import casadi as ca
import numpy as np
import pytest
from helpers.oracles import discriminant_exact

from tmsopt.analysis import optimality
from tmsopt.errors import InputError
from tmsopt.models import from_coefficients, from_matrices
from tmsopt.problem import Problem
from tmsopt.roots import product, shift
from tmsopt.roots.patterns import describe_structure
from tmsopt.search import solve
from tmsopt.tracing import domain, swallowtail, trace

pytestmark = pytest.mark.slow

EXACT = 1e-12
"""Points and events: a few roundings of a Newton step whose condition is below 1e3."""

FEW = {"starts": 2, "step": 0.02}
"""Enough where one branch fills the box."""


def symbols(names):
    return [ca.SX.sym(n) for n in names.split()]


def traced(model, name, free, fixed=None, **options):
    return trace(Problem(model=model, fixed=fixed or {}, free=free, locate=name), **FEW | options)


def only(found):
    (branch,) = found.branches
    return branch


def events(found, name):
    return [e for e in found.events if e.name == name]


def one():
    return from_matrices([[1]], [["c"]], [["k"]], name="one oscillator")


def pair():
    """(s² + d s + k1)(s² + k2) = q²: a damped and an undamped oscillator."""
    return from_matrices([[1, 0], [0, 1]], [["d", 0], [0, 0]], [["k1", "-q"], ["-q", "k2"]], name="two oscillators")


def dimer(beside):
    """Two modes −gⱼ ± i wⱼ coupled by q: an exceptional point where w1 = w2 and q = |g1 − g2|/2; others uncoupled."""
    A = [["-g1", "-w1", 0, "-q"], ["w1", "-g1", "q", 0], [0, "-q", "-g2", "-w2"], ["q", 0, "w2", "-g2"]]
    rows = [[*row, *[0] * len(beside)] for row in A] + [[*[0] * len(A), *row] for row in beside]
    return from_matrices(A=rows, name="dimer")


def chain(unit=1):
    """Three oscillators in a row; `unit` is what a second is in units of time."""
    D, K = (
        [["c1", 0, 0], [0, "c2", 0], [0, 0, "c3"]],
        [["k1 + q", "-q", 0], ["-q", "k2 + 2*q", "-q"], [0, "-q", "k3 + q"]],
    )
    scaled = ([[f"({x})*{f}" for x in row] for row in m] for m, f in ((D, unit), (K, unit**2)))
    return from_matrices([[1, 0, 0], [0, 1, 0], [0, 0, 1]], *scaled, name="three oscillators")


CHAIN = {"c1": 0.1, "c2": 3.0, "k1": 1.0, "k2": 1.2, "k3": 0.8}
PLANE = {"c3": (0.0, 5.0), "q": (0.001, 2.0)}


def unfolded(*others):
    """t⁴ + x t² + y t + z, t = s + 1, times other factors: the unfolding of a 4-fold root."""
    x, y, z = symbols("x y z")
    return from_coefficients(product(shift([1, 0, x, y, z], 1), *others), name="unfolding")


# Closed forms, degree 2 to 12


def test_critical_damping_of_one_oscillator():
    branch = only(traced(one(), "EP2", {"c": (0.1, 4.0), "k": (0.1, 5.0)}))
    c, k = branch.parameters["c"], branch.parameters["k"]
    assert np.abs(c * c / (4 * k) - 1).max() <= 4e-15
    assert branch.abscissa == pytest.approx(-c / 2, abs=4e-15)
    assert branch.stable.all()
    assert branch.heavily_damped.all()
    assert np.ptp(c) == pytest.approx(4 - math.sqrt(0.4), abs=EXACT)  # c = 2√k from k = 0.1 to c = 4


def test_two_oscillators_meet_in_a_complex_and_then_in_a_real_root():
    """(s² + d s + k1)(s² + k2) − q² = (s² + d s/2 + k2)²: k1 = k2 + d²/4, q = d √k2/2, and EP4 at d = 4 √k2."""
    found = traced(pair(), "CEP2", {"d": (0.1, 6.0), "k1": (0.5, 12.0), "q": (0.01, 4.0)}, {"k2": 1.0})
    branch = only(found)
    d = branch.parameters["d"]
    assert branch.parameters["k1"] == pytest.approx(1 + d * d / 4, abs=EXACT)
    assert branch.parameters["q"] == pytest.approx(d / 2, abs=EXACT)
    (ep4,) = events(found, "EP4")
    assert dict(ep4.parameters) == pytest.approx({"d": 4, "k1": 5, "k2": 1, "q": 2}, abs=EXACT)
    apart = np.arange(len(branch)) != ep4.index
    assert np.array_equal(branch.kinds[apart], np.where(d[apart] < 4, "CEP2", "2EP2"))
    assert branch.abscissa[ep4.index] == pytest.approx(-1, abs=1e-7)  # the root of a difference


def test_a_complex_exceptional_point_beside_another_mode():
    """Degree 6: the pair is −(g1 + g2)/2 ± i w, the rest s² + 0.4 s + 9.04."""
    free = {"g1": (0.2, 1.5), "q": (0.01, 1.0), "w2": (0.5, 2.0)}
    branch = only(traced(dimer([[-0.2, -3.0], [3.0, -0.2]]), "CEP2", free, {"g2": 0.1, "w1": 1.0}))
    p, u, one = branch.parameters, branch.unknowns, np.ones(len(branch))
    rate = (p["g1"] + 0.1) / 2
    found = np.stack([p["w2"], p["q"], u["b"], u["c"], u["d1"], u["d2"]])
    assert found == pytest.approx(np.stack([one, rate - 0.1, 2 * rate, rate**2 + 1, 0.4 * one, 9.04 * one]), abs=EXACT)
    assert branch.abscissa == pytest.approx(np.maximum(-rate, -0.2), abs=EXACT)
    assert np.ptp(p["g1"]) == pytest.approx(1.3, abs=EXACT)
    assert set(branch.kinds) == {"CEP2"}


def test_several_patterns_at_once():
    model = dimer([[0, 1], ["-k", "-c"]])
    free = {"c": (0.5, 6.0), "k": (0.5, 6.0), "q": (0.01, 1.0), "w2": (0.5, 2.0)}
    found = traced(model, " CEP2 + EP2", free, {"g1": 0.5, "g2": 0.1, "w1": 1.0})
    branch = only(found)
    assert found.pattern == "EP2+CEP2"
    assert branch.parameters["c"] ** 2 == pytest.approx(4 * branch.parameters["k"], rel=EXACT)
    assert branch.parameters["q"] == pytest.approx(0.2 * np.ones(len(branch)), abs=EXACT)
    assert branch.parameters["w2"] == pytest.approx(np.ones(len(branch)), abs=EXACT)


@pytest.mark.parametrize(("degree", "rate"), [(3, 1.0), (12, 100.0)])
def test_a_root_of_full_multiplicity(degree, rate):
    """Its coefficients are C(n, k) (−r)ᵏ: in degree 12 and a unit of time of 10 ms they reach from 1 to 4e27."""
    names = [f"x{k}" for k in range(1, degree + 1)]
    model = from_coefficients([1, *names])
    free = {n: tuple(comb(degree, k) * (f * rate) ** k for f in (0.5, 2)) for k, n in enumerate(names, 1)}
    branch = only(traced(model, f"EP{degree}", free))
    r = branch.unknowns["r"]
    for k, n in enumerate(names, 1):
        assert branch.parameters[n] == pytest.approx(comb(degree, k) * (-r) ** k, rel=1e-14)
    assert sorted(r[[0, -1]] / rate) == pytest.approx([-2, -0.5], rel=EXACT)
    assert branch.heavily_damped.all()


# Exact arithmetic and invariance on a system without closed form


@pytest.fixture(scope="module")
def real_pairs():
    return traced(chain(), "EP2", PLANE, CHAIN)


def exact_chain(c3, q):
    """det(M s² + D s + K) of the chain in exact arithmetic, for rational c3 and q."""
    c1, c2, k1, k2, k3 = (Fraction(CHAIN[n]) for n in ("c1", "c2", "k1", "k2", "k3"))
    first, second, third = [1, c1, k1 + q], [1, c2, k2 + 2 * q], [1, c3, k3 + q]
    beside = [q * q * (x + y) for x, y in zip(first, third, strict=True)]
    whole = product(first, second, third)
    whole[-3:] = [x - y for x, y in zip(whole[-3:], beside, strict=True)]
    return whole


def test_the_exact_discriminant_changes_sign_within_1e_11_of_every_point(real_pairs):
    assert len(real_pairs.branches) == 2
    for branch in real_pairs.branches:
        for k in range(1, len(branch) - 1, 16):
            # across the curve: the tangent, in widths of the box, turned by 90 degrees
            along = [branch.tangent[n][k] / (hi - lo) for n, (lo, hi) in PLANE.items()]
            step = [Fraction(1e-11 * (hi - lo)) for lo, hi in PLANE.values()]
            sides = []
            for side in (1, -1):
                c3 = Fraction(float(branch.parameters["c3"][k])) + side * step[0] * Fraction(float(-along[1]))
                q = Fraction(float(branch.parameters["q"][k])) + side * step[1] * Fraction(float(along[0]))
                sides.append(discriminant_exact(exact_chain(c3, q)))
            assert sides[0] * sides[1] < 0


def test_no_branch_is_missed_where_the_exact_discriminant_changes_sign(real_pairs):
    """Along lines across the box the exact discriminant changes sign as often as the branches cross them."""
    for q in (Fraction(1, 10), Fraction(3, 5), Fraction(9, 5)):
        values = [discriminant_exact(exact_chain(Fraction(k, 20), q)) for k in range(101)]
        exact = sum(a * b < 0 for a, b in pairwise(values))
        at = [np.sign(b.parameters["q"] - float(q)) for b in real_pairs.branches]
        assert sum(np.sum(s[1:] * s[:-1] < 0) for s in at) == exact


def test_the_unit_of_time_does_not_matter(real_pairs):
    """The same chain with 1 ms for 1 s: the same curves, events and shares, with roots 1000 times as large."""
    slow, fast = real_pairs, traced(chain(1000), "EP2", PLANE, CHAIN)
    assert len(slow.branches) == len(fast.branches)
    for a, b in zip(slow.branches, fast.branches, strict=True):
        assert [(e.name, e.detail) for e in a.events] in (
            [(e.name, e.detail) for e in b.events],
            [(e.name, e.detail) for e in b.events][::-1],
        )
        ends = [{tuple(x.parameters[n][k] for n in PLANE) for k in (0, -1)} for x in (a, b)]
        assert sorted(ends[0]) == [pytest.approx(end, abs=1e-10) for end in sorted(ends[1])]
        assert max(b.abscissa) == pytest.approx(1000 * max(a.abscissa), rel=1e-3)  # other points of the same curve
        assert b.residual <= 1e-13


def test_across_a_weave_curve_two_roots_change_sides_and_none_elsewhere():
    fixed = {"c1": -0.1, "c2": 0.3, "k1": 1.0, "k2": 1.2, "k3": 0.8}
    free = {"c3": (-1.0, 1.0), "q": (0.001, 2.0)}
    model = chain()
    found = traced(model, "weave", free, fixed)
    assert len(found.branches) == 2

    def count(c3, q):
        return (np.roots(model.coefficients({**fixed, "c3": c3, "q": q})).real > 0).sum()

    for branch in found.branches:
        for k in range(5, len(branch) - 5, 40):
            p = {n: float(branch.parameters[n][k]) for n in free}
            normal = (-branch.tangent["q"][k], branch.tangent["c3"][k])
            size = 1e-3 / math.hypot(*normal)
            sides = [count(p["c3"] + s * size * normal[0], p["q"] + s * size * normal[1]) for s in (1, -1)]
            assert abs(sides[0] - sides[1]) == 2
            assert min(sides) == (0 if branch.stable[k] else 2)


# Higher points on curves, and the domain


def test_cusps_and_the_crossing_of_a_section_below_it():
    """t⁴ + x t² + y t + z: EP3 at t² = −x/6, y = −8 t³... by p″ = p′ = p = 0, and 2EP2 at y = 0, z = x²/4."""
    found = traced(unfolded([1, 7]), "EP2", {"y": (-0.5, 0.5), "z": (-0.4, 0.4)}, {"x": -0.3})
    t = math.sqrt(0.05)
    cusps = sorted((e.parameters["y"], e.parameters["z"]) for e in events(found, "EP3"))
    assert cusps == [pytest.approx((s * 8 * t**3, -3 * t**4), abs=EXACT) for s in (-1, 1)]
    assert [e.detail for e in events(found, "EP3")] == ["cusp"] * 2
    crossings = events(found, "2EP2")
    assert len(crossings) == 2  # once by either of its roots
    for event in crossings:
        assert (event.parameters["y"], event.parameters["z"]) == pytest.approx((0, 0.0225), abs=EXACT)


def test_an_ep3_curve_passes_its_ep4():
    found = traced(unfolded([1, 7, 13]), "EP3", {"x": (-0.5, 0.3), "y": (-0.5, 0.5), "z": (-0.4, 0.4)})
    (ep4,) = events(found, "EP4")
    assert [ep4.parameters[n] for n in "xyz"] == pytest.approx([0, 0, 0], abs=EXACT)


def test_domain_of_one_oscillator():
    """Stable for c, k > 0; heavily damped for c² ≥ 4k besides; the three boundaries meet in the double zero.

    The sample holds s² itself, where they do.
    """
    found = domain(Problem(model=one(), free={"c": (-1.0, 1.0), "k": (-1.0, 1.0)}))
    assert {arc.kind for arc in found.stability} == {"weave", "capsize"}
    for arc in found.stability:
        at = arc.points["c" if arc.kind == "weave" else "k"]
        assert np.abs(at).max() <= EXACT
        assert np.ptp(arc.points["k" if arc.kind == "weave" else "c"]) == pytest.approx(1, abs=1e-9)
    (ep2,) = (arc for arc in found.heavy_damping if arc.kind == "EP2")
    assert ep2.points["c"] ** 2 == pytest.approx(4 * ep2.points["k"], abs=EXACT)
    (corner,) = found.corners
    assert "double zero" in corner.name
    assert (corner.parameters["c"], corner.parameters["k"]) == pytest.approx((0, 0), abs=1e-9)


def test_domain_of_a_cubic():
    """s³ + a s² + b s + 1 is stable for a b > 1, a > 0 (Routh), with a cusp of heavy damping at a = b = 3: (s + 1)³."""
    found = domain(Problem(model=from_coefficients([1, "a", "b", 1]), free={"a": (-1.0, 6.0), "b": (-1.0, 6.0)}), **FEW)
    (weave,) = found.stability
    assert weave.points["a"] * weave.points["b"] == pytest.approx(np.ones(len(weave.points["a"])), abs=EXACT)
    (ep2,) = found.heavy_damping
    a, b = ep2.points["a"], ep2.points["b"]
    assert np.abs(a * a * b * b - 4 * a**3 - 4 * b**3 - 27 + 18 * a * b).max() <= 1e-10  # of terms up to 1e3
    (cusp,) = found.corners
    assert (cusp.name, cusp.parameters["a"], cusp.parameters["b"]) == ("EP3", pytest.approx(3), pytest.approx(3))


def test_a_vanishing_mass_bounds_the_domain():
    """m s³ + a s² + 2 s + 1 is stable for m > 0 and 2 a > m; at m = 0 a root passes through infinity."""
    found = domain(Problem(model=from_coefficients(["m", "a", 2, 1]), free={"m": (-1.0, 6.0), "a": (-1.0, 6.0)}), **FEW)
    assert sorted(arc.kind for arc in found.stability) == ["infinity", "weave"]
    for arc in found.stability:
        off = arc.points["m"] if arc.kind == "infinity" else arc.points["m"] - 2 * arc.points["a"]
        assert np.abs(off).max() <= EXACT
    names = {c.name: (c.parameters["m"], c.parameters["a"]) for c in found.corners}
    assert names["infinity and EP2"] == pytest.approx((0, 1), abs=EXACT)  # a s² + 2 s + 1
    assert names["EP3"] == pytest.approx((8 / 27, 4 / 3), abs=EXACT)  # (2 s/3 + 1)³


def test_swallowtail_beside_another_root_is_the_same_surface():
    """p(s) (s + 7) has the double roots of p(s), and its crossing at z = x²/4, y = 0."""
    box = {"x": (-0.5, 0.3), "y": (-0.2, 0.2), "z": (-0.1, 0.1)}
    found = swallowtail(Problem(model=unfolded([1, 7]), free=box), rows=3, across=5, starts=2)
    assert len(found.patches) == 6
    for patch in found.patches:
        t = patch.r + 1
        x, y, z = (patch.points[n] for n in "xyz")
        assert np.abs(t**4 + x * t * t + y * t + z).max() <= 1e-11  # edges of the box are found to 1e-12
        assert np.abs(4 * t**3 + 2 * x * t + y).max() <= 1e-11
    for branch in found.crossing.branches:
        assert branch.parameters["z"] == pytest.approx(branch.parameters["x"] ** 2 / 4, abs=EXACT)


def test_a_cubic_is_fastest_with_one_triple_root():
    """s³ + a s² + b s + 1, the second in ms: the product of the roots is given, and multipliers are 1/(3 ωᵏ⁻¹)."""
    model = from_coefficients([1, "1000*a", "1e6*b", "1e9"])
    design = solve(Problem(model=model, free={"a": (0.1, 6.0), "b": (0.1, 6.0)}, minimize="abscissa"))
    assert (design.structure, design.abscissa) == ("EP3", pytest.approx(-1000, rel=EXACT))
    found = optimality(design)
    (root,) = found.roots
    assert (found.verdict, found.order, root.multiplicity) == ("strict minimum", 1, 3)
    assert (root.beta, root.kappa, *root.ties) == pytest.approx([1 / 3, 1 / 3e3, 1 / 3e6], rel=1e-9)


# What is said


def test_a_pattern_that_the_degree_has_no_room_for_is_named():
    plane = Problem(model=one(), free={"c": (0.1, 4.0), "k": (0.1, 5.0)})
    for pattern, words in (
        ("EP4", "takes 4 roots, and the polynomial has 2"),
        ("EPX", "unknown pattern 'EPX'.*EP2"),
        (None, "no pattern to trace.*EP2 weave capsize"),
    ):
        with pytest.raises(InputError, match=words):
            trace(plane, pattern)
    with pytest.raises(InputError, match=r"'EPX' is no pattern.*EP2"):
        traced(one(), "EPX", dict(plane.free))
    with pytest.raises(InputError, match=r"EP3 needs 3 free parameters \(2 conditions"):
        traced(chain(), "EP3", PLANE, CHAIN)


def test_a_swallowtail_takes_degree_4():
    cubic = from_coefficients([1, *"abc"], name="cubic")
    with pytest.raises(InputError, match="model 'cubic' has degree 3; accepted: 4 or more"):
        swallowtail(Problem(model=cubic, free=dict.fromkeys("abc", (0.1, 4.0))))


def test_structures_in_words():
    assert describe_structure("EP4") == "four roots coincide (EP4)"
    assert describe_structure("EP2", 2) == "both roots coincide (EP2)"
    assert describe_structure("EP6", 6) == "all six roots coincide (EP6)"
    assert describe_structure("EP4", 6) == "the four rightmost roots coincide (EP4)"
    assert describe_structure("CEP3", 6) == "three complex pairs coincide (CEP3)"
    words = "a double complex pair, two complex pairs and a real root share one decay rate"
    assert describe_structure("CEP2+two pairs+real", 9) == f"{words} (CEP2+two pairs+real)"


def test_columns_of_unknowns_are_told_from_parameters_of_the_same_name():
    """The oscillator's c beside c1 of s (s + c1): c = c1 on the line k = 0."""
    found = traced(from_matrices([[1]], [["c1"]], [["k"]]), "capsize", {"c1": (0.1, 4.0), "k": (-1.0, 1.0)})
    columns = found.to_json()["branches"][0]["columns"]
    assert columns["c1"] == pytest.approx(columns["capsize.c1"], abs=EXACT)
    assert np.ptp(columns["c1"]) == pytest.approx(3.9, abs=EXACT)
