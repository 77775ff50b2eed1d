"""Traced patterns against closed forms, 40-digit certified points and exact arithmetic."""

import math
import re
from fractions import Fraction

import numpy as np
import pytest
import sympy
from helpers import curves
from helpers.curves import certified, distance, epset_Fr, equations, exact_polynomial
from helpers.oracles import certified_roots
from helpers.places import PROBLEMS
from mpmath import mp

from tmsopt import laws
from tmsopt.errors import InputError
from tmsopt.models import tms
from tmsopt.problem import Problem
from tmsopt.roots import product
from tmsopt.tracing import Event, trace

BASE = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
"""The chi_H = 1 bicycle of the paper; mu does not matter there."""

OFF = {"zeta_B": -0.4, "zeta_H": -0.2}
MIRRORED = {"zeta_B": -0.2, "zeta_H": -0.4}
EP_SET = PROBLEMS / "ep_set.toml"
SQRT2 = math.sqrt(2)
TAN_EP4 = 15 / 4 - 75 * SQRT2 / 32  # Table 1
FR_EP4 = 3 * math.sqrt(110 * SQRT2 - 120) / 8  # Table 1
SPACE = {"Fr": (0.5, 4.0), "chi_B": (1.01, 3.0), "lambda_s": (0.01, 1.4)}
TILTS = {"Fr": (0.01, 5.0), "lambda_s": (0.01, 1.4)}
SECTION = {"chi_B": (0.5, 3.0), "lambda_s": (0.01, 1.4)}
NAMES = ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")

EXACT = 1e-12
"""Events and points: a few roundings of a Newton step whose condition is below 1e3."""

ROUNDING = 2e-14
"""Coefficients, relative to the terms that they are summed from, for tilts with tangent below 10."""


def traced(pattern, fixed, free, constraints=None, **options):
    problem = Problem(model=tms, fixed=fixed, free=free, constraints=constraints or {}, locate=pattern)
    return trace(problem, **{"starts": 16} | options)


def design(branch, k):
    return {n: float(branch.parameters[n][k]) for n in NAMES}


def events(found, name):
    return [e for b in found.branches for e in b.events if e.name == name]


def sizes_of(values):
    """Sum of the absolute terms of each coefficient, what rounding of the parameters is relative to."""
    T = math.tan(values["lambda_s"])
    return [float(size(*(values[n] for n in NAMES[:-1]), T)) for size in SIZES]


SIZES = [sympy.lambdify(list(curves.SYMBOLS.values()), sum(map(abs, e.args))) for e in curves.COPO]


FACTORS = {
    "2EP2": lambda b, c: [[1, b, c]] * 2,
    "EP4": lambda r: [[1, -r]] * 4,
    "EP3": lambda r, t: [[1, -r]] * 3 + [[1, -t]],
    "EP2": lambda r, b, c: [[1, -r]] * 2 + [[1, b, c]],
    "weave": lambda W, b, c: [[1, 0, W], [1, b, c]],
    "capsize": lambda b, c, d: [[1, 0], [1, b, c, d]],
}
"""Of the monic polynomial of a pattern, by its unknowns."""


def mismatch(branch, k):
    """Largest |a_i − a0 c_i| over the size of its terms, in exact arithmetic on the stored numbers."""
    values = design(branch, k)
    a, sizes = exact_polynomial(values), sizes_of(values)
    u = {n: Fraction(float(c[k])) for n, c in branch.unknowns.items()}
    monic = product(*FACTORS[branch.pattern](**u))
    return max(
        abs(float(p - a[0] * c)) / (size + sizes[0] * abs(float(c))) for p, c, size in zip(a, monic, sizes, strict=True)
    )


def check_ep4(event):
    """Table 1."""
    p = event.parameters
    assert (p["Fr"], p["chi_B"], math.tan(p["lambda_s"])) == pytest.approx((FR_EP4, SQRT2, TAN_EP4), abs=EXACT)


def check_every_point(found, stride=1, limit=ROUNDING):
    for branch in found.branches:
        rows = {*range(0, len(branch), stride), *(e.index for e in branch.events)}
        worst = max(mismatch(branch, k) for k in rows)
        assert worst <= limit
        if not any("infinity" in e.detail for e in branch.events):  # where a0 itself loses its digits
            assert branch.residual <= 1e-13


def check_tangents(branch, free):
    """The tangent is the derivative by the arclength: chords between its own points, in widths, tangents for tilts."""
    values, slopes, widths = dict(branch.parameters), dict(branch.tangent), {n: hi - lo for n, (lo, hi) in free.items()}
    if "lambda_s" in free:
        slopes["lambda_s"] = slopes["lambda_s"] * (1 + np.tan(values["lambda_s"]) ** 2)
        values["lambda_s"], widths["lambda_s"] = np.tan(values["lambda_s"]), np.ptp(np.tan(free["lambda_s"]))
    t, x = (np.stack([some[n] / widths[n] for n in free]) for some in (slopes, values))
    assert np.abs(np.linalg.norm(t, axis=0) - 1).max() <= 1e-12
    chord = np.diff(x, axis=1)
    length = np.linalg.norm(chord, axis=0)
    assert np.diff(branch.arclength) == pytest.approx(length, abs=1e-13)
    long = length > 1e-6
    cosine = np.sum(chord * (t[:, 1:] + t[:, :-1]), axis=0)[long] / (2 * length[long])
    assert np.median(cosine) > 0.9999
    assert np.mean(cosine > 0.95) > 0.98  # a cusp turns the tangent round within a step


# The EP set at chi_H = 1: Fig. fig1 (left)


@pytest.fixture(scope="module")
def ep_set():
    free = {"Fr": (0.5, 4.0), "chi_B": (1.01, 3.0), "lambda_s": (0.01, 1.5)}
    return traced("2EP2", BASE, free, step=0.002), free


def test_ep_set_is_the_closed_form(ep_set):
    found, _ = ep_set
    (branch,) = found.branches
    assert not branch.closed
    assert np.abs(branch.parameters["chi_B"] - SQRT2).max() <= 4e-16  # `chib1`; 2 units of the last place
    with mp.workdps(curves.DIGITS):
        true = [
            abs(epset_Fr(-0.4, -0.2, float(angle)) - mp.mpf(float(Fr)))
            for angle, Fr in zip(branch.parameters["lambda_s"], branch.parameters["Fr"], strict=True)
        ]
    assert max(true) <= 1e-13  # d Fr/Fr is at most (1 + T²)/T times the rounding of the stored angle


def test_ep_set_has_its_ep4_and_its_fold_where_the_paper_and_calculus_put_them(ep_set):
    found, _ = ep_set
    (ep4,) = events(found, "EP4")
    check_ep4(ep4)
    check_every_point(found, stride=7)
    (fold,) = (e for e in events(found, "fold") if "Fr" in e.detail)
    # Fr² = ρ² 4T²/(w⁴ζ_B + 4Tρ) is least at T = −w⁴ζ_B/(2ρ), where Fr² = −w⁴ζ_B: 12.5 · 0.4 = 5
    w2 = math.sqrt(12.5)
    rho = (-0.4 * w2 - 1) / (-0.4 * w2 + 1)
    assert fold.parameters["Fr"] == pytest.approx(math.sqrt(5), abs=EXACT)
    assert math.tan(fold.parameters["lambda_s"]) == pytest.approx(12.5 * 0.4 / (2 * rho), abs=1e-11)
    assert abs(math.tan(fold.parameters["lambda_s"]) - TAN_EP4) > 5e-3  # not at EP4


def test_ep_set_is_2EP2_below_ep4_and_CEP2_above(ep_set):
    (branch,) = ep_set[0].branches
    T = np.tan(branch.parameters["lambda_s"])
    (at,) = np.flatnonzero(branch.kinds == "EP4")
    others = np.arange(len(branch)) != at
    assert np.array_equal(branch.kinds[others], np.where(T[others] < TAN_EP4, "2EP2", "CEP2"))
    assert np.all(branch.stable)  # "the EP-set lies entirely in the domain of asymptotic stability"
    assert np.array_equal(branch.heavily_damped[others], T[others] < TAN_EP4)
    assert branch.heavily_damped[at]
    b, c = branch.unknowns["b"], branch.unknowns["c"]
    assert np.abs(c - math.sqrt(12.5)).max() <= 1e-13  # c² = a4/a0 = 1/(ζ_B ζ_H)
    law = np.where(b * b > 4 * c, -b / 2 + np.sqrt(np.maximum(b * b / 4 - c, 0)), -b / 2)
    assert branch.abscissa[others] == pytest.approx(law[others], abs=1e-7)  # the root of a difference near EP4
    assert branch.abscissa[at] == pytest.approx(-(12.5**0.25), abs=1e-7)


# EP4 as a curve in chi_H: both classes, mu fixed or free

NORMAL = {"chi_H": (0.8, 1.2), "Fr": (0.1, 8.0), "chi_B": (0.1, 4.0), "lambda_s": (0.01, 1.5)}
REVERSED = NORMAL | {"lambda_s": (-1.5, -0.01)}
UNIT = {"unit": "omega0 == -1"}


@pytest.mark.parametrize(
    ("fixed", "free", "constraints", "least"),
    [
        (OFF | {"mu": 0.1}, NORMAL, {}, 0.4),
        (MIRRORED, REVERSED | {"mu": (0.01, 20.0)}, UNIT, 0.19),
    ],
)
def test_ep4_curve_is_the_law(fixed, free, constraints, least):
    found = traced("EP4", fixed, free, constraints)
    (branch,) = found.branches
    p = branch.parameters
    assert np.ptp(p["chi_H"]) >= least - 1e-15
    assert np.all(np.sign(p["lambda_s"]) == np.sign(fixed["zeta_H"] - fixed["zeta_B"]))
    omega0 = -((p_a4(p) / p_a0(p)) ** 0.25)
    if constraints:
        assert omega0 == pytest.approx(-1, abs=1e-13)  # the equality is kept
    assert branch.unknowns["r"] == pytest.approx(omega0, rel=1e-13)
    assert np.array_equal(branch.abscissa, branch.unknowns["r"])
    away = np.abs(p["chi_H"] - 1) > 1e-3  # at chi_H = 1 the mass ratio is free in `ep4`
    law, _ = laws.ep4(omega0[away], fixed["zeta_B"], fixed["zeta_H"], p["chi_H"][away])
    assert p["Fr"][away] == pytest.approx(law.Fr, abs=EXACT)
    assert p["chi_B"][away] == pytest.approx(law.chi_B, abs=EXACT)
    assert np.tan(p["lambda_s"][away]) == pytest.approx(law.tan_lambda_s, rel=EXACT)
    # mu is divided by chi_H − 1 in the law: the rounding of T, up to 1e-15, over 1e-3
    assert p["mu"][away] == pytest.approx(law.mu, abs=1e-10)
    check_every_point(found, stride=9, limit=1e-13)


def p_a0(p):
    return p["zeta_B"] ** 2 * (p["chi_H"] - 1 - p["zeta_H"] * np.tan(p["lambda_s"]))


def p_a4(p):
    return -p["zeta_B"] * np.tan(p["lambda_s"]) - p["mu"] * (p["chi_H"] - 1)


def test_the_other_class_is_not_in_the_other_box():
    """|zeta_B| > |zeta_H| has no EP4 with lambda_s < 0 and Fr > 0, by the paper's laws and by their dual."""
    assert traced("EP4", OFF | {"mu": 0.1}, REVERSED, starts=12).branches == ()
    assert traced("EP4", MIRRORED | {"mu": 0.1}, NORMAL, starts=12).branches == ()


# Cusps EP3 and crossings 2EP2 in the paper's planes


PLANES = {
    # plane → (fixed, free, number of EP3, whether the 2EP2 crossing is there)
    "fig2 left": ({"chi_B": SQRT2 - 0.1}, TILTS, 1, False),
    "fig2 right": ({"lambda_s": math.atan(TAN_EP4) - 0.18}, {"Fr": (0.01, 5.0), "chi_B": (0.5, 3.0)}, 2, True),
    "fig00 at EP4": ({"Fr": FR_EP4}, SECTION, None, True),
    "fig00 below": ({"Fr": FR_EP4 - 0.1}, SECTION, 2, False),
    "fig00 above": ({"Fr": FR_EP4 + 0.5}, SECTION, 0, True),
}


@pytest.fixture(scope="module")
def planes():
    return {name: traced("EP2", BASE | fixed, free) for name, (fixed, free, *_) in PLANES.items()}


@pytest.mark.parametrize("name", PLANES)
def test_cusps_are_certified_ep3(planes, name):
    """Newton at 40 digits on p = p′ = p″ = 0, proven by interval Newton; every free component of the tangent turns."""
    fixed, free, count, _ = PLANES[name]
    cusps = [(b, e) for b in planes[name].branches for e in b.events if e.name == "EP3"]
    if count is not None:
        assert len(cusps) == count
    for branch, event in cusps:
        k = event.index
        start = {n: event.parameters[n] for n in free} | {"s": float(branch.unknowns["r"][k])}
        true = certified(equations("EP3"), start, BASE | fixed)
        for n in free:
            exact = true.lambda_s if n == "lambda_s" else true[n]
            assert event.parameters[n] == pytest.approx(float(exact), abs=EXACT)
        assert branch.unknowns["r"][k] == pytest.approx(float(true["s"]), abs=1e-11)
        assert "cusp" in event.detail
        for n in free:
            assert branch.tangent[n][k - 1] * branch.tangent[n][k + 1] < 0


@pytest.mark.parametrize("name", PLANES)
def test_crossings_are_2EP2_on_the_ep_set(planes, name):
    crossing = PLANES[name][3]
    found = events(planes[name], "2EP2")
    assert len(found) == (2 if crossing else 0)  # once on either of the branches that cross
    for event in found:
        p = event.parameters
        assert p["chi_B"] == pytest.approx(SQRT2, abs=EXACT)
        true = epset_Fr(-0.4, -0.2, p["lambda_s"])
        assert p["Fr"] == pytest.approx(float(true), abs=1e-11 if name == "fig00 at EP4" else EXACT)
        assert math.tan(p["lambda_s"]) < TAN_EP4


@pytest.mark.parametrize("name", ["fig2 right", "fig00 at EP4"])
def test_abscissa_at_a_crossing_does_not_scatter(planes, name):
    """(s² + bs + c)² solved at 40 digits; roots computed from the factor of a double root are 1e-8 off."""
    fixed, free, *_ = PLANES[name]
    for branch in planes[name].branches:
        for event in (e for e in branch.events if e.name == "2EP2"):
            r, other = float(branch.unknowns["r"][event.index]), -float(branch.unknowns["b"][event.index]) / 2
            start = {n: event.parameters[n] for n in free} | {"b": -r - other, "c": r * other}
            true = certified(equations("2EP2"), start, BASE | fixed)
            with mp.workdps(curves.DIGITS):
                larger = (-true["b"] + mp.sqrt(true["b"] ** 2 - 4 * true["c"])) / 2
            exact = 1e-11 if name == "fig00 at EP4" else EXACT  # beside EP4 the factors are near to singular
            assert branch.abscissa[event.index] == pytest.approx(float(larger), abs=exact)


def test_the_section_through_ep4_has_it_as_an_event(planes):
    """EP3 and 2EP2 only touch 0 there; Table 1."""
    (event,) = events(planes["fig00 at EP4"], "EP4")
    check_ep4(event)


@pytest.mark.parametrize("below", [1e-4, 1e-10])
def test_sections_beside_ep4_keep_their_events_apart(below):
    """Below Fr_EP4 two EP3 and two 2EP2, each met by both of its roots, come together as the root of the distance."""
    fixed, free = BASE | {"Fr": FR_EP4 - below}, SECTION
    found = traced("EP2", fixed, free)
    named = [(e.name, e.detail) for e in found.events if e.name in ("EP4", "EP3", "2EP2")]
    if below > 1e-6:
        assert sorted(named) == [("2EP2", "")] * 4 + [("EP3", "cusp")] * 2
        for branch in found.branches:
            for event in (e for e in branch.events if e.name == "EP3"):
                start = {n: event.parameters[n] for n in free} | {"s": float(branch.unknowns["r"][event.index])}
                true = certified(equations("EP3"), start, fixed)
                assert event.parameters["chi_B"] == pytest.approx(float(true["chi_B"]), abs=1e-10)
    else:  # events closer than 1e-6 are one
        assert sorted(named) == [("2EP2", "")] * 2 + [("EP3", "next to an EP4; cusp")]


@pytest.mark.slow
def test_sections_above_ep4_have_no_ep3():
    for above in (1e-10, 1e-7, 1e-4):
        found = traced("EP2", BASE | {"Fr": FR_EP4 + above}, SECTION)
        assert [e.name for e in found.events if e.name in ("EP4", "EP3", "2EP2")] == ["2EP2", "2EP2"]


@pytest.mark.parametrize("name", PLANES)
def test_every_point_of_a_discriminant_curve_has_a_double_root(planes, name):
    # beside EP4 the factors are near to singular, and lose a digit
    check_every_point(planes[name], stride=23, limit=1e-13 if name == "fig00 at EP4" else ROUNDING)
    for branch in planes[name].branches:
        check_tangents(branch, PLANES[name][1])


def test_folds_of_the_discriminant_curves_in_speed_are_at_the_closed_form(planes):
    """p is linear in T, and its slope ζ_B(−ζ_H ζ_B s⁴ − (ζ_B + ζ_H) s² − 1) vanishes at s² = 5 and s² = 5/2 alone.

    There dFr = 0, and p = 0 gives Fr = √5 for s² = 5 and any chi_B, Fr = chi_B √(5/2) for s² = 5/2.
    """
    (fold,) = (e for e in events(planes["fig2 left"], "fold") if "Fr" in e.detail)
    assert fold.parameters["Fr"] == pytest.approx(math.sqrt(5), abs=EXACT)
    on_law = traced("EP2", BASE | {"chi_B": SQRT2}, TILTS)
    assert events(on_law, "EP4")
    for event in events(on_law, "EP4"):  # where symmetry makes the traced equations singular
        check_ep4(event)


def test_ep3_curve_through_space_is_a_cuspidal_edge_ending_in_ep4():
    """Codimension 2: Fr, chi_B, lambda_s free. Its EP4 is the paper's, and its sections are the cusps of the planes."""
    found = traced("EP3", BASE, SPACE)
    ep4 = events(found, "EP4")
    assert ep4
    for event in ep4:
        check_ep4(event)
    check_every_point(found, stride=17)


# Stability boundaries


@pytest.mark.parametrize("chi_B", [1.2, SQRT2, 1.7])
def test_weave_curve_is_the_critical_froude_number(chi_B):
    found = traced("weave", BASE | {"chi_B": chi_B}, TILTS)
    (branch,) = found.branches
    Fr, angle = branch.parameters["Fr"], branch.parameters["lambda_s"]
    assert Fr**2 == pytest.approx(laws.Frc1(chi_B, -0.4, -0.2, angle), rel=1e-13)
    W = branch.unknowns["W"]
    assert np.all(W > 0)
    # ω² = a3/a1 on the axis; here it does not depend on speed or tilt
    assert pytest.approx((chi_B - 1) / (0.4 - 0.2 * chi_B), rel=1e-13) == W
    assert np.all(branch.stable)
    assert np.all(np.abs(branch.abscissa) <= 1e-15)
    check_every_point(found, stride=23)


def test_capsize_is_a4_zero_and_meets_weave_in_the_double_zero():
    """chi_H = 1.02, mu = 20.8: a4 = 0.4 T − 0.416 = 0 at T = 1.04; with it a3 = 0 at chi_B = chi_H, a double zero."""
    fixed = {"chi_H": 1.02, "mu": 20.8, "zeta_B": -0.4, "zeta_H": -0.2, "Fr": 2.337}
    free = {"chi_B": (0.9, 1.5), "lambda_s": (0.01, 1.4)}
    capsize = traced("capsize", fixed, free)
    (branch,) = capsize.branches
    assert np.tan(branch.parameters["lambda_s"]) == pytest.approx(1.04, abs=1e-14)
    (zero,) = events(capsize, "double zero")
    assert zero.parameters["chi_B"] == pytest.approx(1.02, abs=EXACT)
    assert sorted(branch.parameters["chi_B"][[0, -1]]) == pytest.approx([0.9, 1.5], abs=2e-16)
    weave = traced("weave", fixed, free)
    ends = [e for e in events(weave, "end") if "double root 0" in e.detail]
    assert len(ends) == 1
    assert ends[0].parameters["chi_B"] == pytest.approx(1.02, abs=EXACT)
    assert math.tan(ends[0].parameters["lambda_s"]) == pytest.approx(1.04, abs=EXACT)
    (end,) = (b.unknowns["W"][e.index] for b in weave.branches for e in b.events if e is ends[0])
    assert end == 0.0
    check_every_point(weave, stride=23)
    check_every_point(capsize, stride=23)


def test_the_model_has_no_resonance_with_forward_speed():
    """p with two equal imaginary pairs needs a1 = a3 = 0 at Fr > 0: chi_B = chi_H and zeta_B = zeta_H."""
    free = {"Fr": (0.1, 5.0), "chi_B": (0.5, 3.0), "lambda_s": (0.01, 1.4), "chi_H": (0.8, 1.2)}
    assert traced("resonance", OFF | {"mu": 1.0}, free, starts=16).branches == ()


@pytest.mark.parametrize(
    ("fixed", "free"),
    [
        (OFF | {"chi_H": 1.02, "mu": 20.8, "chi_B": 1.19}, {"Fr": (0.05, 6.0), "lambda_s": (0.02, 1.4)}),
        (OFF | {"chi_H": 0.9, "mu": 5.0, "Fr": 2.3}, {"chi_B": (0.5, 3.0), "lambda_s": (-1.4, 1.4)}),
        (MIRRORED | {"chi_H": 0.95, "mu": 3.0, "chi_B": 0.75}, {"Fr": (0.05, 5.0), "lambda_s": (-1.4, -0.02)}),
    ],
)
@pytest.mark.parametrize("pattern", ["EP2", "weave", "capsize"])
def test_patterns_elsewhere_match_exactly_and_their_flags_are_the_roots(fixed, free, pattern):
    """chi_H ≠ 1, negative tilts; stable, heavily damped and abscissa against the isolated roots of the same design."""
    found = traced(pattern, fixed, free, starts=16)
    check_every_point(found, stride=19, limit=1e-13)
    for branch in found.branches:
        for k in range(5, len(branch), max(1, len(branch) // 9)):
            check_flags(branch, k)


def test_a_branch_that_comes_from_infinity_keeps_its_own_kind():
    """Off the law no EP2 curve of a plane is 2EP2 all along: the quotient's roots are apart (60 digits)."""
    fixed, free = OFF | {"chi_H": 0.9, "mu": 5.0, "Fr": 2.3}, {"chi_B": (0.5, 3.0), "lambda_s": (-1.4, 1.4)}
    for branch in traced("EP2", fixed, free, starts=16).branches:
        special = {e.index for e in branch.events}
        assert {str(kind) for k, kind in enumerate(branch.kinds) if k not in special} == {"EP2"}


def check_flags(branch, k):
    """The roots that the pattern ties leave; those that remain decide.

    A double root scatters by the root of the relative rounding of the coefficients, a0 near infinity the worst.
    """
    values = design(branch, k)
    exact = exact_polynomial(values)
    roots = [complex(root) for root, count in certified_roots(exact) for _ in range(count)]
    rest, size = list(roots), max(map(abs, roots))
    room = 4 * math.sqrt(1e-15 * (1 + sizes_of(values)[0] / abs(float(exact[0])))) * size
    w = math.sqrt(branch.unknowns["W"][k]) if branch.pattern == "weave" else 0
    for tied in {"weave": (1j * w, -1j * w), "capsize": (0,)}.get(branch.pattern, ()):
        rest.remove(min(rest, key=lambda z: abs(z - tied)))
    margin = max(z.real for z in rest)
    if abs(margin) > room:
        assert bool(branch.stable[k]) == (margin < 0)
        if branch.pattern != "weave":
            assert bool(branch.heavily_damped[k]) == (margin < 0 and all(abs(z.imag) <= room for z in rest))
    assert branch.abscissa[k] == pytest.approx(max(z.real for z in roots), abs=room)


# Constraints


def test_inequalities_are_events_with_the_constraint_zero_and_flags_on_either_side():
    constraints = {"trail": "nu_H >= 0.06", "fast": "Fr >= 1.5 * Fr_c", "tilt": "tan(lambda_s) + Fr <= 2.5"}
    found = traced("EP2", BASE | {"chi_B": 1.3}, TILTS, constraints)

    def values(p):
        angle, Fr = np.asarray(p["lambda_s"]), np.asarray(p["Fr"])
        critical = np.sqrt(laws.Frc1(1.3, -0.4, -0.2, angle))
        return {"trail": 0.2 * np.sin(angle) - 0.06, "fast": Fr - 1.5 * critical, "tilt": 2.5 - np.tan(angle) - Fr}

    crossed = events(found, "constraint")
    assert {e.detail for e in crossed} == set(constraints)
    for event in crossed:
        assert abs(values(event.parameters)[event.detail]) <= EXACT
    for branch in found.branches:
        here = values(branch.parameters)
        signs = np.array([here[n] > 0 for n in constraints])
        near = np.min(np.abs([*here.values()]), axis=0) < 1e-12
        assert np.array_equal(branch.satisfied[~near], signs.all(axis=0)[~near])
        # every change of a sign has an event between the two points
        clear = np.flatnonzero(~near)
        for n, column in zip(constraints, signs[:, clear], strict=True):
            for i in np.flatnonzero(column[1:] != column[:-1]):
                rows = range(clear[i], clear[i + 1] + 1)
                assert any(e.index in rows and n in e.detail for e in branch.events)


def test_root_quantities_may_constrain_a_traced_pattern():
    """abscissa ≤ −1 along the EP set: −b/2 + √(b²/4 − c) = −1 with c = √12.5, so b = 1 + √12.5, where 2EP2."""
    found = traced("2EP2", BASE, SPACE, {"fast": "abscissa <= -1", "damped": "damping_ratio >= 0.8"})
    (branch,) = found.branches
    rows = {e.detail: [] for e in events(found, "constraint")}
    for e in events(found, "constraint"):
        rows[e.detail].append(e.index)
    b, c = branch.unknowns["b"], math.sqrt(12.5)
    # CEP2 has the abscissa −b/2 and the ratio b/(2√c)
    assert sorted(b[rows["fast"]]) == pytest.approx([2.0, 1 + c], abs=1e-11)
    assert b[rows["damped"]] == pytest.approx([1.6 * math.sqrt(c)], abs=1e-11)
    true = np.where(b * b > 4 * c, (b < 1 + c), b > 2) & ((b * b > 4 * c) | (b > 1.6 * math.sqrt(c)))
    clear = np.ones(len(branch), dtype=bool)
    clear[rows["fast"] + rows["damped"]] = False
    assert np.array_equal(branch.satisfied[clear], true[clear])


def test_equalities_are_kept_along_the_curve():
    """EP2 with the speed tied to the critical one: checked by the closed form, not by the program's Fr_c."""
    free = {"Fr": (0.01, 5.0), "lambda_s": (0.01, 1.4), "chi_B": (1.05, 1.9)}
    found = traced("EP2", BASE, free, {"tied": "Fr == 1.5 * Fr_c"})
    assert found.branches
    for branch in found.branches:
        p = branch.parameters
        law = laws.Frc1(p["chi_B"], -0.4, -0.2, p["lambda_s"])
        assert p["Fr"] ** 2 == pytest.approx(2.25 * law, rel=1e-12)
    check_every_point(found, stride=13)


# Invariants of the whole


def test_seed_and_step_do_not_change_what_is_found(planes):
    fixed, free, *_ = PLANES["fig2 right"]
    other = traced("EP2", BASE | fixed, free, seed=1, step=0.01, starts=48)
    reference = planes["fig2 right"]
    assert len(other.branches) == len(reference.branches)
    for a, b in zip(other.branches, reference.branches, strict=True):
        assert float(a.arclength[-1]) == pytest.approx(float(b.arclength[-1]), rel=1e-3)
        named = [sorted((e.name, round(e.parameters["Fr"], 9)) for e in x.events) for x in (a, b)]
        assert named[0] == named[1]


def test_ends_are_on_the_edges_that_they_name(planes):
    for name, found in planes.items():
        free = PLANES[name][1]
        for event in events(found, "end"):
            parameter, side = event.detail.split(".")
            assert event.parameters[parameter] == free[parameter][side == "max"]


def test_a_limit_that_its_tangent_does_not_return_is_met_exactly():
    limit = 0.249
    assert math.atan(math.tan(limit)) < limit
    found = traced("weave", BASE | {"chi_B": SQRT2}, {"Fr": (0.01, 5.0), "lambda_s": (limit, 1.0)})
    assert limit in [e.parameters["lambda_s"] for e in events(found, "end")]
    assert min(b.parameters["lambda_s"].min() for b in found.branches) == limit


def test_rows_json_and_csv_hold_the_same_numbers(planes, tmp_path):
    found, path = planes["fig2 left"], tmp_path / "branches.csv"
    found.write_csv(path)
    rows, data = pytest.importorskip("pandas").read_csv(path), found.to_json()
    assert len(rows) == found.points == data["points"]
    for (_, own), branch, written in zip(rows.groupby("branch"), found.branches, data["branches"], strict=True):
        assert own["Fr"].tolist() == branch.parameters["Fr"].tolist() == written["columns"]["Fr"]
        assert own["d_lambda_s"].tolist() == branch.tangent["lambda_s"].tolist()
        assert own["stable"].tolist() == branch.stable.tolist() == written["columns"]["stable"]
        for event in written["events"]:
            assert event["parameters"]["Fr"] == written["columns"]["Fr"][event["index"]]


# Bad questions


@pytest.mark.parametrize(
    ("pattern", "free", "words"),
    [
        ("EP2", {"Fr": (0.1, 5.0)}, "2 free parameters"),
        ("EP2", {"Fr": (0.1, 5.0), "chi_B": (1.1, 2.0), "lambda_s": (0.1, 1.0)}, "fix 1 of them"),
        ("EP4", {"Fr": (0.1, 5.0), "chi_B": (1.1, 2.0), "lambda_s": (0.1, 1.0)}, "free 1 more"),
        ("EP5", {"Fr": (0.1, 5.0), "lambda_s": (0.1, 1.0)}, "EP5"),
        (None, {"Fr": (0.1, 5.0), "lambda_s": (0.1, 1.0)}, "no pattern"),
    ],
)
def test_a_question_that_leaves_no_curve_is_refused(pattern, free, words):
    fixed = {n: v for n, v in {**BASE, "chi_B": 1.3, "lambda_s": 0.3}.items() if n not in free}
    with pytest.raises(InputError, match=words):
        trace(Problem(model=tms, fixed=fixed, free=free), pattern)


def test_nothing_of_the_pattern_is_an_empty_trace():
    found = traced("EP3", BASE, {"Fr": (0.01, 0.1), "chi_B": (1.01, 1.1), "lambda_s": (1.2, 1.3)}, starts=8)
    assert found.branches == ()
    assert found.to_json()["branches"] == []


def test_through_begins_where_it_is_told():
    """With no start of its own the search finds the branch through the published 2EP2 design (Table 1)."""
    free = {"Fr": (0.5, 5.0), "chi_B": (1.01, 3.0), "lambda_s": (0.02, 1.48)}
    angle = math.atan(TAN_EP4) - 0.05
    point = {"chi_B": SQRT2, "lambda_s": angle, "Fr": 2.257421384}
    found = traced("2EP2", BASE, free, starts=0, through=[point])
    (branch,) = found.branches
    near = np.argmin(np.abs(branch.parameters["lambda_s"] - angle))
    assert branch.parameters["lambda_s"][near] == pytest.approx(angle, abs=0.05)
    assert traced("2EP2", BASE, free, starts=0).branches == ()


# Nothing that a grid can see is missed


def test_a_short_branch_far_from_every_start_is_found():
    """A double root at zeta_B = −2: 0.7050941 by Newton at 40 digits; 48 starts alone find one branch of two."""
    fixed = {"Fr": 0.15012234384726733, "chi_B": 1.0498249944786298, "chi_H": 1.39922070585915}
    fixed |= {"zeta_H": -1.50192108723902, "lambda_s": 0.9773246612059618}
    free = {"mu": (0.01, 20.0), "zeta_B": (-2.0, -0.1)}
    found = traced("EP2", fixed, free, starts=1)
    assert len(found.branches) == 2
    ends = [e.parameters for e in events(found, "end") if e.detail == "zeta_B.min"]
    assert any(abs(p["mu"] - 0.670327) < 1e-6 for p in ends)


def discriminant(a, b, c, d, e):
    """By the invariants of a quartic."""
    i, j = 12 * a * e - 3 * b * d + c * c, 72 * a * c * e + 9 * b * c * d - 27 * (a * d * d + e * b * b) - 2 * c**3
    return 4 * i**3 - j**2


CHANGES = {
    "EP2": discriminant,
    "weave": lambda a, b, c, d, e: np.where(b * d > 0, b * c * d - a * d * d - b * b * e, np.nan),
    "capsize": lambda a, b, c, d, e: e,
}


@pytest.mark.parametrize("pattern", CHANGES)
def test_every_sign_change_on_a_grid_lies_on_a_branch(pattern):
    """Discriminant, Hurwitz determinant and a4 from the oracle's coefficients, on a grid finer than the program's."""
    rng = np.random.default_rng(8)
    box = {"Fr": (0.1, 5), "mu": (0.01, 20), "chi_B": (0.2, 3), "chi_H": (0.7, 1.3)}
    box |= {"zeta_B": (-1.2, -0.1), "zeta_H": (-1.2, -0.1), "lambda_s": (-1.4, 1.4)}
    numbers = sympy.lambdify(list(curves.SYMBOLS.values()), list(curves.COPO))
    for _ in range(3):
        names = [str(n) for n in rng.choice(list(box), 2, replace=False)]
        fixed = {n: float(rng.uniform(*box[n])) for n in box if n not in names}
        found = traced(pattern, fixed, {n: box[n] for n in names})
        low, high = np.array([box[n] for n in names]).T
        share = np.moveaxis(np.mgrid[0:301, 0:301] / 300, 0, -1)
        values = fixed | dict(zip(names, np.moveaxis(low + share * (high - low), -1, 0), strict=True))
        a = np.stack(
            np.broadcast_arrays(*numbers(*(values[n] for n in NAMES[:-1]), np.tan(values["lambda_s"])), share[..., 0])
        )
        value = CHANGES[pattern](*a[:5])
        along = np.argwhere(value[1:] * value[:-1] < 0) + np.array([0.5, 0])
        edges = np.concatenate([along, np.argwhere(value[:, 1:] * value[:, :-1] < 0) + np.array([0, 0.5])])
        lines = [
            (np.stack([b.parameters[n] for n in names], axis=-1) - low) / (high - low) * 300 for b in found.branches
        ]
        for edge in edges[:: max(1, len(edges) // 60)]:
            assert distance(edge, lines) <= 1.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"step": math.nan}, "step: found nan; accepted: a number from 1e-06 to 0.1"),
        ({"step": 0}, "step: found 0"),
        ({"step": -0.1}, "step: found -0.1"),
        ({"step": 5.0}, "step: found 5.0"),
        ({"starts": -1}, "starts: found -1; accepted: a whole number"),
        ({"most": 0}, "most: found 0"),
        ({"through": [{"Fr": 2.0}]}, "through: found Fr; accepted: each of Fr, lambda_s"),
        ({"through": [{"Fr": math.nan, "lambda_s": 0.3}]}, "outside the box"),
        ({"through": [{"Fr": 50.0, "lambda_s": 0.3}]}, "Fr = 50.0 lies outside the box"),
    ],
)
def test_options_out_of_range_are_refused(options, words):
    with pytest.raises(InputError, match=re.escape(words)):
        traced("EP2", BASE | {"chi_B": SQRT2}, {"Fr": (0.1, 5.0), "lambda_s": (0.01, 1.4)}, **options)


def test_a_box_one_rounding_wide_is_a_number():
    fixed, free = BASE | {"chi_B": SQRT2}, {"Fr": (2.0, 2.0000000000000004), "lambda_s": (0.01, 1.4)}
    with pytest.raises(InputError, match="found 1 "):
        traced("EP2", fixed, free)


@pytest.mark.slow
def test_a_long_branch_that_the_first_starts_miss_is_found():
    """All three are met by 384 starts of any seed; the first 48 of seed 0 find the one of length 0.197."""
    fixed = {"Fr": 2.9237, "chi_B": 0.9004, "zeta_B": -0.2254, "zeta_H": -0.4156}
    free = {"chi_H": (0.7, 1.3), "lambda_s": (-1.4, 1.4), "mu": (0.01, 20.0)}
    for seed in (0, 1):
        found = traced("2EP2", fixed, free, starts=48, seed=seed)
        assert len(found.branches) == 3
        assert max(mismatch(b, k) for b in found.branches for k in range(0, len(b), 11)) <= 1e-13


def test_a_surface_of_perfect_squares_is_not_walked():
    """At chi_H = chi_B = 1 and zeta_B = zeta_H the polynomial is a square for every Fr: no curve, but a surface."""
    fixed = {"mu": 0.3341, "chi_H": 1.0, "zeta_B": -1.1624, "lambda_s": 0.8738}
    p = exact_polynomial(fixed | {"Fr": 1.7, "chi_B": 1.0, "zeta_H": -1.1624})
    assert p[1] == p[3] == 0
    assert float(p[2] ** 2 / p[0] / p[4]) == pytest.approx(4, abs=1e-12)
    found = traced("2EP2", fixed, {"chi_B": (0.2, 3.0), "Fr": (0.1, 5.0), "zeta_H": (-1.2, -0.1)})
    walked = [np.abs(b.parameters["chi_B"] - 1) + np.abs(b.parameters["zeta_H"] + 1.1624) for b in found.branches]
    assert sum(np.sum(apart < 1e-6) for apart in walked) < 100


def test_a_flat_minimum_is_a_fold():
    """Fr over the EP4 curve is least where its tangent vanishes, once; by differences of its own points."""
    fixed = {"mu": 0.0172, "chi_B": 1.5213, "zeta_H": -0.2246}
    free = {"chi_H": (0.7, 1.3), "zeta_B": (-1.2, -0.1), "lambda_s": (-1.4, 1.4), "Fr": (0.1, 5.0)}
    found = traced("EP4", fixed, free)
    (branch,) = found.branches
    k = int(np.argmin(branch.parameters["Fr"]))
    assert 0 < k < len(branch) - 1
    folds = [e for e in events(found, "fold") if "Fr" in e.detail]
    assert [e.parameters["Fr"] for e in folds] == pytest.approx([branch.parameters["Fr"][k]], abs=1e-12)


@pytest.mark.slow
def test_no_fold_where_a_parameter_runs_on():
    """Beside chi_B = chi_H = 1, lambda_s = 0 the equations are singular, and the tangent alone is noise."""
    fixed = {"Fr": 2.322, "mu": 0.0105, "chi_H": 1.0, "zeta_B": -0.5435, "zeta_H": -0.3305}
    found = traced("EP2", fixed, {"lambda_s": (-0.121, 0.628), "chi_B": (0.514, 1.439)})
    for branch in found.branches:
        for event in (e for e in branch.events if e.name == "fold"):
            k = event.index
            around = (
                branch.parameters[event.detail.split(",")[0]][[k - 1, k + 1]]
                - event.parameters[event.detail.split(",")[0]]
            )
            assert around[0] * around[1] > 0


def test_a_curve_comes_back_from_infinity():
    """A root goes to −∞ and comes from +∞ along one discriminant curve, cut in two at a0 = 0 and thinner than a grid."""
    fixed = {"Fr": 0.4538, "mu": 0.0146, "zeta_B": -1.1496, "zeta_H": -0.8924, "chi_H": 1.0}
    found = traced("EP2", fixed, {"chi_B": (0.2, 3.0), "lambda_s": (-1.4, 1.4)})
    limits = [e.parameters["chi_B"] for e in events(found, "end") if "infinity" in e.detail]
    assert sum(abs(x - 1.0139132) < 1e-6 for x in limits) == 2  # both sides of lambda_s = 0
    (cusp,) = [e for e in events(found, "EP3") if e.parameters["lambda_s"] > 0.0004]
    branch = next(b for b in found.branches if cusp in b.events)
    start = dict(cusp.parameters) | {"s": float(branch.unknowns["r"][cusp.index])}
    true = certified(equations("EP3"), {n: start[n] for n in ("chi_B", "lambda_s", "s")}, fixed)
    assert cusp.parameters["chi_B"] == pytest.approx(float(true["chi_B"]), abs=1e-10)


def test_points_that_lost_their_digits_beside_infinity_are_cut():
    """Where a0 = a1 = 0 a double root goes to infinity: the branch stays, without the points that do not fit it."""
    fixed = {"Fr": 3.5559, "mu": 0.058, "chi_B": 2.8386, "chi_H": 1.1037, "zeta_B": -0.7215}
    found = traced("EP2", fixed, {"lambda_s": (-1.4, 1.4), "zeta_H": (-1.2, -0.1)})
    to_infinity = [b for b in found.branches if np.abs(b.unknowns["r"]).max() > 1e4]
    assert max(np.ptp(b.parameters["lambda_s"]) for b in to_infinity) > 1.5
    assert all(any("infinity" in e.detail for e in b.events) for b in to_infinity)  # wherever rounding stops the steps
    for branch in to_infinity:
        assert branch.residual <= 1e-6
        assert max(mismatch(branch, k) for k in (0, 1, len(branch) - 2, len(branch) - 1)) <= 1e-6


def test_a_curve_that_hugs_a0_zero_is_found():
    """A double root near infinity: the discriminant and a0 change sign within one edge of the grid, whatever Fr."""
    fixed = {"mu": 11.5892, "chi_B": 0.3972, "chi_H": 0.7779, "zeta_B": -0.1568, "zeta_H": -0.5159}
    found = traced("EP2", fixed, {"Fr": (0.241, 0.825), "lambda_s": (-1.4, 1.4)}, starts=1)
    assert found.branches
    (branch,) = (b for b in found.branches if np.ptp(b.parameters["Fr"]) > 0.5)
    limit = math.atan((0.7779 - 1) / -0.5159)  # a0 = 0
    assert np.abs(branch.parameters["lambda_s"] - limit).max() < 0.02
    k = len(branch) // 2
    start = {"lambda_s": float(branch.parameters["lambda_s"][k]), "s": float(branch.unknowns["r"][k])}
    true = certified(equations("EP2"), start, fixed | {"Fr": float(branch.parameters["Fr"][k])})
    assert branch.parameters["lambda_s"][k] == pytest.approx(float(true.lambda_s), abs=1e-12)


@pytest.mark.parametrize("beside", [-1e-3, 1e-4])
def test_an_ep4_is_met_once_and_in_its_place_beside_other_events(beside: float) -> None:
    # an exact EP4 takes the place of one that was found between two rows, next to what else is there
    tilt = 0.4107 + beside
    near = Event("near", lambda point: point["lambda_s"] - tilt)
    (branch,) = trace(EP_SET, events=[near]).branches
    tilts = [event.parameters["lambda_s"] for event in branch.events]
    assert [event.name for event in branch.events].count("EP4") == 1
    assert tilts in (sorted(tilts), sorted(tilts, reverse=True))
    assert np.all(np.diff(branch.arclength) > 0)
