"""What a design does after a lean, a push or in noise: `simulate` and the `Simulation` that it gives."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np

from tmsopt.boundaries.weighted_design import parameter_faults
from tmsopt.dynamics.asked import Disturbance, asked_for
from tmsopt.dynamics.flow import sampled, shaken, stationary
from tmsopt.dynamics.measures import FINEST, MOST, Measure, Watched, grid, measured
from tmsopt.dynamics.mode_shapes import ModeShape, mode_shapes
from tmsopt.dynamics.speeds import parameters_of
from tmsopt.dynamics.system import ANGLES, RATES, System, matrices_of, system_of
from tmsopt.errors import InputError, input_error
from tmsopt.files import write_csv
from tmsopt.models.user_spectrum import user_structure
from tmsopt.problem.files import Given, pose
from tmsopt.problem.problem import Posed, Problem
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Column, Table, Tabular, plain
from tmsopt.roots import Structure

_DECAYS, _GROWTHS, _RADIANS = 10.0, 3.0, 200.0  # times of a motion that is watched, in times 1/|abscissa| and 1/|s|
_DOUBLINGS, _STILL = 8, 0.002  # of a stable one, until the second half is so much smaller than its peak
_NO_GROWTH, _ROUNDING = 1e-9, 1e-12  # of the largest root: growth that is none; decay that doubles cannot tell
_SLOW = _DECAYS * FINEST / (2 * math.pi * MOST)  # of the fastest oscillation: decay that no grid can follow to its end
_ALONE = 10.0  # times 1/‖A‖ where all roots are 0
_AFTER = 1.2  # times the settling time
_LARGEST = 600.0  # powers of e by which a motion may grow


@dataclass(frozen=True, repr=False)
class Simulation(Tabular):
    """What a design does over time.

    Attributes:
        parameters: the design: every parameter, as stored.
        disturbance: what set it moving.
        columns: ``t``; of a bicycle ``phi delta phidot deltadot``, then the torques of a controller if it has one
            (``T_phi``, ``T_delta``), then the path: ``x`` along the road, yaw ``psi``, the contacts ``y_rear`` and
            ``y_front`` to the right; of a stated system ``q1 … q1dot …`` or ``x1 …``, of a
            complex H ``psi1_re psi1_im psi2_re …``.
        units: of each column that has one: s, rad, N m, m; of dimensionless parameters √(w/g), rad, m_B g w, w.
        measures: of each coordinate and torque; of the whole motion where the design is stable, else of the time
            shown, as where it dies out so slowly that 20 000 oscillations do not show it; in noise of the times shown.
        deviations: in noise, standard deviations of the long run; empty where there are none, as of a design that is
            not stable.
        modes: shapes of the modes, rightmost first.
        structure: which roots meet on the rightmost line, e.g. ``EP4``.
        stable: whether all roots lie left of the axis; not where those that lie on it but for rounding are multiple, or
            those of a complex H, whose loss then is none.
        extra: the columns of torques and path.

    Example:
        >>> pushed = tmsopt.simulate("problems/whipple_benchmark.toml", push=1, seconds=5)
        >>> jump = [pushed.columns[name][0] for name in ("phidot", "deltadot")]  # M⁻¹ (0, 1)
        >>> M = tmsopt.models.canonical(pushed.parameters)[0]
        >>> [round(float(sum(m * x for m, x in zip(row, jump))), 9) + 0.0 for row in M]
        [0.0, 1.0]

    More: docs/how_to/motion.md
    """

    problem: Problem
    parameters: Table[float]
    disturbance: Disturbance
    columns: Table[Column]
    units: Table[str]
    measures: tuple[Measure, ...]
    deviations: Table[float]
    modes: tuple[ModeShape, ...]
    structure: str
    stable: bool
    extra: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The columns without torques and path: ``t phi delta phidot deltadot``, or those of a stated system."""
        return tuple(n for n in self.columns if n not in self.extra)

    def __getitem__(self, name: str) -> Column:
        return self.columns[name]

    def records(self) -> Iterable[dict[str, float]]:
        """Every column at each time, one time a row."""
        return (dict(zip(self.columns, row, strict=True)) for row in zip(*self.columns.values(), strict=True))

    def write_csv(self, path: str | PathLike[str], *, whole: bool = False) -> None:
        """The columns in one table headed by their names alone: s and rad.

        Args:
            whole: with the torques of a controller and the path too.

        Raises:
            OSError: when the file cannot be written.
        """
        names = tuple(self.columns) if whole else self.names
        write_csv(path, [{n: row[n] for n in names} for row in self.records()], {})

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        return {
            **self.problem.posed.heading,
            **plain(self, "parameters stable structure disturbance units"),
            "measures": {m.name: plain(m, "peak at overshoot settling") for m in self.measures},
            **plain(self, "deviations modes columns"),
        }


def simulate(
    design: Given,
    *,
    lean: float | str | None = None,
    steer: float | str | None = None,
    push: float | None = None,
    lean_push: float | None = None,
    start: Mapping[str, float] | None = None,
    noise: float | None = None,
    seed: int = 0,
    seconds: float | None = None,
    points: int = 1001,
    at: Mapping[str, float] | None = None,
    progress: Listener | None = None,
) -> Simulation:
    """What a design does after a lean, a push of its handlebar or in noise, exactly, also where its roots meet.

    The motion is x(t) = e^(At) x(0) of the linear equations of the design as stored, at evenly spaced times; at a
    multiple root with a Jordan block the same exponential has the terms t^k e^(st). Rounding of the parameters, which
    scatters the roots of an exceptional point, moves e^(At) by no more than itself. Peaks and settling times are those
    of the exact motion, not of the times shown.

    Args:
        design: a solution; or a problem or its file, solved first if it frees parameters.
        lean, steer: angles at the start, to the right, in degrees as on the command line; or ``"0.1 rad"``. Where
            nothing is asked for, a bicycle starts with a lean of 1 degree, a stated system with 1 in its first
            coordinate.
        push, lean_push: impulse of steer torque and of lean torque at t = 0, in N m s; of dimensionless parameters in
            m_B g w √(w/g).
        start: other states at the start, by the names of columns, in rad and s: ``{"phidot": 0.1}``, ``{"q1": 1}``,
            ``{"psi1_re": 1}``.
        noise: intensity σ of white noise on the steer torque, in N m √s: in a time T its impulse has the standard
            deviation σ √T.
        seed: of the noise.
        seconds: how long; by default until all has settled, of a design that is not stable until it has grown
            e³-fold, or 200 radians of its fastest root. Of dimensionless parameters in √(w/g).
        points: how many times, evenly spaced, 0 and the last one included.
        at: parameters of the design that have other values here, such as another speed: ``{"v": 1.5}``. A design of
            several scenarios is looked at for the nominal one.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        NotSolved: where there is no design to look at.
        InputError: for a model without matrices, or what cannot be asked of it.

    Example:
        >>> swing = tmsopt.models.from_matrices(M=[[1]], D=[["c"]], K=[[1]])
        >>> pushed = tmsopt.simulate(tmsopt.Problem(swing, fixed={"c": 2.0}), start={"q1dot": 1})  # q = t e^(-t)
        >>> [f"{x:.6f}" for x in (pushed.measures[0].peak, math.exp(-1))], pushed.structure
        (['0.367879', '0.367879'], 'EP2')

    More: docs/how_to/motion.md
    """
    given, whole = locals(), pose(design)
    asked = whole.nominal
    matrices_of(asked.model)
    own = asked.ordered(parameters_of(design, whole, "", progress)) | dict(at or {})
    if faults := list(parameter_faults(asked, own)):
        raise InputError([replace(f, key=("at", *f.key[-1:])) for f in faults])
    start_steps(progress, "following the motion")
    system = system_of(asked, own)
    disturbance = asked_for(system, given)
    found: Structure = asked.values(own)["structure"]
    structure = user_structure(asked.model, found)
    of = asked.parameter_set
    rate = 1.0 if of.rate is None else float(of.rate(own))
    x = disturbance.state(system)
    stable = _dies_out(asked, found)
    followed, ending, on = _watched(system, x, structure, stable, rate, seconds, bool(noise))
    times, step = np.linspace(0.0, ending, points), ending / (points - 1)
    watched, deviations = {n: system.rows[n] for n in (*system.coordinates, *system.torques)}, Table[float]()
    if noise:
        force = disturbance.noise * system.impulses["T_delta"]
        states = shaken(system.A, x, force, step, points, seed)
        measures = tuple(_greatest(name, times, states @ row) for name, row in watched.items())
        deviations = _deviations(system, force) if stable else deviations
    else:
        states = sampled(system.A, x, step, points)
        measures = tuple(measured(name, row, on, followed) for name, row in watched.items())
    base = tuple(n for n in system.names if n not in system.torques)
    rest = tuple(n for n in system.rows if n not in base)
    columns = {"t": Column(times)} | {n: Column(states @ system.rows[n]) for n in (*base, *rest)}
    if rest:
        columns["x"], rest = Column(system.speed * times), (*rest, "x")
    modes = mode_shapes(asked, own, found, rate)
    units = Table({n: system.units[n] for n in columns if n in system.units})
    return Simulation(
        asked.problem,
        Table(own),
        disturbance,
        Table(columns),
        units,
        measures,
        deviations,
        modes,
        structure.name,
        stable,
        rest,
    )


def _dies_out(problem: Posed, found: Structure) -> bool:
    """Whether the design is stable, multiple roots and those of a complex H by more than rounding."""
    rightmost = [r.multiplicity for r in found.roots if r.re == found.abscissa]
    exact = problem.model.carrier is None and max(rightmost, default=1) == 1
    largest = max((r.size for r in found.roots), default=0.0)
    return found.abscissa < (0.0 if exact else -_ROUNDING * largest)


def _watched(
    system: System, x: Array, structure: Structure, stable: bool, rate: float, seconds: float | None, noisy: bool
) -> tuple[bool, float, Watched]:
    """Whether the motion dies out while it is measured, how long it is shown, and the motion that is measured.

    Raises:
        InputError: where it would grow beyond all numbers.
    """
    if not structure.roots:
        raise input_error(
            "the roots of this design cannot be told: one of them is at infinity, or nearly so", "parameters"
        )
    z = rate * np.array([complex(r.re, r.im) for r in structure.roots])
    abscissa, fastest, largest = map(float, (z.real.max(), np.abs(z.imag).max(), np.abs(z).max()))
    if seconds is not None and seconds * abscissa > _LARGEST:
        accepted = f"accepted: up to {_LARGEST / abscissa:.4g}, in which it grows by e^{_LARGEST:.0f}"
        raise input_error(f"found {seconds:.6g} of a design that is not stable; {accepted}", "seconds")
    size = float(np.linalg.norm(system.A[: len(system.names), : len(system.names)], 2))
    ending = _RADIANS / largest if largest > _ROUNDING * size else _ALONE / (size or 1.0)
    if not stable or -abscissa < max(_SLOW * fastest, _ROUNDING * largest):
        if abscissa > _NO_GROWTH * largest:
            ending = min(ending, _GROWTHS / abscissa)
        ending = _rounded_up(ending) if seconds is None else seconds
        return False, ending, grid(system.A, x, ending, fastest, largest)
    ending, rows = _DECAYS / -abscissa, [system.rows[name] for name in system.coordinates]
    for _ in range(_DOUBLINGS):
        on = grid(system.A, x, ending, fastest, largest)
        values = np.abs(on.states @ np.array(rows).T)
        if (values[on.times > ending / 2].max(axis=0) <= _STILL * values.max(axis=0)).all():
            break
        ending *= 2
    if seconds is None:
        settled = [measured("", row, on, True).settling for row in rows]
        last = max((s for s in settled if s > 0), default=ending)
        seconds = _rounded_up(ending if noisy else _AFTER * last)
    return True, seconds, on


def _rounded_up(value: float) -> float:
    """To two digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit) * unit:.6g}")


def _greatest(name: str, times: Array, values: Array) -> Measure:
    """The peak of a path in noise, at the times shown."""
    k = int(np.abs(values).argmax())
    return Measure(name, float(values[k]), float(times[k]), math.nan, math.nan)


def _deviations(system: System, force: Array) -> Table[float]:
    """Standard deviations in the long run, of all but the path, which wanders off for ever."""
    n = len(system.names)
    spread = stationary(system.A[:n, :n], force[:n])
    rows = {name: system.rows[name][:n] for name in (*ANGLES, *RATES, *system.torques)}
    return Table({name: math.sqrt(max(float(row @ spread @ row), 0.0)) for name, row in rows.items()})
