"""Finds all designs with a pattern in a box of parameters, and proves that there are no others.

Branch and prune drops each part of the box that holds no design, and proves that each other part holds exactly one.
"""

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.balls import Number, number
from tmsopt.algebra.formula import UnsupportedOperation, fold, formula, symbol
from tmsopt.algebra.identity import multiply_out
from tmsopt.algebra.intervals import interval
from tmsopt.algebra.kinds import BALLS, NODES
from tmsopt.algebra.krawczyk import Enclosure, ProofFailed, enclose_solution, refine_solution
from tmsopt.global_search.pattern_equations import (
    Ends,
    PatternSystem,
    build_system,
    enumerate_pieces,
    find_rotating_frame,
)
from tmsopt.global_search.pruning import Box, BoxConditions, outer_doubles, prepare_formula, prune
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import lifted_quantities
from tmsopt.problem.real_form import real_form
from tmsopt.program.nlp import Scale, proof_units, scale_of
from tmsopt.progress import ReportCount
from tmsopt.records import Array, Table, plain

SECONDS = 60.0
"""Default time limit of a proof."""

_SINGULAR = "the equations are (nearly) singular there: the solution is one of a continuum, or two solutions meet"
_CLEAR = 1e-9  # relative distance from a limit that errors of numeric roots do not explain
_TIME_OUT = "time limit reached"
_STOPPED = "interrupted"
# Multiplies the usual unit of the roots: many roots have the size 1, which separates small roots from large ones.
_UNIT_FACTOR = 1.375
_WORK_DIGITS = 60  # decimal digits of the arithmetic
_ZERO_DIGITS = 40  # decimal digits of a zero
_RESULT_DIGITS = 25  # decimal digits of a design
_BATCH = 1024  # boxes per turn, so that a turn takes about 0.1 s
_MIN_WIDTH = 1e-7  # relative to the first box: narrower boxes are not split
_MAX_MIN_WIDTH = 1e-2  # if the least width has grown beyond this, the search stops
_MAX_SMALL_BOXES = 400  # more small boxes show a continuum of designs; the least width then grows tenfold
_MAX_PLACES = 12  # more undecided places are merged into one


@dataclass(frozen=True)
class Undecided:
    """An undecided part of the box.

    Attributes:
        ranges: range of each free parameter, angles in radians.
        reason: why it is undecided.
    """

    ranges: Table[tuple[float, float]]
    reason: str


@dataclass(frozen=True)
class Completeness:
    """Whether all designs of a box with a pattern are known.

    Attributes:
        complete: whether it is proved that the box holds `designs` and no others.
        reason: why it is not proved.
        designs: free parameters of each proved design, angles in radians.
        limits: for each design, the limit that it reaches in all digits computed, or empty; the exact design may
            violate this limit slightly.
        boxes: number of boxes that branch and prune handled.
        seconds: time used.
        undecided: the undecided parts of the box.
        stopped: whether Ctrl-C ended the proof.
        total: number of designs in the whole plane, if the discriminant tells it; else None.
    """

    complete: bool
    reason: str = ""
    designs: tuple[Table[Number], ...] = ()
    limits: tuple[str, ...] = ()
    boxes: int = 0
    seconds: float = 0.0
    undecided: tuple[Undecided, ...] = ()
    stopped: bool = False
    total: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self) | {"seconds": round(self.seconds, 4)}


def prove_completeness(problem: Posed, seconds: float = SECONDS, progress: ReportCount | None = None) -> Completeness:
    """Find all designs of a box with the pattern of a problem, and prove that there are no others.

    Boxes in the parameters and the unknowns of the pattern are contracted and split until interval arithmetic shows
    that they hold no design, or Krawczyk's test shows that a box around them holds exactly one. A float stands for the
    shortest decimal that prints it. Ctrl-C ends the proof and keeps what is proved.

    Args:
        problem: with a pattern, and as many conditions as free parameters.
        progress: called with the seconds used and the seconds granted.
    """
    began = time.perf_counter()
    with flint.ctx.workdps(_WORK_DIGITS):
        try:
            searches = [(system, *_build_conditions(system)) for system in _enumerate_systems(problem)]
        except (UnsupportedOperation, TypeError, ZeroDivisionError) as error:
            return Completeness(False, f"branch and prune does not support {error}")
        zero_search = _ZeroSearch(began + seconds, seconds, progress)
        for system, conditions, box in searches:
            zero_search.search(system, conditions, box)
        return zero_search.summarise(problem, time.perf_counter() - began)


@dataclass(frozen=True)
class _Zero:
    """A proved solution of a system.

    Attributes:
        unique_box: the box that holds no other solution.
    """

    system: PatternSystem
    enclosure: Enclosure
    unique_box: Box


@dataclass
class _ZeroSearch:
    """The state of a search over all systems of a pattern.

    Attributes:
        end_time: value of the clock at which the time is over.
        seconds: the time limit.
        stop_reason: why the search stopped early; empty if it did not.
        undecided: (box, reason) for each undecided part.
    """

    end_time: float
    seconds: float
    progress: ReportCount | None
    box_count: int = 0
    stop_reason: str = ""
    zeros: list[_Zero] = field(default_factory=list)
    undecided: list[tuple[Box, str]] = field(default_factory=list)

    def search(self, system: PatternSystem, conditions: BoxConditions, first_box: Box) -> None:
        """Find all zeros of a system in its box."""
        zeros: list[_Zero] = []
        whole_box = np.array(first_box).T[..., None]
        boxes, small_boxes = whole_box, whole_box[..., :0]
        max_small, min_width = _MAX_SMALL_BOXES, _MIN_WIDTH
        try:
            while boxes.shape[-1] and min_width <= _MAX_MIN_WIDTH and not self.must_stop():
                self.box_count += boxes[..., -_BATCH:].shape[-1]
                pruned = prune(conditions, boxes[..., -_BATCH:], min_width)
                boxes = np.concatenate([boxes[..., :-_BATCH], pruned.remaining], axis=-1)
                is_unproved = [
                    not _add_zero(zeros, system, *map(_as_box, pair)) for pair in np.moveaxis(pruned.proved, -1, 0)
                ]
                small_boxes = np.concatenate([small_boxes, pruned.small, pruned.proved[0][..., is_unproved]], axis=-1)
                if small_boxes.shape[-1] >= max_small:
                    max_small, min_width = max_small + _MAX_SMALL_BOXES, 10 * min_width
        except KeyboardInterrupt:
            self.stop_reason, boxes = _STOPPED, whole_box  # the current batch may be lost
        self.zeros += zeros
        self.undecided += [(_as_box(box), _SINGULAR) for box in np.moveaxis(small_boxes, -1, 0)]
        self.undecided += [(_as_box(box), self.stop_reason or _SINGULAR) for box in np.moveaxis(boxes, -1, 0)]

    def must_stop(self) -> bool:
        """Whether the search was stopped or its time is over; reports progress."""
        seconds_left = self.end_time - time.perf_counter()
        if self.progress:
            self.progress(min(self.seconds - seconds_left, self.seconds), self.seconds, f"{self.box_count:,} boxes")
        self.stop_reason = self.stop_reason or (_TIME_OUT if seconds_left <= 0 else "")
        return bool(self.stop_reason)

    def summarise(self, problem: Posed, seconds: float) -> Completeness:
        """Collect the proved designs and the undecided places."""
        designs: list[tuple[Mapping[str, Any], str]] = []
        for zero in self.zeros:
            parameters = {n: zero.enclosure.balls[n] for n in problem.free}
            limit = _name_active_limits(zero)
            if limit is not None and not any(
                all(parameters[n].overlaps(other[n]) for n in parameters) for other, _ in designs
            ):
                designs.append((parameters, limit))
        designs.sort(key=lambda pair: [float(x) for x in pair[0].values()])
        parameter_set = problem.parameter_set
        numbers = [
            {n: number(x.atan() if parameter_set[n].tangent else x, _RESULT_DIGITS) for n, x in parameters.items()}
            for parameters, _ in designs
        ]
        places = _merge_undecided(problem, self.undecided)
        undecided = tuple(Undecided(_parameter_ranges(problem, box), reason) for box, reason in places)
        reasons = dict.fromkeys(u.reason for u in undecided)
        return Completeness(
            complete=not (self.undecided or self.stop_reason),
            reason="; ".join(reasons) or self.stop_reason,
            designs=tuple(map(Table, numbers)),
            limits=tuple(limit for _, limit in designs),
            boxes=self.box_count,
            seconds=seconds,
            undecided=undecided,
            stopped=self.stop_reason == _STOPPED,
        )


def _add_zero(zeros: list[_Zero], system: PatternSystem, wide_box: Box, image_box: Box) -> bool:
    """Prove by ball arithmetic that a box has one zero; add it to `zeros` if it is new. False if the proof fails."""
    if any(_is_inside(image_box, proved_zero.unique_box) for proved_zero in zeros):
        return True
    zero = _prove_zero(system, image_box)
    zero_box = [(zero.enclosure.balls[n],) * 2 for n in system.names] if zero else []
    if zero is None or not _is_inside(zero_box, wide_box):
        return False
    if not any(_is_inside(zero_box, proved_zero.unique_box) for proved_zero in zeros):
        zeros.append(zero)
    return True


def _enumerate_systems(problem: Posed) -> Iterator[PatternSystem]:
    """Yield one system for each choice of small and large roots."""
    frame = find_rotating_frame(problem)
    problem = problem if frame else real_form(problem).problem
    assert problem.pattern is not None
    equalities = tuple(c for c in problem.conditions.values() if c.equality)
    middle = {n: (lo + hi) / 2 for n, (lo, hi) in problem.free.items()}
    lifted = lifted_quantities(problem.model, problem.parameter_set, problem.ordered(middle), equalities)
    scale = scale_of(problem)
    for pieces in enumerate_pieces(problem.pattern.form, is_complex=frame is not None):
        yield build_system(problem, pieces, frame or Scale(_UNIT_FACTOR * scale.unit, scale.a0_unit), lifted)


def _build_conditions(system: PatternSystem) -> tuple[BoxConditions, Box]:
    """Prepare the equations and limits of a system for pruning, and the box of its unknowns.

    Raises:
        UnsupportedOperation: for equations that branch and prune does not support.
    """
    box = tuple((outer_doubles(lo)[0], outer_doubles(hi)[1]) for lo, hi in _unknown_ranges(system))
    names = {n: symbol(n) for n in system.names}
    limits = [*fold(system.nonnegative, names, NODES), *fold(system.ascending, names, NODES)]
    for name, limit in system.limits.items():
        with suppress(UnsupportedOperation):  # the limit is then only checked at each design
            limits.append(-system.problem.conditions[name].sign * fold(prepare_formula(limit), names, NODES)[0])
    formulas = (system.equations, formula(limits, system.names), system.shared)
    equations, limited, extra = (prepare_formula(multiply_out(f)) for f in formulas)
    widths = tuple(hi - lo if math.isfinite(hi - lo) else 1.0 for lo, hi in box)
    return BoxConditions(equations, limited, widths, extra), box


def _unknown_ranges(system: PatternSystem) -> list[tuple[Any, Any]]:
    """Return the least and the greatest value of each unknown, as balls."""
    problem = system.problem
    ranges: list[tuple[Any, Any]] = []
    for name, ends in problem.free.items():
        lo, hi = (flint.arb(problem.exactly({name: end})[name]) for end in ends)
        ranges.append((lo.tan(), hi.tan()) if problem.parameter_set[name].tangent else (lo, hi))
    further_ranges = [(q.range.lower, q.range.upper) for q in system.lifted] + [
        r for p in system.pieces for r in p.ranges
    ]
    return ranges + [(flint.arb(low), flint.arb(high)) for low, high in further_ranges]


def _prove_zero(system: PatternSystem, box: Box) -> _Zero | None:
    """Prove a zero near the middle of a box by Krawczyk's test; None if the test fails."""
    start = {n: flint.arb(lo + (hi - lo) / 2) for n, (lo, hi) in zip(system.names, box, strict=True)}
    units = proof_units(system.problem)
    try:
        function = partial(fold, system.equations, kind=BALLS)
        middle = refine_solution(function, start, system.names, _ZERO_DIGITS, units)
        enclosure = enclose_solution(function, middle, system.names, _ZERO_DIGITS, units)
    except (ProofFailed, ZeroDivisionError, ValueError):
        return None
    distances = {n: enclosure.uniqueness * units.get(n, 1.0) for n in system.names}
    unique_ranges = [(middle[n] - r, middle[n] + r) for n, r in distances.items()]
    return _Zero(system, enclosure, tuple((interval(lo)[1], interval(hi)[0]) for lo, hi in unique_ranges))


def _as_box(ends: Array) -> Box:
    """A box from its array of lower and upper ends."""
    return tuple(zip(*ends.tolist(), strict=True))


def _is_inside(box: Sequence[tuple[Any, Any]], outer_box: Box) -> bool:
    """Whether a box certainly lies inside another; a ball may stand for both ends."""
    return all(lo > low and hi < high for (lo, hi), (low, high) in zip(box, outer_box, strict=True))


def _name_active_limits(zero: _Zero) -> str | None:
    """Name the limits that a design reaches in all digits computed; empty if none, None if it violates a limit."""
    system, balls = zero.system, zero.enclosure.balls
    margins: list[tuple[str, Any]] = []
    for name, (lo, hi) in zip(system.names, _unknown_ranges(system), strict=True):
        label = "" if name.startswith(":") else name
        margins += [
            (label and f"the least {label}", balls[name] - lo),
            (label and f"the greatest {label}", hi - balls[name]),
        ]
    margins += [("the edge of the pattern", x) for x in fold(system.nonnegative, balls, BALLS)]
    margins += [("", x) for x in fold(system.ascending, balls, BALLS)]
    for name, condition in system.problem.conditions.items():
        if not condition.equality:
            excess = condition.sign * flint.arb(
                fold(system.limits[name], balls, BALLS)[0] if name in system.limits else "nan"
            )
            if not excess.is_finite():  # undefined somewhere in the ball: check the middle
                middle = system.problem.ordered({n: float(balls[n].mid()) for n in system.problem.free})
                values = system.problem.values(middle)
                if not condition.violation(values) <= 0:
                    return None
                difference = condition.sign * float(condition(values))
                if difference < -_CLEAR * max(map(abs, condition.sides(values))):
                    excess = flint.arb(difference)
            margins.append((f"constraint {name}", -excess))
    if any(x < 0 for _, x in margins):
        return None
    active_limits = [label for label, x in margins if label and not x > 0]
    return ", ".join(active_limits + ["a0 = 0"] * flint.arb(fold(system.leading, balls, BALLS)[0]).contains(0))


def _merge_undecided(problem: Posed, undecided: Iterable[tuple[Box, str]]) -> list[tuple[Box, str]]:
    """Merge boxes that touch into one hull, in the free parameters; if many hulls remain, merge all of them."""
    places: list[tuple[Box, str]] = []
    for box, reason in undecided:
        hull, separate_places = box[: len(problem.free)], []
        for other_hull, other_reason in places:
            if other_reason == reason and all(
                a[0] <= b[1] and b[0] <= a[1] for a, b in zip(hull, other_hull, strict=True)
            ):
                hull = _hull([hull, other_hull])
            else:
                separate_places.append((other_hull, other_reason))
        places = [*separate_places, (hull, reason)]
    if len(places) > _MAX_PLACES:
        return [(_hull([hull for hull, _ in places]), "; ".join(dict.fromkeys(text for _, text in places)))]
    return places


def _hull(boxes: Sequence[Box]) -> Box:
    """The smallest box that holds all boxes."""
    return tuple((min(ends)[0], max(hi for _, hi in ends)) for ends in zip(*boxes, strict=True))


def _parameter_ranges(problem: Posed, box: Box) -> Table[Ends]:
    """The ranges of the free parameters in a box, angles in radians instead of tangents."""
    parameter_set = problem.parameter_set
    return Table(
        {
            n: (math.atan(lo), math.atan(hi)) if parameter_set[n].tangent else (lo, hi)
            for n, (lo, hi) in zip(problem.free, box, strict=True)
        }
    )
