"""What sets a design moving, as a user asks for it, and as a state of its system."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tmsopt.dynamics.system import ANGLES, System
from tmsopt.errors import Fault, InputError, count_faults, is_number, short, suggest, table_faults
from tmsopt.problem.units import with_unit
from tmsopt.records import Array, Table, plain

MOST_POINTS = 1_000_000

_LEAN = math.pi / 180  # where nothing is asked for
_IMPULSES = {"push": "T_delta", "lean_push": "T_phi"}


@dataclass(frozen=True)
class Disturbance:
    """What sets a design moving.

    Attributes:
        start: states at the start, before any push, in rad and s; those that are left out are 0.
        push, lean_push: impulses of steer torque and lean torque at t = 0.
        noise: intensity of the white noise on the steer torque.
        seed: of the noise.
        default: whether nothing was asked for.
    """

    start: Table[float] = field(default_factory=Table)
    push: float = 0.0
    lean_push: float = 0.0
    noise: float = 0.0
    seed: int = 0
    default: bool = False

    def state(self, system: System) -> Array:
        """The state at once after it; yaw and the way aside are 0."""
        x = np.zeros(len(system.A))
        x[: len(system.names)] = [self.start.get(name, 0.0) for name in system.names]
        for name, torque in _IMPULSES.items():
            if amount := getattr(self, name):
                x += amount * system.impulses[torque]
        return x

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self, "start push lean_push default") | (plain(self, "noise seed") if self.noise else {})


def asked_for(system: System, **given: Any) -> Disturbance:
    """The disturbance that a user asks for by the words of `simulate`.

    Raises:
        InputError: with everything that cannot be asked so.
    """
    faults = list(_faults(system, given))
    start: dict[str, float] = {}
    for word, name in zip(("lean", "steer"), ANGLES, strict=True):
        if given[word] is not None and system.impulses:
            try:
                start[name] = _radians(given[word])
            except ValueError as error:
                said = str(error).replace("a number without quotes in rad", "a number without quotes in degrees")
                faults.append(Fault(said, (word,)))
    if faults:
        raise InputError(faults)
    start |= {name: float(x) for name, x in (given["start"] or {}).items()}
    amounts = {name: float(given[name] or 0.0) for name in (*_IMPULSES, "noise")}
    nothing = not start and all(given[name] is None for name in amounts)
    if nothing:
        start = {system.coordinates[0]: _LEAN if system.impulses else 1.0}
    return Disturbance(Table(start), **amounts, seed=int(given["seed"]), default=nothing)


def _faults(system: System, given: Mapping[str, Any]) -> Iterator[Fault]:
    for word in ("lean", "steer", *_IMPULSES, "noise"):
        value = given[word]
        if value is None:
            continue
        if not system.impulses:
            example = ", ".join(f"{n}=1" for n in system.names[-1:])
            message = f"a stated system has no lean and no steer; say where it starts, start (--start) {example}"
            yield Fault(message, (word,))
        elif not is_number(value) and not (word in ("lean", "steer") and isinstance(value, str)):
            yield Fault(f"found {short(value)}; accepted: a number", (word,))
        elif word == "noise" and value < 0:
            yield Fault(f"found {value:.6g}; accepted: 0 or more", (word,))
    start = given["start"]
    if start is not None:
        if wrong := table_faults("start", start, f"{{'{system.names[-1]}': 0.1}}"):
            yield from wrong
            return
        for name, value in start.items():
            if name not in system.names:
                yield Fault(f"unknown state '{name}'; {suggest(name, system.names)}", ("start",))
            elif not is_number(value):
                yield Fault(f"found {short(value)}; accepted: a number", ("start", name))
            elif any(given[word] is not None and n == name for word, n in zip(("lean", "steer"), ANGLES, strict=True)):
                yield Fault("is given twice, in degrees and in rad; leave one out", ("start", name))
    seconds = given["seconds"]
    if seconds is not None and not (is_number(seconds) and seconds > 0):
        yield Fault(f"found {short(seconds)}; accepted: a number above 0", ("seconds",))
    yield from count_faults("points", given["points"], 2, MOST_POINTS)
    yield from count_faults("seed", given["seed"], 0)


def _radians(angle: float | str) -> float:
    """Of degrees, or of a text with a unit."""
    return with_unit(angle, "rad") if isinstance(angle, str) else math.radians(angle)
