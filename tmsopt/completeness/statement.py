"""What is proved about all designs of a box, as data."""

from dataclasses import dataclass
from typing import Any

from tmsopt.arithmetic.balls import Number
from tmsopt.records import Table, plain


@dataclass(frozen=True)
class Undecided:
    """A part of the box of which nothing is proved.

    Attributes:
        ranges: of each free parameter.
        reason: why not.
    """

    ranges: Table[tuple[float, float]]
    reason: str


@dataclass(frozen=True)
class Completeness:
    """Whether the designs of a box with a pattern are all known.

    Attributes:
        complete: whether it is proved that the box holds `designs` and no other.
        reason: why not, in words.
        designs: free parameters of each that is proved to exist and to be the only one near, angles in radians.
        limits: of each, the limit on which it lies as far as can be told, so that it may be just beyond; mostly empty.
        boxes: that interval branch and prune looked at.
        seconds: that it took.
        undecided: where it did not decide.
        stopped: whether Ctrl-C ended it.
    """

    complete: bool
    reason: str = ""
    designs: tuple[Table[Number], ...] = ()
    limits: tuple[str, ...] = ()
    boxes: int = 0
    seconds: float = 0.0
    undecided: tuple[Undecided, ...] = ()
    stopped: bool = False

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self) | {"seconds": round(self.seconds, 4)}
