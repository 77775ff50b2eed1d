"""A yes, a no, or neither."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Verdict:
    """Whether something certainly holds.

    Attributes:
        holds: None where the balls cannot tell, or nothing was asked.
        words: what holds, or why not.
    """

    holds: bool | None = None
    words: str = "not looked at"


NOTHING = Verdict()
"""Where no answer was looked for."""
