"""The search as a policy: sample, starts, local, accept, enough, and rescues; `search` is the driver.

In: a `SearchState` at its beginning. Out: the state at its end. Each stage is a function of the state and can be
replaced: ``tmsopt.solve(problem, policy=replace(POLICY, enough=mine))``.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from tmsopt.errors import Fault, InputError, refusal, short, suggest
from tmsopt.program.formulate import default_start
from tmsopt.program.nlp import NLP
from tmsopt.progress import begin
from tmsopt.search.accept import is_better
from tmsopt.search.sample import Sample
from tmsopt.search.starts import is_led
from tmsopt.search.state import LocalEnd, SearchState, Start
from tmsopt.search.tuning import TUNING, Tuning


@dataclass(frozen=True)
class Rescue:
    """What a search does where its loop alone would end wrongly or with nothing.

    Attributes:
        name: to call it by, as in `Policy.without`.
        evidence: suites whose verdicts get worse without it, with the number of problems.
        applies: whether it steps in.
        run: the search taken up again; gets the policy to run starts with.

    Example:
        >>> [rescue.name for rescue in tmsopt.POLICY.rescues][-1]
        'kept design'

    More: docs/explanation/search.md
    """

    name: str
    evidence: str
    applies: Callable[[SearchState], bool]
    run: Callable[[SearchState, "Policy"], SearchState]


@dataclass(frozen=True)
class Policy:
    """How a part of the box is searched.

    Attributes:
        sample: what is seen of the part before any solver.
        starts: designs to start from, one after the other.
        local: where one start ends: IPOPT on the program of the state.
        accept: the state with the best of its ends, polished and rechecked.
        enough: whether more starts would be waste; asked after each start, of the ends on the same program. Rescues
            that have few starts, and cases that are added, try them all.
        rescues: in the order in which they are asked.
        tuning: the numbers that all these depend on.

    Example:
        >>> from dataclasses import replace
        >>> hasty = replace(tmsopt.POLICY, enough=lambda state: len(state.feasible) > 0)
        >>> tmsopt.solve("problems/ep4.toml", policy=hasty).structure
        'EP4'

    More: docs/explanation/search.md
    """

    sample: Callable[[SearchState], Sample | None]
    starts: Callable[[SearchState], Iterator[Start]]
    local: Callable[[SearchState, Start], LocalEnd]
    accept: Callable[[SearchState], SearchState]
    enough: Callable[[SearchState], bool]
    rescues: tuple[Rescue, ...] = ()
    tuning: Tuning = TUNING

    def without(self, name: str) -> "Policy":
        """The same without one rescue.

        Raises:
            InputError: when there is none of this name.
        """
        names = [rescue.name for rescue in self.rescues]
        if name not in names:
            raise refusal(f"no rescue is called {short(name)}; {suggest(name, names)}", "policy", "rescues")
        return replace(self, rescues=tuple(r for r in self.rescues if r.name != name))


def check_policy(policy: Any) -> None:
    """Refuse what cannot be a policy.

    Raises:
        InputError: with everything that is wrong.
    """
    if not isinstance(policy, Policy):
        raise refusal(f"found {short(policy)}; accepted: a tmsopt.Policy, such as tmsopt.POLICY", "policy")
    stages = {name: getattr(policy, name) for name in ("sample", "starts", "local", "accept", "enough")}
    wrong = {name: stage for name, stage in stages.items() if not callable(stage)}
    if wrong:
        raise InputError(
            [Fault(f"found {short(stage)}; accepted: a function", ("policy", n)) for n, stage in wrong.items()]
        )


def search(state: SearchState, policy: Policy) -> SearchState:
    """Search one part of the box; where the user ends that, the state has what was found so far."""
    try:
        begin(state.options.progress, "looking at designs")
        state = replace(state, tuning=policy.tuning)
        state = replace(state, sample=state.sample or policy.sample(state))
        begin(state.options.progress, "searching", "start")
        state = policy.accept(try_starts(state, policy.starts(state), policy))
        for rescue in policy.rescues:
            if not state.interrupted and rescue.applies(state):
                state = rescue.run(state, policy)
    except KeyboardInterrupt:
        state = replace(state, interrupted=True)
    return state


def try_starts(state: SearchState, starts: Iterable[Start], policy: Policy, most: int = 0) -> SearchState:
    """The state after these starts, as far as they are needed."""
    most = most or state.options.starts
    whole = (replace(start, design={**default_start(state.part), **start.design}) for start in starts)
    try:
        for tried, start in enumerate((s for s in whole if not is_led(state, s)), start=1):
            state = replace(state, ends=(*state.ends, policy.local(state, start)))
            if state.options.progress:
                state.options.progress(tried, most, state.so_far)
            if tried >= most or (not state.options.exhaustive and policy.enough(state)):
                break
    except KeyboardInterrupt:
        state = replace(state, interrupted=True)
    return state


def search_again(
    state: SearchState, policy: Policy, starts: Iterable[Start] | None = None, nlp: NLP | None = None, most: int = 0
) -> SearchState:
    """The search with more starts, perhaps on another program: their ends are added, and the better design is kept."""
    own = state.with_program(nlp or state.nlp)
    own = policy.accept(try_starts(own, policy.starts(own) if starts is None else starts, policy, most))
    ends = (*state.ends, *own.ends)
    better = own.best and (state.best is None or is_better(state.problem, own.best, state.best))
    if better:
        state = replace(own, fallback=None)
    return replace(state, ends=ends, accepted=len(ends), interrupted=own.interrupted)


def try_all(policy: Policy) -> Policy:
    """The same policy where every start given is tried."""
    return replace(policy, enough=lambda state: False)
