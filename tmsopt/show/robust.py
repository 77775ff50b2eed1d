"""The robustness of a design as text."""

import math

from tmsopt.margins.nearest import Nearest, Robustness
from tmsopt.show.text import columns

_MAIN = 0.5
"""Share of the largest change above which a parameter is named in the headline."""

_WIDE = 12
"""Parameters up to which each has a column; of more, each has a row."""

_WORDS = {
    "weave": "weave",
    "capsize": "capsize",
    "infinity": "a root through infinity (a0 = 0)",
}


def robustness_line(found: Robustness) -> str:
    """One sentence: how far, to what, and mostly by which parameters."""
    limit = found.limit
    if not limit.found:
        return f"robustness: no boundary of stability found; the design is {'' if found.stable else 'not '}stable"
    where = _WORDS[limit.kind] + _mostly(limit)
    if not found.stable:
        return f"robustness: none, the design is not stable; {_size(found)} to stability through {where}"
    return f"robustness: {_size(found)} to {where}"


def robustness_table(found: Robustness) -> str:
    """The sentence, then the nearest point of every boundary: its distance and the change of each parameter."""
    names = list(found.weights)
    kinds = (found.weave, found.capsize, found.infinity, found.heavy_damping)
    rows: list[tuple[str, ...]] = [("relative changes" if found.relative else "changes in weights", "distance", *names)]
    for n in kinds:
        moves = (f"{n.direction[name]:+.2%}" for name in names) if n.found else ["" for _ in names]
        rows.append((_row(n, found), _percent(n.distance) if n.found else "none found", *moves))
    rows.append(("weight", "", *(f"{found.weights[name]:.6g}" for name in names)))
    for n in kinds:
        if n.found and n.distance > 0:
            rows.append((f"at {n.kind}", "", *(f"{n.parameters[name]:.8g}" for name in names)))
    if len(names) > _WIDE:
        rows = list(zip(*rows, strict=True))
    return "\n".join(line.rstrip() for line in [robustness_line(found), "", *columns(rows)])


def _row(n: Nearest, found: Robustness) -> str:
    if n.kind != "heavy damping":
        return f"to {n.kind}"
    return "out of heavy damping" if found.heavily_damped else "into heavy damping"


def _mostly(limit: Nearest) -> str:
    """The parameters that change most, signed."""
    changes = sorted(limit.direction.items(), key=lambda item: -abs(item[1]))
    largest = abs(changes[0][1])
    named = [f"{n} {_percent(x, '+')}" for n, x in changes if largest > 0 and abs(x) >= _MAIN * largest]
    return f" (mostly {', '.join(named)})" if named else ""


def _size(found: Robustness) -> str:
    if found.relative:
        return f"{_percent(found.limit.distance)} relative change"
    return f"change of {found.limit.distance:.4g} in weights"


def _percent(x: float, sign: str = "") -> str:
    """Two significant digits at least."""
    digits = 1 if x == 0 else max(1 - math.floor(math.log10(abs(100 * x))), 0)
    return f"{100 * x:{sign}.{digits}f} %"
