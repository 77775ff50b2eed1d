"""A ledger of every number and every verifiable statement of the source paper, recomputed by independent routes.

In: the paper's claims in `claims.toml`. Out: a `Ledger` with a verdict on each. Open `claims` first: it explains how to
add a claim.
"""

from collections.abc import Sequence
from fnmatch import fnmatchcase

import flint

from tmsopt.errors import InputError, call_faults, input_error, list_faults
from tmsopt.paper.ledger.algebra import PRECISION
from tmsopt.paper.ledger.claims import compute_entry, list_claims
from tmsopt.paper.ledger.entry import VERDICTS, Entry, Ledger, judge_decimal, judge_identity, judge_statement
from tmsopt.paper.ledger.language import Table, compute, list_definitions, read_tables
from tmsopt.progress import Listener, start_steps

__all__ = [
    "VERDICTS",
    "Entry",
    "Ledger",
    "compute",
    "compute_entry",
    "judge_decimal",
    "judge_identity",
    "judge_statement",
    "list_definitions",
    "read_tables",
    "select_claims",
    "verify",
]

SOURCE = "O. N. Kirillov, Localizing EP sets in dissipative systems and the self-stability of bicycles (2018)"


def select_claims(only: Sequence[str] = ()) -> tuple[Table, ...]:
    """The claims whose keys match one of the patterns; all without patterns."""
    return tuple(c for c in list_claims() if not only or any(fnmatchcase(c["key"], pattern) for pattern in only))


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
        if not select_claims([pattern]):
            raise input_error(f"found '{pattern}'; accepted: a key of the ledger, or a pattern", "--only")
    chosen, steps = select_claims(only), start_steps(progress, "recomputing claims", "claim")
    entries = []
    for done, claim in enumerate(chosen, 1):
        with flint.ctx.workdps(PRECISION):
            entries.append(compute_entry(claim))
        if steps:
            steps(done, len(chosen))
    return Ledger(SOURCE, tuple(entries))
