"""The loop of a search, `search`, and its stages as a `Policy`: sample, starts, local search, acceptance, rescues.

Each stage is a function of the `SearchState` and can be replaced: ``tmsopt.solve(problem, policy=replace(POLICY,
enough=mine))``.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from tmsopt.errors import Fault, InputError, input_error, short, suggest
from tmsopt.program import NLP
from tmsopt.program.formulate import default_start
from tmsopt.progress import begin
from tmsopt.search.acceptance import is_better
from tmsopt.search.sample import Sample
from tmsopt.search.state import LocalEnd, SearchState, Start
from tmsopt.search.tuning import TUNING, Tuning


@dataclass(frozen=True)
class Rescue:
    """A stage that runs after the loop, for problems on which the loop finds a wrong design or none.

    Attributes:
        name: the name to give to `Policy.without`.
        evidence: benchmark suites with the number of problems that get worse without this rescue.
        applies: state → whether the rescue runs.
        run: state and policy → the state after the rescue.

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
        sample: samples the part of the box before the first start; may return None.
        starts: yields designs to start from.
        local: solves the program of the state from one start.
        accept: adds the best end to the state, polished and rechecked.
        enough: tells whether to stop. The loop calls it after each start, with the ends on the same program. Rescues
            with few starts, and searches with added cases, do not call it but try all their starts.
        rescues: stages after the loop, in the order in which they run.
        tuning: the numbers that the stages use.

    Example:
        >>> from dataclasses import replace
        >>> short_policy = replace(tmsopt.POLICY, enough=lambda state: len(state.feasible) > 0)
        >>> tmsopt.solve("problems/ep4.toml", policy=short_policy).structure
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
        """A copy without one rescue.

        Raises:
            InputError: if no rescue has this name.
        """
        names = [rescue.name for rescue in self.rescues]
        if name not in names:
            raise input_error(f"no rescue is called {short(name)}; {suggest(name, names)}", "policy", "rescues")
        return replace(self, rescues=tuple(r for r in self.rescues if r.name != name))


def check_policy(policy: Any) -> None:
    """Check that an object can be used as a policy.

    Raises:
        InputError: with all faults.
    """
    if not isinstance(policy, Policy):
        raise input_error(f"found {short(policy)}; accepted: a tmsopt.Policy, such as tmsopt.POLICY", "policy")
    stages = {name: getattr(policy, name) for name in ("sample", "starts", "local", "accept", "enough")}
    invalid_stages = {name: stage for name, stage in stages.items() if not callable(stage)}
    if faults := [Fault(f"found {short(x)}; accepted: a function", ("policy", n)) for n, x in invalid_stages.items()]:
        raise InputError(faults)


def search(state: SearchState, policy: Policy) -> SearchState:
    """Search one part of the box; if the user stops the search, return its state so far."""
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


def try_starts(state: SearchState, starts: Iterable[Start], policy: Policy, max_starts: int = 0) -> SearchState:
    """Solve from these starts until the policy says that the ends are enough, or after `max_starts`."""
    max_starts = max_starts or state.options.starts
    full_starts = (replace(start, design={**default_start(state.part), **start.design}) for start in starts)
    try:
        new_starts = (s for s in full_starts if not any(s.row in end.led for end in state.ends))
        for start_count, start in enumerate(new_starts, start=1):
            state = replace(state, ends=(*state.ends, policy.local(state, start)))
            if state.options.progress:
                state.options.progress(start_count, max_starts, state.so_far)
            if start_count >= max_starts or (not state.options.exhaustive and policy.enough(state)):
                break
    except KeyboardInterrupt:
        state = replace(state, interrupted=True)
    return state


def run_nested(state: SearchState, starts: Iterable[Start], policy: Policy, max_starts: int = 0) -> SearchState:
    """Solve from these starts inside another search, and accept the best end.

    Raises:
        KeyboardInterrupt: if the user stops it, so that the outer search stops too.
    """
    state = try_starts(state, starts, policy, max_starts)
    if state.interrupted:
        raise KeyboardInterrupt
    return policy.accept(state)


def search_again(
    state: SearchState,
    policy: Policy,
    starts: Iterable[Start] | None = None,
    nlp: NLP | None = None,
    max_starts: int = 0,
) -> SearchState:
    """Solve from more starts, possibly on another program; add their ends and keep the better design."""
    new_state = state.with_program(nlp or state.nlp)
    starts = policy.starts(new_state) if starts is None else starts
    new_state = policy.accept(try_starts(new_state, starts, policy, max_starts))
    ends = (*state.ends, *new_state.ends)
    has_improved = new_state.best and (state.best is None or is_better(state.problem, new_state.best, state.best))
    if has_improved:
        state = replace(new_state, fallback=None)
    return replace(state, ends=ends, accepted=len(ends), interrupted=new_state.interrupted)


def disable_stopping(policy: Policy) -> Policy:
    """A copy of the policy that tries every start."""
    return replace(policy, enough=lambda state: False)
