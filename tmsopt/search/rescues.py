"""Rescues: what a search does beyond its loop, each by a name, so that a benchmark can do without it.

In: the name of a rescue. Out: whether the search at hand has it. `python -m benchmarks --without NAME` measures what
one of them is worth.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Rescue:
    """One way to save a search that its loop alone would lose.

    Attributes:
        name: to call it by.
        about: when it steps in, and what it does.
    """

    name: str
    about: str


RESCUES = (
    Rescue("sought", "few designs of the sample meet all limits: some are moved towards these by Newton's method"),
    Rescue("basins", "many meet them: the best design of each basin that the sample shows is refined too"),
    Rescue("multiple roots", "stable designs are rare, or a0 may vanish: starts at roots of full multiplicity"),
    Rescue("real roots", "abscissa and damping ratio at once: searched again where all roots are real"),
    Rescue("positive roots", "the best design may have a positive real root: searched again without a sector"),
    Rescue("other chains", "roots only cross at the nearest point: other starts for an exceptional point"),
    Rescue("off plateau", "the damping ratio is -1 everywhere: starts of least abscissa"),
    Rescue("restarts", "a start that ended badly is taken up again from where it ended"),
    Rescue("kept start", "a start that was better than its end is run again, keeping to it"),
    Rescue("ways", "root quantities and kinks are held in other ways from one start"),
    Rescue("exchanges", "an end at which another way is as close is left by that way"),
    Rescue("through a0", "a start of the sample ended nowhere: once more with a0 = 0 allowed"),
    Rescue("opposite faces", "without a sample: starts at the other end of each range of the best end"),
    Rescue("least abscissa", "no start met a pattern: starts where the abscissa is least"),
    Rescue("appeals", "a design of the sample is better than the best end: started from again"),
    Rescue("nudge", "an end meets all limits a hair's breadth aside"),
    Rescue("infinity", "designs improve towards a0 = 0: searched there too"),
    Rescue("off the edge", "a root at 0, where the damping ratio jumps: moved a hair"),
    Rescue("attained", "the next end, where the best owes its standing to a multiple root that is not there"),
    Rescue("kept design", "a design of the sample is better than all ends: given as it is"),
    Rescue("left of the axis", "no stable design was found though one is wanted: starts sought for stability alone"),
    Rescue("outdone", "an optimum that another end beats is none"),
    Rescue("unbounded", "an objective far below all else has no optimum"),
    Rescue("runaway", "a root all but at infinity: no optimum"),
    Rescue("ideal", "a design of the sample that no other can beat ends the search at once"),
    Rescue("branch and bound", "no stable design was found: SCIP looks for one"),
    Rescue("required speed", "no design was found: the least speed that one takes"),
    Rescue("steadied", "no remedy was answered: a relaxation after which a design is stable"),
    Rescue("irreducible", "which limits exclude each other"),
)
"""As they are; the order means nothing."""


@dataclass(frozen=True)
class Policy:
    """Which rescues a search has."""

    rescues: frozenset[str] = field(default_factory=lambda: frozenset(r.name for r in RESCUES))

    def has(self, name: str) -> bool:
        """Whether the search has this rescue."""
        return name in self.rescues

    def without(self, name: str) -> "Policy":
        """The same without one.

        Raises:
            KeyError: when there is none of this name.
        """
        if name not in {r.name for r in RESCUES}:
            raise KeyError(name)
        return Policy(self.rescues - {name})


POLICY = Policy()


def rescued_by(name: str) -> bool:
    """Whether searches have this rescue."""
    return POLICY.has(name)
