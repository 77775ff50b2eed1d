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
        >>> tmsopt.TUNING.unit("narrow_share"), tmsopt.TUNING.narrow_share
        ('share of the designs drawn', 0.02)

    More: docs/explanation/search.md
    """

    # The sample
    max_sample: int = number(3 * 2**12, "designs", "in a sample at most", "narrow")
    min_sample: int = number(2**11, "designs", "in a sample at least, even if each is slow to judge", "variety")
    base_sample: int = number(
        3 * 2**7, "designs", "for no parameter; times four for each of the first four parameters", "narrow"
    )
    higher_degree_cost: int = number(
        4, "times", "cost of a polynomial of higher degree, compared with a quartic", "random"
    )
    max_corner_parameters: int = number(
        10, "parameters", "at most for which all corners of the box are sampled", "solve"
    )
    face_copies: int = number(
        4, "designs", "per design that is moved to faces of the box, where many optima lie", "solve"
    )
    narrow_share: float = number(
        0.02, "share of the designs drawn", "that meet all limits, below which the search counts as narrow", "hard"
    )
    ranked_designs: int = number(1024, "designs", "best ones among which designs far apart are chosen", "hard")
    leaders: int = number(8, "designs", "best ones far apart, refined and started from", "solve")
    infeasible_leaders: int = number(
        8, "designs", "of best objective, started from even if they violate limits", "hard"
    )
    newton_designs: int = number(256, "designs", "that Newton's method moves towards the limits", "hard")
    cell_size: float = number(
        0.05, "of the box", "size of the cells of a grid; each cell holds one of these designs", "hard"
    )
    basin_distance: float = number(0.15, "of the box", "distance of designs that may lie in different basins", "solve")
    near_best_distance: float = number(0.01, "of the box", "distance of different designs near the best end", "hard")
    basins: int = number(64, "designs", "best ones in their neighbourhood, refined", "narrow")
    deepest_basins: int = number(24, "designs", "best of these, started from in addition to the leaders", "narrow")
    cells_per_design: int = number(2, "cells a design", "at most, of the grid that separates basins", "narrow")
    step_sizes: tuple[float, ...] = number(
        (0.1, 0.03, 0.008, 2e-3, 4e-4), "of the box", "step sizes of refinement, round after round", "solve"
    )
    neighbour_count: int = number(40, "designs", "judged around each refined one, in each round", "solve")
    basin_step_sizes: tuple[float, ...] = number(
        (0.6, 0.3, 0.15, 0.07, 0.03, 0.01), "of a cell", "step sizes of refinement in basins", "narrow"
    )
    basin_neighbour_count: int = number(24, "designs", "judged around each basin, in each round", "narrow")
    shell_distances: int = number(12, "distances", "from a design at which its neighbourhood is sampled", "hard")
    shell_designs: int = number(64, "designs", "at each of these distances", "hard")
    newton_steps: int = number(12, "steps", "of Newton's method towards violated limits", "hard")
    hopeless_newton_steps: int = number(
        4, "steps", "after which Newton's method stops if all designs stay far from the limits", "conflicts"
    )
    difference_step: float = number(1e-7, "of the box", "step of the difference quotients of limits", "hard")
    step_shares: tuple[float, ...] = number(
        (1.0, 0.5, 0.1, 0.01, 1e-3), "of a step", "tried; the best is taken", "hard"
    )
    limit_tolerance: float = number(
        1e-10, "of a limit's scale", "excess with which a limit still counts as met, for numeric roots", "hard"
    )
    far_excess: float = number(
        1e-3,
        "of scales, in sum",
        "excess of refined designs above which limits count as excluding each other",
        "conflicts",
    )
    unreachable_distance: float = number(
        2.1, "times the n-th root of a step", "distance of a sample from an n-fold root", "hard"
    )
    vanishing_share: float = number(1e-2, "of its usual size", "size of a leading coefficient that may reach 0", "hard")

    # One start
    restarts: int = number(4, "times", "that a start is repeated if IPOPT does not converge", "hard")
    max_variants: int = number(
        3, "variants", "of the program, with other active roots and sides of kinks, tried from one start", "variety"
    )
    variant_exchanges: int = number(4, "times", "that an end may switch to another variant", "variety")
    variant_tolerance: float = number(
        1e-5, "of a distance", "by which two variants that fit an end equally well may differ", "variety"
    )
    feasible_violation: float = number(1e-6, "of rows", "violation accepted before polishing and recheck", "solve")
    root_scatter: float = number(
        0.01, "of the size of roots", "error of roots; near a 4-fold root doubles are off by 4e-4", "solve"
    )
    max_residual: float = number(
        1e-11, "of the equations", "residual of an end; it moves an n-fold root by its n-th root", "random"
    )
    path_rise: float = number(
        1e-3, "of the fall of a path", "rise allowed on a falling path, for numeric roots", "narrow"
    )

    # One end
    same_objective: float = number(1e-7, "relative", "difference of objectives that count as one optimum", "solve")
    equal_ends: int = number(3, "ends", "of equal objective that are rechecked", "hard")
    stationary_gradient: float = number(
        1e-6, "of the gradient", "below which a point has converged, even if IPOPT reports a failure", "solve"
    )
    polished_violation: float = number(1e-8, "of rows", "violation accepted in a polished end", "hard")
    polished_gradient: float = number(
        1e-9, "of the gradient", "with which a polished end is accepted even if its violation is larger", "hard"
    )
    claim_tolerance: float = number(
        1e-6, "relative", "difference allowed between claimed and rechecked objective", "hard"
    )
    claim_weight: float = number(100.0, "times", "weight of this difference when ends are compared", "hard")
    rounding_violation: float = number(1e-3, "of limits", "largest violation that rounding may explain", "hard")
    min_box_width: float = number(1e-9, "rad", "width of a part of the box that is not searched separately", "solve")

    # The end of a search
    min_starts_if_narrow: int = number(8, "starts", "at least if few designs meet all limits", "hard")
    min_starts_without_sample: int = number(12, "starts", "at least without a sample", "hard")
    agreeing_starts: int = number(5, "starts", "at the best value after which a search without a sample ends", "hard")
    hopeless_starts: int = number(8, "starts", "that fail, after which the search ends", "conflicts")
    hopeless_far_starts: int = number(
        3, "starts", "that fail, after which it ends if no sampled design is near the limits", "conflicts"
    )
    repeated_blind_starts: int = number(
        4, "starts", "without a sample, after which no failed start is repeated", "sixfold"
    )
    zero_squares: float = number(1e-14, "of squares", "sum below which an over-determined pattern is met", "hard")

    # Rescues
    second_program_starts: int = number(8, "starts", "on another program if the first one had feasible ends", "variety")
    lead_starts: int = number(3, "designs", "with a root of full multiplicity, started from", "hard")
    starts_without_lead: int = number(4, "starts", "without such a design, after which no others are tried", "hard")
    chain_starts: int = number(16, "starts", "for an exceptional point if the nearest one is a crossing", "statements")
    appeals: int = number(8, "times", "of starting from better sampled designs", "sixfold")
    rival_starts: int = number(2, "designs", "better than the best end, started from each time", "hard")
    better_by: float = number(1e-7, "relative", "difference of the objective that makes a design better", "hard")
    small_step_optima: int = number(3, "optima", "with the best claims, near which designs are tried", "hard")
    small_steps: tuple[float, ...] = number(
        tuple(10.0 ** -(7 + k / 4) for k in range(33)),
        "of the way to another design",
        "by which an end is moved",
        "hard",
    )
    zero_root_size: float = number(
        1e-9, "of the largest root", "size of a root whose sign rounding may decide", "narrow"
    )
    small_step_targets: int = number(30, "designs", "random ones, towards which an end is moved", "hard")
    small_step_accuracy: float = number(
        1e-6, "relative", "accuracy of the objective of such a design, near a double root", "narrow"
    )
    same_design_distance: float = number(1e-3, "of the box", "distance within which an end is the same design", "hard")
    polished_difference: float = number(
        1e-11, "relative", "difference of the objective that separates polished designs", "hard"
    )
    polish_steps: tuple[float, ...] = number(
        tuple(10.0 ** -(4 + k / 3) for k in range(19)),
        "of the box",
        "step sizes that refine a sampled design kept as the answer",
        "hard",
    )
    rechecked_designs: int = number(8, "designs", "that are rechecked", "hard")
    singular_starts: int = number(4, "designs", "of each kind, from which a singular mass matrix is approached", "hard")
    zero_a0: float = number(1e-9, "of the other coefficients", "a0 that counts as 0", "hard")
    infimum_a0: float = number(1e-12, "of the other coefficients", "a0 of the design returned for an infimum", "hard")
    far_root_size: float = number(1e5, "times the middle root", "size of a root near infinity", "hard")
    infinite_root_size: float = number(1e7, "times the middle root", "size of a root that counts as infinite", "hard")
    unbounded_spreads: float = number(
        1e6, "spreads of the objective", "below which the objective counts as unbounded", "hard"
    )
    distinct_root_difference: float = number(
        2e-3, "relative", "difference of roots that is more than rounding, even at a 4-fold root", "hard"
    )

    # Cases, radius
    case_rounds: int = number(12, "times", "that cases are added; each squares the remaining excess", "variety")
    radius_rounds: int = number(40, "times", "that cases are added for the robustness radius", "variety")
    followed_optima: int = number(
        3, "optima", "kept when cases are added: the best one may be worse in a new case", "variety"
    )
    equal_design_distance: float = number(1e-6, "of the box", "distance of designs that count as one", "variety")
    max_climbs: int = number(6, "climbs", "for the radius at most", "variety")
    min_climbs: int = number(3, "climbs", "at least", "variety")
    climb_rounds: int = number(10, "times", "that boundary points are added to a climb", "variety")
    radius_estimates: int = number(512, "designs", "stable ones whose radius is estimated", "variety")
    max_boundary_distance: float = number(3.0, "radii", "beyond which a boundary point is left out", "variety")
    radius_accuracy: float = number(1e-9, "relative", "accuracy of the claimed radius", "variety")
    equal_point_distance: float = number(
        1e-3, "of a distance", "distance of boundary points that count as one", "variety"
    )

    def unit(self, name: str) -> str:
        """The unit of a number."""
        return str(next(f.metadata["unit"] for f in fields(self) if f.name == name))


TUNING = Tuning()
"""The default numbers, set by benchmarks."""
