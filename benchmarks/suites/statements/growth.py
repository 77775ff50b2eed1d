"""Roots on the imaginary axis: the motion grows by a power of t exactly where Jordan chains are longer than one vector.

The truth is the size of the largest Jordan block on the axis, read from matrices that are in Jordan form, or diagonal,
or in a closed form; of coefficients, the multiplicity, for p(d/dt) y = 0 has the solutions t^(k−1) e^(st).
"""

import re
from functools import partial

from benchmarks.suites.statements.case import Answer, Case

_JSON, _TEXT = ("solve", "problem.toml", "--json"), ("solve", "problem.toml")
_POWERS = {1: "", 2: "t", 3: "t^2", 4: "t^3"}
_CALM = ("neither decay nor growth", "neither loss nor gain")


def _said(answer: Answer, block: int) -> str:
    """What JSON says that is false."""
    data, power = answer.data, _POWERS[block]
    if data["stable"]:
        return "it is called stable"
    if data.get("growth", "") != power:
        return f"growth is {data.get('growth')!r}, not {power!r}"
    grows = {root.get("growth") for root in data["roots"]} - {None}
    if grows != ({power} if power else set()):
        return f"the roots grow as {grows}"
    return "" if data["verdict"] == ("growing" if power else "marginally stable") else f"verdict {data['verdict']}"


def _told(answer: Answer, block: int) -> str:
    """What the report says that is false; all systems here are exact in fractions."""
    text, power = answer.stdout, _POWERS[block]
    first = text.splitlines()[1]
    if "as far as rounding tells" in text:
        return "it doubts what fractions prove"
    if not power:
        return "" if "marginally stable" in first and not re.search(r"grow(s|ing) as", text) else f"headline: {first}"
    if any(words in text for words in _CALM):
        return "it says that nothing grows"
    return "" if re.search(rf"growing as {re.escape(power)}(\W|$)", first) else f"headline: {first}"


_SYSTEMS = (
    ("free particle", 'M = [[1]]\nK = [["k"]]', "k = 0", 2),
    ("charge in a magnetic field", 'M = [[1, 0], [0, 1]]\nD = [[0, "g"], ["-g", 0]]\nK = [[0, 0], [0, 0]]', "g = 1", 1),
    ("chain of four", 'A = [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], ["z", 0, 0, 0]]', "z = 0", 4),
    ("chains of three and one", 'A = [[0, 1, 0, 0], [0, 0, 1, 0], ["z", 0, 0, 0], [0, 0, 0, 0]]', "z = 0", 3),
    ("1:1 resonance", 'M = [[1, 0], [0, 1]]\nK = [[1, "c"], [0, 1]]', "c = 1", 2),
    ("two equal oscillators", 'M = [[1, 0], [0, 1]]\nK = [["k", 0], [0, "k"]]', "k = 4", 1),
    ("one oscillator", 'M = [["m"]]\nK = [[9]]', "m = 2", 1),
    ("real double eigenfrequency of H", 'H = [["w", 1], [0, "w"]]', "w = 2.5", 2),
    ("H with a block of three", 'H = [["w", 1, 0], [0, "w", 1], [0, 0, "w"]]', "w = -1", 3),
    ("diagonal H", 'H = [["w", 0], [0, "w"]]', "w = 2.5", 1),
    ("PT-symmetric dimer at its threshold", 'H = [["1j*g", 1.25], [1.25, "-1j*g"]]', "g = 1.25", 2),
    ("free mass by a dragged one", 'M = [[1, 0], [0, 1]]\nD = [[0, 0], [0, "c"]]\nK = [[0, 0], [0, 0]]', "c = 1", 2),
    ("dragged mass", 'M = [[1]]\nD = [["c"]]\nK = [[0]]', "c = 3", 1),
    ("coefficients of s^2", 'coefficients = [1, 0, "k"]', "k = 0", 2),
    ("coefficients of (s^2 + 1)^2", 'coefficients = [1, 0, "2*w", 0, "w*w"]', "w = 1", 2),
    ("coefficients of s^3", 'coefficients = [1, 0, 0, "k"]', "k = 0", 3),
    ("coefficients of s^2 + 4", 'coefficients = [1, 0, "k"]', "k = 4", 1),
    (
        "double imaginary pair with one vector",
        'A = [[0, "w", 1, 0], ["-w", 0, 0, 1], [0, 0, 0, "w"], [0, 0, "-w", 0]]',
        "w = 2",
        2,
    ),
    (
        "three equal oscillators",
        'M = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nK = [["k", 0, 0], [0, "k", 0], [0, 0, "k"]]',
        "k = 1",
        1,
    ),
    ("onset of flutter", 'M = [[1, 0], [0, 1]]\nK = [[1, "p"], ["-p", 2]]', "p = 0.5", 2),
    ("block of two beside a loss", 'H = [[1, 1, 0], [0, 1, 0], [0, 0, "-1j*g"]]', "g = 0.3", 2),
    (
        "two equal pairs beside a damped one",
        "M = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
        'D = [[0, 0, 0], [0, 0, 0], [0, 0, "c"]]\nK = [[2, 0, 0], [0, 2, 0], [0, 0, 1]]',
        "c = 0.5",
        1,
    ),
)
"""Name, model, parameters, size of the largest Jordan block on the axis."""

CASES: tuple[Case, ...] = tuple(
    Case(
        f"{name}, {kind}",
        {"problem.toml": f"[model]\n{model}\n[parameters]\n{parameters}\n"},
        arguments,
        partial(judge, block=block),
        f"largest Jordan block on the axis: {block}",
    )
    for name, model, parameters, block in _SYSTEMS
    for kind, arguments, judge in (("JSON", _JSON, _said), ("report", _TEXT, _told))
)
