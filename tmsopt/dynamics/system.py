"""A design as a first-order linear system x′ = A x, with the path of its wheels among the states."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.errors import input_error
from tmsopt.models import Model
from tmsopt.models.bicycles.bicycle import contact_path
from tmsopt.problem.problem import Posed
from tmsopt.records import Array, Table

ANGLES = ("phi", "delta")
"""Names of lean and steer, which are positive to the right."""

RATES = ("phidot", "deltadot")
"""Names of the rates of lean and steer."""

TORQUES = ("T_phi", "T_delta")
"""Names of the torques of a controller."""

_MAX_CONDITION = 1e15
"""Largest condition number of a mass matrix, with columns of equal size, that does not count as singular."""


@dataclass(frozen=True)
class System:
    """x′ = A x, in the units of time, torque and length of `units`.

    Attributes:
        names: names of the states, for a bicycle without its last two states, the yaw and the lateral position of the
            rear contact.
        coordinates: lean and steer, or the coordinates of a stated system.
        A: shape (n, n).
        rows: column of the motion → row c of the output c x. Outputs include the torques of a controller and the path.
        impulses: ``T_phi``, ``T_delta`` → change of x by a unit impulse of the torque; empty without torques.
        speed: forward speed of a bicycle; nan for other systems.
        units: ``t`` and names of columns → unit; a dimensionless column has an empty unit.
    """

    names: tuple[str, ...]
    coordinates: tuple[str, ...]
    A: Array
    rows: Table[Array]
    impulses: Table[Array]
    speed: float
    units: Table[str]

    @property
    def torques(self) -> tuple[str, ...]:
        """The torques of a controller."""
        return tuple(n for n in TORQUES if n in self.rows)


def is_bicycle(model: Model) -> bool:
    """Whether the first coordinates of a model are lean and steer."""
    return model.words[0] == "weave"


def matrices_of(model: Model) -> Any:
    """The matrices of a model as a function of its native parameters.

    Raises:
        InputError: if only the characteristic polynomial is known.
    """
    pencil = model.pencil
    if pencil is None:
        advice = "give its matrices under [model], M, D and K or A (in Python tmsopt.models.from_matrices)"
        message = f"'{model.name}' has coefficients only, which determine roots but no motion; {advice}"
        raise input_error(message, "model")
    kind = complex if model.is_complex else float
    return lambda native: [np.array(P, dtype=kind) for P in pencil(native)]


def coordinates_of(model: Model, pencil: Sequence[Any]) -> tuple[str, ...]:
    """Names of the coordinates of a mode: lean and steer, ``q1 …``, ``x1 …``, or ``psi1 …`` for a complex H."""
    if is_bicycle(model):
        return ANGLES
    letter = "psi" if model.is_complex else "q" if len(pencil) == 3 else "x"
    return tuple(f"{letter}{k}" for k in range(1, len(pencil[0]) + 1))


def system_of(problem: Posed, parameters: Mapping[str, float]) -> System:
    """The linear system of a design, in SI if the problem is in SI, otherwise in the model's own units.

    M q″ + D q′ + K q = 0 becomes x′ = A x with x = (q, q′). Two matrices I, −A give A directly. A bicycle has the yaw
    and the rear contact of `contact_path` as further states, so these are also exact. For ψ′ = −i H ψ the
    states are Re ψ₁, Im ψ₁, Re ψ₂ ….

    Raises:
        InputError: without matrices, or if the mass matrix is singular.
    """
    model, parameter_set = problem.model, problem.parameter_set
    native = parameter_set.native(parameters)
    pencil = matrices_of(model)(native)
    n = len(pencil[0])
    scaled_mass = pencil[0] / np.maximum(np.abs(pencil[0]).max(axis=0), 1e-300)
    if not all(np.isfinite(P).all() for P in pencil) or np.linalg.cond(scaled_mass) > _MAX_CONDITION:
        message = "the mass matrix of this design is singular: a root is at infinity, and there is no motion to show"
        raise input_error(message, "parameters")
    A = -np.linalg.solve(pencil[0], pencil[-1])
    if len(pencil) == 3:
        A = np.block([[np.zeros((n, n)), np.eye(n)], [A, -np.linalg.solve(pencil[0], pencil[1])]])
    if is_bicycle(model):
        return _build_bicycle_system(A, pencil[0], problem, parameters)
    q = coordinates_of(model, pencil)
    names = (*q, *(f"{name}dot" for name in q)) if len(pencil) == 3 else q
    if model.is_complex:
        A = np.kron(A.real, np.eye(2)) + np.kron(A.imag, [[0.0, -1.0], [1.0, 0.0]])
        q = names = tuple(f"{name}_{part}" for name in q for part in ("re", "im"))
    return System(names, q, A, Table(dict(zip(names, np.eye(len(names)), strict=True))), Table(), math.nan, Table())


def _build_bicycle_system(A: Array, mass: Array, problem: Posed, parameters: Mapping[str, float]) -> System:
    """The system with the path as two more states and the torques of a controller as rows, in the user's units."""
    parameter_set = problem.parameter_set
    native = parameter_set.native(parameters)
    feedback = problem.model.feedback(native) if problem.model.feedback else None
    has_lag, driven = feedback is not None and feedback.lag is not None, dict[str, int]()
    if feedback is not None:
        mass, driven = np.array(feedback.mass, dtype=float), {TORQUES[k]: k for k in sorted(feedback.driven_rows)}
    names = (*ANGLES, *RATES, *(driven if has_lag else ()))
    yaw_per_steer, yaw_per_steer_rate, v, w, contact_shift = map(float, contact_path(native))
    n = len(names)
    matrix = np.zeros((n + 2, n + 2))
    matrix[:n, :n] = A
    matrix[n, [1, 3]] = yaw_per_steer, yaw_per_steer_rate
    matrix[n + 1, n] = v
    unit_rows = np.eye(n + 2)
    rows = {**dict(zip(names, unit_rows, strict=False)), "psi": unit_rows[n], "y_rear": unit_rows[n + 1]}
    rows["y_front"] = unit_rows[n + 1] + w * unit_rows[n] + contact_shift * unit_rows[1]
    if feedback is not None and not has_lag:
        gains = np.hstack([np.array(feedback.gains, dtype=float), np.zeros((2, 2))])
        rows |= {name: -gains[k] for name, k in driven.items()}
    inverse_mass = np.linalg.inv(mass)
    rate_unit = 1.0 if parameter_set.rate is None else float(parameter_set.rate(parameters))
    torque_unit = 1.0 if parameter_set.torque is None else float(parameter_set.torque(parameters))
    length_unit = parameters["w"] / native.get("w", 1.0) if "w" in parameters else 1.0
    column_kinds = (  # names, size of the unit, and text of the unit for dimensionless and for SI parameters
        (("t",), 1.0, ("√(w/g)", "s")),
        ((*ANGLES, "psi"), 1.0, ("rad", "rad")),
        (RATES, rate_unit, ("rad √(g/w)", "rad/s")),
        (TORQUES, torque_unit, ("m_B g w", "N m")),
        (("x", "y_rear", "y_front"), length_unit, ("w", "m")),
    )
    unit_sizes = {name: size for names_of_kind, size, _ in column_kinds for name in names_of_kind}
    state_sizes = np.array([unit_sizes[name] for name in (*names, "psi", "y_rear")])
    impulses = {
        name: rate_unit / torque_unit * state_sizes * np.r_[0.0, 0.0, inverse_mass[:, k], np.zeros(n - 2)]
        for k, name in enumerate(TORQUES)
    }
    return System(
        names,
        ANGLES,
        rate_unit * state_sizes[:, None] * matrix / state_sizes,
        Table({name: unit_sizes[name] * row / state_sizes for name, row in rows.items()}),
        Table(impulses),
        v * rate_unit * length_unit,
        Table(
            {
                name: unit_pair[parameter_set.rate is not None]
                for names_of_kind, _, unit_pair in column_kinds
                for name in names_of_kind
            }
        ),
    )
