"""The Carvallo–Whipple bicycle in SI (Meijaard et al. 2007): two wheels, rear frame and handlebar, with trail.

What is left out is not there: without wheels, trail and moments of inertia this is the two-mass-skate bicycle, written
in the same parameters, with the same roots per second.
"""

from collections.abc import Mapping
from typing import Any

from tmsopt.models.bicycles.bicycle import WORDS, times
from tmsopt.models.bicycles.feedback import UNCONTROLLED, Steered
from tmsopt.models.bicycles.sketches import CONVENTIONS, WHIPPLE
from tmsopt.models.bicycles.tms import GRAVITY, LAMBDA_S
from tmsopt.models.bicycles.whipple_equations import carvallo_whipple, tangent_matrices
from tmsopt.models.bicycles.whipple_quantities import IN_MATRICES, QUANTITIES, algebraic, canonical
from tmsopt.models.model import Matrix, Model, Parameter, ParameterSet, Range

_POSITIVE = Range(lower=0.0, closed=False)
_NOT_NEGATIVE = Range(lower=0.0)
_NOT_POSITIVE = Range(upper=0.0)
_ANY = Range()


def _length(name: str, meaning: str, latex: str, range: Range = _ANY, default: float | None = None) -> Parameter:
    return Parameter(name, "m", meaning, latex, range, default)


def _mass(name: str, meaning: str, range: Range = _NOT_NEGATIVE, default: float | None = None) -> Parameter:
    return Parameter(name, "kg", f"mass of the {meaning}", name, range, default)


def _inertia(name: str, meaning: str, range: Range = _NOT_NEGATIVE) -> Parameter:
    body, axes = name[2], name[3:]
    return Parameter(name, "kg m^2", meaning, rf"I_{{{body}{axes}}}", range, default=0.0)


_NO_RADIUS = "a wheel without radius would turn infinitely fast"

_SI = ParameterSet(
    "SI",
    (
        _length("w", "wheelbase", "w", _POSITIVE),
        _length("c", "trail, how far the steer axis meets the ground ahead of the front contact", "c", default=0.0),
        LAMBDA_S,
        Parameter("g", "m/s^2", "gravity", "g", _POSITIVE, default=GRAVITY),
        Parameter("v", "m/s", "forward speed", "v", _NOT_NEGATIVE),
        _length("r_R", "radius of the rear wheel", "r_R", _NOT_NEGATIVE, 0.0),
        _mass("m_R", "rear wheel", default=0.0),
        _inertia("I_Rxx", "moment of inertia of the rear wheel about a diameter"),
        _inertia("I_Ryy", "moment of inertia of the rear wheel about its axle"),
        _length("x_B", "rear frame centre of mass, forward of the rear contact", "x_B"),
        _length("z_B", "rear frame centre of mass, downward", "z_B", _NOT_POSITIVE),
        _mass("m_B", "rear frame with a rider who does not move", _POSITIVE),
        _inertia("I_Bxx", "moment of inertia of the rear frame about a forward axis"),
        _inertia("I_Bzz", "moment of inertia of the rear frame about a vertical axis"),
        _inertia("I_Bxz", "product of inertia of the rear frame, the negative of ∫ x z dm", _ANY),
        _length("x_H", "handlebar and fork, centre of mass, forward of the rear contact", "x_H"),
        _length("z_H", "handlebar and fork, centre of mass, downward", "z_H", _NOT_POSITIVE),
        _mass("m_H", "handlebar and fork"),
        _inertia("I_Hxx", "moment of inertia of handlebar and fork about a forward axis"),
        _inertia("I_Hzz", "moment of inertia of handlebar and fork about a vertical axis"),
        _inertia("I_Hxz", "product of inertia of handlebar and fork, the negative of ∫ x z dm", _ANY),
        _length("r_F", "radius of the front wheel", "r_F", _NOT_NEGATIVE, 0.0),
        _mass("m_F", "front wheel", default=0.0),
        _inertia("I_Fxx", "moment of inertia of the front wheel about a diameter"),
        _inertia("I_Fyy", "moment of inertia of the front wheel about its axle"),
    ),
    native=dict,
    quantities=(*QUANTITIES, *times(lambda p: 1, "1")),
    rate=lambda p: 1,
    root_unit="1/s",
    torque=lambda p: 1,
    needs={"I_Ryy": ("r_R", _NO_RADIUS), "I_Fyy": ("r_F", _NO_RADIUS)},
)


def _pencil(p: Mapping[str, Any]) -> tuple[Matrix, ...]:
    """M, v C1 and g K0 + v² K2."""
    return _at_speed(*canonical(p), p["v"], p["g"])


def _at_speed(M: Matrix, C1: Matrix, K0: Matrix, K2: Matrix, v: Any, g: Any) -> tuple[Matrix, Matrix, Matrix]:
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
    words=WORDS,
    conventions=CONVENTIONS,
    sketch=WHIPPLE,
    absent=UNCONTROLLED,
)
"""The Carvallo–Whipple bicycle; its roots are in 1/s."""


def _steered(p: Mapping[str, Any]) -> tuple[Matrix, Matrix, Matrix]:
    """M, v C1 and g K0 + v² K2 for a steer angle in units of w/cos λ_s."""
    return _at_speed(*tangent_matrices(**{name: p[name] for name in ("T", *IN_MATRICES)}), p["v"], p["g"])


STEERED = Steered(whipple, _steered, unit=lambda p, h: (p["w"] * h, p["w"] * p["w"] * (1 + p["T"] * p["T"])), speed="v")
