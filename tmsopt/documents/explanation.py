"""Documents on the meaning of an optimum, the effect of rounding, and the splitting of multiple roots."""

import math
from itertools import takewhile

from tmsopt.analysis import NOT_COVERED, NOT_MINIMAL, STRICT, Response
from tmsopt.analysis.diagnosis import Diagnosis
from tmsopt.analysis.explain import Explanation
from tmsopt.analysis.optimality import Optimality, RightmostRoot
from tmsopt.analysis.rounding import SINGLE_DIGITS, RoundedDesign
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
from tmsopt.documents.tables import remove_empty_columns

_MAX_COST = 0.05
"""Largest relative loss of decay and objective that rounding may cause."""
_ZERO = 1e-9
"""An absolute loss that is smaller counts as 0."""
_SMALLEST_SHOWN = 1e-16
"""A singular value that is smaller is shown as "less than" this number."""
_ROUNDING_ERROR = 1e-13
"""Error of an abscissa by rounding."""
_UNRESOLVED = (
    "no power of ε fits two changes that differ by a factor of 100; write constants exactly, such as sqrt(2) or 8/3, "
    "or solve with another value"
)


def write_explanation(explanation: Explanation, _level: Level) -> Parts:
    """Write the meaning, local optimality, warnings, the effect of each limit, and the cost of rounding."""
    warnings = count_things(explanation.warnings, "warning") if explanation.warnings else ""
    limits = count_things(explanation.levers, "limit")
    yield explanation.structure, *_summarise_optimality(explanation.optimality), limits, warnings
    yield Chapter("meaning")
    yield Sentence(explanation.summary, "meaning", "answer")
    yield from write_optimality(explanation.optimality)
    yield from (Sentence(text, "warning", "doubt") for text in explanation.warnings)
    if explanation.levers:
        yield Chapter("limits")
        yield "improvement if a limit is relaxed, from a new solution near the optimum:"
        yield from (lever.sentence for lever in explanation.levers)
    yield Chapter("rounding")
    if explanation.precision:
        yield tabulate_rounding(explanation)
    if explanation.worst:
        yield f"rounding {explanation.worst} alone to {SINGLE_DIGITS} digits has the largest effect"


def describe_rounding(explanation: Explanation, noun: str = "design") -> str:
    """Describe the fewest digits that suffice, the effect of fewer digits, and the parameter that needs most digits.

    Digits suffice if the rounded design is stable, meets all limits, and loses at most 5 % in decay and objective.
    """
    rows = explanation.precision
    if not rows or not math.isfinite(explanation.abscissa):
        return ""
    is_stable = explanation.abscissa < -_ZERO
    sufficient_rows = takewhile(lambda row: _is_near(row, explanation) and not row.violations, reversed(rows))
    fewest_digits = [None, *sufficient_rows][-1]  # with still fewer digits a design may be good by chance
    few_digits = next((row for row in rows if row.digits == SINGLE_DIGITS), None)
    parts, becomes_unstable = [], False
    if is_stable and few_digits and not few_digits.realised < 0:
        single_row, becomes_unstable = explanation.rounding.get(explanation.worst), True
        cause = f" ({explanation.worst} alone: {single_row.written[explanation.worst]})" if single_row else ""
        parts.append(f"with {SINGLE_DIGITS} digits the {noun} is unstable{cause}")
    elif is_stable and few_digits and (fewest_digits is None or fewest_digits.digits > SINGLE_DIGITS):
        parts.append(f"with {SINGLE_DIGITS} digits the {noun} {_describe_effect(few_digits, explanation)}")
    row = fewest_digits or rows[-1]
    parts.append(f"with {row.digits} digits {'it' if parts else f'the {noun}'} {_describe_effect(row, explanation)}")
    needs = f"; {explanation.worst} needs the most digits" if explanation.worst and not becomes_unstable else ""
    return f"{'; '.join(parts)}{needs}"


def _is_near(row: RoundedDesign, explanation: Explanation) -> bool:
    """Return whether decay and objective of the rounded design are near those of the solution."""
    is_decay_near = row.loss <= max(_MAX_COST * abs(explanation.abscissa), _ZERO)
    deviation = abs(row.objective - explanation.value)  # nan without an objective, or if computing it needs a search
    return is_decay_near and not deviation > max(_MAX_COST * abs(explanation.value), _ZERO)


def _describe_effect(row: RoundedDesign, explanation: Explanation) -> str:
    """Describe the effect of rounding on the decay, the stability and the limits."""
    if explanation.abscissa >= -_ZERO:
        effect = f"shifts its rightmost root by {row.loss:.2g}" if row.loss > _ZERO else "hardly changes"
    elif row.realised >= 0:
        return "is unstable"
    elif _is_near(row, explanation):
        share = min(math.floor(round(100 * row.realised / explanation.abscissa, 6)), 100)
        effect = f"keeps {share} % of the decay rate"
    else:
        effect = f"loses {100 * row.loss / -explanation.abscissa:.2g} % of the decay rate"
    return f"{effect} and violates the limit {' and '.join(map(repr, row.violations))}" if row.violations else effect


def tabulate_rounding(explanation: Explanation) -> TableBlock:
    """Tabulate the effect of rounding: first each parameter alone, then all parameters together."""
    labelled_rows = [(f"{name} alone", row.written[name], row) for name, row in explanation.rounding.items()]
    labelled_rows += [("all", f"{row.digits} digits", row) for row in explanation.precision]
    has_ratios = any(math.isfinite(row.damping_ratio) for *_, row in labelled_rows)
    heads = ("damping_ratio",) if has_ratios else ()
    rows: list[Row] = [("parameter", "rounded to", "abscissa", "abscissa rises by", *heads, "violated limits")]
    for label, value_text, row in labelled_rows:
        ratio = (f"{_drop_noise(row.damping_ratio):.4g}",) if has_ratios else ()
        abscissa, loss = Cell(row.realised, error=_ROUNDING_ERROR), f"{_drop_noise(row.loss):.2g}"
        rows.append((label, value_text, abscissa, loss, *ratio, ", ".join(row.violations)))
    return TableBlock(rows, "Effect of rounding")


def _summarise_optimality(optimality: Optimality) -> tuple[Badge, str]:
    """Return the verdict, and the order that decides it (empty if there is none)."""
    tones: dict[str, Tone] = {STRICT: "good", NOT_MINIMAL: "bad"}
    order = f"by order {optimality.order}" if optimality.order else ""
    return Badge(optimality.verdict, tones.get(optimality.verdict, "doubt")), order


def write_optimality(optimality: Optimality, _level: Level = "full") -> Parts:
    """Write the verdict, then the multipliers of each rightmost root."""
    yield _summarise_optimality(optimality)
    if optimality.verdict == NOT_COVERED:
        yield Sentence(f"not decided: {optimality.reason}", "local optimality")
        return
    yield Sentence(optimality.reason, "local optimality")
    if optimality.roots:
        of_H = optimality.roots[0].eigenfrequency is not None
        root = "an eigenfrequency with the largest Im ω" if of_H else "a rightmost root"
        residual_text = f"the optimality conditions hold within {optimality.residual:.1g}"
        yield f"increase of the objective if {root} is forced to move by one unit ({residual_text}):"
        head = ("root", "down" if of_H else "to the left", "share of the total", "if a multiple root splits")
        rows = [head, *map(_list_root, optimality.roots)]
        yield TableBlock(remove_empty_columns(rows), "Multipliers")


def _list_root(root: RightmostRoot) -> tuple[str, ...]:
    share = f"{100 * root.share:.3g} %" if root.share < 1 - 1e-9 else ""
    kappa = f"{_drop_noise(root.kappa, root.beta):.4g}" if root.multiplicity > 1 else ""
    return format_root(root, 5, root.multiplicity), f"{root.beta:.4g}", share, kappa


def _drop_noise(x: float, size: float = 1.0) -> float:
    """Replace a number by 0 if it is only a rounding error of numbers of this size."""
    return 0.0 if abs(x) <= _ROUNDING_ERROR * size else x


def write_diagnosis(diagnosis: Diagnosis, level: Level = "full") -> Parts:
    """Write the kind of the root and how it splits; unless brief, also a table with the laws of every parameter."""
    noun = "pair" if diagnosis.im else "root"
    yield f"{diagnosis.algebraic}-fold {noun}", format_pair(diagnosis.re, diagnosis.im, 5), diagnosis.kind
    full = level != "brief"
    yield Sentence(_describe_root(diagnosis), tone="answer")
    yield _describe_splitting(diagnosis, full)
    if full:
        yield TableBlock(_list_laws(diagnosis), "How the root splits")


def _describe_root(diagnosis: Diagnosis) -> str:
    vectors = count_things(diagnosis.geometric, "independent eigenvector")
    if diagnosis.jordan is None:
        reason = "no eigenvectors are known, so one Jordan chain is assumed, as for a companion matrix"
    else:
        jordan = diagnosis.jordan
        zero = f"{jordan.zero:.1g}" if jordan.zero > _SMALLEST_SHOWN else f"less than {_SMALLEST_SHOWN:g}"
        zero_text = f"is {zero} and counts"
        if diagnosis.geometric > 1:
            zero_text = f"{diagnosis.geometric} are at most {zero} and count"
        reason = vectors + (f" instead of {diagnosis.algebraic}" if diagnosis.geometric < diagnosis.algebraic else "")
        reason += f"; singular values of the matrix, divided by the largest: the smallest {zero_text} as 0"
        reason += f", the next is {jordan.nonzero:.2g}" if jordan.nonzero < math.inf else ""
    lengths = ", ".join(map(str, diagnosis.partial))
    plural = "s" if len(diagnosis.partial) > 1 else ""
    chains = f"Jordan chain{plural} of length {lengths}" if diagnosis.partial else "chains not decided"
    noun = "pair" if diagnosis.im else "root"
    noun = noun if diagnosis.eigenfrequency is None else "eigenfrequency"
    return f"{diagnosis.algebraic}-fold {noun} {format_root(diagnosis, 8)}: {diagnosis.kind}, {chains} ({reason})"


def _describe_splitting(diagnosis: Diagnosis, full: bool) -> str:
    """Describe how each parameter moves the root, the most sensitive first; if `full`, only the most sensitive."""
    moving_responses = [r for r in diagnosis.responses if r.laws]
    unresolved_names = [r.parameter for r in diagnosis.responses if r.unresolved]
    unmoved_names = [r.parameter for r in diagnosis.responses if not (r.laws or r.unresolved)]
    other_laws = [
        f"{r.parameter}{'' if r.relative else ' (absolute)'} by {_describe_laws(r, diagnosis)}"
        for r in moving_responses[1:]
    ]
    parts: list[str] = []
    if moving_responses:
        first = moving_responses[0]
        change = "relative change" if first.relative else "change"
        first_law = f"a {change} ε of {first.parameter} moves it by {_describe_laws(first, diagnosis)}"
        accuracy = f"with an error below {100 * DEVIATION:.0f} % {_describe_range(first.laws[0])} (tested at some ε)"
        parts = [
            f"{first_law}, {accuracy}",
            *([] if full else other_laws),
        ]
    if unmoved_names:
        verb = "does" if len(unmoved_names) == 1 else "do"
        never_moves = len(unmoved_names) == len(diagnosis.responses)
        parts.append("no parameter moves it" if never_moves else f"{', '.join(unmoved_names)} {verb} not move it")
    if unresolved_names:
        parts.append(f"not resolved for {', '.join(unresolved_names)}: {_UNRESOLVED}")
    return "; ".join(parts)


def _describe_laws(response: Response, diagnosis: Diagnosis) -> str:
    return " and ".join(
        _format_law(law)
        + (f" ({law.branches.roots} of {diagnosis.algebraic})" if law.branches.roots < diagnosis.algebraic else "")
        for law in response.laws
    )


def _format_law(law: Law) -> str:
    exponent = str(law.branches.exponent)
    power = "ε" if exponent == "1" else f"ε^({exponent})" if "/" in exponent else f"ε^{exponent}"
    return f"{law.branches.prefactor:.3g} {power}"


def _describe_range(law: Law) -> str:
    lower = f"|ε| >= {law.least:.2g} and " if law.least else ""
    return f"while {lower}|ε| <= {min(law.below, law.above):.2g}"


def _list_laws(diagnosis: Diagnosis) -> list[Row]:
    rows: list[Row] = [("parameter", "change", "roots", "shift", "holds for ε < 0", "holds for ε > 0")]
    for response in diagnosis.responses:
        change = "relative" if response.relative else "absolute"
        for law in response.laws:
            lower = f"{law.least:.2g} <= " if law.least else ""
            ends = (f"{lower}|ε| <= {x:.2g}" for x in (law.below, law.above))
            rows.append((response.parameter, change, str(law.branches.roots), _format_law(law), *ends))
        for root_count, text in ((response.unmoved, "no shift"), (response.unresolved, "not resolved")):
            rows += [(response.parameter, change, str(root_count), text, "", "")] if root_count else []
    return rows
