"""What a ledger is made of, and the rules that turn what was computed into a verdict."""

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

_OFF_UNITS = 50  # of the last printed digit: only the last two digits differ
_OFF_RELATIVE = 1e-6  # and the number is the same for every practical purpose


class Judgement(NamedTuple):
    """What computing a claim gave, and what a reader must know besides."""

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
        """Number of entries per verdict, every verdict named."""
        counted = Counter(entry.verdict for entry in self.entries)
        return {verdict: counted[verdict] for verdict in VERDICTS}

    def records(self) -> Iterable[dict[str, Any]]:
        """The entries, one a row."""
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

    Exact if they are one number; the printed digits hold if the true value is within half a unit of the last;
    the last digits are off if it is within 50 units and a millionth; otherwise the number does not hold.

    Raises:
        ArithmeticError: if the ball is too wide to tell.
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
    """Exact where a proof runs through; otherwise it does not hold, for the reason given."""
    return Judgement(EXACT, remark) if holds else Judgement(FAILS, otherwise or "The proof does not run through.")


def judge_statement(condition: str, under: bool, against: str, counterexample: bool, remark: str = "") -> Judgement:
    """Judge a general statement: proved under a condition and refuted outside it, or refuted.

    Args:
        condition: what must be added.
        under: whether the proof under the condition runs through.
        against: the counterexample in words.
        counterexample: whether it refutes the statement as printed.

    Raises:
        ArithmeticError: where it does not.
    """
    if not counterexample:
        raise ArithmeticError(f"neither proved nor refuted: {condition}")
    needed = f"Condition: {condition}. " if under else ""
    return Judgement(CONDITIONAL if under else FAILS, f"{needed}Counterexample: {against}. {remark}".strip())
