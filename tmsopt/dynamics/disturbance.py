"""The disturbance that starts the motion of a design, as the user states it and as a state of the system."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tmsopt.dynamics.system import ANGLES, System
from tmsopt.errors import Fault, InputError, count_faults, is_number, short, suggest, table_faults
from tmsopt.problem.units import parse_quantity
from tmsopt.records import Array, Table, plain

MAX_POINTS = 1_000_000
"""Largest number of points of a simulation."""

_DEFAULT_LEAN = math.pi / 180  # lean at the start if the user states no disturbance
_ANGLE_NAMES = dict(zip(("lean", "steer"), ANGLES, strict=True))  # argument → name of the state
_IMPULSES = {"push": "T_delta", "lean_push": "T_phi"}  # argument → name of the torque
_AMOUNTS = (*_IMPULSES, "noise")  # arguments that are a number without a choice of units


@dataclass(frozen=True)
class Disturbance:
    """A disturbance of a design.

    Attributes:
        start: states at the start, before any push, in rad and s; states that are missing are 0.
        push, lean_push: impulses of steer torque and lean torque at t = 0.
        noise: intensity of the white noise on the steer torque.
        seed: seed of the noise.
        default: whether the user stated no disturbance.
    """

    start: Table[float] = field(default_factory=Table)
    push: float = 0.0
    lean_push: float = 0.0
    noise: float = 0.0
    seed: int = 0
    default: bool = False

    def state(self, system: System) -> Array:
        """The state immediately after the disturbance; yaw and lateral displacement are 0."""
        x = np.zeros(len(system.A))
        x[: len(system.names)] = [self.start.get(name, 0.0) for name in system.names]
        for name, torque in _IMPULSES.items():
            if amount := getattr(self, name):
                x += amount * system.impulses[torque]
        return x

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self, "start push lean_push default") | (plain(self, "noise seed") if self.noise else {})


def parse_disturbance(system: System, arguments: Mapping[str, Any]) -> Disturbance:
    """The disturbance that the arguments of `simulate` state.

    Args:
        arguments: name of each argument of `simulate` → its value.

    Raises:
        InputError: with all faults of the arguments.
    """
    start, faults = _parse_angles(system, arguments)
    states = {} if arguments["start"] is None else arguments["start"]
    start_faults = table_faults("start", states, f"{{'{system.names[-1]}': 0.1}}")
    faults += start_faults
    for name, value in () if start_faults else states.items():
        if name not in system.names:
            faults.append(Fault(f"unknown state '{name}'; {suggest(name, system.names)}", ("start",)))
        elif not is_number(value):
            faults.append(Fault(f"found {short(value)}; accepted: a number", ("start", name)))
        elif name in start:
            faults.append(Fault("is given twice, in degrees and in rad; give it once", ("start", name)))
        else:
            start[name] = float(value)
    seconds = arguments["seconds"]
    if seconds is not None and not (is_number(seconds) and seconds > 0):
        faults.append(Fault(f"found {short(seconds)}; accepted: a number above 0", ("seconds",)))
    faults += [
        *count_faults("points", arguments["points"], 2, MAX_POINTS),
        *count_faults("seed", arguments["seed"], 0),
    ]
    if faults:
        raise InputError(faults)
    is_default = not start and all(arguments[name] is None for name in _AMOUNTS)
    if is_default:
        start = {system.coordinates[0]: _DEFAULT_LEAN if system.impulses else 1.0}
    amounts = {name: float(arguments[name] or 0.0) for name in _AMOUNTS}
    return Disturbance(Table(start), **amounts, seed=int(arguments["seed"]), default=is_default)


def _parse_angles(system: System, arguments: Mapping[str, Any]) -> tuple[dict[str, float], list[Fault]]:
    """The angles at the start, and the faults of the angles, pushes and noise."""
    faults, start = list[Fault](), dict[str, float]()
    for argument, value in ((w, arguments[w]) for w in (*_ANGLE_NAMES, *_AMOUNTS) if arguments[w] is not None):
        if not system.impulses:
            example = ", ".join(f"{n}=1" for n in system.names[-1:])
            message = f"a stated system has no lean and no steer; give its initial state, start (--start) {example}"
            faults.append(Fault(message, (argument,)))
        elif argument in _ANGLE_NAMES and isinstance(value, str):
            try:
                start[_ANGLE_NAMES[argument]] = parse_quantity(value, "rad")
            except ValueError as error:
                text = str(error).replace("a number without quotes in rad", "a number without quotes in degrees")
                faults.append(Fault(text, (argument,)))
        elif not is_number(value):
            faults.append(Fault(f"found {short(value)}; accepted: a number", (argument,)))
        elif argument in _ANGLE_NAMES:
            start[_ANGLE_NAMES[argument]] = math.radians(value)
        elif argument == "noise" and value < 0:
            faults.append(Fault(f"found {value:.6g}; accepted: 0 or more", (argument,)))
    return start, faults
