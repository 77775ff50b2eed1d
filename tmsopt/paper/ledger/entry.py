"""What a ledger is made of, and the rules that turn what was computed into a verdict."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import flint

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


@dataclass(frozen=True)
class Judgement:
    """What computing a claim gave."""

    verdict: str
    printed: str = ""
    computed: str = ""
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
    ball = value if isinstance(value, flint.arb) else flint.arb(value)
    text: str = ball.str(SHOWN, radius=False)
    return text


def judge_decimal(printed: str, value: Any, remark: str = "") -> Judgement:
    """Judge a printed decimal against a ball, or a fraction, that contains the true value.

    Exact if they are one number; the printed digits hold if the true value is within half a unit of the last;
    the last digits are off if it is within 50 units and a millionth; otherwise the number does not hold.

    Raises:
        ArithmeticError: if the ball is too wide to tell.
    """
    fraction = Fraction(printed)
    claimed = flint.fmpq(fraction.numerator, fraction.denominator)
    shown = format_digits(value)
    if isinstance(value, flint.fmpq) and value == claimed:
        return Judgement(EXACT, printed, shown, remark)
    unit = flint.fmpq(1, 10 ** len(printed.partition(".")[2]))
    ball = flint.arb(value) if isinstance(value, flint.fmpq) else value
    distance = abs(ball - claimed) / unit
    half, few = flint.arb(0.5), flint.arb(_OFF_UNITS)
    if distance <= half:
        verdict = DIGITS_HOLD
    elif not distance > half:
        raise ArithmeticError(f"{printed} against {ball}: the ball is too wide to round")
    else:
        close = abs(ball - claimed) < abs(ball) * _OFF_RELATIVE
        verdict = DIGITS_OFF if distance < few and close else FAILS
    size = f"{float(distance.mid()):.2g}" if verdict != FAILS else f"{float(distance.mid()):.3g}"
    words = f"The true value is {size} units of the last printed digit away."
    return Judgement(verdict, printed, shown, f"{words} {remark}".strip())


def judge_identity(
    holds: bool, remark: str = "", otherwise: str = "", printed: str = "", computed: str = ""
) -> Judgement:
    """Exact where a proof runs through; otherwise it does not hold, for the reason given."""
    if holds:
        return Judgement(EXACT, printed, computed, remark)
    return Judgement(FAILS, printed, computed, otherwise or "The proof does not run through.")


def judge_statement(
    condition: str,
    under: bool,
    against: str,
    counterexample: bool,
    printed: str = "",
    computed: str = "",
    remark: str = "",
) -> Judgement:
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
    parts = [f"Condition: {condition}."] if under else []
    parts += [f"Counterexample: {against}.", remark]
    return Judgement(CONDITIONAL if under else FAILS, printed, computed, " ".join(p for p in parts if p))
