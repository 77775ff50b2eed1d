"""Entries of the ledger, and the rules for the verdict on a computed value."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import flint

from tmsopt.algebra.balls import rational
from tmsopt.records import Tabular, plain
from tmsopt.versions import SCHEMA

EXACT = "exact"
DIGITS_HOLD = "holds to the printed digits"
DIGITS_OFF = "last digits off"
CONDITIONAL = "holds only under a stated condition"
FAILS = "does not hold"
VERDICTS = (EXACT, DIGITS_HOLD, DIGITS_OFF, CONDITIONAL, FAILS)
"""All verdicts, from the best to the worst."""

_SHOWN_DIGITS = 40
"""Significant digits of a computed number."""

_MAX_UNITS_OFF = 50  # largest difference for `DIGITS_OFF` in units of the last printed digit, so only two digits differ
_MAX_RELATIVE_OFF = 1e-6  # largest relative difference for `DIGITS_OFF`


class Judgement(NamedTuple):
    """The verdict on a claim, and a remark for the reader."""

    verdict: str
    remark: str = ""


@dataclass(frozen=True)
class Entry:
    """One line of the ledger."""

    key: str
    section: str
    place: str
    statement: str
    printed: str
    computed: str
    route: str
    verdict: str
    remark: str


@dataclass(frozen=True, repr=False)
class Ledger(Tabular):
    """Every entry, in the order of the paper.

    Example:
        >>> ledger = tmsopt.verify(only=["chib1*"])
        >>> ledger.counts["does not hold"]
        0

    More: docs/explanation/paper.md
    """

    source: str
    entries: tuple[Entry, ...]

    @property
    def counts(self) -> dict[str, int]:
        """Verdict → number of entries, for all verdicts."""
        counts = Counter(entry.verdict for entry in self.entries)
        return {verdict: counts[verdict] for verdict in VERDICTS}

    def records(self) -> Iterable[dict[str, Any]]:
        """One record for each entry."""
        return map(plain, self.entries)

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {"schema": SCHEMA} | plain(self, "source counts entries")


# Verdict rules


def format_digits(value: Any) -> str:
    """A ball or a fraction with 40 significant digits."""
    return str(flint.arb(value).str(_SHOWN_DIGITS, radius=False))


def judge_decimal(printed: str, value: Any, remark: str = "") -> Judgement:
    """Judge a printed decimal by its distance from the true value, which is a fraction or lies in a ball.

    The number is exact if it equals a fraction. Its digits hold up to a distance of half a unit of the last digit. The
    last digits are off up to 50 units, if the relative difference is below 10⁻⁶. Otherwise the number does not hold.

    Raises:
        ArithmeticError: if the ball is too wide to decide.
    """
    printed_number, ball = rational(printed), flint.arb(value)
    if isinstance(value, flint.fmpq) and value == printed_number:
        return Judgement(EXACT, remark)
    distance = abs(ball - printed_number) * 10 ** len(printed.partition(".")[2])
    half = flint.arb(0.5)
    if distance <= half:
        verdict = DIGITS_HOLD
    elif not distance > half:
        raise ArithmeticError(f"{printed} against {ball}: the ball is too wide to round")
    else:
        is_close = abs(ball - printed_number) < abs(ball) * _MAX_RELATIVE_OFF
        verdict = DIGITS_OFF if distance < _MAX_UNITS_OFF and is_close else FAILS
    size = f"{float(distance.mid()):.{2 + (verdict == FAILS)}g}"
    words = f"The true value is {size} units of the last printed digit away."
    return Judgement(verdict, f"{words} {remark}".strip())


def judge_identity(is_proved: bool, remark: str = "", reason: str = "") -> Judgement:
    """Judge an identity: it is exact if the proof succeeds; otherwise it does not hold, for the given reason."""
    return Judgement(EXACT, remark) if is_proved else Judgement(FAILS, reason or "The proof does not run through.")


def judge_statement(
    condition: str, is_proved: bool, counterexample: str, is_refuted: bool, remark: str = ""
) -> Judgement:
    """Judge a general statement that a counterexample refutes; it may be proved under a condition.

    Args:
        condition: the condition that must be added.
        is_proved: whether the proof under the condition succeeds.
        counterexample: the counterexample in words.
        is_refuted: whether the counterexample refutes the statement as printed.

    Raises:
        ArithmeticError: if the counterexample does not refute the statement.
    """
    if not is_refuted:
        raise ArithmeticError(f"neither proved nor refuted: {condition}")
    condition_text = f"Condition: {condition}. " if is_proved else ""
    return Judgement(
        CONDITIONAL if is_proved else FAILS, f"{condition_text}Counterexample: {counterexample}. {remark}".strip()
    )
