from tmsopt.design.solution import Solution
from tmsopt.report.limits import relaxation_lines


def infeasible_lines(solution: Solution, full: bool) -> list[str]:
    return relaxation_lines(solution)
