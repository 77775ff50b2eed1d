"""What an optimum means, what rounding does to it, and how its multiple roots split."""

import math
from itertools import takewhile

from tmsopt.analysis import NOT_COVERED, NOT_MINIMAL, STRICT, Response
from tmsopt.analysis.diagnosis import Diagnosis
from tmsopt.analysis.explain import Explanation
from tmsopt.analysis.optimality import Optimality, RightmostRoot
from tmsopt.analysis.rounding import ALONE, RoundedDesign
from tmsopt.analysis.splitting import DEVIATION, Law
from tmsopt.documents.blocks import (
    Badge,
    Cell,
    Chapter,
    Level,
    Parts,
    Row,
    Sentence,
    TableBlock,
    Tone,
    count_things,
)
from tmsopt.documents.design_rows import format_pair, format_root

_SHARE, _NIL = 0.05, 1e-9
"""Of decay and objective: what rounding may cost; what is nothing."""
_ROUNDING, _ROUNDED = 1e-16, 1e-13
_UNRESOLVED = (
    "no power of ε holds at two changes, one 100 times the other; state constants exactly, as in sqrt(2) or 8/3, or "
    "solve with another value to see"
)


def write_explanation(found: Explanation, _level: Level) -> Parts:
    """The meaning, local optimality, warnings, what limits are worth, what rounding costs."""
    warnings = count_things(found.warnings, "warning") if found.warnings else ""
    yield found.structure, *_judge_optimality(found.optimality), count_things(found.levers, "limit"), warnings
    yield Chapter("meaning")
    yield Sentence(found.summary, "meaning", "answer")
    yield from write_optimality(found.optimality)
    yield from (Sentence(text, "warning", "doubt") for text in found.warnings)
    if found.levers:
        yield Chapter("limits")
        yield "improvement if a limit is relaxed, from a new solution near the optimum:"
        yield from (lever.sentence for lever in found.levers)
    yield Chapter("rounding")
    if found.precision:
        yield tabulate_rounding(found)
    if found.worst:
        yield f"rounding {found.worst} alone to {ALONE} digits has the largest effect"


def describe_rounding(found: Explanation) -> str:
    """The fewest digits that keep what was asked, what fewer cost, and the parameter that needs the most.

    Kept is a design that is stable as it was, within all its limits, and within 5 % in decay and objective.
    """
    rows = found.precision
    if not rows or not math.isfinite(found.abscissa):
        return ""
    stable = found.abscissa < -_NIL
    held = takewhile(lambda row: _is_near(row, found) and not row.violations, reversed(rows))
    enough = [None, *held][-1]  # not just the fewest digits: these may do no harm by chance
    three = next((row for row in rows if row.digits == ALONE), None)
    parts, unstable = [], False
    if stable and three and three.realised < 0 and (enough is None or enough.digits > ALONE):
        parts.append(f"to {ALONE} digits the design {_describe_cost(three, found)}")
    if stable and three and not three.realised < 0:
        alone, unstable = found.rounding.get(found.worst), True
        worst = f" ({found.worst} alone: {alone.written[found.worst]})" if alone else ""
        parts.append(f"to {ALONE} digits the design is unstable{worst}")
    last = enough or rows[-1]
    parts.append(f"to {last.digits} digits the design {(_describe_benefit if enough else _describe_cost)(last, found)}")
    needs = f"; {found.worst} needs the most digits" if found.worst and not unstable else ""
    return f"{'; '.join(parts)}{needs}"


def _is_near(row: RoundedDesign, found: Explanation) -> bool:
    """Whether decay and objective are about what they were."""
    good = row.loss <= max(_SHARE * abs(found.abscissa), _NIL)
    off = abs(row.objective - found.value)  # nan where none was asked, or it takes a search
    return good and not off > max(_SHARE * abs(found.value), _NIL)


def _describe_benefit(row: RoundedDesign, found: Explanation) -> str:
    if found.abscissa >= -_NIL:
        return f"shifts its rightmost root by {row.loss:.2g}" if row.loss > _NIL else "hardly changes"
    share = min(math.floor(round(100 * row.realised / found.abscissa, 6)), 100)
    return f"keeps {share} % of the decay rate"


def _describe_cost(row: RoundedDesign, found: Explanation) -> str:
    """What digits that are not enough do."""
    if found.abscissa < -_NIL and row.realised >= 0:
        return "is unstable"
    if _is_near(row, found) or found.abscissa >= -_NIL:
        cost = _describe_benefit(row, found)
    else:
        cost = f"keeps {100 * row.realised / found.abscissa:.2g} % of the decay rate"
    return f"{cost} and violates the limit {', '.join(row.violations)}" if row.violations else cost


def tabulate_rounding(found: Explanation) -> TableBlock:
    """The design rounded, one parameter alone and then all together."""
    named = [(f"{name} alone", row.written[name], row) for name, row in found.rounding.items()]
    named += [("all", f"{row.digits} digits", row) for row in found.precision]
    known = any(math.isfinite(row.damping_ratio) for *_, row in named)
    heads = ("damping_ratio",) if known else ()
    rows: list[Row] = [("parameter", "rounded to", "abscissa", "abscissa rises by", *heads, "violated limits")]
    for which, to, row in named:
        ratio = (f"{_drop_noise(row.damping_ratio):.4g}",) if known else ()
        abscissa, loss = Cell(row.realised, error=_ROUNDED), f"{_drop_noise(row.loss):.2g}"
        rows.append((which, to, abscissa, loss, *ratio, ", ".join(row.violations)))
    return TableBlock(rows, "What rounding does")


def _judge_optimality(found: Optimality) -> tuple[Badge, str]:
    tones: dict[str, Tone] = {STRICT: "good", NOT_MINIMAL: "bad"}
    return Badge(found.verdict, tones.get(found.verdict, "doubt")), f"by order {found.order}" if found.order else ""


def write_optimality(found: Optimality, _level: Level = "full") -> Parts:
    """The verdict, then the multipliers of each root on the rightmost line."""
    yield _judge_optimality(found)
    if found.verdict == NOT_COVERED:
        yield Sentence(f"not judged, for {found.reason}", "local optimality")
        return
    yield Sentence(found.reason, "local optimality")
    if found.roots:
        of_H = found.roots[0].eigenfrequency is not None
        root = "an eigenfrequency of the largest Im ω" if of_H else "a root on the rightmost line"
        balance = f"the optimality conditions hold within {found.residual:.1g}"
        yield f"cost in the objective per unit of each change of {root}; {balance}:"
        head = ("root", f"shift {'down' if of_H else 'to the left'}", "share of all shifts", "split of a multiple root")
        rows = [head, *map(_list_root, found.roots)]
        is_multiple = any(root.multiplicity > 1 for root in found.roots)
        yield TableBlock(rows if is_multiple else [row[:-1] for row in rows], "Multipliers")


def _list_root(root: RightmostRoot) -> tuple[str, ...]:
    share = f"{100 * root.share:.3g} %" if root.share < 1 - 1e-9 else ""
    kappa = f"{_drop_noise(root.kappa, root.beta):.4g}" if root.multiplicity > 1 else ""
    return format_root(root, 5, root.multiplicity), f"{root.beta:.4g}", share, kappa


def _drop_noise(x: float, size: float = 1.0) -> float:
    """A number, or 0 for one that is only rounding compared with a size."""
    return 0.0 if abs(x) <= _ROUNDED * size else x


def write_diagnosis(found: Diagnosis, level: Level = "full") -> Parts:
    """Two sentences: the kind of the root, and how it splits; the laws of every parameter where all is wanted."""
    what = "pair" if found.im else "root"
    yield f"{found.algebraic}-fold {what}", format_pair(found.re, found.im, 5), found.kind
    full = level != "brief"
    yield Sentence(_describe_root(found), tone="answer")
    yield _describe_splitting(found, full)
    if full:
        yield TableBlock(_list_laws(found), "How the root splits")


def _describe_root(found: Diagnosis) -> str:
    vectors = count_things(found.geometric, "independent eigenvector")
    if found.jordan is None:
        why = "there are no matrices to judge by, so one chain of eigenvectors, as for a companion matrix"
    else:
        zero = f"{found.jordan.zero:.1g}" if found.jordan.zero > _ROUNDING else f"below {_ROUNDING:g}"
        why = f"{vectors} instead of {found.algebraic}: " if found.geometric < found.algebraic else f"{vectors}: "
        why += f"of the singular values of its matrix, relative to the greatest, {zero} counts as 0"
        why += f", the next is {found.jordan.nonzero:.2g}" if found.jordan.nonzero < math.inf else ""
    lengths = ", ".join(map(str, found.partial))
    many = "s" if len(found.partial) > 1 else ""
    chains = f"Jordan chain{many} of length {lengths}" if found.partial else "chains not decided"
    what = "pair" if found.im else "root"
    what = what if found.eigenfrequency is None else "eigenfrequency"
    return f"{found.algebraic}-fold {what} {format_root(found, 8)}: {found.kind}, {chains} ({why})"


def _describe_splitting(found: Diagnosis, full: bool) -> str:
    """Every parameter with its laws, the most sensitive first; that alone where a table has them all."""
    moving = [r for r in found.responses if r.laws]
    unsure = [r.parameter for r in found.responses if r.unresolved]
    still = [r.parameter for r in found.responses if not (r.laws or r.unresolved)]
    others = [f"{r.parameter}{'' if r.relative else ' (absolute)'} by {_describe_laws(r, found)}" for r in moving[1:]]
    parts: list[str] = []
    if moving:
        first = moving[0]
        change = "relative change" if first.relative else "change"
        moves = f"a {change} ε of {first.parameter} moves it by {_describe_laws(first, found)}"
        parts = [
            f"{moves}, within {100 * DEVIATION:.0f} % {_describe_range(first.laws[0])}, as sampled",
            *([] if full else others),
        ]
    if still:
        none = "no parameter moves it" if len(still) == len(found.responses) else ""
        parts.append(none or f"{', '.join(still)} {'does' if len(still) == 1 else 'do'} not move it")
    if unsure:
        parts.append(f"not resolved for {', '.join(unsure)}: {_UNRESOLVED}")
    return "; ".join(parts)


def _describe_laws(response: Response, found: Diagnosis) -> str:
    return " and ".join(
        _format_law(law)
        + (f" ({law.branches.roots} of {found.algebraic})" if law.branches.roots < found.algebraic else "")
        for law in response.laws
    )


def _format_law(law: Law) -> str:
    exponent = str(law.branches.exponent)
    power = "ε" if exponent == "1" else f"ε^({exponent})" if "/" in exponent else f"ε^{exponent}"
    return f"{law.branches.size:.3g} {power}"


def _describe_range(law: Law) -> str:
    least = f"|ε| >= {law.least:.2g} and " if law.least else ""
    return f"while {least}|ε| <= {min(law.below, law.above):.2g}"


def _list_laws(found: Diagnosis) -> list[Row]:
    rows: list[Row] = [("parameter", "change", "roots", "shift", "holds for ε < 0", "holds for ε > 0")]
    for response in found.responses:
        change = "relative" if response.relative else "absolute"
        for law in response.laws:
            least = f"{law.least:.2g} <= " if law.least else ""
            ends = (f"{least}|ε| <= {x:.2g}" for x in (law.below, law.above))
            rows.append((response.parameter, change, str(law.branches.roots), _format_law(law), *ends))
        for count, word in ((response.unmoved, "no shift"), (response.unresolved, "not resolved")):
            rows += [(response.parameter, change, str(count), word, "", "")] if count else []
    return rows
