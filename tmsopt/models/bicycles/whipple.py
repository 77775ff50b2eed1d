"""The Carvallo–Whipple bicycle in SI (Meijaard et al. 2007): two wheels, rear frame and handlebar, with trail.

Parameters that a problem omits are 0. Without wheels, trail and moments of inertia this is the two-mass-skate bicycle,
with the same parameters and roots.
"""

from pkgutil import resolve_name
from typing import Any

from tmsopt.models.bicycles.bicycle import WORDS, time_quantities
from tmsopt.models.bicycles.feedback import NO_CONTROLLER, ControllableBicycle
from tmsopt.models.bicycles.sketches import CONVENTIONS, WHIPPLE
from tmsopt.models.bicycles.tables import parameters, quantities
from tmsopt.models.bicycles.whipple_equations import carvallo_whipple, tangent_matrices
from tmsopt.models.bicycles.whipple_quantities import COMPUTED, IN_MATRICES, algebraic, canonical
from tmsopt.models.model import Matrices, Matrix, Model, ParameterSet
from tmsopt.models.tables import read_table
from tmsopt.records import AnyNumbers

_TABLES = read_table("bicycles/whipple")
_RADIUS_REASON = "a wheel without radius would turn infinitely fast"

_SI = ParameterSet(
    "SI",
    parameters(_TABLES["parameters"]),
    native=dict,
    quantities=(*quantities(_TABLES["quantities"], COMPUTED), *time_quantities(lambda p: 1, "1")),
    rate=lambda p: 1,
    root_unit="1/s",
    torque=lambda p: 1,
    needs={"I_Ryy": ("r_R", _RADIUS_REASON), "I_Fyy": ("r_F", _RADIUS_REASON)},
)


def _pencil(p: AnyNumbers) -> Matrices:
    """M, v C1 and g K0 + v² K2."""
    return _matrices_at_speed(*canonical(p), p["v"], p["g"])


def _matrices_at_speed(M: Matrix, C1: Matrix, K0: Matrix, K2: Matrix, v: Any, g: Any) -> Matrices:
    D = [[v * e for e in row] for row in C1]
    return M, D, [[g * a + v * v * b for a, b in zip(*rows, strict=True)] for rows in zip(K0, K2, strict=True)]


whipple = Model(
    name="whipple",
    title="Carvallo–Whipple bicycle",
    degree=4,
    sets=(_SI,),
    algebraic=algebraic,
    polynomial=carvallo_whipple,
    pencil=_pencil,
    origin=(resolve_name, (f"{__name__}:whipple",)),
    words=WORDS,
    conventions=CONVENTIONS,
    sketch=WHIPPLE,
    absent=NO_CONTROLLER,
)
"""The Carvallo–Whipple bicycle; its roots are in 1/s."""


def _scaled_matrices(p: AnyNumbers) -> Matrices:
    """M, v C1 and g K0 + v² K2 for a steer angle in units of w/cos λ_s."""
    return _matrices_at_speed(*tangent_matrices(**{name: p[name] for name in ("T", *IN_MATRICES)}), p["v"], p["g"])


CONTROLLABLE = ControllableBicycle(
    whipple, _scaled_matrices, unit=lambda p, h: (p["w"] * h, p["w"] * p["w"] * (1 + p["T"] * p["T"])), speed="v"
)
