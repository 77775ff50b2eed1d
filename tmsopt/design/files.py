"""Problem files: TOML to a Problem, with every fault placed at its line."""

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, StrictFloat, StrictInt, StrictStr, ValidationError

from tmsopt.design.cases import POINTS, Band
from tmsopt.design.errors import Fault, InputError, suggest
from tmsopt.design.problem import Problem, unasked
from tmsopt.design.units import with_unit
from tmsopt.design.validate import VARIATIONS, guess_parameter_set
from tmsopt.models import MODELS, Model

LARGEST = 1_000_000
"""Bytes; a longer file is not a problem file."""

_Number = StrictFloat | StrictInt | StrictStr


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid")


class _FreeParameter(_Table):
    min: _Number
    max: _Number
    start: _Number | None = None


class _Band(_Table):
    min: _Number
    max: _Number
    points: StrictInt = POINTS


class _Objective(_Table):
    minimize: StrictStr | None = None
    maximize: StrictStr | None = None
    pareto: list[StrictStr] | None = None
    locate: StrictStr | None = None


class _File(_Table):
    """The shape of a problem file."""

    title: StrictStr = ""
    model: StrictStr = "tms"
    parameters: dict[str, _FreeParameter | StrictFloat | StrictInt | StrictStr]
    objective: _Objective = Field(default_factory=_Objective)
    constraints: dict[str, StrictStr] = Field(default_factory=dict)
    scenarios: dict[str, _Band | list[_Number]] = Field(default_factory=dict)
    tolerances: dict[str, _Number] = Field(default_factory=dict)
    weights: dict[str, _Number] = Field(default_factory=dict)


def load(path: str | PathLike[str], asks: bool = True) -> Problem:
    """Read a problem file; one that `asks` must say what to do with its free parameters.

    Raises:
        InputError: listing every fault with file, line, key, what was found and what is accepted.
    """
    file = str(path)
    text = _text(file)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"line (\d+)", str(error))
        message = f"not TOML: {error}"
        raise InputError([Fault(message).at(file, int(place[1]) if place else text.count("\n") + 1)]) from None
    except RecursionError:
        raise InputError([Fault("not TOML: nested too deeply", file=file)]) from None
    lines = _lines(text)

    shape_faults, parsed = _shape(data)
    model = MODELS.get(str(data.get("model", "tms")))
    if model is None:
        name = str(data["model"])
        shape_faults.append(Fault(f"unknown model '{name}'; {suggest(name, MODELS)}", ("model",)))
    faults, problem = shape_faults, None
    if model is not None and parsed is not None:
        numbers = _numbers(parsed, model)
        faults = shape_faults + numbers.faults
        for fault in shape_faults:
            if fault.key[:1] in (("parameters",), ("scenarios",)) and len(fault.key) > 1:
                numbers.fixed[fault.key[1]] = math.nan  # known to be given, and already reported
        try:
            problem = Problem(
                model=model,
                fixed=numbers.fixed,
                free=numbers.free,
                start=numbers.start,
                scenarios=numbers.scenarios,
                tolerances=numbers.tolerances,
                weights=numbers.weights,
                constraints=parsed.constraints,
                minimize=parsed.objective.minimize,
                maximize=parsed.objective.maximize,
                pareto=() if parsed.objective.pareto is None else parsed.objective.pareto,
                locate=parsed.objective.locate,
                title=parsed.title or Path(file).stem,
            )
        except InputError as error:
            reported = (
                {f.key[:2] for f in faults}
                | {("parameters", *f.key[1:2]) for f in faults}
                | {f.key[:1] for f in faults if f.key[:1] == ("objective",)}
            )
            faults = faults + [f for f in error.faults if f.key[:2] not in reported]
    if problem is not None and asks and not problem.pareto:
        faults = [*faults, *unasked(problem)]
    if problem is None or faults:
        placed = [f.at(file, _line_of(lines, f.key)) for f in faults]
        raise InputError(sorted(placed, key=lambda f: f.line))
    return problem


def _text(file: str) -> str:
    path = Path(file)
    try:
        if path.is_dir():
            raise InputError([Fault("is a directory; accepted: a TOML problem file", file=file)])
        if not path.exists():
            near = suggest(
                path.name, sorted(p.name for p in path.parent.glob("*.toml")) if path.parent.is_dir() else []
            )
            hint = f"; {near}" if "did you mean" in near else ""
            raise InputError([Fault(f"no such file{hint}", file=file)])
        if not path.is_file():
            raise InputError([Fault("is not a regular file; accepted: a TOML problem file", file=file)])
        with path.open("rb") as stream:
            raw = stream.read(LARGEST + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        if isinstance(error, InputError):
            raise
        raise InputError([Fault(f"cannot be read: {reason}", file=file)]) from None
    if len(raw) > LARGEST:
        raise InputError([Fault(f"is larger than {LARGEST} bytes; accepted: a problem file of a few lines", file=file)])
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise InputError([Fault(f"not TOML: byte {raw[error.start]:#x} is not UTF-8").at(file, line)]) from None


def _shape(data: Mapping[str, Any]) -> tuple[list[Fault], _File | None]:
    """Faults of shape, and what is left of the file without the faulty keys."""
    faults: dict[tuple[str, ...], Fault] = {}
    pruned: dict[str, Any] = dict(data)
    for _ in range(2):
        try:
            return list(faults.values()), _File.model_validate(pruned)
        except ValidationError as error:
            found = [_shape_fault(d["loc"], d["type"], d.get("input")) for d in error.errors(include_url=False)]
            deepest = {f.key[:2]: max(len(g.key) for g in found if g.key[:2] == f.key[:2]) for f in found}
            for fault in found:
                if len(fault.key) == deepest[fault.key[:2]]:
                    faults.setdefault(fault.key, fault)
        for key in faults:
            pruned = _without(pruned, key[:2])
    return list(faults.values()), None


def _without(data: Mapping[str, Any], key: tuple[str, ...]) -> dict[str, Any]:
    inner = data.get(key[0])
    if len(key) == 2 and isinstance(inner, dict):
        return {**data, key[0]: {k: v for k, v in inner.items() if k != key[1]}}
    return {k: v for k, v in data.items() if k != key[0]}


def _shape_fault(where: tuple[int | str, ...], kind: str, found: Any) -> Fault:  # noqa: PLR0911, PLR0912 - one per case
    """One pydantic complaint in the words of the problem file."""
    tags = ("_FreeParameter", "_Band", "float", "int", "str")
    key = tuple(str(k) for k in where if k not in tags)
    match key:
        case (section,) if kind == "extra_forbidden":
            return Fault(f"unknown key '{section}'; {suggest(section, _File.model_fields)}", key)
        case ("parameters",) if kind == "missing":
            return Fault("missing section [parameters]", key)
        case ("parameters", name, end) if kind == "extra_forbidden":
            return Fault(f"unknown key '{end}' of {name}; {suggest(end, _FreeParameter.model_fields)}", key)
        case ("parameters", name, end) if kind == "missing":
            return Fault(f"missing {end} of {name}; write e.g. {name} = {{ min = 0.5, max = 2 }}", key)
        case ("parameters", _, *_):
            accepted = "a number, a text with a unit such as '5 deg', or { min = …, max = …, start = … }"
            return Fault(f"found {_short(found)}; accepted: {accepted}", key[:3])
        case ("objective", sense, *_) if kind == "extra_forbidden":
            return Fault(f"unknown key '{sense}'; {suggest(sense, _Objective.model_fields)}", key)
        case ("scenarios", name, end, *_) if kind == "extra_forbidden":
            return Fault(f"unknown key '{end}' of {name}; {suggest(end, _Band.model_fields)}", key)
        case ("scenarios", name, end) if kind == "missing":
            return Fault(f"missing {end} of {name}; write e.g. {name} = {{ min = 1, max = 2, points = 7 }}", key)
        case ("scenarios", _, *_):
            accepted = "{ min = …, max = …, points = … }, or a list of values such as [1, 2.5]"
            return Fault(f"found {_short(found)}; accepted: {accepted}", key[:2])
        case (("tolerances" | "weights"), _, *_):
            return Fault(f"found {_short(found)}; accepted: a number, or a text with a unit such as '5 mm'", key[:2])
        case ("objective", "pareto", *_):
            return Fault(f"found {_short(found)}; accepted: two or three texts, such as ['abscissa', 'Fr']", key[:2])
        case ("constraints", *_):
            return Fault(f"found {_short(found)}; accepted: a comparison in quotes, such as 'nu_H >= 0.02'", key)
        case _:
            table = key[0] in ("parameters", "objective", *VARIATIONS)
            return Fault(f"found {_short(found)}; accepted: {'a table' if table else 'a text in quotes'}", key)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "…"


@dataclass(frozen=True)
class _Numbers:
    """The numbers of a file in the parameters' own units."""

    faults: list[Fault]
    fixed: dict[str, Any]
    free: dict[str, tuple[Any, Any]]
    start: dict[str, Any]
    scenarios: dict[str, Any]
    tolerances: dict[str, Any]
    weights: dict[str, Any]


def _numbers(written: _File, model: Model) -> _Numbers:
    """Every number, with written units converted."""
    faults: list[Fault] = []
    of = guess_parameter_set(model, {**written.parameters, **written.scenarios})

    def number(value: Any, table: str, name: str, *end: str) -> Any:
        if not isinstance(value, str) or name not in of.names:
            return value
        unit = of[name].unit
        if unit == "1" and table in ("tolerances", "weights"):
            unit = of[name].multiple_of or unit  # a tolerance of 5 mm is one of 0.005 wheelbases of 1 m
        try:
            return with_unit(value, unit)
        except ValueError as error:
            faults.append(Fault(str(error), (table, name, *end)))
            return value

    fixed, free, start = {}, {}, {}
    scenarios: dict[str, Any] = {}
    for name, value in written.parameters.items():
        if isinstance(value, _FreeParameter):
            free[name] = tuple(number(getattr(value, end), "parameters", name, end) for end in ("min", "max"))
            if value.start is not None:
                start[name] = number(value.start, "parameters", name, "start")
        else:
            fixed[name] = number(value, "parameters", name)
    for name, band in written.scenarios.items():
        if isinstance(band, _Band):
            lower, upper = (number(getattr(band, end), "scenarios", name, end) for end in ("min", "max"))
            scenarios[name] = Band(lower, upper, band.points)
        else:
            scenarios[name] = tuple(number(value, "scenarios", name) for value in band)
    tolerances = {name: number(value, "tolerances", name) for name, value in written.tolerances.items()}
    weights = {name: number(value, "weights", name) for name, value in written.weights.items()}
    return _Numbers(faults, fixed, free, start, scenarios, tolerances, weights)


_HEADER = re.compile(r"\s*\[+\s*([^\]]+?)\s*\]+")
_KEY = re.compile(r"\s*([A-Za-z0-9_\-.\"' ]+?)\s*=")


def _lines(text: str) -> dict[tuple[str, ...], int]:
    """Line number of every section and key that begins a line."""
    section: tuple[str, ...] = ()
    lines: dict[tuple[str, ...], int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            section = _path(header[1])
            lines.setdefault(section, number)
        elif key := _KEY.match(line):
            lines.setdefault((*section, *_path(key[1])), number)
    return lines


def _path(dotted: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))


def _line_of(lines: Mapping[tuple[str, ...], int], key: tuple[str, ...]) -> int:
    """Line of the longest part of a key path that the file has; 1 for something missing altogether."""
    for end in range(len(key), 0, -1):
        if key[:end] in lines:
            return lines[key[:end]]
    return 1
