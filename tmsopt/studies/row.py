"""One row of a study: a design as it was solved, as plain data."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from tmsopt.records import Table

STATUSES = ("optimal", "infeasible", "not_converged", "failed", "quarantined")
"""Of a row: those of a solution; ``failed`` where the row cannot be posed or solving it broke; ``quarantined`` where it
ended its worker, twice."""


@dataclass(frozen=True)
class Row:
    """What one row of a study came to; a failure is a row with a cause.

    Attributes:
        number: of the row, from 0.
        seed: of its starts.
        varied: name → value that the study gave it (rad, SI units).
        status: one of `STATUSES`.
        cause: why the status is not ``optimal``; empty where it is.
        objective: value of the objective expression; nan where there is none.
        abscissa, abscissa_realised: as in `Solution`; rows of older stores have the first alone.
        parameters: every parameter of the set the problem is written in.
        reports: the expressions that the study asked for.
        bound: a value that no design in the box can beat; −inf where none is known.
        method: how the bound was found; ``none``.
        laws: label of a law of the paper → relative residual, where the law applies.
        violations: name → by how much it is violated, in its own units (rad, SI).
        starts: tried.
        warm: whether it was started from a neighbour's optimum.
        seconds, host: how long it took and where; the only ones that differ when a row is solved again.
    """

    number: int
    seed: int
    varied: Table[float]
    status: str
    cause: str = ""
    objective: float = math.nan
    abscissa: float = math.nan
    abscissa_realised: float = math.nan
    damping_ratio: float = math.nan
    structure: str = ""
    parameters: Table[float] = field(default_factory=Table)
    reports: Table[float] = field(default_factory=Table)
    bound: float = -math.inf
    gap: float = math.inf
    proven: bool = False
    method: str = "none"
    laws: Table[float] = field(default_factory=Table)
    violations: Table[float] = field(default_factory=Table)
    starts: int = 0
    warm: bool = False
    seconds: float = 0.0
    host: str = ""

    @property
    def stable(self) -> bool | None:
        """Whether all roots lie left of the axis, ideal and as stored; None where there are none."""
        return None if not math.isfinite(self.abscissa) else self.abscissa < 0 and not self.abscissa_realised >= 0

    @property
    def identity(self) -> str:
        """Everything but `seconds` and `host`, as text: equal for equal bits, nan included."""
        kept = {name: value for name, value in self.to_json().items() if name not in ("seconds", "host")}
        return json.dumps(kept, sort_keys=True)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: None is nan, or no bound; other infinities are text, ``"-inf"``."""
        data = {f.name: _plain(getattr(self, f.name), f.type, _ABSENT.get(f.name, math.nan)) for f in _FIELDS}
        return data | {"stable": self.stable}

    @staticmethod
    def from_json(data: Mapping[str, Any]) -> "Row":
        """The row that `to_json` was made of, bit by bit."""
        made: dict[str, Any] = {}
        for f in _FIELDS:
            if f.name not in data:
                continue
            value = data[f.name]
            if isinstance(value, Mapping):
                made[f.name] = Table({n: _number(v, math.nan) for n, v in value.items()})
            else:
                made[f.name] = _number(value, _ABSENT.get(f.name, math.nan)) if f.type is float else value
        return Row(**made)


_FIELDS = fields(Row)
_ABSENT = {"bound": -math.inf, "gap": math.inf}


def _plain(value: Any, kind: Any, absent: float) -> Any:
    if kind is float:
        return number if math.isfinite(number := float(value)) else _text(number, absent)
    if isinstance(value, Mapping):
        return {n: v if math.isfinite(v := float(given)) else _text(v, math.nan) for n, given in value.items()}
    return kind(value)  # NumPy's integers and truths are not JSON


def _text(number: float, absent: float) -> str | None:
    return None if number == absent or (math.isnan(number) and math.isnan(absent)) else str(number)


def _number(value: float | str | None, absent: float) -> float:
    return absent if value is None else float(value)
