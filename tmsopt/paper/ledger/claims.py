"""Computes the claims of `claims.toml`.

A claim about a printed decimal is one table in that file; it needs no other code:

    [[section.claim]]
    key = "Fr_EP4"
    place = "text before Fig. fig00"
    statement = "Fr_EP4 as a decimal"
    route = "p(s) = a0 (s − ω0)⁴ solved for Fr, χ_B, tan λ_s and ω0 by interval Newton, 80 digits"
    rule = "decimal"
    printed = "2.236317517"
    value = "ep4.Fr"

The head of the file explains the other rules and the keys of a table. If the expressions of `language` cannot express a
computation, add a function to `algebra`; expressions can then call it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from typing import Any

import flint

from tmsopt.algebra.identity import Quotient
from tmsopt.errors import InputError, callback_faults, input_error, list_faults
from tmsopt.paper.ledger.algebra import PRECISION
from tmsopt.paper.ledger.entry import (
    EXACT,
    Entry,
    Ledger,
    format_digits,
    judge_decimal,
    judge_identity,
    judge_statement,
)
from tmsopt.paper.ledger.language import TomlTable, are_true, compute, open_scope, read_tables
from tmsopt.progress import Listener, start_steps

_TEXTS = ("printed", "remark", "otherwise", "condition", "against")
"""Keys of a claim whose texts may contain values, as ``{name}``."""

SOURCE = "O. N. Kirillov, Localizing EP sets in dissipative systems and the self-stability of bicycles (2018)"


def verify(progress: Listener | None = None, only: Sequence[str] = ()) -> Ledger:
    """Compute the ledger, or only the entries whose keys match one of the given patterns.

    Args:
        progress: called from time to time with a `tmsopt.Progress`.
        only: keys, or patterns with * and ?.

    Raises:
        InputError: for a pattern that no key matches.

    Example:
        >>> [(entry.place, entry.verdict) for entry in tmsopt.verify(only=["chib1*"]).entries]
        [('Eq. chib1', 'exact'), ('text after Eq. chib1', 'exact')]

    More: docs/explanation/paper.md
    """
    if faults := [*list_faults("only", only, "['lscf-*']"), *callback_faults("progress", progress)]:
        raise InputError(faults)
    for pattern in map(str, only):
        if not select_claims([pattern]):
            raise input_error(f"found '{pattern}'; accepted: a key of the ledger, or a pattern", "--only")
    claims, steps = select_claims(only), start_steps(progress, "recomputing claims", "claim")
    entries = []
    for count, claim in enumerate(claims, 1):
        with flint.ctx.workdps(PRECISION):
            entries.append(compute_entry(claim))
        if steps:
            steps(count, len(claims))
    return Ledger(SOURCE, tuple(entries))


def select_claims(only: Sequence[str] = ()) -> tuple[TomlTable, ...]:
    """The claims whose keys match one of the patterns; all claims if there is no pattern."""
    return tuple(c for c in list_claims() if not only or any(fnmatchcase(c["key"], pattern) for pattern in only))


@cache
def list_claims() -> tuple[TomlTable, ...]:
    """Every claim, in the order of the paper, with the title of its section."""
    return tuple({"section": s["title"], **claim} for s in read_tables()["section"] for claim in s["claim"])


def compute_entry(claim: TomlTable) -> Entry:
    """Compute the entry of a claim.

    Raises:
        ArithmeticError: if a verdict other than exact has no remark, or the statements under ``noted`` are not proved.
    """
    scope = open_scope(claim, {})
    formatted_values = {name: _FormattedValue(value) for name, value in scope.items()}
    printed, remark, failure_reason, condition, counterexample = (
        claim.get(key, "").format_map(formatted_values) for key in _TEXTS
    )
    value = compute(claim.get("value", claim.get("computed", "''")), scope)
    computed = format_digits(value) if isinstance(value, flint.arb | flint.fmpq) else f"{_FormattedValue(value)}"
    is_proved = are_true(claim.get("holds", []), scope)
    match claim["rule"]:
        case "decimal":
            outcome = judge_decimal(printed, value, remark)
        case "identity":
            outcome = judge_identity(is_proved, remark, failure_reason)
        case _:
            is_refuted = are_true(claim["refutes"], scope)
            outcome = judge_statement(condition, bool(condition) and is_proved, counterexample, is_refuted, remark)
    if (outcome.verdict != EXACT and not outcome.remark) or not are_true(claim.get("noted", []), scope):
        raise ArithmeticError(f"{claim['key']}: '{outcome.verdict}' without an explanation that is proved")
    texts = {field: claim[field] for field in ("key", "section", "place", "statement", "route")}
    return Entry(**texts, printed=printed, computed=computed, **outcome._asdict())


@dataclass(frozen=True)
class _FormattedValue:
    """The value of an expression that is inserted into a text."""

    value: Any

    def __format__(self, form: str) -> str:
        """The text of the value: unchanged, with a number of digits, or in a format of Python for floats."""
        match self.value:
            case list(parts):
                return ", ".join(format(_FormattedValue(part), form) for part in parts)
            case Quotient(numerator=numerator):
                return str(numerator)
            case number if form.isdigit():
                return str(flint.arb(number).str(int(form), radius=False))
            case number if form:
                return format(float(flint.arb(number).mid()), form)
        return str(self.value)
