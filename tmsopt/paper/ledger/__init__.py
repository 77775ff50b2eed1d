"""A ledger of every number and every verifiable statement of the source paper, recomputed by independent routes.

In: nothing but the paper's own claims, a room per section. Out: a `Ledger` with a verdict on each. Open `entry` first.
"""

from collections.abc import Sequence
from fnmatch import fnmatchcase

import flint

from tmsopt.errors import Fault, InputError, call_faults, list_faults
from tmsopt.paper.ledger import (
    abscissa,
    benchmark,
    critical,
    epset,
    exceptional,
    experiment,
    model,
    motion,
    optimum,
    precursor,
    sets,
    stability,
)
from tmsopt.paper.ledger.algebra import PRECISION
from tmsopt.paper.ledger.entry import VERDICTS, Claim, Entry, Ledger, decimal, entry_of, proof, universal
from tmsopt.paper.ledger.stability import BACKWARD, WITNESS
from tmsopt.progress import Listener, counted

__all__ = [
    "BACKWARD", "CLAIMS", "VERDICTS", "WITNESS", "Claim", "Entry", "Ledger", "decimal", "matching", "proof",
    "universal", "verify",
]  # fmt: skip

SOURCE = "O. N. Kirillov, Localizing EP sets in dissipative systems and the self-stability of bicycles (2018)"

CLAIMS: tuple[Claim, ...] = (
    *model.CLAIMS, *stability.CLAIMS, *abscissa.CLAIMS, *benchmark.CLAIMS, *critical.CLAIMS, *exceptional.CLAIMS,
    *sets.CLAIMS, *epset.CLAIMS, *sets.EDGES, *optimum.CLAIMS, *motion.CLAIMS, *precursor.CLAIMS, *experiment.CLAIMS,
)  # fmt: skip
"""Every claim, in the order of the paper."""


def matching(only: Sequence[str] = ()) -> tuple[Claim, ...]:
    """The claims whose keys match one of the patterns; all without patterns."""
    return tuple(c for c in CLAIMS if not only or any(fnmatchcase(c.key, pattern) for pattern in only))


def verify(progress: Listener | None = None, only: Sequence[str] = ()) -> Ledger:
    """Compute the ledger, or the entries whose keys match one of the given patterns.

    Args:
        progress: called with a `tmsopt.Progress` now and then.
        only: keys, or patterns with * and ?.

    Raises:
        InputError: for a pattern that no key matches.

    Example:
        >>> [(entry.place, entry.verdict) for entry in tmsopt.verify(only=["chib1*"]).entries]
        [('Eq. chib1', 'exact'), ('text after Eq. chib1', 'exact')]

    More: docs/explanation/paper.md
    """
    if faults := [*list_faults("only", only, "['lscf-*']"), *call_faults("progress", progress)]:
        raise InputError(faults)
    for pattern in map(str, only):
        if not matching([pattern]):
            raise InputError([Fault(f"found '{pattern}'; accepted: a key of the ledger, or a pattern", ("--only",))])
    chosen, steps = matching(only), counted(progress, "recomputing claims", "claim")
    entries = []
    for done, claim in enumerate(chosen, 1):
        with flint.ctx.workdps(PRECISION):
            entries.append(entry_of(claim))
        if steps:
            steps(done, len(chosen))
    return Ledger(SOURCE, tuple(entries))
