"""All designs of a box with a pattern: boxes without one dropped, each of the others proved to hold exactly one."""

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
from tmsopt.global_search.conditions import Ends, Sheet, rotating_frame, sheet, sheets
from tmsopt.global_search.pruning import Box, Puzzle, ends, prepared, prune
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import lifted_quantities
from tmsopt.program.nlp import Scale, proof_units, scale_of
from tmsopt.progress import Counts
from tmsopt.records import Array, Table, plain

SECONDS = 60.0
"""Time for a proof, by default."""

_SINGULAR = "the equations are singular there, or nearly so: one of a continuum of designs, or one where two meet"
_TIME = "time was over"
_STOPPED = "interrupted"
_UNITS = 1.375  # of the usual unit: roots are often at 1, where large and small ones meet
_CARRIED, _DIGITS, _SHOWN = 60, 40, 25  # decimal digits: of arithmetic, of a zero, of a design
_AT_ONCE = 1024  # boxes, so that a turn takes a tenth of a second or so
_SMALL, _COARSE = 1e-7, 1e-2  # of the first box: what is smaller is not split
_MOST = 400  # boxes so small, and they are no isolated designs: from then on ten times as large ones are small
_SAID = 12  # places that are named


@dataclass(frozen=True)
class Undecided:
    """A part of the box of which nothing is proved.

    Attributes:
        ranges: of each free parameter.
        reason: why not.
    """

    ranges: Table[tuple[float, float]]
    reason: str


@dataclass(frozen=True)
class Completeness:
    """Whether the designs of a box with a pattern are all known.

    Attributes:
        complete: whether it is proved that the box holds `designs` and no other.
        reason: why not, in words.
        designs: free parameters of each that is proved to exist and to be the only one near, angles in radians.
        limits: of each, the limit on which it lies as far as can be told, so that it may be just beyond; mostly empty.
        boxes: that interval branch and prune looked at.
        seconds: that it took.
        undecided: where it did not decide.
        stopped: whether Ctrl-C ended it.
    """

    complete: bool
    reason: str = ""
    designs: tuple[Table[Number], ...] = ()
    limits: tuple[str, ...] = ()
    boxes: int = 0
    seconds: float = 0.0
    undecided: tuple[Undecided, ...] = ()
    stopped: bool = False

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self) | {"seconds": round(self.seconds, 4)}


def completeness(problem: Posed, seconds: float = SECONDS, progress: Counts | None = None) -> Completeness:
    """Every design in the box of a problem with its pattern, and whether that is proved.

    Boxes in the parameters and the unknowns of the pattern are contracted and split until interval arithmetic shows
    that they hold no design, or the test of Krawczyk that a box around them holds exactly one. Numbers stand for the
    decimals that print them. Ctrl-C ends it with what is proved so far.

    Args:
        problem: one with a pattern, and as many conditions as free parameters.
        progress: called with seconds passed and seconds at most.
    """
    began = time.perf_counter()
    with flint.ctx.workdps(_CARRIED):
        try:
            posed = [(sheet, *_puzzle(sheet)) for sheet in _sheets(problem)]
        except (UnsupportedOperation, TypeError, ZeroDivisionError) as error:
            return Completeness(False, f"branch and prune cannot take {error}")
        run = _Run(began + seconds, seconds, progress)
        for sheet, puzzle, box in posed:
            run.search(sheet, puzzle, box)
        return run.stated(problem, time.perf_counter() - began)


@dataclass(frozen=True)
class _Zero:
    """A solution of the equations of a sheet, proved.

    Attributes:
        near: the box in which it is the only one.
    """

    sheet: Sheet
    enclosure: Enclosure
    near: Box


@dataclass
class _Run:
    """A search under way; discarded once it is stated."""

    end: float
    seconds: float
    progress: Counts | None
    boxes: int = 0
    stopped: str = ""
    zeros: list[_Zero] = field(default_factory=list)
    left: list[tuple[Box, str]] = field(default_factory=list)

    def search(self, sheet: Sheet, puzzle: Puzzle, first: Box) -> None:
        """All zeros of a sheet in its box."""
        known: list[_Zero] = []
        whole = np.array(first).T[..., None]
        left, small = whole, whole[..., :0]
        most, least = _MOST, _SMALL
        try:
            while left.shape[-1] and least <= _COARSE and not self.over():
                self.boxes += left[..., -_AT_ONCE:].shape[-1]
                pruned = prune(puzzle, left[..., -_AT_ONCE:], least)
                left = np.concatenate([left[..., :-_AT_ONCE], pruned.left], axis=-1)
                each = np.moveaxis(pruned.shown, -1, 0)
                refused = [self.refuses(sheet, known, *map(_box, own)) for own in each]
                small = np.concatenate([small, pruned.small, pruned.shown[0][..., refused]], axis=-1)
                if small.shape[-1] >= most:
                    most, least = most + _MOST, 10 * least
        except KeyboardInterrupt:
            self.stopped, left = _STOPPED, whole  # whatever was in hand
        self.zeros += known
        self.left += [(_box(own), _SINGULAR) for own in np.moveaxis(small, -1, 0)]
        self.left += [(_box(own), self.stopped or _SINGULAR) for own in np.moveaxis(left, -1, 0)]

    def over(self) -> bool:
        """Whether time is over; the reader is told how far it is."""
        left = self.end - time.perf_counter()
        if self.progress:
            self.progress(min(self.seconds - left, self.seconds), self.seconds, f"{self.boxes:,} boxes")
        self.stopped = self.stopped or (_TIME if left <= 0 else "")
        return bool(self.stopped)

    def refuses(self, sheet: Sheet, known: list[_Zero], wide: Box, image: Box) -> bool:
        """Whether the only zero of a box is not proved by balls; a new one becomes known."""
        if any(_inside(image, other.near) for other in known):
            return False
        zero = _zero(sheet, image)
        at = [(zero.enclosure.balls[n],) * 2 for n in sheet.names] if zero else []
        if zero is None or not _inside(at, wide):
            return True
        if not any(_inside(at, other.near) for other in known):
            known.append(zero)
        return False

    def stated(self, problem: Posed, seconds: float) -> Completeness:
        """What is proved by now."""
        designs: list[tuple[Mapping[str, Any], str]] = []
        for zero in self.zeros:
            at = {n: zero.enclosure.balls[n] for n in problem.free}
            limit = _standing(zero)
            if limit is not None and not any(all(at[n].overlaps(b[n]) for n in at) for b, _ in designs):
                designs.append((at, limit))
        designs.sort(key=lambda found: [float(x) for x in found[0].values()])
        of = problem.parameter_set
        numbers = [{n: number(x.atan() if of[n].tangent else x, _SHOWN) for n, x in at.items()} for at, _ in designs]
        places = _places(problem, self.left)
        undecided = tuple(Undecided(_ranges(problem, box), reason) for box, reason in places)
        reasons = dict.fromkeys(u.reason for u in undecided)
        return Completeness(
            complete=not (self.left or self.stopped),
            reason="; ".join(reasons) or self.stopped,
            designs=tuple(map(Table, numbers)),
            limits=tuple(limit for _, limit in designs),
            boxes=self.boxes,
            seconds=seconds,
            undecided=undecided,
            stopped=self.stopped == _STOPPED,
        )


def _sheets(problem: Posed) -> Iterator[Sheet]:
    """The equations, one for each way in which the roots may be small or large."""
    assert problem.pattern is not None
    equalities = tuple(c for c in problem.conditions.values() if c.equality)
    middle = {n: (lo + hi) / 2 for n, (lo, hi) in problem.free.items()}
    lifted = lifted_quantities(problem.model, problem.parameter_set, problem.ordered(middle), equalities)
    frame, scale = rotating_frame(problem), scale_of(problem)
    for pieces in sheets(problem.pattern.form, of_h=frame is not None):
        yield sheet(problem, pieces, frame or Scale(_UNITS * scale.unit, scale.lead), lifted)


def _puzzle(sheet: Sheet) -> tuple[Puzzle, Box]:
    """Equations and limits as plain data, and the box of all unknowns.

    Raises:
        UnsupportedOperation: for equations that branch and prune cannot take.
    """
    box = tuple((ends(lo)[0], ends(hi)[1]) for lo, hi in _ends(sheet))
    names = {n: symbol(n) for n in sheet.names}
    limits = [*fold(sheet.nonnegative, names, NODES), *fold(sheet.ascending, names, NODES)]
    for name, limit in sheet.limits.items():
        with suppress(UnsupportedOperation):  # it takes no part, and is asked of every design that is found
            limits.append(-sheet.problem.conditions[name].sign * fold(prepared(limit), names, NODES)[0])
    equations, more, limited = (
        prepared(multiply_out(asked)) for asked in (sheet.equations, sheet.shared, formula(limits, sheet.names))
    )
    widths = tuple(hi - lo if math.isfinite(hi - lo) else 1.0 for lo, hi in box)
    return Puzzle(equations, limited, widths, more), box


def _ends(sheet: Sheet) -> list[tuple[Any, Any]]:
    """Least and greatest value of each unknown, as balls."""
    problem = sheet.problem
    found: list[tuple[Any, Any]] = []
    for name, (least, greatest) in problem.free.items():
        lo, hi = (flint.arb(problem.exactly({name: end})[name]) for end in (least, greatest))
        found.append((lo.tan(), hi.tan()) if problem.parameter_set[name].tangent else (lo, hi))
    plain = [(q.range.lower, q.range.upper) for q in sheet.lifted] + [r for p in sheet.pieces for r in p.ranges]
    return found + [(flint.arb(low), flint.arb(high)) for low, high in plain]


def _zero(sheet: Sheet, box: Box) -> _Zero | None:
    """The zero beside a box, proved; None where the test fails."""
    start = {n: flint.arb(lo + (hi - lo) / 2) for n, (lo, hi) in zip(sheet.names, box, strict=True)}
    units = proof_units(sheet.problem)
    try:
        system = partial(fold, sheet.equations, kind=BALLS)
        middle = refine_solution(system, start, sheet.names, _DIGITS, units)
        found = enclose_solution(system, middle, sheet.names, _DIGITS, units)
    except (ProofFailed, ZeroDivisionError, ValueError):
        return None
    around = {n: found.uniqueness * units.get(n, 1.0) for n in sheet.names}
    near = [(middle[n] - r, middle[n] + r) for n, r in around.items()]
    return _Zero(sheet, found, tuple((interval(lo)[1], interval(hi)[0]) for lo, hi in near))


def _box(own: Array) -> Box:
    """One of many boxes."""
    return tuple(zip(*own.tolist(), strict=True))


def _inside(box: Sequence[tuple[Any, Any]], other: Box) -> bool:
    """Whether a box is in another for certain; balls are their own ends."""
    return all(lo > low and hi < high for (lo, hi), (low, high) in zip(box, other, strict=True))


def _standing(zero: _Zero) -> str | None:
    """The limit on which a design lies as far as can be told, or empty; None for one beyond a limit."""
    sheet, at = zero.sheet, zero.enclosure.balls
    room: list[tuple[str, Any]] = []
    for name, (lo, hi) in zip(sheet.names, _ends(sheet), strict=True):
        said = "" if name.startswith(":") else name
        room += [(said and f"the least {said}", at[name] - lo), (said and f"the greatest {said}", hi - at[name])]
    room += [("the edge of the pattern", x) for x in fold(sheet.nonnegative, at, BALLS)]
    room += [("", x) for x in fold(sheet.ascending, at, BALLS)]
    for name, condition in sheet.problem.conditions.items():
        if not condition.equality:
            told = fold(sheet.limits[name], at, BALLS)[0] if name in sheet.limits else "nan"
            excess = condition.sign * flint.arb(told)
            if not excess.is_finite():  # it may not exist somewhere near: does it at the middle, and is it met?
                middle = sheet.problem.ordered({n: float(at[n].mid()) for n in sheet.problem.free})
                if not condition.violation(sheet.problem.values(middle)) <= 0:
                    return None
            room.append((f"constraint {name}", -excess))
    if any(x < 0 for _, x in room):
        return None
    on = [said for said, x in room if said and not x > 0]
    return ", ".join(on + ["a0 = 0"] * flint.arb(fold(sheet.leading, at, BALLS)[0]).contains(0))


def _places(problem: Posed, left: Iterable[tuple[Box, str]]) -> list[tuple[Box, str]]:
    """Hulls in the free parameters of boxes that touch."""
    places: list[tuple[Box, str]] = []
    for box, reason in left:
        own, rest = box[: len(problem.free)], []
        for other, why in places:
            if why == reason and all(a[0] <= b[1] and b[0] <= a[1] for a, b in zip(own, other, strict=True)):
                own = _hull([own, other])
            else:
                rest.append((other, why))
        places = [*rest, (own, reason)]
    if len(places) > _SAID:
        return [(_hull([own for own, _ in places]), "; ".join(dict.fromkeys(why for _, why in places)))]
    return places


def _hull(boxes: Sequence[Box]) -> Box:
    """The least box around boxes."""
    return tuple((min(ends)[0], max(hi for _, hi in ends)) for ends in zip(*boxes, strict=True))


def _ranges(problem: Posed, box: Box) -> Table[Ends]:
    """A box in the parameters themselves, angles in radians."""
    of = problem.parameter_set
    return Table(
        {
            n: (math.atan(lo), math.atan(hi)) if of[n].tangent else (lo, hi)
            for n, (lo, hi) in zip(problem.free, box, strict=True)
        }
    )
