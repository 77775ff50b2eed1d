"""Adds a controller u = −G y, y = C x to a system of the user's own: M q″ + D q′ + K q = B u or x′ = A x + B u."""

from collections.abc import Mapping

import numpy as np

from tmsopt.models.model import Matrix
from tmsopt.models.stated.texts import Unfit

LOOP_KEYS = ("B", "C", "G")
"""Keys of the controller's matrices."""


def check_loop(shapes: Mapping[str, tuple[int, int]]) -> None:
    """Check that the matrices of a controller fit each other and the system.

    Args:
        shapes: key of each given matrix → its numbers of rows and columns.

    Raises:
        Unfit: if a matrix is missing or has another size.
    """
    if shapes.keys().isdisjoint(LOOP_KEYS):
        return
    for key in ("B", "G"):
        if key not in shapes:
            raise Unfit(key, "is missing; a controller needs B and G, and C unless every state is measured")
    system = "A" if "A" in shapes else "M"
    n = shapes[system][0]
    states = n if system == "A" else 2 * n
    rows, inputs = shapes["B"]
    if rows != n:
        raise Unfit("B", f"has {rows} rows; accepted: {n}, as many as {system}")
    measured, columns = shapes.get("C", (states, states))
    if columns != states:
        meaning = "one per state" if system == "A" else "the coordinates, then their rates"
        raise Unfit("C", f"has {columns} columns; accepted: {states}, {meaning}")
    if shapes["G"] != (inputs, measured):
        size = " × ".join(map(str, shapes["G"]))
        raise Unfit(
            "G",
            f"is {size}; accepted: {inputs} × {measured}, a row per column of B and a column per "
            + ("row of C" if "C" in shapes else "state"),
        )


def close_loop(matrices: Mapping[str, Matrix]) -> dict[str, Matrix]:
    """The matrices of the system with its controller: B G C is added to K and D, or subtracted from A."""
    system = {key: rows for key, rows in matrices.items() if key not in LOOP_KEYS}
    if "B" not in matrices:
        return system
    B, G, C = (np.array(matrices.get(key, 0), dtype=object) for key in ("B", "G", "C"))
    gain = B @ G @ C if "C" in matrices else B @ G
    if "A" in system:
        return {"A": (system["A"] - gain).tolist()}
    n = len(system["M"])
    return {
        "M": system["M"],
        "D": (system.get("D", 0) + gain[:, n:]).tolist(),
        "K": (system["K"] + gain[:, :n]).tolist(),
    }
