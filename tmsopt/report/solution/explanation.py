"""What an optimum means, how its multiple roots split, and how far its boundaries are, as lines for a reader."""

import math
from collections.abc import Sequence

from tmsopt.design.unit_system import unit_of
from tmsopt.diagnosis.diagnosis import Diagnosis
from tmsopt.diagnosis.splitting import DEVIATION, Law, Response
from tmsopt.explanation.explain import Explanation
from tmsopt.explanation.optimality import NOT_COVERED, OnLine, Optimality
from tmsopt.explanation.rounding import ALONE, Rounded
from tmsopt.margins.nearest import Nearest, Robustness
from tmsopt.models import Model, in_words_of, words_of
from tmsopt.report.text import columns, number

_SHARE, _LIMIT, _NIL = 0.05, 0.01, 1e-9
"""Of decay and objective, and of the sizes of limits: what rounding may cost; what is nothing."""
_MAIN = 0.5
"""Share of the largest change above which a parameter is named in the headline."""
_WIDE = 12
"""Parameters up to which each has a column; of more, each has a row."""
_MULTIPLIERS = "what it costs, per unit, to change a root on the rightmost line"
_LITTLE = 1e-3
"""Share of the largest change below which one is 0."""
_NAMED = 3
"""Parameters named in the headline at most."""
_VERBS = {"divergence": "diverge"}
"""Of words that are no verbs."""
_ROUNDING, _ROUNDED = 1e-16, 1e-13


def explained_lines(explanation: Explanation) -> list[str]:
    """Summary, local optimality, levers, rounding, precision and warnings."""
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

    Kept is what is stable as the design was, within its limits to their 100th, and within 5 % in decay and objective.
    """
    rows = explanation.precision
    if not rows or not math.isfinite(explanation.abscissa):
        return ""
    stable = explanation.abscissa < -_NIL
    enough = next((row for row in rows if _kept(row, explanation)), None)
    three = next((row for row in rows if row.digits == ALONE), None)
    parts = []
    if stable and three and three.realised < 0 and (enough is None or enough.digits > ALONE):
        parts.append(f"{ALONE} digits {_lose(three, explanation)}")
    if stable and three and not three.realised < 0:
        alone = explanation.rounding.get(explanation.worst)
        worst = f" ({explanation.worst} alone: {alone.written[explanation.worst]})" if alone else ""
        parts.append(f"{ALONE} digits make it unstable{worst}")
    if enough:
        parts.append(f"{enough.digits} digits {_keep(enough, explanation)}")
    else:
        parts.append(f"{rows[-1].digits} digits {_lose(rows[-1], explanation)}")
    told = "make it unstable" in parts[0]
    needs = f"; {explanation.worst} needs the most" if explanation.worst and not told else ""
    return f"{'; '.join(parts)}{needs}"


def _kept(row: Rounded, explanation: Explanation) -> bool:
    good = row.loss <= max(_SHARE * abs(explanation.abscissa), _NIL)
    off = abs(row.objective - explanation.value)  # nan where none was asked, or it takes a search
    near = not off > max(_SHARE * abs(explanation.value), _NIL)
    return good and near and all(v <= _LIMIT for v in row.violations.values())


def _keep(row: Rounded, explanation: Explanation) -> str:
    if explanation.abscissa >= -_NIL:
        return f"move the rightmost root by {row.loss:.2g}" if row.loss > _NIL else "change next to nothing"
    share = min(math.floor(round(100 * row.realised / explanation.abscissa, 6)), 100)
    return f"keep {share} % of the decay"


def _lose(row: Rounded, explanation: Explanation) -> str:
    """What the most digits that were tried cost."""
    if explanation.abscissa < -_NIL and row.realised >= 0:
        return "make it unstable"
    violated = [name for name, v in row.violations.items() if v > _LIMIT]
    if violated:
        return f"violate {', '.join(violated)}"
    if explanation.abscissa >= -_NIL:
        return f"move the rightmost root by {row.loss:.2g}"
    return f"lose {100 * row.loss / -explanation.abscissa:.2g} % of the decay"


def optimality_lines(optimality: Optimality) -> list[str]:
    """The verdict, then the multipliers of each root on the rightmost line."""
    if optimality.verdict == NOT_COVERED:
        return [f"local optimality: not judged, for {optimality.reason}"]
    lines = [f"local optimality: {optimality.reason}"]
    if optimality.roots:
        lines.append(f"  {_MULTIPLIERS} (they balance within {optimality.residual:.1g}):")
    return [*lines, *map(_root_line, optimality.roots)]


def _root_line(root: OnLine) -> str:
    place = _place(root.re, root.im, 5)
    times = f" ({root.multiplicity}-fold)" if root.multiplicity > 1 else ""
    share = f" ({100 * root.share:.3g} % of what all bear)" if root.share < 1 - 1e-9 else ""
    kappa = f", to part it {_seen(root.kappa, root.beta):.4g}" if root.multiplicity > 1 else ""
    return f"  {place}{times}: to move it left {root.beta:.4g}{share}{kappa}"


def _place(re: float, im: float, digits: int) -> str:
    """A root or a pair; a real part that is none but for rounding is 0."""
    return f"{_seen(re, math.hypot(re, im)):.{digits}g}" + (f" ± {im:.{digits}g}i" if im else "")


def _seen(x: float, size: float = 1.0) -> float:
    """A number, or 0 for one that is none beside a size but for rounding."""
    return 0.0 if abs(x) <= _ROUNDED * size else x


def rounding_rows(explanation: Explanation) -> list[Sequence[str]]:
    rows: list[Sequence[str]] = [("rounded", "to", "abscissa", "loses", "damping_ratio", "violates")]
    rows += [_row(f"{name} alone", row.written[name], row) for name, row in explanation.rounding.items()]
    return rows + [_row("all", f"{row.digits} digits", row) for row in explanation.precision]


def _row(what: str, to: str, row: Rounded) -> tuple[str, ...]:
    violated = ", ".join(row.violations)
    ratio, loss = _seen(row.damping_ratio), _seen(row.loss)
    return (what, to, number(_seen(row.realised)), f"{loss:.2g}", f"{ratio:.4g}", violated)


def diagnosis_lines(diagnoses: Sequence[Diagnosis], details: bool = False) -> list[str]:
    """Two sentences for each multiple root: what it is, and how it splits; the laws of every parameter as details."""
    lines: list[str] = []
    for found in diagnoses:
        lines += [_kind(found), *_splitting(found)]
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
    return f"{found.algebraic}-fold {what} {place}: {found.kind}, {chains} ({why})"


def _splitting(found: Diagnosis) -> list[str]:
    moved = [r for r in found.responses if r.laws]
    if not moved:
        return ["  no parameter moves it"]
    first, still = moved[0], [r.parameter for r in found.responses if not r.laws]
    rest = f"; {', '.join(still)} {'does' if len(still) == 1 else 'do'} not move it" if still else ""
    change = "relative change" if first.relative else "change"
    return [f"  a {change} ε of {first.parameter} moves it by {_law(first.laws[0])}, {_range(first.laws[0])}{rest}"]


def _law(law: Law) -> str:
    exponent = str(law.branches.exponent)
    power = "ε" if exponent == "1" else f"ε^({exponent})" if "/" in exponent else f"ε^{exponent}"
    return f"{law.branches.size:.3g} {power}"


def _range(law: Law) -> str:
    least = min(law.below, law.above)
    within = f"within {100 * DEVIATION:.0f} %"
    if not least:
        return f"{within} for no change that was sampled"
    return f"{within} while |ε| <= {least:.2g}, as sampled"


def _diagnosis_rows(found: Diagnosis) -> list[Sequence[str]]:
    rows: list[Sequence[str]] = [("parameter", "change", "roots", "shift", "holds for ε < 0", "holds for ε > 0")]
    for response in found.responses:
        rows += [_diagnosis_row(response, law) for law in response.laws]
        if response.unmoved:
            rows.append((response.parameter, _change(response), str(response.unmoved), "none", "", ""))
    return rows


def _diagnosis_row(response: Response, law: Law) -> tuple[str, ...]:
    ends = (f"|ε| <= {x:.2g}" if x else "nowhere sampled" for x in (law.below, law.above))
    return (response.parameter, _change(response), str(law.branches.roots), _law(law), *ends)


def _change(response: Response) -> str:
    return "relative" if response.relative else "absolute"


def robustness_line(found: Robustness) -> str:
    """In one line: how large a change ends stability, or brings it, how, and by which parameters mostly."""
    if found.edges:
        on = " and ".join(_ON_EDGE[kind] for kind in found.edges)
        if found.zeros:
            return f"at its edge already: {', '.join(f'{n} = 0' for n in found.zeros)} ({on})"
        return f"none, on the edge of stability already, with {on}"
    limit = found.limit
    if not limit.found:
        return f"{'' if found.stable else 'not stable; '}no change that was looked at makes it {_other(found)}"
    if not found.stable:
        return f"not stable; {_size(found)} makes it stable{_mostly(limit, found.relative)}"
    return f"{_size(found)} {_event(found.problem.model, limit.kind)}{_mostly(limit, found.relative)}"


_ON_EDGE = {"weave": "a pair of roots on the imaginary axis", "capsize": "a root 0", "infinity": "a root at infinity"}


def _other(found: Robustness) -> str:
    return "unstable" if found.stable else "stable"


def _event(model: Model, kind: str) -> str:
    if kind == "infinity":
        return "takes a root through infinity (a0 = 0)"
    word = words_of(model)[kind]
    return f"makes it {_VERBS.get(word, word)}"


def robustness_table(found: Robustness) -> str:
    """The sentence, then the nearest point of every boundary: its distance and the change of each parameter."""
    names = list(found.weights)
    kinds = (found.weave, found.capsize, found.infinity, found.heavy_damping)
    rows: list[tuple[str, ...]] = [("relative changes" if found.relative else "changes in weights", "distance", *names)]
    for n in kinds:
        moves = _moves(n, found.relative) if n.found and n.distance else ["" for _ in names]
        rows.append((_robust_row(n, found), _distance(n, found), *moves))
    units = {name: unit_of(found.problem, name) for name in names}
    rows.append(("weight", "", *(units[name].show(found.weights[name], 6) for name in names)))
    for n in kinds:
        if n.found and n.distance > 0:
            at = "at" if n.kind == "infinity" else "with"
            word = in_words_of(found.problem.model, n.kind)
            rows.append((f"{at} {word}", "", *(units[name].show(n.parameters[name], 8) for name in names)))
    if len(names) > _WIDE:
        rows = list(zip(*rows, strict=True))
    return "\n".join(line.rstrip() for line in [f"robustness: {robustness_line(found)}", "", *columns(rows)])


def nearest_table(found: Nearest) -> str:
    """How far one boundary is, then the nearest point and the change of each parameter in weights."""
    if not found.found:
        return f"no point of the boundary of {found.kind} was found"
    lines = [f"to {found.kind}: {found.distance:.6g} in weights"]
    if not found.refined:
        lines[0] += ", the nearest crossing seen"
    rows = [("", "there", "change in weights")]
    rows += [(n, f"{found.parameters[n]:.8g}", f"{change:+.4g}") for n, change in found.direction.items()]
    return "\n".join(line.rstrip() for line in [*lines, "", *columns(rows)])


def _robust_row(n: Nearest, found: Robustness) -> str:
    to = "at the edge of" if n.distance == 0 else "to"
    if n.kind != "heavy damping":
        return f"{to} {in_words_of(found.problem.model, n.kind)}"
    return f"{to} {n.kind}" if n.distance == 0 else f"{'out of' if found.heavily_damped else 'into'} {n.kind}"


def _distance(n: Nearest, found: Robustness) -> str:
    if not n.found:
        return "none found"
    if n.distance == 0:
        return ""
    return _percent(n.distance) if found.relative else f"{n.distance:.4g}"


def _moves(n: Nearest, relative: bool) -> list[str]:
    """The change of each parameter; 0 for what is too little to matter."""
    largest = max(map(abs, n.direction.values()))
    shown = (x if abs(x) >= _LITTLE * largest else 0.0 for x in n.direction.values())
    return ["0" if x == 0 else _percent(x, "+") if relative else f"{x:+.3g}" for x in shown]


def _mostly(limit: Nearest, relative: bool) -> str:
    """The parameters that change most."""
    changes = sorted(limit.direction.items(), key=lambda item: -abs(item[1]))
    largest = abs(changes[0][1])
    named = [n for n, x in changes if largest > 0 and abs(x) >= _MAIN * largest]
    return f", mostly {', '.join(named[:_NAMED])}" if named and len(changes) > 1 else ""


def _size(found: Robustness) -> str:
    if found.relative:
        return f"{_percent(found.limit.distance)} of change"
    return f"a change of {found.limit.distance:.2g} in {'your' if found.problem.weights else 'the'} weights"


def _percent(x: float, sign: str = "") -> str:
    """Two significant digits at least."""
    digits = 1 if x == 0 else max(1 - math.floor(math.log10(abs(100 * x))), 0)
    return f"{100 * x:{sign}.{digits}f} %"
