"""Geometry of a two-mass-skate bicycle, seen from its right side and to scale."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tmsopt.records import Array, Table


@dataclass(frozen=True)
class Sketch:
    """Points (x, z) of the side view, in wheelbases; x is forward, z is down, the origin is the rear contact.

    Attributes:
        parameters: the native parameters.
        rear, front: contact points of the skates, shape (2,).
        B, H: the two masses, shape (2,).
        axis: upward unit vector along the steer axis, which passes through the front contact (zero trail).
        foot: foot of the perpendicular from H on the steer axis.
        nu_H: signed distance of H from the axis, positive in front of it (text below equation matrices).
    """

    parameters: Table[float]
    rear: Array
    front: Array
    B: Array
    H: Array
    axis: Array
    foot: Array
    nu_H: float

    def on_axis(self, length: float) -> Array:
        """The point of the steer axis at a signed distance from the front contact, upward."""
        return self.front + length * self.axis


def sketch(parameters: Mapping[str, float]) -> Sketch:
    """Geometry of the design with these native parameters.

    H is projected on the axis as a vector, so that ν_H is computed without the formula of the model.
    """
    p = Table(parameters)
    front, H = np.array([1.0, 0.0]), np.array([p["chi_H"], p["zeta_H"]])
    axis = -np.array(
        [np.sin(p["lambda_s"]), np.cos(p["lambda_s"])]
    )  # with a positive tilt, the top of the axis leans back
    forward = np.array([-axis[1], axis[0]])
    foot = front + np.dot(H - front, axis) * axis
    return Sketch(
        parameters=p,
        rear=np.zeros(2),
        front=front,
        B=np.array([p["chi_B"], p["zeta_B"]]),
        H=H,
        axis=axis,
        foot=foot,
        nu_H=float(np.dot(H - foot, forward)),
    )
