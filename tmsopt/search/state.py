"""The state of a search: a frozen record; each stage returns a new one."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from tmsopt.evaluation.recheck import Evaluation, recheck
from tmsopt.problem import Posed
from tmsopt.program import DEFAULTS, NLP, Options
from tmsopt.program.formulate import design_of, formulate
from tmsopt.program.ipopt import Point, Run
from tmsopt.records import Array
from tmsopt.search.sample import Sample, sample_box
from tmsopt.search.tuning import TUNING, Tuning


@dataclass(frozen=True)
class Start:
    """A design to start from.

    Attributes:
        design: free parameters; a missing one takes its value in the problem's start, or the middle of its range.
        near: whether the design may be close to an optimum.
        row: row of the design in the sample; -1 if it is not from the sample.

    Example:
        >>> tmsopt.Start({"Fr": 2.0, "chi_B": 1.4}).near
        True

    More: docs/explanation/search.md
    """

    design: Mapping[str, float]
    near: bool = True
    row: int = -1


@dataclass(frozen=True)
class LocalEnd:
    """The end of one start.

    Attributes:
        start: the start.
        nlp: the variant of the program that was solved.
        run: the result of IPOPT.
        objective: objective of the NLP, plus the amount by which rounding errors of its rows may have improved it;
            less is better, whether the problem minimises or maximises; inf if the objective has no value.
        feasible: whether the rows hold, the factors cover all roots, and located roots have Jordan chains; the recheck
            may still find a violated limit.
        crossing: whether the end is infeasible only because these chains are missing.
        led: rows of the sample's designs from which the objective falls along a straight line to this end.

    Example:
        >>> from dataclasses import replace
        >>> ends = []
        >>> def local(state, start):
        ...     ends.append(tmsopt.POLICY.local(state, start))
        ...     return ends[-1]
        >>> design = tmsopt.solve("problems/ep4.toml", policy=replace(tmsopt.POLICY, local=local))
        >>> [end.feasible for end in ends]
        [True]

    More: docs/explanation/search.md
    """

    start: Start
    nlp: NLP
    run: Run
    objective: float
    feasible: bool
    crossing: bool = False
    led: frozenset[int] = frozenset()

    @property
    def weight(self) -> int:
        """Number of starts for which the end counts: its own start, and each sampled design in `led`."""
        return 1 + len(self.led)

    @property
    def rank(self) -> tuple[bool, float]:
        """Sort key: the better of two ends has the lower rank."""
        return not self.feasible, self.objective


def make_failed_end(start: Start, nlp: NLP) -> LocalEnd:
    """Make an infeasible end for a start that cannot be solved."""
    return LocalEnd(start, nlp, Run(np.full(len(nlp.variables), np.nan), np.empty(0), np.empty(0), ""), math.inf, False)


@dataclass(frozen=True)
class CheckedEnd:
    """A polished and rechecked end.

    Attributes:
        end: the end before polishing.
        point: the polished end.
        parameters: every parameter of the design there.
        checked: the result of the recheck.

    Example:
        >>> from dataclasses import replace
        >>> best = []
        >>> def accept(state):
        ...     accepted = tmsopt.POLICY.accept(state)
        ...     best.append(accepted.best)
        ...     return accepted
        >>> design = tmsopt.solve("problems/ep4.toml", policy=replace(tmsopt.POLICY, accept=accept))
        >>> best[0].checked.structure.name
        'EP4'

    More: docs/explanation/search.md
    """

    end: LocalEnd
    point: Point
    parameters: Mapping[str, float]
    checked: Evaluation
    tuning: Tuning = TUNING


@dataclass(frozen=True)
class Fallback:
    """A design to return if no optimum is known: it is better than all ends, or near an infimum.

    Attributes:
        design: the free parameters.
        words: why the design is no optimum.
        without_best: whether no optimum exists.
    """

    design: Mapping[str, float]
    words: str
    without_best: bool = False


@dataclass(frozen=True)
class SearchState:
    """A search of one part of the box.

    Attributes:
        problem: the problem as posed.
        part: the problem on the part of the box that is searched, e.g. one sign of one parameter.
        side: name of the part, e.g. ``normal rake``; empty for the whole box.
        nlp: the program to solve from each start.
        extra: designs to start from that may be close to the optimum.
        sample: sample of the part; None if arrays cannot judge the problem, or the policy takes no sample.
        ends: ends of the starts, in order.
        accepted: how many of the ends were considered for `best`.
        best: the best end that passed the recheck, or else the end that fails it least.
        fallback: a design to return instead of `best`, though it is no optimum either.
        interrupted: whether the user stopped the search.

    Example:
        >>> counts = []
        >>> def enough(state):
        ...     counts.append(len(state.ends))
        ...     return tmsopt.POLICY.enough(state)
        >>> from dataclasses import replace
        >>> design = tmsopt.solve("problems/ep4.toml", policy=replace(tmsopt.POLICY, enough=enough))
        >>> counts  # the first end reaches a proven bound
        [1]

    More: docs/explanation/search.md
    """

    problem: Posed
    part: Posed
    nlp: NLP
    options: Options = DEFAULTS
    tuning: Tuning = TUNING
    side: str = ""
    extra: tuple[Mapping[str, float], ...] = ()
    sample: Sample | None = None
    ends: tuple[LocalEnd, ...] = ()
    accepted: int = 0
    best: CheckedEnd | None = None
    fallback: Fallback | None = None
    interrupted: bool = False

    @property
    def feasible(self) -> list[LocalEnd]:
        """Feasible ends, before the recheck."""
        return [end for end in self.ends if end.feasible]

    @property
    def left(self) -> list[int]:
        """Rows of sampled designs that were no start and do not lead straight to an end."""
        used_rows = {end.start.row for end in self.ends}.union(*(end.led for end in self.ends))
        return [row for row in range(len(self.sample.leaders) if self.sample else 0) if row not in used_rows]

    @property
    def out_of_reach(self) -> bool:
        """Whether all sampled designs are far from meeting the limits, even without the pattern."""
        sample = self.limits_sample
        return sample is not None and sample.out_of_reach

    @property
    def limits_sample(self) -> Sample | None:
        """The sample; for a problem with a pattern, a sample for its limits without the pattern."""
        if self.sample or not (self.part.pattern and self.part.conditions) or self.part.asks_radius:
            return self.sample
        return sample_limits(self.part, self.options.seed, self.tuning)

    @property
    def so_far(self) -> str:
        """The best objective so far, in words."""
        best = min((end.objective for end in self.feasible), default=math.inf)
        is_known = self.problem.objective is not None and math.isfinite(best)
        return ", ".join(filter(None, (f"best {self.problem.sign * best:.6g}" if is_known else "", self.side)))

    @property
    def designs(self) -> list[dict[str, float]]:
        """The designs at the ends."""
        return [self.design_at(end) for end in self.ends if np.all(np.isfinite(end.run.x))]

    def design_at(self, end: LocalEnd) -> dict[str, float]:
        """The free parameters at an end, clipped to the part of the box."""
        return design_of(self.part, end.run.x.tolist())

    def coefficients_at(self, end: LocalEnd) -> Array:
        """Return the coefficients at an end in every case, shape (cases, n + 1)."""
        nominal = self.part.ordered(self.design_at(end))
        designs = [case.applied(nominal) for case in end.nlp.cases if not case.direction] or [nominal]
        return np.array([[float(c) for c in self.part.values(p).coefficients] for p in designs])

    def recheck(self, design: Mapping[str, float]) -> Evaluation:
        """Recheck a design in the cases of the program."""
        return recheck(self.problem, self.problem.ordered(design), self.nlp.cases)

    def with_program(self, nlp: NLP) -> "SearchState":
        """A copy with another program and no ends."""
        return replace(self, nlp=nlp, ends=(), accepted=0, best=None)


def begin_search(
    problem: Posed,
    options: Options = DEFAULTS,
    extra: tuple[Mapping[str, float], ...] = (),
    tuning: Tuning = TUNING,
) -> list[SearchState]:
    """Make the initial states of a problem, one for each part of its box that contains `options.near`.

    The box is split at 0 of the first parameter whose signs have names (such as ``normal rake``); positive values come
    first.
    """
    parts = {"": problem}
    for name, (lower, upper) in problem.free.items():
        side_names = problem.parameter_set[name].sides
        if side_names is not None and lower < -tuning.min_box_width and upper > tuning.min_box_width:
            parts = {}
            for side, low, high in ((side_names[1], 0.0, upper), (side_names[0], lower, 0.0)):
                start = problem.start if low <= problem.start.get(name, low) <= high else {}
                parts[side] = problem.derive(free={**problem.free, name: (low, high)}, start=start)
            break
    return [
        SearchState(problem, part, formulate(part, problem.cases), options, tuning, side, extra)
        for side, part in parts.items()
        if is_inside(part, options.near or {})
    ]


def is_inside(problem: Posed, design: Mapping[str, float]) -> bool:
    """Whether the given parameters of a design are in the box."""
    return all(lower <= design.get(n, lower) <= upper for n, (lower, upper) in problem.free.items())


def is_close(problem: Posed, design: Mapping[str, float], other: Mapping[str, float], share: float) -> bool:
    """Whether no free parameter differs by more than a share of its range."""
    return all(abs(design[n] - other[n]) <= share * (upper - lower) for n, (lower, upper) in problem.free.items())


def clip_to_box(problem: Posed, design: Mapping[str, float]) -> dict[str, float]:
    """Return the free parameters of a design, moved into their ranges."""
    return {n: min(max(design[n], low), high) for n, (low, high) in problem.free.items()}


def same_objective(a: float, b: float, size: float = 1.0, tolerance: float = TUNING.same_objective) -> bool:
    """Whether two objectives count as the same optimum; `size` is the least scale of the comparison."""
    return abs(a - b) <= tolerance * (size + abs(b))


@lru_cache(maxsize=8)
def sample_limits(problem: Posed, seed: int, tuning: Tuning) -> Sample:
    """Sample a problem without its pattern, to see whether its limits can be met."""
    return sample_box(problem.derive(locate=None), seed, tuning)
