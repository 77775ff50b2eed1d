"""Rows of a study for tests of its store, also in processes that load nothing else."""

from typing import Any

from tmsopt.records import Table
from tmsopt.studies import Row

STUDY: dict[str, Any] = {
    "problem": {"parameters": {"mu": 0.1, "zeta_B": -0.4}, "objective": {"minimize": "abscissa"}},
    "columns": {"mu": [0.1, 0.2, 0.3], "zeta_B": [-0.4, -0.5, -0.6]},
    "seed": 7,
}


def row(number: int, **given: Any) -> Row:
    varied = Table({"mu": 0.1 * number})
    return Row(
        number, 1000 + number, **({"varied": varied, "status": "optimal", "abscissa": -1 / (1 + number)} | given)
    )
