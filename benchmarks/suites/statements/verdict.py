"""One severity, one verdict: the lines of an answer agree with each other and with the truth."""

import re
from functools import partial

from benchmarks.suites.statements.case import Answer, Case

_SOLVE, _FULL = ("solve", "problem.toml"), ("solve", "problem.toml", "--full")
_SIGNED = r"(least loss|gain|decay time|growth time) [\d.e+-]+"


def _growing(answer: Answer) -> str:
    """The one-way coupled H is exceptional at a = b = 0 alone, on the real axis: it grows as t."""
    text = answer.stdout
    if answer.status != 0:
        return f"status {answer.status}"
    if match := re.search(_SIGNED, text):
        return f"a rate where the rate is 0: {match[0]}"
    if "not stable" in text:
        return "not stable beside " + text.splitlines()[4]
    return "" if "growing as t" in text else "it does not say that it grows"


def _without_best(answer: Answer) -> str:
    """The objective improves towards a0 = 0 and reaches nothing there."""
    head = answer.stdout.splitlines()[1]
    if answer.status == 0 or "optimal" in head:
        return f"called the best: {head}"
    return "" if "no best design exists" in head else f"headline: {head}"


def _best(answer: Answer, least: float) -> str:
    text = answer.stdout
    if answer.status != 0:
        return f"status {answer.status}: {text.splitlines()[1]}"
    value = float(re.findall(r"abscissa = (-?[\d.e-]+)", text)[0])
    return "" if abs(value - least) < 1e-6 else f"{value} instead of {least}"


def _words(answer: Answer, wanted: str, unwanted: str) -> str:
    text = answer.stdout
    if wanted not in text:
        return f"'{wanted}' is not said"
    return f"'{unwanted}' is said" if unwanted in text else ""


def _one_way(a: tuple[float, float], b: tuple[float, float], coupling: float, seed: int, full: bool) -> Case:
    text = (
        f'[model]\nH = [["a + 1j*b", {coupling}], [0, 0]]\n[parameters]\n'
        f'a = {{ min = {a[0]}, max = {a[1]} }}\nb = {{ min = {b[0]}, max = {b[1]} }}\n[objective]\nlocate = "EP2"\n'
    )
    arguments = (*(_FULL if full else _SOLVE), "--seed", str(seed))
    name = f"one-way coupled, a in {a}, b in {b}, coupling {coupling}"
    return Case(name, {"problem.toml": text}, arguments, _growing, "eigenvalues a + ib and 0, one vector at a = b = 0")


def _towards(root: float, slope: float, low: float, ends: bool) -> Case:
    """(m s + 1)(s + root − slope m): the abscissa −root + slope m is least at m = 0, where a root is at infinity."""
    text = (
        f'[model]\ncoefficients = ["m", "1 + m*({root} - {slope}*m)", "{root} - {slope}*m"]\n[parameters]\n'
        f'm = {{ min = {low}, max = 0.4 }}\n[objective]\nminimize = "abscissa"\n'
    )
    judge = partial(_best, least=-root + slope * low) if ends else _without_best
    name = f"(m s + 1)(s + {root} - {slope} m), m >= {low}"
    return Case(name, {"problem.toml": text}, _SOLVE, judge, "the abscissa is -root + slope m")


def _axis(name: str, model: str, parameters: str, arguments: tuple[str, ...], wanted: str, unwanted: str) -> Case:
    text = f"[model]\n{model}\n[parameters]\n{parameters}\n"
    return Case(
        name, {"problem.toml": text}, arguments, partial(_words, wanted=wanted, unwanted=unwanted), "closed form"
    )


_SCRIPT = "import tmsopt\nprint(repr(tmsopt.solve('problem.toml')))\n"

CASES: tuple[Case, ...] = (
    *(
        _one_way(*box)
        for box in (
            ((-1, 1), (-1, 1), 1, 0, False),
            ((-2, 3), (-1, 2), 1, 0, False),
            ((-0.7, 1.1), (-0.4, 1.3), 1, 1, True),
            ((-1, 2), (-2, 1), 1, 3, False),
            ((-5, 3), (-3, 4), 1, 2, False),
            ((-2, 1), (-3, 2), 2, 0, True),
            ((-1, 3), (-2, 5), 0.5, 1, False),
            ((-4, 1), (-1, 3), 1, 4, True),
        )
    ),
    *(
        _towards(*what)
        for what in (
            (2, 1, 0, False),
            (2, 1, -0.1, False),
            (5, 2, 0, False),
            (1, 1, 0, False),
            (3, 0.5, 0, False),
            (2, 1, 0.01, True),
            (5, 2, 0.05, True),
            (3, 1, 1e-6, True),
        )
    ),
    _axis("an oscillator, solve", 'M = [[1]]\nK = [["k"]]', "k = 3", _SOLVE, "marginally stable", "not stable"),
    _axis(
        "an oscillator, simulate",
        'M = [[1]]\nK = [["k"]]',
        "k = 3",
        ("simulate", "problem.toml"),
        "marginally stable",
        "not stable",
    ),
    _axis(
        "a real eigenfrequency, simulate",
        'H = [["w", 0], [0, "2*w - 1j"]]',
        "w = 1",
        ("simulate", "problem.toml"),
        "marginally stable",
        "not stable",
    ),
    _axis(
        "a charge that drifts",
        'M = [[1, 0], [0, 1]]\nD = [[0, "g"], ["-g", 0]]\nK = [[0, 0], [0, 0]]',
        "g = 2",
        _SOLVE,
        "marginally stable",
        "(EP2)\n",
    ),
    Case(
        "the line of a notebook",
        {"problem.toml": '[model]\nM = [[1]]\nK = [["k"]]\n[parameters]\nk = 3\n', "show.py": _SCRIPT},
        ("python", "show.py"),
        partial(_words, wanted="marginally stable", unwanted="not stable"),
        "s = ±i√3",
    ),
    Case(
        "the line of a notebook, growing",
        {"problem.toml": '[model]\nM = [[1]]\nK = [["k"]]\n[parameters]\nk = 0\n', "show.py": _SCRIPT},
        ("python", "show.py"),
        partial(_words, wanted="growing as t", unwanted="marginally"),
        "x = a + b t",
    ),
)
