"""The numbers by which a search is tuned: the unit of each, the reason for it, and the benchmark that set it.

Tolerances by which reports judge any design stand where they are used; how many better optima may be left to be
expected, beside the rule that needs it, in `tmsopt.problem.searches`.
"""

from dataclasses import dataclass, field, fields
from typing import Any


def number(value: Any, unit: str, reason: str, benchmark: str) -> Any:
    """A field of `Tuning`."""
    return field(default=value, metadata={"unit": unit, "reason": reason, "benchmark": benchmark})


@dataclass(frozen=True)
class Tuning:
    """Numbers of the search; ``tmsopt.TUNING`` has those that benchmarks set.

    Example:
        >>> tmsopt.TUNING.unit("narrow"), tmsopt.TUNING.narrow
        ('share of the designs drawn', 0.02)

    More: docs/explanation/search.md
    """

    # The sample
    most: int = number(3 * 2**12, "designs", "of a sample at most", "narrow")
    least: int = number(2**11, "designs", "of a sample at least, where each costs much", "variety")
    first: int = number(3 * 2**7, "designs", "for no parameter at all; four times as many for each of four", "narrow")
    slower: int = number(4, "times", "as long as a quartic a polynomial of higher degree takes", "random")
    corners: int = number(10, "parameters", "up to which all corners of the box are drawn", "solve")
    faces: int = number(4, "designs", "one of which is moved to faces of the box, where many optima lie", "solve")
    narrow: float = number(0.02, "share of the designs drawn", "that meet all limits, below which few do", "hard")
    ranked: int = number(1024, "designs", "first of an order among which those apart are chosen", "hard")
    leaders: int = number(8, "designs", "the best ones apart, that are refined and started from", "solve")
    bold: int = number(8, "designs", "to start from, whatever they violate", "hard")
    sought: int = number(256, "designs", "from which limits are approached", "hard")
    cell: float = number(0.05, "of the box", "cells with one of these each", "hard")
    apart: float = number(0.15, "of the box", "distance of designs that may lie in different basins", "solve")
    beside: float = number(0.01, "of the box", "distance of designs about one that count as different", "hard")
    basins: int = number(64, "designs", "the best ones of their neighbourhoods, that are refined", "narrow")
    deepest: int = number(24, "designs", "of these basins, started from beside the leaders", "narrow")
    cells: int = number(2, "cells a design", "of the grid in which basins are told apart, at most", "narrow")
    reaches: tuple[float, ...] = number(
        (0.1, 0.03, 0.008, 2e-3, 4e-4), "of the box", "steps by which designs are refined, round after round", "solve"
    )
    local: int = number(40, "designs", "looked at about each that is refined, in each round", "solve")
    basin_reaches: tuple[float, ...] = number(
        (0.6, 0.3, 0.15, 0.07, 0.03, 0.01), "of a cell", "steps by which basins are refined", "narrow"
    )
    basin_local: int = number(24, "designs", "looked at about each basin, in each round", "narrow")
    shells: int = number(12, "distances", "about a design at which others are looked at", "hard")
    shell: int = number(64, "designs", "at each of them", "hard")
    newton_steps: int = number(12, "steps", "towards what violated limits allow", "hard")
    hopeless_steps: int = number(4, "steps", "after which this ends where all designs stay far away", "conflicts")
    difference: float = number(1e-7, "of the box", "for slopes of limits by differences", "hard")
    shares: tuple[float, ...] = number((1.0, 0.5, 0.1, 0.01, 1e-3), "of a step", "the best is taken", "hard")
    met: float = number(1e-10, "of a limit's scale", "excess up to which numeric roots count as meeting it", "hard")
    far_off: float = number(
        1e-3, "of scales, in sum", "excess of refined designs where limits exclude others", "conflicts"
    )
    unreachable: float = number(2.1, "times the n-th root of a step", "by which a sample misses an n-fold root", "hard")
    vanishing: float = number(1e-2, "of its usual size", "a leading coefficient that may come to 0", "hard")

    # One start
    restarts: int = number(4, "times", "that a start is taken up again where IPOPT did not converge", "hard")
    ways: int = number(3, "ways", "in which root quantities and kinks are held from one start", "variety")
    exchanges: int = number(4, "times", "that an end may turn out to be one of another way", "variety")
    meets: float = number(1e-5, "of a distance", "difference at which two ways meet", "variety")
    feasible: float = number(1e-6, "of rows", "violation before polishing; the recheck has the last word", "solve")
    scatter: float = number(
        0.01, "of the size of roots", "off those next to a 4-fold one are by 4e-4 in doubles", "solve"
    )
    residual: float = number(1e-11, "of the equations", "an n-fold root is off by its n-th root", "random")
    level: float = number(1e-3, "of the height of a way", "what may be worse on it for numeric roots", "narrow")

    # One end
    same: float = number(1e-7, "relative", "difference of objectives of one optimum", "solve")
    alike: int = number(3, "ends", "of one objective that are looked at closely", "hard")
    stationary: float = number(1e-6, "of the gradient", "at which a point has converged whatever IPOPT says", "solve")
    exact: float = number(1e-8, "of rows", "violation of a polished end", "hard")
    polished: float = number(1e-9, "of the gradient", "instead of that violation", "hard")
    claimed: float = number(1e-6, "relative", "difference of the claimed objective from the design's own", "hard")
    doubt: float = number(100.0, "times", "that difference is weighed: rounding parts roots alike in both", "hard")
    spurious: float = number(1e-3, "of limits", "violation that no lack of digits explains", "hard")
    thin: float = number(1e-9, "rad", "width of a part of the box that is worth no search of its own", "solve")

    # Enough
    fewest_narrow: int = number(8, "starts", "at least where few designs meet all limits", "hard")
    fewest_blind: int = number(12, "starts", "at least without a sample", "hard")
    agree: int = number(5, "starts", "at the best value that end a search without a sample", "hard")
    hopeless: int = number(8, "starts", "that end nowhere, after which no more are tried", "conflicts")
    hopeless_afar: int = number(
        3, "starts", "the same where no design of the sample comes near the limits", "conflicts"
    )
    blind: int = number(4, "starts", "that ended nowhere, after which none is taken up again", "sixfold")
    met_conditions: float = number(1e-14, "of squares", "sum at which more conditions than parameters hold", "hard")

    # Rescues
    fewer: int = number(8, "starts", "on another program where the first one has led somewhere", "variety")
    leads: int = number(3, "designs", "with roots of full multiplicity that are started from", "hard")
    leadless: int = number(4, "starts", "that led to none, after which no more are tried", "hard")
    chains: int = number(16, "starts", "for an exceptional point where the nearest one is a crossing", "statements")
    appeals: int = number(8, "times", "that better designs are started from", "sixfold")
    rivals_seen: int = number(2, "designs", "better than the best end, towards which others lie", "hard")
    lost: float = number(1e-7, "relative", "difference of the objective that makes a design better", "hard")
    asides: int = number(3, "optima", "the best that ends claim, beside which designs are looked for", "hard")
    hairs: tuple[float, ...] = number(
        tuple(10.0 ** -(7 + k / 4) for k in range(33)),
        "of the way to another design",
        "by which an end is moved",
        "hard",
    )
    zero_root: float = number(1e-9, "of the largest root", "size of one that rounding may put on either side", "narrow")
    towards: int = number(30, "designs", "random ones, in whose direction it is", "hard")
    edge: float = number(1e-6, "relative", "what numeric roots next to a double one tell of such a design", "narrow")
    same_design: float = number(1e-3, "of the box", "distance at which an end is the same design", "hard")
    finer: float = number(1e-11, "relative", "difference of the objective between polished designs", "hard")
    finest: tuple[float, ...] = number(
        tuple(10.0 ** -(4 + k / 3) for k in range(19)),
        "of the box",
        "steps that improve a design kept as it is",
        "hard",
    )
    kept: int = number(8, "designs", "that are checked closely", "hard")
    open: int = number(4, "designs", "from which a singular mass matrix is approached, of each kind", "hard")
    singular: float = number(1e-9, "of the other coefficients", "a0 that is 0 in all but name", "hard")
    inside: float = number(1e-12, "of the other coefficients", "a0 of the design that is given for an infimum", "hard")
    far_root: float = number(1e5, "times the middle root", "size of a root near infinity", "hard")
    runaway: float = number(1e7, "times the middle root", "size of a root at infinity in all but name", "hard")
    endless: float = number(1e6, "spreads of the objective", "beyond which it has no lower bound", "hard")
    merged: float = number(2e-3, "relative", "more than roots next to a 4-fold one are off in doubles", "hard")

    # Cases, radius
    rounds: int = number(12, "times", "that cases are added; each shrinks the worst one to its square", "variety")
    far_rounds: int = number(40, "times", "the same for the robustness radius", "variety")
    followed: int = number(
        3, "optima", "when cases are added: a better one may do worse between the old ones", "variety"
    )
    alike_designs: float = number(1e-6, "of the box", "distance of designs that are one", "variety")
    nearer: float = number(1e-7, "of the radius", "by which a nearer boundary counts", "variety")
    climbs: int = number(6, "climbs", "for the radius at most", "variety")
    fewest_climbs: int = number(3, "climbs", "at least", "variety")
    climb_rounds: int = number(10, "times", "that boundary points are added to a climb", "variety")
    estimated: int = number(512, "designs", "stable ones whose radius is estimated", "variety")
    beyond: float = number(3.0, "radii", "at which a boundary point is left out", "variety")
    exact_radius: float = number(1e-9, "relative", "how well the claim is the radius", "variety")
    alike_points: float = number(1e-3, "of a distance", "boundary points that are one", "variety")

    def unit(self, name: str) -> str:
        """The unit of a number."""
        return str(next(f.metadata["unit"] for f in fields(self) if f.name == name))


TUNING = Tuning()
"""The numbers that benchmarks set."""
