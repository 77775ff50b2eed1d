"""The numbers of the search, each with its unit, its reason and the benchmark that set it.

Tolerances that reports need for any design are kept where they are used. The stopping rule is in
`tmsopt.problem.searches`.
"""

from dataclasses import dataclass, field, fields
from typing import Any


def number(value: Any, unit: str, reason: str, benchmark: str) -> Any:
    """A field of `Tuning`: its default value, unit and reason, and the benchmark that set it."""
    return field(default=value, metadata={"unit": unit, "reason": reason, "benchmark": benchmark})


@dataclass(frozen=True)
class Tuning:
    """Numbers of the search; ``tmsopt.TUNING`` holds the defaults.

    Example:
        >>> tmsopt.TUNING.unit("narrow"), tmsopt.TUNING.narrow
        ('share of the designs drawn', 0.02)

    More: docs/explanation/search.md
    """

    # The sample
    most: int = number(3 * 2**12, "designs", "in a sample at most", "narrow")
    least: int = number(2**11, "designs", "in a sample at least, even if each is slow to judge", "variety")
    first: int = number(
        3 * 2**7, "designs", "for no parameter; times four for each of the first four parameters", "narrow"
    )
    slower: int = number(4, "times", "cost of a polynomial of higher degree, compared with a quartic", "random")
    corners: int = number(10, "parameters", "at most for which all corners of the box are sampled", "solve")
    faces: int = number(4, "designs", "per design that is moved to faces of the box, where many optima lie", "solve")
    narrow: float = number(
        0.02, "share of the designs drawn", "that meet all limits, below which the search counts as narrow", "hard"
    )
    ranked: int = number(1024, "designs", "best ones among which designs far apart are chosen", "hard")
    leaders: int = number(8, "designs", "best ones far apart, refined and started from", "solve")
    bold: int = number(8, "designs", "of best objective, started from even if they violate limits", "hard")
    sought: int = number(256, "designs", "that Newton's method moves towards the limits", "hard")
    cell: float = number(
        0.05, "of the box", "size of the cells of a grid; each cell holds one of these designs", "hard"
    )
    apart: float = number(0.15, "of the box", "distance of designs that may lie in different basins", "solve")
    beside: float = number(0.01, "of the box", "distance of different designs near the best end", "hard")
    basins: int = number(64, "designs", "best ones in their neighbourhood, refined", "narrow")
    deepest: int = number(24, "designs", "best of these, started from in addition to the leaders", "narrow")
    cells: int = number(2, "cells a design", "at most, of the grid that separates basins", "narrow")
    reaches: tuple[float, ...] = number(
        (0.1, 0.03, 0.008, 2e-3, 4e-4), "of the box", "step sizes of refinement, round after round", "solve"
    )
    local: int = number(40, "designs", "judged around each refined one, in each round", "solve")
    basin_reaches: tuple[float, ...] = number(
        (0.6, 0.3, 0.15, 0.07, 0.03, 0.01), "of a cell", "step sizes of refinement in basins", "narrow"
    )
    basin_local: int = number(24, "designs", "judged around each basin, in each round", "narrow")
    shells: int = number(12, "distances", "from a design at which its neighbourhood is sampled", "hard")
    shell: int = number(64, "designs", "at each of these distances", "hard")
    newton_steps: int = number(12, "steps", "of Newton's method towards violated limits", "hard")
    hopeless_steps: int = number(
        4, "steps", "after which Newton's method stops if all designs stay far from the limits", "conflicts"
    )
    difference: float = number(1e-7, "of the box", "step of the difference quotients of limits", "hard")
    shares: tuple[float, ...] = number((1.0, 0.5, 0.1, 0.01, 1e-3), "of a step", "tried; the best is taken", "hard")
    met: float = number(
        1e-10, "of a limit's scale", "excess with which a limit still counts as met, for numeric roots", "hard"
    )
    far_off: float = number(
        1e-3,
        "of scales, in sum",
        "excess of refined designs above which limits count as excluding each other",
        "conflicts",
    )
    unreachable: float = number(
        2.1, "times the n-th root of a step", "distance of a sample from an n-fold root", "hard"
    )
    vanishing: float = number(1e-2, "of its usual size", "size of a leading coefficient that may reach 0", "hard")

    # One start
    restarts: int = number(4, "times", "that a start is repeated if IPOPT does not converge", "hard")
    ways: int = number(
        3, "variants", "of the program, with other active roots and sides of kinks, tried from one start", "variety"
    )
    exchanges: int = number(4, "times", "that an end may switch to another variant", "variety")
    meets: float = number(
        1e-5, "of a distance", "by which two variants that fit an end equally well may differ", "variety"
    )
    feasible: float = number(1e-6, "of rows", "violation accepted before polishing and recheck", "solve")
    scatter: float = number(
        0.01, "of the size of roots", "error of roots; near a 4-fold root doubles are off by 4e-4", "solve"
    )
    residual: float = number(
        1e-11, "of the equations", "residual of an end; it moves an n-fold root by its n-th root", "random"
    )
    level: float = number(1e-3, "of the fall of a path", "rise allowed on a falling path, for numeric roots", "narrow")

    # One end
    same: float = number(1e-7, "relative", "difference of objectives that count as one optimum", "solve")
    alike: int = number(3, "ends", "of equal objective that are rechecked", "hard")
    stationary: float = number(
        1e-6, "of the gradient", "below which a point has converged, even if IPOPT reports a failure", "solve"
    )
    exact: float = number(1e-8, "of rows", "violation accepted in a polished end", "hard")
    polished: float = number(
        1e-9, "of the gradient", "with which a polished end is accepted even if its violation is larger", "hard"
    )
    claimed: float = number(1e-6, "relative", "difference allowed between claimed and rechecked objective", "hard")
    doubt: float = number(100.0, "times", "weight of this difference when ends are compared", "hard")
    spurious: float = number(1e-3, "of limits", "largest violation that rounding may explain", "hard")
    thin: float = number(1e-9, "rad", "width of a part of the box that is not searched separately", "solve")

    # The end of a search
    fewest_narrow: int = number(8, "starts", "at least if few designs meet all limits", "hard")
    fewest_blind: int = number(12, "starts", "at least without a sample", "hard")
    agree: int = number(5, "starts", "at the best value after which a search without a sample ends", "hard")
    hopeless: int = number(8, "starts", "that fail, after which the search ends", "conflicts")
    hopeless_afar: int = number(
        3, "starts", "that fail, after which it ends if no sampled design is near the limits", "conflicts"
    )
    blind: int = number(4, "starts", "without a sample, after which no failed start is repeated", "sixfold")
    met_conditions: float = number(1e-14, "of squares", "sum below which an over-determined pattern is met", "hard")

    # Rescues
    fewer: int = number(8, "starts", "on another program if the first one had feasible ends", "variety")
    leads: int = number(3, "designs", "with a root of full multiplicity, started from", "hard")
    leadless: int = number(4, "starts", "without such a design, after which no others are tried", "hard")
    chains: int = number(16, "starts", "for an exceptional point if the nearest one is a crossing", "statements")
    appeals: int = number(8, "times", "of starting from better sampled designs", "sixfold")
    rivals_seen: int = number(2, "designs", "better than the best end, started from each time", "hard")
    lost: float = number(1e-7, "relative", "difference of the objective that makes a design better", "hard")
    asides: int = number(3, "optima", "with the best claims, near which designs are tried", "hard")
    hairs: tuple[float, ...] = number(
        tuple(10.0 ** -(7 + k / 4) for k in range(33)),
        "of the way to another design",
        "by which an end is moved",
        "hard",
    )
    zero_root: float = number(1e-9, "of the largest root", "size of a root whose sign rounding may decide", "narrow")
    towards: int = number(30, "designs", "random ones, towards which an end is moved", "hard")
    edge: float = number(1e-6, "relative", "accuracy of the objective of such a design, near a double root", "narrow")
    same_design: float = number(1e-3, "of the box", "distance within which an end is the same design", "hard")
    finer: float = number(1e-11, "relative", "difference of the objective that separates polished designs", "hard")
    finest: tuple[float, ...] = number(
        tuple(10.0 ** -(4 + k / 3) for k in range(19)),
        "of the box",
        "step sizes that refine a sampled design kept as the answer",
        "hard",
    )
    kept: int = number(8, "designs", "that are rechecked", "hard")
    open: int = number(4, "designs", "of each kind, from which a singular mass matrix is approached", "hard")
    singular: float = number(1e-9, "of the other coefficients", "a0 that counts as 0", "hard")
    inside: float = number(1e-12, "of the other coefficients", "a0 of the design returned for an infimum", "hard")
    far_root: float = number(1e5, "times the middle root", "size of a root near infinity", "hard")
    runaway: float = number(1e7, "times the middle root", "size of a root that counts as infinite", "hard")
    endless: float = number(1e6, "spreads of the objective", "below which the objective counts as unbounded", "hard")
    merged: float = number(
        2e-3, "relative", "difference of roots that is more than rounding, even at a 4-fold root", "hard"
    )

    # Cases, radius
    rounds: int = number(12, "times", "that cases are added; each squares the remaining excess", "variety")
    far_rounds: int = number(40, "times", "that cases are added for the robustness radius", "variety")
    followed: int = number(3, "optima", "kept when cases are added: the best one may be worse in a new case", "variety")
    alike_designs: float = number(1e-6, "of the box", "distance of designs that count as one", "variety")
    climbs: int = number(6, "climbs", "for the radius at most", "variety")
    fewest_climbs: int = number(3, "climbs", "at least", "variety")
    climb_rounds: int = number(10, "times", "that boundary points are added to a climb", "variety")
    estimated: int = number(512, "designs", "stable ones whose radius is estimated", "variety")
    beyond: float = number(3.0, "radii", "beyond which a boundary point is left out", "variety")
    exact_radius: float = number(1e-9, "relative", "accuracy of the claimed radius", "variety")
    alike_points: float = number(1e-3, "of a distance", "distance of boundary points that count as one", "variety")

    def unit(self, name: str) -> str:
        """The unit of a number."""
        return str(next(f.metadata["unit"] for f in fields(self) if f.name == name))


TUNING = Tuning()
"""The default numbers, set by benchmarks."""
