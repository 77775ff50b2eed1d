"""Motion of a design after a lean or a push, or in noise: `simulate` and its `Simulation`."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np

from tmsopt.boundaries.weighted_design import parameter_faults
from tmsopt.dynamics.disturbance import Disturbance, parse_disturbance
from tmsopt.dynamics.flow import sample_motion, simulate_noise, stationary_covariance
from tmsopt.dynamics.measures import (
    MAX_GRID_POINTS,
    POINTS_PER_PERIOD,
    Measure,
    SampledMotion,
    measure_output,
    sample_grid,
)
from tmsopt.dynamics.mode_shapes import ModeShape, compute_mode_shapes
from tmsopt.dynamics.speeds import parameters_of
from tmsopt.dynamics.system import ANGLES, RATES, System, matrices_of, system_of
from tmsopt.errors import InputError, input_error
from tmsopt.files import write_csv
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.problem import Posed, Problem
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Column, Table, Tabular, plain
from tmsopt.roots import Structure

_DECAY_DURATION = 10.0  # first duration for a stable design, in units of 1/|abscissa|
_GROWTH_DURATION = 3.0  # longest duration for an unstable design, in units of 1/abscissa
_MAX_RADIANS = 200.0  # longest duration for an unstable design, in units of 1/|s| of the largest root s
_MAX_DOUBLINGS = 8  # largest number of doublings of the duration
_STILL_RATIO = 0.002  # a duration is long enough if its second half stays below this share of the peak
_NO_GROWTH = 1e-9  # largest growth rate, relative to the largest root, that is not significant
_ROUNDING = 1e-12  # rounding error of a root, relative to the largest root
# smallest decay rate, relative to the fastest root, for which the grid is long enough
_MIN_DECAY = _DECAY_DURATION * POINTS_PER_PERIOD / (2 * math.pi * MAX_GRID_POINTS)
_DRIFT_DURATION = 10.0  # duration in units of 1/‖A‖ if all roots are 0
_SETTLED_RATIO = 1.2  # duration relative to the settling time
_MAX_EXPONENT = 600.0  # largest growth as an exponent of e


@dataclass(frozen=True, repr=False)
class Simulation(Tabular):
    """Motion of a design over time.

    Attributes:
        parameters: every parameter of the design, in double precision.
        disturbance: the disturbance that starts the motion.
        columns: ``t``, then for a bicycle ``phi delta phidot deltadot``, the torques ``T_phi`` and ``T_delta`` of a
            controller, and the path: ``x`` along the road, yaw ``psi``, and the positions ``y_rear`` and ``y_front`` of
            the contacts, positive to the right. A stated system has ``q1 … q1dot …`` or ``x1 …``, and a complex H has
            ``psi1_re psi1_im psi2_re …``.
        units: unit of each column that has a unit: s, rad, N m, m; for dimensionless parameters √(w/g), rad, m_B g w,
            w.
        measures: one for each coordinate and torque. For a stable design they cover the whole motion. They cover only
            the time shown for an unstable design, for a decay over more than about 20 000 oscillations, and in noise.
        deviations: stationary standard deviations in noise; empty without noise or for an unstable design.
        modes: mode shapes, in the order of their roots, rightmost first.
        structure: structure of the roots on the rightmost line, e.g. ``EP4``.
        stable: whether all roots are left of the axis; multiple roots, and roots of a complex H, must be left of it by
            more than rounding errors.
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
        """The columns without torques and path: ``t phi delta phidot deltadot`` for a bicycle."""
        return tuple(n for n in self.columns if n not in self.extra)

    def __getitem__(self, name: str) -> Column:
        return self.columns[name]

    def records(self) -> Iterable[dict[str, float]]:
        """Every column, one row per time."""
        return (dict(zip(self.columns, row, strict=True)) for row in zip(*self.columns.values(), strict=True))

    def write_csv(self, path: str | PathLike[str], *, whole: bool = False) -> None:
        """Write the columns as a table with their names as header, in s and rad.

        Args:
            whole: also write the torques of a controller and the path.

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
    design: ProblemSource,
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
    """Simulate a design after a lean, a push of its handlebar or in noise; exact even where its roots meet.

    The motion is x(t) = e^(At) x(0) at evenly spaced times, for the linear equations of the design with its
    parameters in double precision. At a multiple root with a Jordan block, the exponential contains the terms
    t^k e^(st). Rounding moves the roots of an exceptional point, but changes e^(At) only by the size of the rounding.
    Peaks and settling times belong to the exact motion, not to the times shown.

    Args:
        design: a solution, or a problem or its file, which is solved first if it has free parameters.
        lean, steer: initial angles, positive to the right, in degrees, or ``"0.1 rad"``. Without any disturbance, a
            bicycle starts with a lean of 1 degree, and a stated system with 1 in its first coordinate.
        push, lean_push: impulse of steer torque and of lean torque at t = 0, in N m s; for dimensionless parameters in
            m_B g w √(w/g).
        start: other initial states, by the names of their columns, in rad and s: ``{"phidot": 0.1}``, ``{"q1": 1}``,
            ``{"psi1_re": 1}``.
        noise: intensity σ of white noise on the steer torque, in N m √s; its impulse over a time T has the standard
            deviation σ √T.
        seed: seed of the noise.
        seconds: duration, for dimensionless parameters in √(w/g). By default, a stable design is shown until all
            outputs have settled, and an unstable design until its motion has grown by e³. If this takes longer than
            200/|s|, where s is the largest root, an unstable design is shown for 200/|s|.
        points: number of evenly spaced times, including 0 and the end.
        at: parameters that have other values than in the design, such as the speed: ``{"v": 1.5}``. If the problem has
            several scenarios, the nominal design is simulated.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        NotSolved: if no design is found.
        InputError: for a model without matrices, or invalid arguments.

    Example:
        >>> swing = tmsopt.models.from_matrices(M=[[1]], D=[["c"]], K=[[1]])
        >>> pushed = tmsopt.simulate(tmsopt.Problem(swing, fixed={"c": 2.0}), start={"q1dot": 1})  # q = t e^(-t)
        >>> [f"{x:.6f}" for x in (pushed.measures[0].peak, math.exp(-1))], pushed.structure
        (['0.367879', '0.367879'], 'EP2')

    More: docs/how_to/motion.md
    """
    arguments, posed = locals(), pose(design)
    problem = posed.nominal
    matrices_of(problem.model)  # without matrices, raise an error before the problem is solved
    parameters = problem.ordered(parameters_of(design, posed, "", progress)) | dict(at or {})
    if faults := list(parameter_faults(problem, parameters)):
        raise InputError([replace(f, key=("at", *f.key[-1:])) for f in faults])
    start_steps(progress, "following the motion")
    system = system_of(problem, parameters)
    disturbance = parse_disturbance(system, arguments)
    structure: Structure = problem.values(parameters)["structure"]
    parameter_set = problem.parameter_set
    rate_unit = 1.0 if parameter_set.rate is None else float(parameter_set.rate(parameters))
    x = disturbance.state(system)
    is_stable = _is_stable(problem, structure)
    has_died_out, end_time, motion = _choose_duration(system, x, structure, is_stable, rate_unit, seconds, bool(noise))
    times, step = np.linspace(0.0, end_time, points), end_time / (points - 1)
    output_rows, deviations = {n: system.rows[n] for n in (*system.coordinates, *system.torques)}, Table[float]()
    if noise:
        force = disturbance.noise * system.impulses["T_delta"]
        states = simulate_noise(system.A, x, force, step, points, seed)
        measures = tuple(_find_peak(name, times, states @ row) for name, row in output_rows.items())
        deviations = _compute_deviations(system, force) if is_stable else deviations
    else:
        states = sample_motion(system.A, x, step, points)
        measures = tuple(measure_output(name, row, motion, has_died_out) for name, row in output_rows.items())
    base_names = tuple(n for n in system.names if n not in system.torques)
    extra_names = tuple(n for n in system.rows if n not in base_names)
    columns = {"t": Column(times)} | {n: Column(states @ system.rows[n]) for n in (*base_names, *extra_names)}
    if extra_names:
        columns["x"], extra_names = Column(system.speed * times), (*extra_names, "x")
    modes = compute_mode_shapes(problem, parameters, structure, rate_unit)
    units = Table({n: system.units[n] for n in columns if n in system.units})
    return Simulation(
        problem.problem,
        Table(parameters),
        disturbance,
        Table(columns),
        units,
        measures,
        deviations,
        modes,
        structure.name,
        is_stable,
        extra_names,
    )


def _is_stable(problem: Posed, structure: Structure) -> bool:
    """Whether the design is stable. Multiple roots, and roots of a complex H, must be stable by more than rounding."""
    rightmost_multiplicities = [r.multiplicity for r in structure.roots if r.re == structure.abscissa]
    is_exact = not problem.model.is_complex and max(rightmost_multiplicities, default=1) == 1
    max_root_size = max((r.size for r in structure.roots), default=0.0)
    return structure.abscissa < (0.0 if is_exact else -_ROUNDING * max_root_size)


def _choose_duration(
    system: System,
    x: Array,
    structure: Structure,
    is_stable: bool,
    rate_unit: float,
    seconds: float | None,
    has_noise: bool,
) -> tuple[bool, float, SampledMotion]:
    """Choose how long to sample and to show a motion.

    Returns three things: whether the motion has died out when the samples end, the time to show, and the sampled
    motion.

    Raises:
        InputError: if the motion would overflow.
    """
    if not structure.roots:
        raise input_error(
            "the roots of this design are not known: one of them is at infinity, or nearly so", "parameters"
        )
    z = rate_unit * np.array([complex(r.re, r.im) for r in structure.roots])
    abscissa, max_frequency, max_root_size = map(float, (z.real.max(), np.abs(z.imag).max(), np.abs(z).max()))
    if seconds is not None and seconds * abscissa > _MAX_EXPONENT:
        accepted = f"accepted: up to {_MAX_EXPONENT / abscissa:.4g}, in which the motion grows by e^{_MAX_EXPONENT:.0f}"
        raise input_error(f"found {seconds:.6g} for an unstable design; {accepted}", "seconds")
    matrix_norm = float(np.linalg.norm(system.A[: len(system.names), : len(system.names)], 2))
    has_nonzero_root = max_root_size > _ROUNDING * matrix_norm
    end_time = _MAX_RADIANS / max_root_size if has_nonzero_root else _DRIFT_DURATION / (matrix_norm or 1.0)
    if not is_stable or -abscissa < max(_MIN_DECAY * max_frequency, _ROUNDING * max_root_size):
        if abscissa > _NO_GROWTH * max_root_size:
            end_time = min(end_time, _GROWTH_DURATION / abscissa)
        end_time = _round_up(end_time) if seconds is None else seconds
        return False, end_time, sample_grid(system.A, x, end_time, max_frequency, max_root_size)
    end_time, rows = _DECAY_DURATION / -abscissa, [system.rows[name] for name in system.coordinates]
    for _ in range(_MAX_DOUBLINGS):
        motion = sample_grid(system.A, x, end_time, max_frequency, max_root_size)
        values = np.abs(motion.states @ np.array(rows).T)
        if (values[motion.times > end_time / 2].max(axis=0) <= _STILL_RATIO * values.max(axis=0)).all():
            break
        end_time *= 2
    if seconds is None:
        settled = [measure_output("", row, motion, True).settling for row in rows]
        last_settling_time = max((s for s in settled if s > 0), default=end_time)
        seconds = _round_up(end_time if has_noise else _SETTLED_RATIO * last_settling_time)
    return True, seconds, motion


def _round_up(value: float) -> float:
    """Round up to two digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit) * unit:.6g}")


def _find_peak(name: str, times: Array, values: Array) -> Measure:
    """The peak of a motion in noise, at the times shown."""
    k = int(np.abs(values).argmax())
    return Measure(name, float(values[k]), float(times[k]), math.nan, math.nan)


def _compute_deviations(system: System, force: Array) -> Table[float]:
    """Stationary standard deviations of all columns except the path, whose deviation grows without limit."""
    n = len(system.names)
    covariance = stationary_covariance(system.A[:n, :n], force[:n])
    rows = {name: system.rows[name][:n] for name in (*ANGLES, *RATES, *system.torques)}
    return Table({name: math.sqrt(max(float(row @ covariance @ row), 0.0)) for name, row in rows.items()})
