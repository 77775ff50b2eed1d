"""Parameters and quantities of a bicycle from its TOML file."""

from collections.abc import Mapping
from math import pi
from typing import Any

from tmsopt.algebra.kinds import positive_part
from tmsopt.models.expression import parse_value
from tmsopt.models.model import Parameter, Quantity, Range
from tmsopt.records import AnyNumbers, Table

_RANGES = {
    "": Range(),
    "> 0": Range(lower=0.0, closed=False),
    ">= 0": Range(lower=0.0),
    "<= 0": Range(upper=0.0),
}

_TILT = Range(-pi / 2, pi / 2, closed=False)
LAMBDA_S = Parameter(
    "lambda_s", "rad", "steer axis tilt", r"\lambda_s", _TILT, tangent=True, sides=("reversed rake", "normal rake")
)


def parameters(rows: AnyNumbers) -> tuple[Parameter, ...]:
    """Parameters by name, each with the fields of `Parameter`; `latex` is the name by default."""
    return tuple(Parameter(name, **_fields(name, row)) if row else LAMBDA_S for name, row in rows.items())


def quantities(
    rows: AnyNumbers,
    computed: Mapping[str, dict[str, Any]] = Table(),
    counterparts: Mapping[str, Quantity] = Table(),
) -> tuple[Quantity, ...]:
    """Quantities by name, each with the fields of `Quantity`; formulas are expressions of parameters and quantities.

    A row with `positive_part` is the positive part of an expression.

    Args:
        computed: name → fields that are functions, which a file cannot contain.
        counterparts: name → quantity in SI.
    """
    result = []
    for name, row in rows.items():
        fields = {"value": row.get("stands_for")} | _fields(name, row) | computed.get(name, {})
        if "positive_part" in fields:
            fields |= _positive_part(fields.pop("positive_part"))
        elif isinstance(fields["value"], str):
            fields["value"] = parse_value(fields["value"], None)
        result.append(Quantity(name, **fields | {"counterpart": counterparts.get(fields.get("counterpart", ""))}))
    return tuple(result)


def _fields(name: str, row: AnyNumbers) -> dict[str, Any]:
    return {"latex": name, **row, "range": _RANGES[row.get("range", "")]}


def _positive_part(text: str) -> dict[str, Any]:
    part = parse_value(text, None)
    return {"value": lambda v: positive_part(part(v)), "pieces": (lambda v: 0, part)}
