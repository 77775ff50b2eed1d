"""What solving needs of a problem again and again, made once: for one problem, or for many that differ in numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from tmsopt.boundaries.nearest import Robustness, robustness_at
from tmsopt.errors import Fault, InputError, is_number, short, suggest
from tmsopt.evaluation.recheck import Evaluation, recheck
from tmsopt.global_search.signs import none_stable
from tmsopt.problem.cases import Case
from tmsopt.problem.freedom import Freedom, degrees_of_freedom
from tmsopt.problem.problem import Posed
from tmsopt.problem.verdict.meetings import is_crossing
from tmsopt.program.formulate import design_of, formulate
from tmsopt.program.ipopt import Run
from tmsopt.program.nlp import NLP
from tmsopt.program.options import DEFAULTS, Options
from tmsopt.records import Array
from tmsopt.search.sample import Sample, Sampler

_THIN = 1e-9
"""Width of a part of the box below which it is not worth a search of its own."""


@dataclass(frozen=True)
class LocalEnd:
    """Where one start ended.

    Attributes:
        nlp: with the limits that held.
        objective: of the NLP; inf unless finite.
        feasible: whether rows and bounds hold as IPOPT left them, and located roots have Jordan chains.
        crossing: whether these chains alone are missing.
    """

    nlp: NLP
    run: Run
    objective: float
    feasible: bool
    crossing: bool = False


@dataclass(frozen=True)
class Workspace:
    """One problem, and everything that solving it asks for more than once.

    Attributes:
        part: the problem on the part of the box that designs are drawn from, e.g. one sign of one parameter.
        name: of the part, e.g. ``normal rake``; empty for the whole box.
        extra_starts: designs that may be close to the optimum, to be started from.
        without_sample: whether to do without a sample.
        met: where starts ended in any part of the box, each with the NLP that it was started in.
    """

    problem: Posed
    part: Posed
    options: Options
    name: str = ""
    extra_starts: tuple[Mapping[str, float], ...] = ()
    without_sample: bool = False
    met: list[tuple[NLP, LocalEnd]] = field(default_factory=list, compare=False)

    def chained(self, candidate: LocalEnd) -> LocalEnd:
        """The same, not feasible where roots that a pattern makes meet have no Jordan chain."""
        pattern = self.part.pattern
        if pattern is None or not candidate.feasible:
            return candidate
        crossing = is_crossing(self.part, pattern, self.part.ordered(self.design_at(candidate.run.x)))
        return replace(candidate, feasible=not crossing, crossing=crossing)

    @cached_property
    def freedom(self) -> Freedom:
        """Degrees of freedom of the problem."""
        return degrees_of_freedom(self.problem)

    @cached_property
    def sampler(self) -> Sampler | None:
        """Looks at designs of this part; None where arrays cannot tell what is asked of them."""
        told = self.part.pattern is None and not self.part.asks_radius and not self.without_sample
        return Sampler(self.part, self.options.seed) if told else None

    @cached_property
    def sample(self) -> Sample | None:
        """What was seen of this part before any solver."""
        return self.sampler.sample() if self.sampler else None

    @cached_property
    def _seen(self) -> Sample | None:
        """The sample, of a pattern that of the limits alone."""
        part = self.part
        limits_alone = part.pattern and part.conditions and not (part.asks_radius or self.without_sample)
        return Sampler(part.derive(locate=None), self.options.seed).sample() if limits_alone else self.sample

    @property
    def out_of_reach(self) -> bool:
        """Whether all designs of a sample are far from what the limits allow, be it without the pattern asked for."""
        return self._seen is not None and self._seen.refined.out_of_reach(self.part.model.degree)

    @property
    def needles(self) -> bool:
        """Whether limits about the roots may be met where the mass matrix is nearly singular, which few starts find."""
        about = self.part.asked_of_roots or self.part.pattern
        return bool(about) and self._seen is not None and self._seen.singular

    @cached_property
    def never_stable(self) -> bool:
        """Whether it is certain at once that no design of this part is stable."""
        return none_stable(self.part)

    def formulate(self, cases: Sequence[Case], damping_ratio: float | None = None, lead: int = 0) -> NLP:
        """The NLP of the problem on this part of the box."""
        return formulate(self.part, cases, damping_ratio=damping_ratio, lead=lead)

    def around(self, parameters: Mapping[str, float]) -> Robustness | None:
        """The boundaries nearest to a design, where the problem asks for the radius."""
        return robustness_at(self.problem, parameters) if self.problem.asks_radius else None

    def design_at(self, x: Array) -> dict[str, float]:
        """The free parameters at a point of an NLP, inside the part of the box."""
        return design_of(self.part, x.tolist())

    def recheck(self, parameters: Mapping[str, float], cases: Sequence[Case]) -> Evaluation:
        """What a design is in the given cases; see `checks.recheck`."""
        return recheck(self.problem, parameters, cases)

    def parts(self, near: Mapping[str, float] | None = None) -> "tuple[Workspace, ...]":
        """The parts into which a parameter with two sides divides the box, positive values first.

        Args:
            near: a design; only the parts that it is on.
        """
        of = self.problem.parameter_set
        for name, (lower, upper) in self.problem.free.items():
            names = of[name].sides
            if names is not None and lower < -_THIN and upper > _THIN:
                halves = [(names[1], (0.0, upper)), (names[0], (lower, 0.0))]
                if near and name in near:
                    halves = [half for half in halves if half[1][0] <= near[name] <= half[1][1]]
                return tuple(replace(self, part=_on(self.problem, name, ends), name=side) for side, ends in halves)
        return (self,)

    def holds(self, design: Mapping[str, float]) -> bool:
        """Whether a design, as far as it is given, is on this part."""
        return all(lower <= design.get(n, lower) <= upper for n, (lower, upper) in self.part.free.items())


def workspace(
    problem: Posed,
    options: Options = DEFAULTS,
    extra_starts: Sequence[Mapping[str, float]] = (),
    without_sample: bool = False,
) -> Workspace:
    """The workspace of a problem in its whole box."""
    return Workspace(problem, problem, options, extra_starts=tuple(extra_starts), without_sample=without_sample)


def _on(problem: Posed, name: str, ends: tuple[float, float]) -> Posed:
    """The problem with a smaller range of one parameter, and its start where that fits."""
    inside = all(ends[0] <= v <= ends[1] for n, v in problem.start.items() if n == name)
    return problem.derive(free={**problem.free, name: ends}, start=problem.start if inside else {})


def check_near(problem: Posed, near: Mapping[str, float]) -> None:
    """Refuse a design to start near that names no parameters, or has no numbers.

    Raises:
        InputError: with everything that is wrong.
    """
    names = problem.parameter_set.names
    faults = [Fault(f"unknown parameter '{n}'; {suggest(str(n), names)}", ("near",)) for n in near if n not in names]
    wrong = (n for n, value in near.items() if not is_number(value))
    faults += [Fault(f"found {short(near[n])}; accepted: a finite number", ("near", n)) for n in wrong]
    if faults:
        raise InputError(faults)
