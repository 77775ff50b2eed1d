"""Entries of the ledger, and the rules that give a verdict on a computed value."""

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
"""The only verdicts, best first."""

SHOWN = 40
"""Significant digits of a computed number."""

_OFF_UNITS = 50  # of the last printed digit, so only the last two digits differ
_OFF_RELATIVE = 1e-6  # largest relative difference


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
        counted = Counter(entry.verdict for entry in self.entries)
        return {verdict: counted[verdict] for verdict in VERDICTS}

    def records(self) -> Iterable[dict[str, Any]]:
        """The entries, one per row."""
        return map(plain, self.entries)

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {"schema": SCHEMA} | plain(self, "source counts entries")


# Verdict rules


def format_digits(value: Any) -> str:
    """A ball or a fraction to 40 significant digits."""
    return str(flint.arb(value).str(SHOWN, radius=False))


def judge_decimal(printed: str, value: Any, remark: str = "") -> Judgement:
    """Judge a printed decimal against a ball, or a fraction, that contains the true value.

    The number is exact if both are equal. The printed digits hold within half a unit of the last digit. The last digits
    are off within 50 units and a relative millionth. Otherwise the number does not hold.

    Raises:
        ArithmeticError: if the ball is too wide to decide.
    """
    claimed, ball = rational(printed), flint.arb(value)
    if isinstance(value, flint.fmpq) and value == claimed:
        return Judgement(EXACT, remark)
    distance = abs(ball - claimed) * 10 ** len(printed.partition(".")[2])
    half = flint.arb(0.5)
    if distance <= half:
        verdict = DIGITS_HOLD
    elif not distance > half:
        raise ArithmeticError(f"{printed} against {ball}: the ball is too wide to round")
    else:
        close = abs(ball - claimed) < abs(ball) * _OFF_RELATIVE
        verdict = DIGITS_OFF if distance < _OFF_UNITS and close else FAILS
    size = f"{float(distance.mid()):.{2 + (verdict == FAILS)}g}"
    words = f"The true value is {size} units of the last printed digit away."
    return Judgement(verdict, f"{words} {remark}".strip())


def judge_identity(holds: bool, remark: str = "", otherwise: str = "") -> Judgement:
    """Exact if the proof succeeds; otherwise it does not hold, for the given reason."""
    return Judgement(EXACT, remark) if holds else Judgement(FAILS, otherwise or "The proof does not run through.")


def judge_statement(condition: str, under: bool, against: str, counterexample: bool, remark: str = "") -> Judgement:
    """Judge a general statement: proved under a condition and refuted outside it, or refuted.

    Args:
        condition: the condition that must be added.
        under: whether the proof under the condition succeeds.
        against: the counterexample in words.
        counterexample: whether it refutes the statement as printed.

    Raises:
        ArithmeticError: if it does not.
    """
    if not counterexample:
        raise ArithmeticError(f"neither proved nor refuted: {condition}")
    needed = f"Condition: {condition}. " if under else ""
    return Judgement(CONDITIONAL if under else FAILS, f"{needed}Counterexample: {against}. {remark}".strip())
