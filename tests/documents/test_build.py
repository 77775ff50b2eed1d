"""What a builder asks of a design: wheel loads, ballast, mass margin, units; each against mechanics of its own.

The lateral dynamics come here from the equations of Meijaard, Papadopoulos, Ruina and Schwab (2007), appendix A,
which take any two rigid bodies; a point mass is a body without inertia of its own.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
import sympy
from helpers.bicycles import BODIES, appendix
from helpers.designs import ROBOT, designs
from helpers.oracles import polynomial_60, roots_60

import tmsopt
from tmsopt.models import Values, matrices, tms
from tmsopt.problem.units import convert_to_reading, parse_quantity

NATIVE, SI = tms.sets
EPS = np.finfo(float).eps


def values(p, of=NATIVE):
    return Values(tms, of, p)


# The lateral dynamics of two assemblies of point masses


def rigid(bodies):
    """Mass, centre, and the moments and product of inertia about it of bodies that are fixed to one another."""
    m = sum(b[0] for b in bodies)
    x, z = (sum(b[0] * b[k] for b in bodies) / m for k in (1, 2))
    Ixx = sum(b[0] * (b[2] - z) ** 2 for b in bodies)
    Izz = sum(b[0] * (b[1] - x) ** 2 for b in bodies)
    Ixz = -sum(b[0] * (b[1] - x) * (b[2] - z) for b in bodies)
    return m, x, z, Ixx, Ixz, Izz


def lateral(rear, front, w, v, g, sine, cosine):
    """M, v C1 and g K0 + v² K2 of lean and steer, without trail and without the mass of wheels."""
    bodies = dict.fromkeys(BODIES.split(), 0) | {"w": w, "r_R": 1, "r_F": 1}
    for end, masses in (("B", rear), ("H", front)):
        names = (f"m_{end}", f"x_{end}", f"z_{end}", f"I_{end}xx", f"I_{end}xz", f"I_{end}zz")
        bodies |= dict(zip(names, rigid(masses), strict=True))
    M, C1, K0, K2 = map(np.array, appendix(bodies, sine, cosine))
    return M, v * C1, g * K0 + v**2 * K2


def lateral_of(p):
    """The same of a design in SI."""
    masses = ([tuple(p[f"{n}_{end}"] for n in ("m", "x", "z"))] for end in "BH")
    return lateral(*masses, p["w"], p["v"], p.get("g", 9.81), math.sin(p["lambda_s"]), math.cos(p["lambda_s"]))


def test_the_equations_used_here_are_those_of_the_model():
    """Two independent sources, one system: so that what follows is about the model."""
    names = "mu chi_B chi_H zeta_B zeta_H Fr sine cosine"
    mu, chi_B, chi_H, zeta_B, zeta_H, Fr, *turn = sympy.symbols(names, positive=True)
    paper = matrices(Fr, mu, chi_B, chi_H, zeta_B, zeta_H, *turn)
    general = lateral([(1, chi_B, zeta_B)], [(mu, chi_H, zeta_H)], 1, Fr, 1, *turn)
    assert [sympy.expand(e) for e in np.ravel(np.array(paper) - np.array(general))] == [0] * 12


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


def test_si_loads_are_in_newtons_and_ballast_in_kilograms():
    """The benchmark: 10 kg at 1.2 m and 1 kg at 1.02 m over a wheelbase of 1 m, by hand."""
    p = tmsopt.load("problems/benchmark.toml").fixed
    got = values({name: p[name] for name in SI.names}, SI)
    assert got["N_F"] == pytest.approx(9.81 * (10 * 1.2 + 1.02), rel=1e-14)
    assert got["N_R"] == pytest.approx(-9.81 * (10 * 0.2 + 0.02), rel=1e-13)
    assert got["N_F"] + got["N_R"] == pytest.approx(9.81 * 11, rel=1e-14)
    assert got["m_ballast_rear"] == pytest.approx(2.02, rel=1e-13)
    assert got["m_ballast_front"] == 0
    larger = {n: x * 3 if n in ("w", "x_B", "z_B", "x_H", "z_H") else x for n, x in p.items()}
    assert values(larger, SI)["N_R"] == pytest.approx(float(got["N_R"]), rel=1e-13)  # similar bicycles, equal loads


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
    M, _, _ = lateral_of(p)
    margin = np.linalg.eigvalsh(np.array(M))[0] / (p["m_B"] * p["w"] ** 2)
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


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (0.4, "m", (400.0, "mm")),
        (1.0, "m/s", (3.6, "km/h")),
        (math.pi / 2, "rad", (90.0, "deg")),
        (12.0, "kg", (12.0, "kg")),
        (9.81, "m/s^2", (9.81, "m/s^2")),
        (-35.0, "N", (-35.0, "N")),
    ],
)
def test_readings_by_the_definitions_of_the_units(value, unit, expected):
    assert convert_to_reading(value, unit) == expected


@pytest.mark.parametrize(("name", "unit"), [("km/h", "m/s"), ("mm", "m"), ("deg", "rad")])
def test_what_was_written_with_a_unit_reads_the_same(name, unit):
    """Exactly, although SI lies in between: tenths from 0.1 to 100."""
    for tenths in range(1, 1001):
        assert convert_to_reading(parse_quantity(f"{tenths / 10} {name}", unit), unit) == (tenths / 10, name)


def test_si_of_the_benchmark_is_the_motion_in_seconds():
    """Eigenvalues of the dimensional equations in m, kg and s; simple and well apart, so doubles give 1e-10."""
    design = tmsopt.solve(tmsopt.load("problems/benchmark.toml"))
    p = design.parameters
    M, C, K = map(np.array, lateral_of(p))
    inverse = np.linalg.inv(M)
    z = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ K, -inverse @ C]]))
    si = design.to_json()["si"]
    assert si["decay_time_s"] == pytest.approx(-1 / z.real.max(), rel=1e-10)
    assert si["growth_time_s"] is None
    assert si["frequencies_Hz"] == pytest.approx([z.imag.max() / (2 * math.pi)], rel=1e-10)
    assert (si["v_kmh"], si["lambda_s_deg"], si["x_B_mm"], si["z_H_mm"]) == (14.4, 5.0, 1200.0, -200.0)
    assert si["v_c_kmh"] == pytest.approx(3.6 * 2.8410083233664, rel=1e-13)
    assert (si["N_F_N"], si["N_R_N"]) == pytest.approx((127.7262, -19.8162), rel=1e-13)
    assert si["m_ballast_rear_kg"] == pytest.approx(2.02, rel=1e-13)


def test_si_of_an_unstable_bicycle_has_a_growth_time():
    """The benchmark at 2 m/s, below v_c = 2.841 m/s; the roots at 60 digits."""
    fixed = {**tmsopt.load("problems/benchmark.toml").fixed, "v": 2.0}
    design = tmsopt.solve(tmsopt.Problem(tms, fixed=fixed))
    z = max(roots_60(polynomial_60(**design.dimensionless)), key=lambda r: (r.real, r.imag))
    si = design.to_json()["si"]
    assert si["decay_time_s"] is None
    assert si["growth_time_s"] == pytest.approx(1 / (float(z.real) * math.sqrt(9.81)), rel=1e-9)
    assert si["frequencies_Hz"][0] == pytest.approx(float(z.imag) * math.sqrt(9.81) / (2 * math.pi), rel=1e-9)


def test_a_dimensionless_problem_has_no_si():
    """Its lengths, masses and seconds are not known."""
    design = tmsopt.solve(tmsopt.Problem(tms, fixed=designs(1, 5)[0]))
    assert design.si == {}
    assert "si" not in design.to_json()
