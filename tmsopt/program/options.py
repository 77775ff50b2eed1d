"""The options of a solution, declared once and passed from a command or a function to IPOPT."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypedDict, TypeVar

from tmsopt.errors import MOST_STARTS, Fault, InputError, callback_faults, count_faults, is_number, short, suggest
from tmsopt.progress import Listener, Steps, steps_for

LINEAR_SOLVERS = ("mumps", "spral")
"""Linear solvers of the IPOPT in the CasADi wheel, which ignores any other name without an error."""

STARTS = 64
"""Default maximum of starts; most problems need a dozen."""


class CommonOptions(TypedDict, total=False):
    """Options that every solving function takes by name; see `Options`."""

    starts: int
    seed: int
    linear_solver: str
    progress: Listener | None


class SolveOptions(CommonOptions, total=False):
    """Options that `solve` takes in addition."""

    exhaustive: bool
    near: Mapping[str, float] | None
    alone: bool
    stability: float
    interruptible: bool


@dataclass(frozen=True)
class Options:
    """How to solve.

    Attributes:
        starts: maximum number of starts, for each side of the box and again for each rescue; the search ends early
            when few better optima are expected, or at a proof.
        seed: seed of the quasi-random starting designs.
        linear_solver: ``mumps`` or ``spral``.
        progress: function called with a `tmsopt.Progress` now and then.
        exhaustive: try all starts, even if several agree.
        near: a design that may be close to the optimum, tried first; if both signs of a parameter could be searched,
            only the sign of this design is.
        alone: if the problem is infeasible, also find for each limit in conflict how far it must be relaxed if no other
            limit is relaxed.
        stability: if no stable design was found, seconds for branch and bound to find one or to prove that none
            exists; 0 skips it. `solve` allows 5 s if SCIP is installed.
        interruptible: whether Ctrl-C ends the search with the best design so far, as in `solve`; otherwise, or without
            a design yet, the interrupt reaches the caller.

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


DEFAULTS = Options()


Verb = TypeVar("Verb", bound=Callable[..., Any])


def documents_options(accepted: type, defaults: Options = DEFAULTS) -> Callable[[Verb], Verb]:
    """A decorator that adds options and their defaults to the signature of a function.

    Args:
        accepted: the class that lists the options.
    """

    def add_signature(verb: Verb) -> Verb:
        signature = inspect.signature(verb)
        parameters = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        options = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=getattr(defaults, name), annotation=kind)
            for name, kind in accepted.__annotations__.items()
        ]
        vars(verb)["__signature__"] = signature.replace(parameters=[*parameters, *options])
        return verb

    return add_signature


def make_options(
    options: CommonOptions | SolveOptions,
    accepted: type = CommonOptions,
    defaults: Options = DEFAULTS,
    min_starts: int = 1,
) -> Options:
    """The options that a user chose, with defaults for all others.

    Args:
        accepted: the class that lists the accepted options.
        min_starts: smallest meaningful number of starts.

    Raises:
        TypeError: for an unknown name.
        InputError: for a value out of range.
    """
    values: dict[str, Any] = {**vars(defaults), **options}
    for name in options:
        if name not in accepted.__annotations__:
            raise TypeError(f"unknown option '{name}'; {suggest(name, accepted.__annotations__)}")
    faults = [*count_faults("starts", values["starts"], min_starts, MOST_STARTS)]
    faults += count_faults("seed", values["seed"], 0)
    if not isinstance(values["near"], Mapping | None):
        faults.append(Fault(f"found {short(values['near'])}; accepted: a mapping of parameters to values", ("near",)))
    if not (is_number(values["stability"]) and values["stability"] >= 0):
        faults.append(Fault(f"found {short(values['stability'])}; accepted: seconds, 0 or more", ("stability",)))
    if values["linear_solver"] not in LINEAR_SOLVERS:
        message = f"found {short(values['linear_solver'])}; accepted: {' '.join(LINEAR_SOLVERS)}"
        faults.append(Fault(message, ("linear_solver",)))
    if faults := [*faults, *callback_faults("progress", values["progress"])]:
        raise InputError(faults)
    return Options(**values | {"progress": steps_for(values["progress"])})
