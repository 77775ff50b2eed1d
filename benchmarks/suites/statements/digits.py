"""Numbers as they are printed: every digit holds, 0 reads 0, nothing internal is named, no warning is heard."""

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from mpmath import mp

from benchmarks.suites.statements.case import Answer, Case

_DIGITS = 50
_NUMBER = re.compile(r"^-?\d+(?:\.(\d+))?(?:e([+-]\d+))?$")
_NOTHING = re.compile(r"(?<![\d.\w])[-−]?\d(?:\.\d+)?e-(?:1[4-9]|[2-9]\d|\d{3})(?![\d])")
_OUTSIDE = ("search", "robustness", "rounding", "proof")
"""Sections in which sizes of rounding are told."""


def _unit(text: str) -> Any:
    """One unit of the last digit of a number in text."""
    found = _NUMBER.match(text)
    if not found:
        raise ValueError(f"no number: {text}")
    return mp.mpf(10) ** (int(found[2] or 0) - len(found[1] or ""))


def _rows(text: str) -> dict[str, list[str]]:
    """Name → cells of a table of all designs."""
    cells = (line.split() for line in text.splitlines() if line.startswith("  "))
    return {row[0]: row[1:] for row in cells if len(row) > 1}


def _of_all(truth: Callable[[], Sequence[Mapping[str, Any]]], answer: Answer) -> str:
    """Every number of every solution is that of a true one, to one unit of its last digit."""
    with mp.workdps(_DIGITS):
        rows, known = _rows(answer.stdout), truth()
        names = [n for n in known[0] if n in rows]
        count = len(rows[names[0]])
        if count != len(known):
            return f"{count} solutions, not {len(known)}"
        for k in range(count):
            cells = {n: rows[n][k] for n in names}
            near = min(known, key=lambda t: max(abs(mp.mpf(cells[n]) - t[n]) for n in names))
            for n, cell in cells.items():
                if abs(mp.mpf(cell) - near[n]) > _unit(cell):
                    return f"{n} = {cell} for {mp.nstr(near[n], 15)}"
        return ""


def _zeros(answer: Answer) -> str:
    """No rounding stands for 0, but where sizes of rounding are told."""
    section = ""
    for line, below in zip(answer.stdout.splitlines(), [*answer.stdout.splitlines()[1:], ""], strict=True):
        section = line if below and set(below) == {"-"} else section
        if section not in _OUTSIDE and (found := _NOTHING.search(line.replace("below 1e-16", ""))):
            return f"{found[0]} in: {line.strip()}"
    return "" if answer.stdout else "nothing was printed"


def _names(answer: Answer) -> str:
    inner = re.search(r"^  (?:\w+\.)?[bcdW]\d+ .*", answer.stdout, re.M)
    return inner[0].strip() if inner else "" if "proved" in answer.stdout else "nothing was proved"


def _silent(answer: Answer) -> str:
    found = re.search(r".*Warning.*", answer.stderr)
    return found[0] if found else ""


def _case(name: str, text: str, judge: Callable[[Answer], str], truth: str, *arguments: str) -> Case:
    return Case(name, {"system.toml": text}, (arguments[0], "system.toml", *arguments[1:]), judge, truth)


def _file(model: str, parameters: Mapping[str, Any], objective: str = "") -> str:
    each = "".join(
        f"{n} = {{ min = {x[0]}, max = {x[1]} }}\n" if isinstance(x, tuple) else f"{n} = {x}\n"
        for n, x in parameters.items()
    )
    return f"[model]\n{model}\n\n[parameters]\n{each}" + (f"\n[objective]\n{objective}\n" if objective else "")


def _dampings(k: str) -> list[dict[str, Any]]:
    """(s ± √k)²."""
    root = mp.sqrt(mp.mpf(k))
    return [{"c": 2 * root, "abscissa": -root}, {"c": -2 * root, "abscissa": root}]


def _triple(k: str) -> list[dict[str, Any]]:
    """(s + r)³ = s³ + c s² + d s + k."""
    root = mp.cbrt(mp.mpf(k))
    return [{"c": 3 * root, "d": 3 * root**2, "abscissa": -root}]


def _dimer(a: str, b: str) -> list[dict[str, Any]]:
    """k = ± (a − b)/2 at d = 0."""
    half = (mp.mpf(a) - mp.mpf(b)) / 2
    return [{"k": sign * half, "d": mp.mpf(0), "abscissa": -(mp.mpf(a) + mp.mpf(b)) / 2} for sign in (1, -1)]


def _pencil() -> list[dict[str, Any]]:
    """Where the discriminant of a cubic vanishes, by Newton's method from three digits."""

    def discriminant(x: Any, y: Any) -> list[Any]:
        A = mp.matrix(
            [
                [1 + mp.mpf("0.3") * x, mp.mpf("0.2") + x / 2 + mp.mpf("0.1") * 1j * y, mp.mpf("0.4")],
                [mp.mpf("0.7") - mp.mpf("0.2") * 1j * y, mp.mpf("-0.5") + 1j * x, mp.mpf("0.3") * y],
                [mp.mpf("0.1"), mp.mpf("0.6") * x, mp.mpf("0.2") - 1j * y],
            ]
        )
        square = A * A
        b = -sum(A[i, i] for i in range(3))
        c = (b * b - sum(square[i, i] for i in range(3))) / 2
        d = -mp.det(A)
        z = b * b * c * c - 4 * c**3 - 4 * b**3 * d - 27 * d * d + 18 * b * c * d
        return [z.real, z.imag]

    starts = ((-0.753, -0.333), (0.918, -0.888), (-0.970, 0.797))
    return [dict(zip("xy", mp.findroot(discriminant, s), strict=True)) for s in starts]


_RANGE = (-20, 20)
_PENCIL = (
    'H = [["1+0.3*x","0.2+0.5*x+0.1j*y",0.4],["0.7-0.2j*y","-0.5+1j*x","0.3*y"],[0.1,"0.6*x","0.2-1j*y"]]',
    {"x": (-3, 3), "y": (-3, 3)},
)
_SYSTEMS = {
    "trimer": _file('H = [["d + 1j*g", 1, 0], [1, 0, 1], [0, 1, "-1j*g"]]', {"g": (0.5, 2), "d": 0}, 'locate = "EP3"'),
    "spin chain": _file(
        'H = [["1.5j*g", "sqrt(3)/2", 0, 0], ["sqrt(3)/2", "0.5j*g", 1, 0], [0, 1, "-0.5j*g", "sqrt(3)/2"], '
        '[0, 0, "sqrt(3)/2", "-1.5j*g"]]',
        {"g": (0.5, 1.5)},
        'locate = "EP4"',
    ),
    "one-way pair": _file('H = [["a + 1j*b", 1], [0, 0]]', {"a": (-1, 1), "b": (-1, 1)}, 'locate = "EP2"'),
    "oscillators with gain and loss": _file(
        'M = [[1, 0], [0, 1]]\nD = [["g", 0], [0, "-g"]]\nK = [[1, "k"], ["k", 1]]',
        {"g": (0.3, 0.9), "k": 0.6},
        'locate = "CEP2"',
    ),
    "dimer": _file(
        'H = [["d - 1j*a", "k"], ["k", "-1j*b"]]', {"d": (-1, 1), "k": (0.05, 2), "a": 1.3, "b": 0.1}, 'locate = "EP2"'
    ),
}
_NASTY = {
    "tiny coefficients": (
        _file('coefficients = [1, "1e-200*c", "1e-300*k"]', {"c": (0, 2), "k": (0, 2)}, 'minimize = "abscissa"'),
        ("solve", "--full"),
    ),
    "a power beyond doubles": (
        _file('coefficients = [1, "c", "x**200"]', {"c": (0, 2), "x": (0, 100)}, 'minimize = "abscissa"'),
        ("chart", "--points", "40x30"),
    ),
    "growth over a pole": (
        _file('A = [["a", 1, 0], ["b", -1, 1], [0, "1/a", -2]]', {"a": (-1, 1), "b": (-3, 3)}, 'minimize = "abscissa"'),
        ("solve", "--plot", "growth.png"),
    ),
    "growth over an arc": (
        _file('coefficients = [1, "acos(x)", 1]', {"x": (-2, 2)}, 'maximize = "damping_ratio"'),
        ("solve", "--plot", "growth.png"),
    ),
    "growth over a logarithm": (
        _file('coefficients = [1, "log(x)", 1]', {"x": (-1, 30)}, 'maximize = "damping_ratio"'),
        ("solve", "--plot", "growth.png"),
    ),
    "a chart beside a pole": (
        _file('coefficients = [1, "a", "b", "a*b/(a-b)"]', {"a": (0, 3), "b": (0, 3)}, 'maximize = "damping_ratio"'),
        ("chart", "--points", "40x30"),
    ),
}

CASES: tuple[Case, ...] = (
    *(
        _case(
            f"all of s² + c s + {k}",
            _file(f'coefficients = [1, "c", "{k}"]', {"c": _RANGE}, 'locate = "EP2"'),
            partial(_of_all, partial(_dampings, k)),
            "(s ± √k)²",
            "solve",
            "--all",
        )
        for k in ("2", "0.1", "1e-6")
    ),
    *(
        _case(
            f"all of s² + c s + {k}, by a search",
            _file(f'coefficients = [1, "c", "{k}"]', {"c": _RANGE}, 'locate = "EP2"'),
            partial(_of_all, partial(_dampings, k)),
            "(s ± √k)²",
            "solve",
            "--all",
            "--seconds",
            "0.01",
        )
        for k in ("3", "0.7")
    ),
    _case(
        "all of a cubic, by a search",
        _file('coefficients = [1, "c", "d", 5]', {"c": _RANGE, "d": _RANGE}, 'locate = "EP3"'),
        partial(_of_all, partial(_triple, "5")),
        "(s + r)³",
        "solve",
        "--all",
        "--seconds",
        "0.01",
    ),
    _case(
        "all of a dimer, by a search",
        _file(
            'H = [["d - 1j*a", "k"], ["k", "-1j*b"]]',
            {"d": (-1, 1), "k": (-2, 2), "a": 1.3, "b": 0.1},
            'locate = "EP2"',
        ),
        partial(_of_all, partial(_dimer, "1.3", "0.1")),
        "k = ±(a − b)/2",
        "solve",
        "--all",
        "--seconds",
        "0.01",
    ),
    _case(
        "all of a pencil, by a search",
        _file(*_PENCIL, 'locate = "EP2"'),
        partial(_of_all, _pencil),
        "discriminant at 50 digits",
        "solve",
        "--all",
        "--seconds",
        "0.01",
    ),
    *(_case(f"zeros of a {n}", text, _zeros, "0 by symmetry", "solve", "--full") for n, text in _SYSTEMS.items()),
    *(
        _case(
            f"names in a proof of an EP3 of degree {n}",
            _file(
                f"coefficients = {[1, *'abefh'[: n - 1], 1]!s}".replace("'", '"'),
                dict.fromkeys("abefh"[: n - 1], (0, 9)),
                'locate = "EP3"',
            ),
            _names,
            "roots are listed instead",
            "prove",
        )
        for n in (5, 6)
    ),
    *(_case(name, text, _silent, "no warning, no traceback", *command) for name, (text, command) in _NASTY.items()),
)
