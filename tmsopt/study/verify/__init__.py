"""A ledger of every number and every verifiable statement of the source paper, recomputed by independent routes."""

from collections.abc import Callable, Sequence
from fnmatch import fnmatchcase

import flint

from tmsopt.study.verify import (
    abscissa,
    benchmark,
    critical,
    edges,
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
from tmsopt.study.verify.algebra import PRECISION
from tmsopt.study.verify.entry import VERDICTS, Claim, Entry, Ledger, entry_of

__all__ = ["CLAIMS", "VERDICTS", "Claim", "Entry", "Ledger", "matching", "verify"]

SOURCE = "O. N. Kirillov, Localizing EP sets in dissipative systems and the self-stability of bicycles (2018)"

_PARTS = (
    model, stability, abscissa, benchmark, critical, exceptional, sets, epset, edges, optimum, motion, precursor,
    experiment,
)  # fmt: skip

CLAIMS: tuple[Claim, ...] = tuple(claim for part in _PARTS for claim in part.CLAIMS)
"""Every claim, in the order of the paper."""


def matching(only: Sequence[str] = ()) -> tuple[Claim, ...]:
    """The claims whose keys match one of the patterns; all without patterns."""
    return tuple(c for c in CLAIMS if not only or any(fnmatchcase(c.key, pattern) for pattern in only))


def verify(progress: Callable[[int, int], None] | None = None, only: Sequence[str] = ()) -> Ledger:
    """Compute the ledger, or the entries whose keys match one of the given patterns."""
    chosen = matching(only)
    entries = []
    for done, claim in enumerate(chosen, 1):
        with flint.ctx.workdps(PRECISION):
            entries.append(entry_of(claim))
        if progress:
            progress(done, len(chosen))
    return Ledger(SOURCE, tuple(entries))
