"""What a builder asks of a design: wheel loads, ballast, mass margin, units; each against mechanics of its own."""

import math
from fractions import Fraction

import numpy as np
import pytest
from helpers.designs import ROBOT, designs
from helpers.oracles import polynomial_60, roots_60
from helpers.structures import quantities_60

import tmsopt
from tmsopt.models import Values, tms
from tmsopt.problem.units import convert_exactly, parse_quantity

NATIVE, SI = tms.sets
EPS = np.finfo(float).eps


def values(p, of=NATIVE):
    return Values(tms, of, p)


# Statics


def loads(bodies, w):
    """Vertical forces at front and rear, per g: moments about the other wheel."""
    return sum(m * x for m, x in bodies) / w, sum(m * (w - x) for m, x in bodies) / w


def exact(p):
    return {name: Fraction(value) for name, value in p.items()}


def test_loads_and_ballast_balance_forces_and_moments():
    """Ballast, over a wheelbase from the other wheel, takes the load of a lifted wheel to 0."""
    seen = set()
    for p in designs(80, 2):
        q, got = exact(p), values(p)
        found = loads([(Fraction(1), q["chi_B"]), (q["mu"], q["chi_H"])], Fraction(1))
        bound = 4 * EPS * (1 + abs(p["chi_B"]) + abs(p["chi_H"]))
        for end, load in zip(("front", "rear"), found, strict=True):
            assert got[f"load_{end}"] == pytest.approx(float(load / (1 + q["mu"])), abs=bound)
            assert got[f"ballast_{end}"] == pytest.approx(max(0, float(-load)), abs=2 * bound * float(1 + q["mu"]))
            seen |= {end} if load < 0 else set()
    assert seen == {"front", "rear"}


# The mass matrix


def test_mass_margin_vanishes_like_the_square_of_nu_H():
    """Limit of margin/ν_H²: det M / (tr M ν_H²) = μ ζ_B²/(μ ζ_H² + ζ_B²), with relative error of the order of ν_H²."""
    for nu in (1e-3, 1e-6, 1e-9, 1e-12):
        p = {"Fr": 1, "mu": 0.5, "chi_B": 1.2, "chi_H": 1.0, "zeta_B": -0.5, "zeta_H": -0.25}
        tilt = math.asin(nu / 0.25)  # ν_H = 0.25 sin λ_s
        limit = 0.5 * 0.25 / (0.5 * 0.0625 + 0.25)
        assert values({**p, "lambda_s": tilt})["mass_margin"] / nu**2 == pytest.approx(limit, rel=10 * nu**2 + 1e-14)


@pytest.mark.parametrize("on", [{"mu": 0.0}, {"zeta_B": 0.0}, {"chi_H": 1.0, "lambda_s": 0.0}, {"mu": 0, "zeta_B": 0}])
def test_mass_margin_of_a_singular_mass_matrix_is_0(on):
    p = {"Fr": 1, "mu": 0.5, "chi_B": 1.2, "chi_H": 1.1, "zeta_B": -0.5, "zeta_H": -0.25, "lambda_s": 0.3, **on}
    assert values(p)["mass_margin"] == 0


# In problems


@pytest.mark.parametrize(
    "limits",
    [
        pytest.param(["N_R >= 20", "N_F >= 10", "mass_margin >= 1e-4"], marks=pytest.mark.slow),
        ["m_ballast_rear <= 2", "mass_margin >= 1e-4"],
        pytest.param(["load_rear >= 0.1", "load_front >= 0.3"], marks=pytest.mark.slow),
    ],
)
def test_a_builders_limits_hold_by_statics(tmp_path, limits):
    """Each limit on loads, ballast or inertia is recomputed from the SI parameters of the optimum, to 1e-7."""
    file, limits = tmp_path / "robot.toml", {f"limit_{k}": text for k, text in enumerate([*limits, "u_H >= 0.015"])}
    file.write_text(ROBOT % "\n".join(f'{name} = "{text}"' for name, text in limits.items()))
    design = tmsopt.solve(tmsopt.load(str(file)))
    p = design.parameters
    assert p["w"] == pytest.approx(0.8, rel=1e-15)
    front, rear = (9.81 * x for x in loads([(p["m_B"], p["x_B"]), (p["m_H"], p["x_H"])], p["w"]))
    margin = float(quantities_60(p)["mass_margin"])
    weight = front + rear
    slack = {
        "N_R >= 20": rear - 20,
        "N_F >= 10": front - 10,
        "u_H >= 0.015": (p["x_H"] - p["w"]) * math.cos(p["lambda_s"]) - p["z_H"] * math.sin(p["lambda_s"]) - 0.015,
        "mass_margin >= 1e-4": margin - 1e-4,
        "m_ballast_rear <= 2": 2 - max(0.0, -rear) / 9.81,
        "load_rear >= 0.1": rear / weight - 0.1,
        "load_front >= 0.3": front / weight - 0.3,
    }
    assert all(slack[text] >= -1e-7 for text in limits.values())
    binding = {name for name, text in limits.items() if abs(slack[text]) <= 1e-7}
    assert {name for name in design.active if "." not in name} <= binding
    assert binding  # the optimum leans on one of them, so that the test means something


# Units and times


@pytest.mark.parametrize(("name", "unit"), [("km/h", "m/s"), ("mm", "m"), ("deg", "rad")])
def test_what_was_written_with_a_unit_reads_the_same(name, unit):
    """Exactly, although SI lies in between: tenths from 0.1 to 100."""
    for tenths in range(1, 1001):
        value, converted, digits = convert_exactly(parse_quantity(f"{tenths / 10} {name}", unit), unit)
        assert (float(f"{value:.{digits}g}"), converted) == (tenths / 10, name)


@pytest.mark.parametrize(("v", "kept", "absent"), [(4.0, "decay", "growth"), (2.0, "growth", "decay")])
def test_si_of_the_benchmark_is_the_motion_in_seconds(v, kept, absent):
    """Roots at 60 digits by the clock of √(w/g); unstable at 2 m/s, below v_c = 2.841 m/s."""
    design = tmsopt.solve(tmsopt.Problem(tms, fixed={**tmsopt.load("problems/benchmark.toml").fixed, "v": v}))
    z = max(roots_60(polynomial_60(**design.dimensionless)), key=lambda r: (r.real, r.imag))
    si = design.to_json()["si"]
    assert si[f"{kept}_time_s"] == pytest.approx(1 / (abs(float(z.real)) * math.sqrt(9.81)), rel=1e-10)
    assert si[f"{absent}_time_s"] is None
    assert si["frequencies_Hz"][0] == pytest.approx(float(z.imag) * math.sqrt(9.81) / (2 * math.pi), rel=1e-10)
    assert (si["v_kmh"], si["lambda_s_deg"], si["x_B_mm"], si["z_H_mm"]) == (3.6 * v, 5.0, 1200.0, -200.0)
    assert si["v_c_kmh"] == pytest.approx(3.6 * 2.8410083233664, rel=1e-13)
    assert (si["N_F_N"], si["N_R_N"]) == pytest.approx((127.7262, -19.8162), rel=1e-13)
    assert si["m_ballast_rear_kg"] == pytest.approx(2.02, rel=1e-13)


def test_a_dimensionless_problem_has_no_si():
    """Its lengths, masses and seconds are not known."""
    design = tmsopt.solve(tmsopt.Problem(tms, fixed=designs(1, 5)[0]))
    assert design.si == {}
    assert "si" not in design.to_json()
