"""Nearest points of the boundaries: closed forms, dense rays, first-order conditions, invariances."""

import json
import math
from dataclasses import replace
from importlib import import_module
from itertools import islice

import casadi as ca
import numpy as np
import pytest
import sympy  # type: ignore[import-untyped]
from helpers.oracles import polynomial_exact, routh_exact, symbolic_copo

import tmsopt
from tmsopt import laws
from tmsopt.boundaries import nearest, robustness
from tmsopt.documents import describe_robustness
from tmsopt.errors import InputError
from tmsopt.evaluation import recheck
from tmsopt.models import from_coefficients, from_matrices, tms, to_si
from tmsopt.problem import Problem
from tmsopt.roots import roots

pytestmark = pytest.mark.slow

NAMES = ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")
KINDS = ("weave", "capsize", "infinity", "heavy damping")

FORWARD = dict(zip(NAMES, (3.0, 0.1, 1.3, 1.0, -0.4, -0.2, 0.3), strict=True))
BACKWARD = dict(zip(NAMES, (2.24, 0.25, 0.44, 1.0, -0.2, -0.9, -0.1), strict=True))
OFF = dict(zip(NAMES, (3.5, 20.8, 1.19, 1.02, -0.4, -0.2, 0.85), strict=True))
DAMPED = dict(zip(NAMES, (2.469, 0.1, 1.318, 1.0, -0.4, -0.2, 0.133), strict=True))
DESIGNS = {"forward": FORWARD, "backward": BACKWARD, "off the law": OFF, "heavily damped": DAMPED}


def problem(design):
    return Problem(model=tms, fixed=design)


def coefficients(columns):
    """The law's coefficients, shape (…, 5), positive a0."""
    a = np.stack(np.broadcast_arrays(*laws.copo(**columns)), axis=-1)
    return a * np.sign(a[..., :1])


def stable(columns):
    """By every coefficient and the Hurwitz determinant of a quartic."""
    a0, a1, a2, a3, a4 = np.moveaxis(coefficients(columns), -1, 0)
    positive = (a0 > 0) & (a1 > 0) & (a2 > 0) & (a3 > 0) & (a4 > 0)
    return positive & (a1 * a2 * a3 - a0 * a3**2 - a4 * a1**2 > 0)


def moved(design, weights, u):
    """Parameters at displacements of shape (…, weights), inside the physical ranges."""
    columns = {n: np.full(u.shape[:-1], v) for n, v in design.items()}
    for k, (n, w) in enumerate(weights.items()):
        columns[n] = design[n] + w * u[..., k]
    for n in ("Fr", "mu"):
        columns[n] = np.maximum(columns[n], 0)
    for n in ("zeta_B", "zeta_H"):
        columns[n] = np.minimum(columns[n], 0)
    columns["lambda_s"] = np.clip(columns["lambda_s"], -1.57, 1.57)
    return columns


# Closed forms, one parameter at a time


@pytest.mark.parametrize("name", ["forward", "off the law"])
def test_only_the_speed_varies(name):
    """Weave is then at Fr_c (equation flus), and neither capsize nor infinity depend on the speed (copo: a4, a0)."""
    design = DESIGNS[name]
    critical = float(laws.Fr_c(**{n: v for n, v in design.items() if n != "Fr"}))
    assert 0 < critical < design["Fr"]
    found = robustness(problem(design), weights={"Fr": design["Fr"]})
    assert found.weave.distance == pytest.approx(1 - critical / design["Fr"], rel=1e-12)
    assert found.weave.parameters["Fr"] == pytest.approx(critical, rel=1e-12)
    assert found.weave.direction["Fr"] == pytest.approx(critical / design["Fr"] - 1, rel=1e-12)
    assert found.limit is found.weave
    assert not found.capsize.found
    assert not found.infinity.found


def test_only_the_tilt_varies_on_the_law():
    """χ_H = 1: a4 = −ζ_B T and a0 = −ζ_H T ζ_B² (copo), both 0 exactly at λ_s = 0."""
    for design in (FORWARD, BACKWARD):
        found = robustness(problem(design), weights={"lambda_s": 0.5})
        for n in (found.capsize, found.infinity):
            assert n.distance == pytest.approx(abs(design["lambda_s"]) / 0.5, rel=1e-9)
            assert n.parameters["lambda_s"] == pytest.approx(0, abs=1e-10)


def test_only_the_tilt_varies_off_the_law():
    """a4 = 0 at tan λ_s = −μ (χ_H − 1)/ζ_B (copo)."""
    tilt = math.atan(-OFF["mu"] * (OFF["chi_H"] - 1) / OFF["zeta_B"])
    found = nearest(problem(OFF), "capsize", weights={"lambda_s": 1.0})
    assert found.parameters["lambda_s"] == pytest.approx(tilt, rel=1e-12)


# Nothing is nearer


@pytest.mark.parametrize("name", DESIGNS)
def test_no_ray_finds_a_nearer_change(name):
    """20 000 directions, half of them around the answer's, at four radii below the one reported."""
    design = DESIGNS[name]
    weights = {n: abs(v) if name in ("forward", "off the law") else 1.0 for n, v in design.items()}
    found = robustness(problem(design), weights=weights)
    rng = np.random.default_rng(1)
    random = rng.standard_normal((20_000, len(weights)))
    random /= np.linalg.norm(random, axis=1, keepdims=True)
    for answer, inside in ((found.limit, stable), (found.heavy_damping, _damped if found.heavily_damped else None)):
        if inside is None:
            continue
        rays = random.copy()
        rays[::2] = np.array(list(answer.direction.values())) / answer.distance + 0.3 * rays[::2]
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        for share in (1 - 1e-9, 0.9, 0.6, 0.3):
            assert inside(moved(design, weights, share * answer.distance * rays)).all()
        # And beyond the answer there is a change.
        straight = np.array(list(answer.direction.values()))
        assert not inside(moved(design, weights, (1 + 1e-6) * straight[None, :])).any()


def _damped(columns):
    """By the roots: rounding scatters a double root by 1e-8, and 1e-6 beyond the edge it has parted by 1e-4."""
    z = roots(coefficients(columns))
    return (np.abs(z.imag).max(axis=-1) <= 1e-6 * np.abs(z).max(axis=-1)) & (z.real.max(axis=-1) < 0)


# On the edge, beyond it, and invariances


def test_an_ep4_is_on_the_edge_of_heavy_damping():
    ep4 = laws.ep4_chi_H_1(-0.4, -0.2)
    design = FORWARD | {"chi_B": float(ep4.chi_B), "Fr": float(ep4.Fr), "lambda_s": float(ep4.lambda_s)}
    found = robustness(problem(design))
    assert found.stable
    assert found.heavily_damped
    assert found.heavy_damping.distance == 0
    assert 0 < found.radius < 1


def test_a_real_double_pair_is_on_the_edge_and_a_complex_one_is_not():
    """Along the EP set (equation epset) Fr < Fr of EP4 or T beyond it give 2EP2 or CEP2; told apart by b² − 4c."""
    for tilt in (0.3, 0.6):
        Fr = float(laws.epset(-0.4, -0.2, tilt))
        design = FORWARD | {"chi_B": math.sqrt(2), "Fr": Fr, "lambda_s": tilt}
        z = roots(coefficients(design))
        found = robustness(problem(design))
        on_edge = bool(np.abs(z.imag).max() < 1e-6)
        assert (found.heavy_damping.distance == 0) == on_edge
        assert found.heavily_damped == on_edge


def test_just_inside_and_just_outside_heavy_damping():
    """Only the speed varies: the edge is where the discriminant (SymPy) vanishes, from either side."""
    a, symbols = symbolic_copo()
    s = sympy.Symbol("s")
    at = {"T": math.tan(DAMPED["lambda_s"]), **{n: v for n, v in DAMPED.items() if n not in ("Fr", "lambda_s")}}
    exact = {symbols[n]: sympy.Rational(v) for n, v in at.items()}
    p = sympy.Poly(sum(c.subs(exact) * s ** (4 - k) for k, c in enumerate(a)), s)
    edges = [float(x) for x in sympy.Poly(p.discriminant(), symbols["Fr"]).nroots(n=30) if x.is_real and x > 0]
    for Fr in (DAMPED["Fr"], DAMPED["Fr"] * 1.01, DAMPED["Fr"] * 0.99):
        found = nearest(problem(DAMPED | {"Fr": Fr}), "heavy damping", weights={"Fr": 1.0})
        assert found.distance == pytest.approx(min(abs(e - Fr) for e in edges), rel=1e-6)


def test_the_radius_of_a_recheck_has_the_weights_of_its_problem():
    """Twice the change counts as 1: half the radius; distances in the same units as `nearest` gives them."""
    asked = replace(problem(OFF), constraints={"room": "radius >= 0.001"})
    once, twice = (replace(asked, weights={"Fr": w, "chi_B": w}) for w in (0.1, 0.2))
    one, two = (tmsopt.solve(p).quantities["radius"] for p in (once, twice))
    assert one == pytest.approx(robustness(problem(OFF), weights={"Fr": 0.1, "chi_B": 0.1}).radius, rel=1e-12)
    assert two == pytest.approx(one / 2, rel=1e-9)


def test_a_recheck_finds_the_radius_without_ipopt(monkeypatch):
    """Of 15 random stable designs, by another method: as near as what IPOPT found, or it would be no recheck."""
    rng, claimed = np.random.default_rng(39), []
    while len(claimed) < 15:
        low, high = (0.5, 0.01, 0.2, 0.5, -2, -1.5, -1), (6, 10, 2, 2, -0.05, -0.05, 1.2)
        design = dict(zip(NAMES, rng.uniform(low, high).tolist(), strict=True))
        if stable({n: np.array(x) for n, x in design.items()}):
            claimed.append((design, robustness(problem(design)).radius))

    def nothing(*arguments, **options):
        raise AssertionError

    for name in ("program.ipopt", "boundaries.nearest"):
        monkeypatch.setattr(import_module(f"tmsopt.{name}"), "make_ipopt", nothing)
    for design, radius in claimed:
        asked = replace(problem(design), constraints={"far": "radius >= 0"}).posed
        assert recheck(asked, design).quantities["radius"] == pytest.approx(radius, rel=1e-8)


def test_a_radius_that_is_kept_is_that_of_the_weights():
    """The same object, its weights changed in place: c = 0 is at 1, and k = 0 then at 4/8."""
    weights = {"c": 1.0, "k": 1.0}
    swing = Problem(from_coefficients([1, "c", "k"]), {"c": 1.0, "k": 4.0}, constraints={"far": "radius >= 0.6"})
    swing = replace(swing, weights=weights)
    radii = [tmsopt.solve(swing, throw=False).quantities["radius"]]
    swing.weights.update(k=8.0)
    radii.append(tmsopt.solve(swing, throw=False).quantities["radius"])
    assert radii == pytest.approx([1.0, 0.5], abs=1e-12)


def test_an_unstable_design_has_no_radius():
    design = FORWARD | {"Fr": 0.5}
    critical = float(laws.Fr_c(**{n: v for n, v in design.items() if n != "Fr"}))
    found = robustness(problem(design), weights={"Fr": 0.5})
    assert not found.stable
    assert found.radius == 0
    assert found.to_stability == pytest.approx(critical / 0.5 - 1, rel=1e-12)
    assert "not stable" in describe_robustness(found)


@pytest.mark.parametrize("name", ["backward"])
def test_units_do_not_matter(name):
    """Shapes and speed only: w, m_B and g stay, so relative changes of SI and dimensionless parameters are the same."""
    design = DESIGNS[name]
    si = to_si(design, w=1.1, m_B=17.0)
    native = {n: abs(design[n]) for n in NAMES}
    partner = dict(zip(NAMES, ("v", "m_H", "x_B", "x_H", "z_B", "z_H", "lambda_s"), strict=True))
    first = robustness(problem(design), weights=native)
    second = robustness(problem(si), weights={partner[n]: abs(si[partner[n]]) for n in NAMES})
    assert second.radius == pytest.approx(first.radius, rel=1e-9)
    assert second.limit.kind == first.limit.kind
    for n in NAMES:
        assert second.limit.direction[partner[n]] == pytest.approx(first.limit.direction[n], abs=1e-6)


def test_weights_are_units():
    """Twice the weights, half the distance; a weight 0 and a missing one hold a parameter."""
    weights = {n: abs(v) for n, v in OFF.items()}
    once = robustness(problem(OFF), weights=weights)
    twice = robustness(problem(OFF), weights={n: 2 * w for n, w in weights.items()})
    assert robustness(problem(OFF)).radius == pytest.approx(once.radius, rel=1e-12)
    assert twice.radius == pytest.approx(once.radius / 2, rel=1e-9)
    held = nearest(problem(OFF), "capsize", weights=weights | {"chi_H": 0})
    assert held.parameters["chi_H"] == OFF["chi_H"]
    assert "chi_H" not in held.direction
    assert held.distance > once.capsize.distance


def test_zeros_in_parameters():
    """μ = 0 at χ_H = 1 changes no coefficient, so nothing but μ's own weight differs; Fr = 0 is at weave already."""
    assert robustness(problem(FORWARD | {"mu": 0.0})).weights["mu"] == 1
    at_rest = robustness(problem(FORWARD | {"Fr": 0.0}))
    assert (at_rest.stable, at_rest.radius) == (False, 0)


def test_a_solution_is_accepted():
    free = Problem(
        model=tms,
        fixed={n: FORWARD[n] for n in ("chi_H", "zeta_B", "zeta_H", "mu")},
        free={"Fr": (0.01, 10), "chi_B": (1.01, 5), "lambda_s": (0.02, 1.4)},
        minimize="abscissa",
    )
    design = tmsopt.solve(free)
    found = tmsopt.robustness(design)
    assert found.heavy_damping.distance == 0
    assert found.parameters["Fr"] == design.parameters["Fr"]
    written = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert written["radius"] == found.radius
    assert set(written["nearest"]) == set(KINDS)
    assert found.report().startswith("robustness: ")
    with pytest.raises(InputError, match="give values of the free parameters"):
        tmsopt.robustness(free)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"pattern": "wobble"}, "accepted: weave capsize"),
        ({"weights": {"chi": 1.0}}, "unknown parameter 'chi'"),
        ({"weights": {"Fr": -1.0}}, "accepted: a number above 0"),
        ({"weights": {"Fr": 0.0}}, "no weight is above 0"),
        ({"parameters": {"Fr": -1.0}}, "Froude number"),
        ({"parameters": {"Fr": math.nan}}, "finite number"),
    ],
)
def test_bad_input_is_told(arguments, told):
    with pytest.raises(InputError, match=told):
        nearest(problem(FORWARD), **{"pattern": "weave"} | arguments)


# Boundary points in exact arithmetic, and designs on the edge


OSCILLATOR = from_matrices([[ca.SX.sym("m")]], [[ca.SX.sym("c")]], [[ca.SX.sym("k")]])


def oscillator(m, c, k):
    return Problem(model=OSCILLATOR, fixed={"m": m, "c": c, "k": k})


@pytest.mark.parametrize(
    ("m", "c", "k", "edges", "zeros"),
    [
        (1.0, 0.0, 2.0, ("weave",), ("c",)),
        (1.0, 0.1, 0.0, ("capsize",), ("k",)),
        (0.0, 0.1, 2.0, ("infinity",), ("m",)),
        (1.0, 0.1, 2.0, (), ()),
        (1.0, 1e-9, 2.0, (), ()),
        (1.0, 0.0, -2.0, (), ()),  # a root at √2
        (0.3, 0.1 * 3 - 0.3, 2.0, ("weave",), ()),  # 5.6e-17: on the edge as far as rounding tells
    ],
)
def test_an_oscillator_without_damping_is_on_the_edge(m, c, k, edges, zeros):
    """m s² + c s + k is stable exactly where all three are positive."""
    found = robustness(oscillator(m, c, k))
    assert (found.edges, found.zeros) == (edges, zeros)
    assert found.stable == (min(m, c, k) > 0 and not edges)
    if edges:
        assert found.limit.kind == edges[0]
        assert found.limit.distance == found.radius == found.to_stability == 0
        reason = f", because {zeros[0]} = 0" if zeros else ", with"
        told = f"none: the design is on the edge of stability{reason}"
        assert describe_robustness(found).startswith(told)
        assert "-0" not in found.report()


def test_what_a_change_does_is_said_in_the_words_of_a_model():
    """c = 0 is the nearest edge of m = 1, c = 0.1, k = 2, at 100 % like the others; of a bicycle it is weave."""
    damped = oscillator(1.0, 0.1, 2.0)
    for of, weights, words in (
        (damped, {"c": 1.0}, "a change of 0.1 times the weights makes it unstable (flutter)"),
        (damped, {"k": 1.0, "c": 1.0}, "a change of 0.1 times the weights, mostly in c, makes it unstable (flutter)"),
        (damped, {"k": 1.0}, "makes it unstable (divergence)"),
        (oscillator(1.0, -0.1, 2.0), {"c": 0.05}, "not stable; a change of 2 times the weights makes it stable"),
        (problem(FORWARD), {"Fr": FORWARD["Fr"]}, "makes it unstable (weave)"),
    ):
        assert describe_robustness(robustness(of, weights=weights)).endswith(words)


def test_no_boundary_point_is_one_of_cancellation_alone():
    """(x − y) (s² + c s + 1) has no root anywhere at x = y, and the same ones on either side."""
    x, y, c = (ca.SX.sym(n) for n in "xyc")
    model = from_coefficients([x - y, (x - y) * c, x - y])
    found = robustness(Problem(model=model, fixed={"x": 1.3, "y": 0.1, "c": 0.4}), weights={"x": 1.0, "y": 1.0})
    assert found.stable
    assert not found.limit.found
    assert describe_robustness(found).endswith("makes it unstable")


def test_beside_every_boundary_point_of_stable_designs_there_is_an_unstable_one():
    """By exact arithmetic; corners are among the points, where ever more coefficients vanish."""
    rng = np.random.default_rng(7)
    low, high = (np.array(v) for v in ((0.3, 0.05, 0.3, 0.7, -1.0, -1.0, 0.05), (4.0, 5.0, 1.6, 1.2, -0.1, -0.1, 0.9)))
    drawn = (dict(zip(NAMES, x.tolist(), strict=True)) for x in low + (high - low) * rng.random((2000, 7)))
    for design in islice(filter(exactly, drawn), 5):
        found = robustness(problem(design))
        assert found.stable
        for near in (found.weave, found.capsize, found.infinity):
            if near.found:
                u = np.array(list(near.direction.values()))
                rays = u + near.distance * rng.choice([1e-6, 1e-3, 0.05], (4000, 1)) * rng.standard_normal((4000, 7))
                at = moved(design, dict(found.weights), rays)
                other = np.flatnonzero(~stable(at))[:20]
                assert any(not exactly({n: float(at[n][k]) for n in NAMES}) for k in other)


def exactly(design):
    """Stability by the Routh table in fractions, of the tangent as the double that it rounds to."""
    at = {n: v for n, v in design.items() if n != "lambda_s"}
    a = polynomial_exact(**at, tan_lambda_s=math.tan(design["lambda_s"]))
    return a[0] != 0 and routh_exact(a)


def test_an_undamped_oscillator_without_stiffness_has_both_roots_at_0():
    """s² = 0: the scale of the roots underflows when their product does, as at 5e-324."""
    assert abs(roots([1.0, 5e-324, 0.0])).max() <= 1e-160
    assert robustness(oscillator(1.0, 0.0, 0.0)).edges == ("capsize",)


def test_where_a_root_only_touches_the_axis_a_farther_edge_is_found():
    """ω = −i g/2 ± √(k² − g²/4) is real at k = 0, but decays on both sides of it; g < 0 is gain."""
    dimer = tmsopt.Problem(tmsopt.models.from_hamiltonian([["-1j*g", "k"], ["k", 0]]), fixed={"g": 2.0, "k": 1.0})
    assert tmsopt.robustness(dimer).radius == pytest.approx(1, abs=1e-9)
    assert tmsopt.robustness(dimer).weave.parameters["g"] == pytest.approx(0, abs=1e-9)
