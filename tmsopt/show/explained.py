"""What an optimum means, as lines for a reader."""

from collections.abc import Mapping, Sequence

from tmsopt.explanation.explain import Explanation
from tmsopt.explanation.optimality import NOT_COVERED, OnLine, Optimality
from tmsopt.explanation.rounding import ALONE, Rounded
from tmsopt.show.text import columns, number


def explained_lines(explanation: Explanation) -> list[str]:
    """Summary, local optimality, levers, rounding, precision and warnings."""
    lines = [f"meaning: {explanation.summary}", *optimality_lines(explanation.optimality)]
    lines += [f"warning: {text}" for text in explanation.warnings]
    if explanation.levers:
        lines += ["", "what moving a limit buys, solved again:"]
        lines += [f"  {lever.sentence}" for lever in explanation.levers]
    if explanation.precision:
        lines.append("")
        lines += columns(_rows(explanation))
    if explanation.worst:
        lines.append(f"rounding {explanation.worst} alone to {ALONE} digits costs most")
    return [line.rstrip() for line in lines]


def optimality_lines(optimality: Optimality) -> list[str]:
    """The verdict, then the multipliers of each root on the rightmost line."""
    if optimality.verdict == NOT_COVERED:
        return [f"local optimality: not judged, for {optimality.reason}"]
    lines = [f"local optimality: {optimality.reason}", *map(_root_line, optimality.roots)]
    if optimality.roots:
        lines[-1] += f"; stationary within {optimality.residual:.1g}"
    return lines


def _root_line(root: OnLine) -> str:
    place = f"{root.re:.5g}" + (f" ± {root.im:.5g}i" if root.im else "")
    times = f" ({root.multiplicity}-fold)" if root.multiplicity > 1 else ""
    share = f" bears {100 * root.share:.3g} % of the line," if root.share < 1 - 1e-9 else ""
    kappa = f", of kappa {root.kappa:.4g}" if root.multiplicity > 1 else ""
    return f"  {place}{times}{share} multiplier of beta {root.beta:.4g}{kappa}"


def _rows(explanation: Explanation) -> list[Sequence[str]]:
    rows: list[Sequence[str]] = [("rounded", "to", "abscissa", "loses", "damping_ratio", "violates")]
    for name, row in explanation.rounding.items():
        rows.append(_row(f"{name} alone", row.written[name], row))
    for row in explanation.precision:
        rows.append(_row("all", f"{row.digits} digits", row))
    return rows


def _row(what: str, to: str, row: Rounded) -> tuple[str, ...]:
    return (what, to, number(row.realised), f"{row.loss:.2g}", f"{row.damping_ratio:.4g}", _violated(row.violations))


def _violated(violations: Mapping[str, float]) -> str:
    return ", ".join(f"{name} by {value:.1g}" for name, value in violations.items())
