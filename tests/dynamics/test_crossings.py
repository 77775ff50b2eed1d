"""Places where roots meet, of polynomials that are special for every value: roots 0, mirrored, repeated. Closed forms."""

import math
import re

import pytest

import tmsopt
from tmsopt.dynamics import find_crossings, stable_speeds
from tmsopt.models import from_matrices


def _speeds(free, between, **matrices):
    return tmsopt.speeds(tmsopt.Problem(from_matrices(**matrices), free={free: between}), free)


def test_a_rigid_body_mode_does_not_hide_an_exceptional_point():
    """Masses 1 and 2, spring 3, damper d: s² (2s² + 3d s + 9) has a double root −3d/4 where d² = 8."""
    free = [[2], [0, 3], [9], [0], [0]]
    found = find_crossings(free, 0, 10)
    (ep2,) = found.found
    assert (ep2.kind, ep2.root.multiplicity) == ("EP2", 2)
    assert ep2.at == pytest.approx(2 * math.sqrt(2), rel=1e-15)
    assert ep2.root.re == pytest.approx(-3 / math.sqrt(2), rel=1e-15)
    assert (found.always, found.zeros, found.stable, found.marginal) == (("capsize",), 2, (), ((0, 10),))


def test_pt_symmetric_trimer():
    """A = [[g, −1, 0], [1, 0, −1], [0, 1, −g]]: s (s² + 2 − g²), on the axis below g = √2, a triple root 0 there."""
    found = find_crossings([[1], [0], [2, 0, -1], [0]], 0, 5)
    assert {(c.kind, c.root.re, c.root.im, c.root.multiplicity, c.changes) for c in found.found} == {
        ("capsize", 0, 0, 3, True),
        ("EP3", 0, 0, 3, True),
    }
    assert all(c.at == pytest.approx(math.sqrt(2), rel=1e-15) for c in found.found)
    assert (found.always, found.zeros, found.stable) == (("capsize", "weave"), 1, ())
    assert found.marginal == ((0, pytest.approx(math.sqrt(2), rel=1e-15)),)


def test_gyroscopic_stabilisation():
    """s⁴ + (Ω² − 3) s² + 2: pairs ±iω meet at Ω = 1 + √2 and are simple above; below √2 − 1 all roots are real."""
    found = find_crossings([[1], [0], [-3, 0, 1], [0], [2]], 0, 5)
    assert [(c.kind, c.root.multiplicity, c.changes) for c in found.found] == [
        ("EP2", 2, False),
        ("EP2", 2, False),
        ("CEP2", 2, True),
    ]
    assert [c.at for c in found.found] == pytest.approx([math.sqrt(2) - 1] * 2 + [math.sqrt(2) + 1], rel=1e-15)
    assert found.found[2].root.im == pytest.approx(2**0.25, rel=1e-15)
    assert (found.stable, found.marginal) == ((), ((pytest.approx(1 + math.sqrt(2)), 5),))


def test_factors_that_are_mirrored_or_repeated_beside_others():
    """(s² + 1)(s + y)(s + 2): one pair stays on the axis, marginally stable from y = 0. (s² + y s + 1)² (s + 3)."""
    found = find_crossings([[1], [2, 1], [1, 2], [2, 1], [0, 2]], -1, 5)
    assert [(c.at, c.kind, c.root.re) for c in found.found] == [(0, "capsize", 0), (2, "EP2", -2)]
    assert (found.always, found.marginal) == (("weave",), ((0, 5),))
    squared = find_crossings([[1], [3, 2], [2, 6, 1], [6, 2, 3], [1, 6], [3]], 0, 3)
    (met,) = [c for c in squared.found if c.kind == "EP4"]
    assert (met.at, met.root.re) == (2, -1)
    assert (squared.always, squared.stable) == (("EP2",), ((0, 3),))
    oscillators = find_crossings(
        [[1], [0], [0, 2], [0], [0, 0, 1]], -1, 1
    )  # (s² + y)²: they drift, not marginally stable
    assert (oscillators.marginal, oscillators.always) == ((), ("weave", "EP2"))


def test_a_leading_coefficient_that_is_0_for_every_value():
    """0 s² + s + y: a root at infinity, another 0 at y = 0."""
    found = find_crossings([[0], [1], [0, 1]], -1, 1)
    assert [(c.at, c.kind) for c in found.found] == [(0, "capsize")]
    assert found.always == ("infinity",)


def test_what_is_said_of_roots_that_stay_on_the_axis():
    said = " ".join(str(_speeds("g", (0, 5), A=[["g", -1, 0], [1, 0, -1], [0, 1, "-g"]])).split())
    assert re.search(r"EP3 +1\.414213562373", said)
    assert "s = 0 is a root for every g" in said
    assert (
        "marginally stable (no root is right of the imaginary axis, and the roots on it are simple): to 1.4142136"
        in said
    )
    assert "speed" not in said
    masses = _speeds("d", (0.1, 10), M=[[1, 0], [0, 2]], D=[["d", "-d"], ["-d", "d"]], K=[[3, -3], [-3, 3]])
    said = masses.report()
    assert "2.8284271247461" in said
    assert "s = 0 is a root for every d, 2-fold" in said
    assert "stable except for the 2-fold root 0: everywhere" in said
    assert masses.to_json()["zeros"] == 2
    with pytest.raises(tmsopt.InputError, match="--parameter NAME"):
        tmsopt.speeds(masses.problem)


@pytest.mark.parametrize("file", ["benchmark", "negative_tilt", "whipple_benchmark", "whipple_trail"])
def test_bands_of_speed_are_the_same_without_what_happens_at_their_ends(file):
    """The box of the speed plays no part in them."""
    design = tmsopt.solve(f"problems/{file}.toml")
    name = tmsopt.speeds(design).parameter
    allowed = design.problem.posed.parameter_set[name].range
    assert stable_speeds(design) == tmsopt.speeds(design, between=(allowed.lower, allowed.upper)).stable != ()


def test_a_model_without_a_speed_has_no_bands_of_it():
    assert stable_speeds(tmsopt.solve("problems/two_mass_spring.toml")) is None
    model = tmsopt.models.from_coefficients([1.0, "Fr", 1.0])  # a name alone makes no speed: this may be negative
    assert stable_speeds(tmsopt.solve(tmsopt.Problem(model, free={"Fr": (0.5, 1)}, minimize="abscissa"))) is None


def test_a_band_over_another_parameter_ends_where_stability_does():
    """Of the EP4 over the tilt: Fr_c² = tan(lambda_s) (chi_B + 1)/(chi_B − 1) for chi_H = 1 reaches Fr²."""
    design = tmsopt.solve("problems/ep4.toml")
    Fr, chi_B = design.parameters["Fr"], design.parameters["chi_B"]
    ((_, end),) = tmsopt.growth(design, over="lambda_s").stable
    assert end == pytest.approx(math.atan(Fr**2 * (chi_B - 1) / (chi_B + 1)), rel=1e-12)
