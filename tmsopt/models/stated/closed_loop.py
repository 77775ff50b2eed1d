"""A stated system with a controller: u = −G y of y = C x, in M q″ + D q′ + K q = B u or x′ = A x + B u."""

from collections.abc import Mapping

from tmsopt.models.model import Matrix
from tmsopt.models.stated.texts import Unfit

LOOP = ("B", "C", "G")
"""Keys of the controller's matrices."""


def check_loop(shapes: Mapping[str, tuple[int, int]]) -> None:
    """Refuses matrices of a controller that do not fit each other, or the system.

    Args:
        shapes: rows and columns of every matrix that is given.

    Raises:
        Unfit: saying what is missing, or which size is accepted.
    """
    given = [key for key in LOOP if key in shapes]
    if not given:
        return
    for key in ("B", "G"):
        if key not in shapes:
            raise Unfit(key, f"is missing beside {given[0]}; a controller is B and G, and C where not all is measured")
    system = "A" if "A" in shapes else "M"
    n = shapes[system][0]
    states = n if system == "A" else 2 * n
    rows, inputs = shapes["B"]
    if rows != n:
        raise Unfit("B", f"has {rows} rows; accepted: {n}, those of {system}")
    measured, columns = shapes.get("C", (states, states))
    if columns != states:
        what = "the states" if system == "A" else "the coordinates and then their rates"
        raise Unfit("C", f"has {columns} columns; accepted: {states}, {what}")
    if shapes["G"] != (inputs, measured):
        found = " × ".join(map(str, shapes["G"]))
        raise Unfit(
            "G",
            f"is {found}; accepted: {inputs} × {measured}, a row per column of B and a column per "
            + ("row of C" if "C" in shapes else "state"),
        )


def closed(matrices: Mapping[str, Matrix]) -> dict[str, Matrix]:
    """The matrices of the system with its controller, B G C added to K and D, or taken from A."""
    own = {key: rows for key, rows in matrices.items() if key not in LOOP}
    if "B" not in matrices:
        return own
    gain = _product(matrices["B"], matrices["G"])
    if "C" in matrices:
        gain = _product(gain, matrices["C"])
    if "A" in own:
        return {"A": _sum(own["A"], [[-x for x in row] for row in gain])}
    n = len(own["M"])
    still = own.get("D") or [[0] * n for _ in range(n)]
    return {"M": own["M"], "D": _sum(still, [row[n:] for row in gain]), "K": _sum(own["K"], [row[:n] for row in gain])}


def _product(A: Matrix, B: Matrix) -> Matrix:
    return [[sum(x * y for x, y in zip(row, column, strict=True)) for column in zip(*B, strict=True)] for row in A]


def _sum(A: Matrix, B: Matrix) -> Matrix:
    return [[x + y for x, y in zip(*rows, strict=True)] for rows in zip(A, B, strict=True)]
