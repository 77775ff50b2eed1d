"""How to solve: declared here once, and handed on as one from the verb that a user calls to IPOPT."""

import inspect
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Any, TypedDict, TypeVar

from tmsopt.errors import MOST_STARTS, Fault, InputError, call_faults, count_faults, is_number, short, suggest
from tmsopt.progress import Listener, Steps, steps_for

LINEAR_SOLVERS = ("mumps", "spral")
"""Inside IPOPT: those in the CasADi wheel; any other name fails there without an error."""

STARTS = 64
"""Starts tried at most; most problems settle with a dozen."""


class Asked(TypedDict, total=False):
    """What every verb that solves lets its user say by name; see `Options`."""

    starts: int
    seed: int
    linear_solver: str
    progress: Listener | None


class AskedOfSolve(Asked, total=False):
    """What `solve` lets its user say beside that."""

    exhaustive: bool
    near: Mapping[str, float] | None
    alone: bool
    stability: float
    interruptible: bool


@dataclass(frozen=True)
class Options:
    """How to solve.

    Attributes:
        starts: starts tried at most, of each side of the box and again by each rescue; the search ends early when few
            better optima are expected, or at a proof.
        seed: of the quasi-random starting designs.
        linear_solver: ``mumps`` or ``spral``.
        progress: called with a `tmsopt.Progress` now and then: what is being done, how far it is.
        exhaustive: try all the starts, even when several agree.
        near: a design that may be close to the optimum, tried first; where both signs of a parameter are searched,
            only its own is.
        alone: of an infeasible problem, also find how far each limit in conflict would have to give alone.
        stability: where a stable design was looked for and none was found, seconds for branch and bound to look for one
            or to prove that there is none; 0 to do without. `solve` gives it 5, where SCIP is installed.
        interruptible: whether Ctrl-C ends the search with the best design so far, as `solve` has it; else it goes on to
            whoever called, as it always does where no design is in hand yet.

    Example:
        >>> tmsopt.Options().starts, tmsopt.solve("problems/ep4.toml", starts=4, seed=1).structure
        (64, 'EP4')

    More: docs/reference/commands.md
    """

    starts: int = STARTS
    seed: int = 0
    linear_solver: str = "mumps"
    progress: Steps | None = None
    exhaustive: bool = False
    near: Mapping[str, float] | None = None
    alone: bool = True
    stability: float = 0.0
    interruptible: bool = False

    @property
    def of_ipopt(self) -> Hashable:
        """What IPOPT must know: where it is the same, a solver can be used again."""
        return self.linear_solver


DEFAULTS = Options()


Verb = TypeVar("Verb", bound=Callable[..., Any])


def documents_options(accepted: type, defaults: Options = DEFAULTS) -> Callable[[Verb], Verb]:
    """A decorator of verbs: `help` and notebooks list the options that one takes by name, each with its default."""

    def listed(verb: Verb) -> Verb:
        own = inspect.signature(verb)
        named = [p for p in own.parameters.values() if p.kind is not p.VAR_KEYWORD]
        options = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=getattr(defaults, name), annotation=kind)
            for name, kind in accepted.__annotations__.items()
        ]
        vars(verb)["__signature__"] = own.replace(parameters=[*named, *options])
        return verb

    return listed


def options_of(
    asked: Asked | AskedOfSolve, accepted: type = Asked, defaults: Options = DEFAULTS, fewest: int = 1
) -> Options:
    """Options that a user named, and the verb's own defaults for the others.

    Args:
        fewest: starts that make sense.

    Raises:
        TypeError: for a name that is not accepted.
        InputError: for a value that is not.
    """
    given: dict[str, Any] = {**vars(defaults), **asked}
    for name in asked:
        if name not in accepted.__annotations__:
            raise TypeError(f"unknown option '{name}'; {suggest(name, accepted.__annotations__)}")
    faults = [*count_faults("starts", given["starts"], fewest, MOST_STARTS), *count_faults("seed", given["seed"], 0)]
    if not isinstance(given["near"], Mapping | None):
        faults.append(Fault(f"found {short(given['near'])}; accepted: a mapping of parameters to values", ("near",)))
    if not (is_number(given["stability"]) and given["stability"] >= 0):
        faults.append(Fault(f"found {short(given['stability'])}; accepted: seconds, 0 or more", ("stability",)))
    if given["linear_solver"] not in LINEAR_SOLVERS:
        message = f"found {short(given['linear_solver'])}; accepted: {' '.join(LINEAR_SOLVERS)}"
        faults.append(Fault(message, ("linear_solver",)))
    if faults := [*faults, *call_faults("progress", given["progress"])]:
        raise InputError(faults)
    return Options(**given | {"progress": steps_for(given["progress"])})
