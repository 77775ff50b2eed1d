"""The verdict on stability, such as stable, marginally stable or growing, and its description in words."""

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any

from tmsopt.records import plain

STABLE, MARGINAL, GROWING, EDGE, UNSTABLE = (
    "stable",
    "marginally stable",
    "growing",
    "on the edge of stability",
    "not stable",
)
"""Verdicts. `EDGE` is for a root at infinity, which may lie on either side of the axis."""

CROSSING = "diabolic point (semisimple), not an EP"
"""Name of a multiple root with as many eigenvectors as its multiplicity."""

ROUNDED = ", up to rounding errors"
"""Added to a verdict that holds in doubles but was not confirmed in exact arithmetic."""

_ROUNDING_FACTOR = 2.0
"""The ideal abscissa counts as 0 if it is at most this factor times its difference from the abscissa as stored.

The difference shows the effect of rounding on multiple roots.
"""

_MAX_ROUNDING = 1e-6
"""The ideal abscissa does not count as 0 if it is above this share of the largest root."""

_SAME_REAL_PART = 1e-12
"""Real parts count as equal if they differ by less than this share of the largest root."""


@dataclass(frozen=True)
class MultipleRoot:
    """A multiple root, or a multiple eigenfrequency, with its eigenvectors.

    Attributes:
        re, im: the root as users read it.
        multiplicity: the algebraic multiplicity.
        geometric: number of independent eigenvectors; None for a system given by coefficients.
        longest: length of the longest Jordan chain; for coefficients, in the equation p(d/dt) y = 0.
    """

    re: float
    im: float
    multiplicity: int
    geometric: int | None
    longest: int

    @property
    def defective(self) -> bool | None:
        """Whether the root has fewer eigenvectors than its multiplicity; None if unknown."""
        return None if self.geometric is None else self.geometric < self.multiplicity

    @property
    def exceptional(self) -> bool:
        """Whether the root may be an exceptional point: it has one eigenvector, or their number is unknown."""
        return self.geometric in (1, None)


def power_of_t(longest: int) -> str:
    """The power of t that multiplies the exponential in the motion of a Jordan chain; empty for one vector."""
    return "" if longest < 2 else "t" if longest == 2 else f"t^{longest - 1}"


def longest_chain_on_line(meetings: Iterable[MultipleRoot], abscissa: float, largest: float) -> int | None:
    """Length of the longest Jordan chain on the rightmost line; None if no root on it is multiple."""
    return max((m.longest for m in meetings if m.re >= abscissa - _SAME_REAL_PART * largest), default=None)


@dataclass(frozen=True)
class StabilityVerdict:
    """The verdict on a solution.

    Attributes:
        verdict: one of the verdicts such as `STABLE`; empty if the abscissa does not exist.
        growth: the power of t, such as ``t^2``, if the verdict is `GROWING`; else empty.
    """

    verdict: str
    growth: str = ""

    @property
    def on_edge(self) -> bool:
        """Whether the rightmost roots are on the imaginary axis or at infinity."""
        return self.verdict in (MARGINAL, GROWING, EDGE)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return {"verdict": self.verdict or None, **({"growth": self.growth} if self.growth else {})}


def stability(
    abscissas: tuple[float, float], edges: Collection[str], meetings: Iterable[MultipleRoot] = (), largest: float = 0.0
) -> StabilityVerdict:
    """The verdict on a solution.

    Args:
        abscissas: of the ideal solution, and of its parameters as stored; they differ by the effect of rounding.
        edges: boundaries of stability that contain the solution, such as ``weave``.
        meetings: multiple roots of the solution.
        largest: size of the largest root.
    """
    ideal, stored = abscissas
    if not math.isfinite(ideal) or not math.isfinite(stored):
        return StabilityVerdict("")
    rounding = min(_ROUNDING_FACTOR * abs(ideal - stored), _MAX_ROUNDING * largest)
    if not edges and not min(abscissas) <= 0 <= max(abscissas) and abs(ideal) > rounding:
        return StabilityVerdict(STABLE if ideal < 0 else UNSTABLE)
    growth = power_of_t(longest_chain_on_line(meetings, ideal, largest) or 1)
    return StabilityVerdict(GROWING if growth else EDGE if "infinity" in edges else MARGINAL, growth)


def roots_to_json(solution: Any) -> dict[str, Any]:
    """JSON of the roots. The facts on multiple roots stand at the top level and in the entry of each multiple root.

    Args:
        solution: an object with `roots`, `eigenfrequencies`, `meetings` and `stability`.
    """
    growth_power: str = solution.stability.growth
    data: dict[str, Any] = {}
    largest_re = max((m.re for m in solution.meetings if m.longest > 1), default=math.nan)
    tolerance = _SAME_REAL_PART * max((r.size for r in solution.roots), default=0.0)  # a root of 1e-17 is shown as 0

    def chain_facts(m: MultipleRoot) -> dict[str, Any]:
        growth = {"growth": power_of_t(m.longest)} if growth_power and m.re == largest_re and m.longest > 1 else {}
        return {"defective": m.defective, "geometric_multiplicity": m.geometric, **growth}

    for name, entries in plain(solution, "roots eigenfrequencies").items():
        for entry, root in zip(entries, solution.roots, strict=True) if entries else ():
            for meeting in (m for m in solution.meetings if math.hypot(m.re - root.re, m.im - root.im) <= tolerance):
                entry.update(chain_facts(meeting))
        data |= {name: entries} if entries or name == "roots" else {}
    facts = {n: x for n, x in chain_facts(solution.meetings[0]).items() if n != "growth"} if solution.meetings else {}
    return facts | data


def describe_stability(
    verdict: StabilityVerdict, *, is_exact: bool, has_matrices: bool, is_complex: bool = False
) -> str:
    """A verdict for a headline.

    Args:
        is_exact: whether roots on the axis and their chains were confirmed in exact arithmetic.
        has_matrices: whether Jordan chains are known from matrices; coefficients give only p(d/dt) y = 0.
        is_complex: whether the system is a complex H, so that the roots are eigenfrequencies.
    """
    if not verdict.on_edge:
        complex_words = {STABLE: "decaying", UNSTABLE: "with gain"} if is_complex else {}
        return complex_words.get(verdict.verdict, verdict.verdict)
    root = "real eigenfrequency" if is_complex else "root on the imaginary axis"
    reason = f"from a defective {root}" if has_matrices else "as the solutions of p(d/dt) y = 0 do"
    words = f"growing as {verdict.growth}, {reason}" if verdict.growth else verdict.verdict
    return words if is_exact else f"{words}{ROUNDED}"


def describe_crossing(meeting: MultipleRoot) -> str:
    """The name of a multiple root with more than one eigenvector."""
    if meeting.defective:
        return f"{meeting.geometric} Jordan chains, not an EP{meeting.multiplicity}"
    return CROSSING
