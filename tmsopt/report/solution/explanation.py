"""What an optimum means and how its multiple roots split, as lines for a reader."""

import math
from collections.abc import Sequence
from itertools import takewhile

from tmsopt.analysis.diagnosis import Diagnosis
from tmsopt.analysis.explain import Explanation
from tmsopt.analysis.optimality import NOT_COVERED, OnLine, Optimality
from tmsopt.analysis.rounding import ALONE, Rounded
from tmsopt.analysis.splitting import DEVIATION, Law, Response
from tmsopt.report.solution.rows import frequency_of
from tmsopt.report.text import columns, number

_SHARE, _NIL = 0.05, 1e-9
"""Of decay and objective: what rounding may cost; what is nothing."""
_MULTIPLIERS = "what it costs, per unit, to change "
_ROUNDING, _ROUNDED = 1e-16, 1e-13
_UNRESOLVED = (
    "no power of ε holds at two changes, one 100 times the other; state constants exactly, as in sqrt(2) or 8/3, or "
    "solve with another value to see"
)


def explained_lines(explanation: Explanation) -> list[str]:
    """Summary, local optimality, levers, rounding, precision and warnings.

    Example:
        >>> explanation = tmsopt.explain("problems/ep4.toml")
        >>> print(tmsopt.report.explained_lines(explanation)[0])
        meaning: four roots meet in one (EP4): no design in the box decays faster (proven)

    More: docs/how_to/report.md
    """
    lines = [f"meaning: {explanation.summary}", *optimality_lines(explanation.optimality)]
    lines += [f"warning: {text}" for text in explanation.warnings]
    if explanation.levers:
        lines += ["", "what moving a limit buys, solved again from the optimum:"]
        lines += [f"  {lever.sentence}" for lever in explanation.levers]
    if explanation.precision:
        lines.append("")
        lines += columns(rounding_rows(explanation))
    if explanation.worst:
        lines.append(f"rounding {explanation.worst} alone to {ALONE} digits costs most")
    return [line.rstrip() for line in lines]


def rounding_line(explanation: Explanation) -> str:
    """In one line: the fewest digits that keep what was asked, what fewer cost, and the parameter that needs the most.

    Kept is what is stable as the design was, within all its limits, and within 5 % in decay and objective.

    Example:
        >>> print(tmsopt.report.rounding_line(tmsopt.explain("problems/ep4.toml")))
        3 digits lose 31 % of the decay; 6 digits keep 95 % of the decay; chi_B needs the most

    More: docs/how_to/report.md
    """
    rows = explanation.precision
    if not rows or not math.isfinite(explanation.abscissa):
        return ""
    stable = explanation.abscissa < -_NIL
    held = list(takewhile(lambda row: _kept(row, explanation), reversed(rows)))  # few digits may do no harm by chance
    enough = held[-1] if held else None
    three = next((row for row in rows if row.digits == ALONE), None)
    parts = []
    if stable and three and three.realised < 0 and (enough is None or enough.digits > ALONE):
        parts.append(f"{ALONE} digits {_cost(three, explanation)}")
    if stable and three and not three.realised < 0:
        alone = explanation.rounding.get(explanation.worst)
        worst = f" ({explanation.worst} alone: {alone.written[explanation.worst]})" if alone else ""
        parts.append(f"{ALONE} digits make it unstable{worst}")
    if enough:
        parts.append(f"{enough.digits} digits {_keep(enough, explanation)}")
    else:
        parts.append(f"{rows[-1].digits} digits {_cost(rows[-1], explanation)}")
    told = "make it unstable" in parts[0]
    needs = f"; {explanation.worst} needs the most" if explanation.worst and not told else ""
    return f"{'; '.join(parts)}{needs}"


def _kept(row: Rounded, explanation: Explanation) -> bool:
    return _near(row, explanation) and not row.violations


def _near(row: Rounded, explanation: Explanation) -> bool:
    """Whether decay and objective are about what they were."""
    good = row.loss <= max(_SHARE * abs(explanation.abscissa), _NIL)
    off = abs(row.objective - explanation.value)  # nan where none was asked, or it takes a search
    return good and not off > max(_SHARE * abs(explanation.value), _NIL)


def _keep(row: Rounded, explanation: Explanation) -> str:
    if explanation.abscissa >= -_NIL:
        return f"move the rightmost root by {row.loss:.2g}" if row.loss > _NIL else "change next to nothing"
    share = min(math.floor(round(100 * row.realised / explanation.abscissa, 6)), 100)
    return f"keep {share} % of the decay"


def _cost(row: Rounded, explanation: Explanation) -> str:
    """What digits that are not enough do."""
    if explanation.abscissa < -_NIL and row.realised >= 0:
        return "make it unstable"
    if _near(row, explanation) or explanation.abscissa >= -_NIL:
        what = _keep(row, explanation)
    else:
        what = f"lose {100 * row.loss / -explanation.abscissa:.2g} % of the decay"
    return f"{what} but violate {', '.join(row.violations)}" if row.violations else what


def optimality_lines(optimality: Optimality) -> list[str]:
    """The verdict, then the multipliers of each root on the rightmost line.

    Example:
        >>> print(tmsopt.report.optimality_lines(tmsopt.optimality("problems/ep4.toml"))[0])
        local optimality: this EP4 is a strict local minimum of abscissa: ...

    More: docs/how_to/report.md
    """
    if optimality.verdict == NOT_COVERED:
        return [f"local optimality: not judged, for {optimality.reason}"]
    lines = [f"local optimality: {optimality.reason}"]
    if optimality.roots:
        of_H = optimality.roots[0].eigenfrequency is not None
        what = "an eigenfrequency of the largest Im ω" if of_H else "a root on the rightmost line"
        lines.append(f"  {_MULTIPLIERS}{what} (they balance within {optimality.residual:.1g}):")
    return [*lines, *map(_root_line, optimality.roots)]


def _root_line(root: OnLine) -> str:
    place = _place(root.re, root.im, 5)
    if (omega := root.eigenfrequency) is not None:
        place = frequency_of(omega.real, omega.imag, 5)
    times = f" ({root.multiplicity}-fold)" if root.multiplicity > 1 else ""
    share = f" ({100 * root.share:.3g} % of what all bear)" if root.share < 1 - 1e-9 else ""
    kappa = f", to part it {_seen(root.kappa, root.beta):.4g}" if root.multiplicity > 1 else ""
    return f"  {place}{times}: to move it {'left' if omega is None else 'down'} {root.beta:.4g}{share}{kappa}"


def _place(re: float, im: float, digits: int) -> str:
    """A root or a pair; a real part that is none but for rounding is 0."""
    return f"{_seen(re, math.hypot(re, im)):.{digits}g}" + (f" ± {im:.{digits}g}i" if im else "")


def _seen(x: float, size: float = 1.0) -> float:
    """A number, or 0 for one that is none beside a size but for rounding."""
    return 0.0 if abs(x) <= _ROUNDED * size else x


def rounding_rows(explanation: Explanation) -> list[Sequence[str]]:
    rows: list[Sequence[str]] = [("rounded", "to", "abscissa", "loses", "damping_ratio", "violates")]
    rows += [_row(f"{name} alone", row.written[name], row) for name, row in explanation.rounding.items()]
    rows += [_row("all", f"{row.digits} digits", row) for row in explanation.precision]
    known = any(math.isfinite(row.damping_ratio) for row in (*explanation.rounding.values(), *explanation.precision))
    return rows if known else [(*row[:4], *row[5:]) for row in rows]


def _row(what: str, to: str, row: Rounded) -> tuple[str, ...]:
    violated = ", ".join(row.violations)
    ratio, loss = _seen(row.damping_ratio), _seen(row.loss)
    return (what, to, number(row.realised, _ROUNDED), f"{loss:.2g}", f"{ratio:.4g}", violated)


def diagnosis_lines(diagnoses: Sequence[Diagnosis], details: bool = False) -> list[str]:
    """Two sentences for each multiple root: what it is, and how it splits; the laws of every parameter as details.

    Example:
        >>> diagnoses = tmsopt.diagnose(tmsopt.solve("problems/ep4.toml"))
        >>> print(tmsopt.report.diagnosis_lines(diagnoses)[0])
        4-fold root -1.8803015: defective, Jordan chain of length 4 ...

    More: docs/explanation/exceptional_points.md
    """
    lines: list[str] = []
    for found in diagnoses:
        lines += [_kind(found), _splitting(found, details)]
        if details:
            lines += ["", *(f"  {line}".rstrip() for line in columns(_diagnosis_rows(found))), ""]
    return lines[:-1] if details and lines else lines


def _kind(found: Diagnosis) -> str:
    place = _place(found.re, found.im, 8)
    vectors = f"{found.geometric} independent eigenvector" + ("s" if found.geometric > 1 else "")
    if found.jordan is None:
        why = "there are no matrices to judge by, so one chain of eigenvectors, as for a companion matrix"
    else:
        zero = f"{found.jordan.zero:.1g}" if found.jordan.zero > _ROUNDING else f"below {_ROUNDING:g}"
        why = f"{vectors} instead of {found.algebraic}: " if found.geometric < found.algebraic else f"{vectors}: "
        why += f"of the singular values of its matrix, relative to the greatest, {zero} counts as 0"
        why += f", the next is {found.jordan.nonzero:.2g}" if found.jordan.nonzero < float("inf") else ""
    chains = f"Jordan chains of length {', '.join(map(str, found.partial))}" if found.partial else "chains not decided"
    chains = chains.replace("chains", "chain", 1) if len(found.partial) == 1 else chains
    what = "pair" if found.im else "root"
    if (omega := found.eigenfrequency) is not None:
        what, place = "eigenfrequency", frequency_of(omega.real, omega.imag, 8)
    return f"{found.algebraic}-fold {what} {place}: {found.kind}, {chains} ({why})"


def _splitting(found: Diagnosis, details: bool) -> str:
    """Every parameter with its laws, the most sensitive first; that alone where a table has them all."""
    moved = [r for r in found.responses if r.laws]
    unsure = [r.parameter for r in found.responses if r.unresolved]
    still = [r.parameter for r in found.responses if not (r.laws or r.unresolved)]
    parts = [f"{r.parameter}{'' if r.relative else ' (absolute)'} by {_laws(r, found)}" for r in moved[1:]]
    parts = [] if details else parts
    if moved:
        first = moved[0]
        change = "relative change" if first.relative else "change"
        moves = f"a {change} ε of {first.parameter} moves it by {_laws(first, found)}"
        parts = [f"{moves}, within {100 * DEVIATION:.0f} % {_range(first.laws[0])}, as sampled", *parts]
    if still:
        none = "no parameter moves it" if len(still) == len(found.responses) else ""
        parts.append(none or f"{', '.join(still)} {'does' if len(still) == 1 else 'do'} not move it")
    if unsure:
        parts.append(f"not resolved for {', '.join(unsure)}: {_UNRESOLVED}")
    return f"  {'; '.join(parts)}"


def _laws(response: Response, found: Diagnosis) -> str:
    return " and ".join(
        _law(law) + (f" ({law.branches.roots} of {found.algebraic})" if law.branches.roots < found.algebraic else "")
        for law in response.laws
    )


def _law(law: Law) -> str:
    exponent = str(law.branches.exponent)
    power = "ε" if exponent == "1" else f"ε^({exponent})" if "/" in exponent else f"ε^{exponent}"
    return f"{law.branches.size:.3g} {power}"


def _range(law: Law) -> str:
    least = f"|ε| >= {law.least:.2g} and " if law.least else ""
    return f"while {least}|ε| <= {min(law.below, law.above):.2g}"


def _diagnosis_rows(found: Diagnosis) -> list[Sequence[str]]:
    rows: list[Sequence[str]] = [("parameter", "change", "roots", "shift", "holds for ε < 0", "holds for ε > 0")]
    for response in found.responses:
        rows += [_diagnosis_row(response, law) for law in response.laws]
        for count, word in ((response.unmoved, "none"), (response.unresolved, "not resolved")):
            rows += [(response.parameter, _change(response), str(count), word, "", "")] if count else []
    return rows


def _diagnosis_row(response: Response, law: Law) -> tuple[str, ...]:
    least = f"{law.least:.2g} <= " if law.least else ""
    ends = (f"{least}|ε| <= {x:.2g}" for x in (law.below, law.above))
    return (response.parameter, _change(response), str(law.branches.roots), _law(law), *ends)


def _change(response: Response) -> str:
    return "relative" if response.relative else "absolute"
