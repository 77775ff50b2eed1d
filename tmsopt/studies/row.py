"""One row of a study: a design as it was solved, as plain data."""

import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

from tmsopt.errors import short
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

    Example:
        >>> row = tmsopt.run_study(tmsopt.over_grid("problems/ep4.toml", {"mu": [0.3]}), workers=1).rows[0]
        >>> row.status, row.structure, row.varied
        ('optimal', 'EP4', {'mu': 0.3})

    More: docs/reference/study_file.md
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
    def from_json(data: Any) -> "Row":
        """The row that `to_json` was made of, bit by bit.

        Raises:
            ValueError: for data that no row becomes.
        """
        if not isinstance(data, Mapping):
            raise ValueError(f"found {short(data)}; accepted: a table")
        if missing := [f.name for f in _FIELDS if f.default is f.default_factory is MISSING and f.name not in data]:
            raise ValueError(f"it lacks {', '.join(missing)}")
        made = {f.name: _read(f.name, data[f.name], f.type) for f in _FIELDS if f.name in data}
        if made["status"] not in STATUSES:
            raise ValueError(f"status: found {short(made['status'])}; accepted: {' '.join(STATUSES)}")
        return Row(**made)


_FIELDS = fields(Row)
_WHOLE = 2**1023  # a larger one is no double
_ABSENT = {"bound": -math.inf, "gap": math.inf}


def _plain(value: Any, kind: Any, absent: float) -> Any:
    if kind is float:
        return number if math.isfinite(number := float(value)) else _text(number, absent)
    if isinstance(value, Mapping):
        return {n: v if math.isfinite(v := float(given)) else _text(v, math.nan) for n, given in value.items()}
    return kind(value)  # NumPy's integers and truths are not JSON


def _text(number: float, absent: float) -> str | None:
    return None if number == absent or (math.isnan(number) and math.isnan(absent)) else str(number)


def _read(name: str, value: Any, kind: Any) -> Any:
    """The value of a field.

    Raises:
        ValueError: for one of another kind.
    """
    if kind is float:
        return _number(name, value, _ABSENT.get(name, math.nan))
    if kind in (int, str, bool):
        if type(value) is not kind:
            raise ValueError(f"{name}: found {short(value)}; accepted: {kind.__name__}")
        return value
    if not isinstance(value, Mapping):
        raise ValueError(f"{name}: found {short(value)}; accepted: names with numbers")
    return Table({n: _number(f"{name}.{n}", v, math.nan) for n, v in value.items()})


def _number(name: str, value: Any, absent: float) -> float:
    if value is None:
        return absent
    if value in ("nan", "inf", "-inf") or type(value) is float or (type(value) is int and abs(value) <= _WHOLE):
        return float(value)
    raise ValueError(f"{name}: found {short(value)}; accepted: a number")
