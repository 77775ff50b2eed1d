"""What the multiple roots of a design are, as lines for a reader."""

from collections.abc import Sequence

from tmsopt.diagnosis.diagnosis import Diagnosis
from tmsopt.diagnosis.splitting import DEVIATION, Law, Response
from tmsopt.show.text import columns

_ROUNDING = 1e-16


def diagnosis_lines(diagnoses: Sequence[Diagnosis], details: bool = False) -> list[str]:
    """Two sentences for each multiple root: what it is, and how it splits; the laws of every parameter as details."""
    lines: list[str] = []
    for found in diagnoses:
        lines += [_kind(found), *_splitting(found)]
        if details:
            lines += ["", *(f"  {line}".rstrip() for line in columns(_rows(found))), ""]
    return lines[:-1] if details and lines else lines


def _kind(found: Diagnosis) -> str:
    place = f"{found.re:.8g}" + (f" ± {found.im:.8g}i" if found.im else "")
    vectors = f"{found.geometric} independent eigenvector" + ("s" if found.geometric > 1 else "")
    if found.jordan is None:
        why = "there are no matrices to judge by, so one chain, as a companion matrix has"
    else:
        zero = f"{found.jordan.zero:.1g}" if found.jordan.zero > _ROUNDING else f"below {_ROUNDING:g}"
        why = f"{vectors}: relative singular value {zero}"
        why += f" beside {found.jordan.nonzero:.2g}" if found.jordan.nonzero < float("inf") else ", and no other"
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


def _rows(found: Diagnosis) -> list[Sequence[str]]:
    rows: list[Sequence[str]] = [("parameter", "change", "roots", "shift", "holds for ε < 0", "holds for ε > 0")]
    for response in found.responses:
        rows += [_row(response, law) for law in response.laws]
        if response.unmoved:
            rows.append((response.parameter, _change(response), str(response.unmoved), "none", "", ""))
    return rows


def _row(response: Response, law: Law) -> tuple[str, ...]:
    ends = (f"|ε| <= {x:.2g}" if x else "nowhere sampled" for x in (law.below, law.above))
    return (response.parameter, _change(response), str(law.branches.roots), _law(law), *ends)


def _change(response: Response) -> str:
    return "relative" if response.relative else "absolute"
