"""What was meant by an expression that does not read as one, written as it should be."""

import re
from collections.abc import Callable, Iterable

from tmsopt.models.names import MEANT

_NUMBER = r"(?<![\w.])(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)"
_UNITS = {
    "mm": 1e-3,
    "cm": 0.01,
    "km/h": 5 / 18,
    "km": 1e3,
    "m/s": 1,
    "m": 1,
    "kg": 1,
    "ms": 1e-3,
    "s": 1,
    "kN": 1e3,
    "N": 1,
    "Hz": 1,
}
"""What others write behind a number → what one of it is in an expression; a g may be the gravity."""

_SIGNS = {
    "=>": ">=",
    "=<": "<=",
    "≤": "<=",
    "≥": ">=",
    "≈": "==",
    "−": "-",
    "–": "-",
    "×": "*",
    "·": "*",
    "÷": "/",
    "²": "**2",
    "³": "**3",
    "^": "**",
    "√": "sqrt",
    "π": "pi",
    "λ": "lambda_s",
    "ζ": "zeta",
    "χ": "chi",
    "ν": "nu",
    "μ": "mu",
    "µ": "mu",
    "ω": "omega",
    "omega_0": "omega0",
    "lambda_s_s": "lambda_s",
}

_CALLS = {
    "ln": "log(x)",
    "log10": "log(x)/log(10)",
    "cosh": "(exp(x) + exp(-x))/2",
    "sinh": "(exp(x) - exp(-x))/2",
    "tanh": "1 - 2/(exp(2*x) + 1)",
    "fabs": "abs(x)",
    "pow": "x**y",
    "cot": "1/tan(x)",
    **{f"arc{name}": f"a{name}(x)" for name in ("sin", "cos", "tan")},
    **dict.fromkeys(("re", "Re", "real"), "abscissa for the largest real part of the roots; expressions are real"),
    **dict.fromkeys(("im", "Im", "imag"), "angular_frequency for the largest |Im s|; expressions are real"),
    **dict.fromkeys(("eig", "eigs", "eigvals", "eigenvalues", "roots"), "abscissa for the largest real part of them"),
}
"""Functions that others have → what to write."""

Repair = tuple[str, str | Callable[[re.Match[str]], str]]


def _converted(found: re.Match[str]) -> str:
    return f"{float(found[1]) * _UNITS[found[2]]:.12g}"


_REPAIRS: tuple[Repair, ...] = (
    *((re.escape(sign), meant) for sign, meant in _SIGNS.items()),
    (r"(?<![<>=!])=(?!=)", "=="),
    (r"([<>])(?!=)", r"\1="),
    (r"(?<=\d),(?=\d)", "."),
    (_NUMBER + r"\s*%", lambda found: f"{float(found[1]) / 100:.12g}"),
    (_NUMBER + r"\s*(?:°|deg\b|degrees?\b)", r"\1*pi/180"),
    (_NUMBER + r"\s*rad\b", r"\1"),
    (_NUMBER + rf"\s*({'|'.join(_UNITS)})\b(?!\s*/)", _converted),
    (_NUMBER + r"\s*(?=(?!j\b)[A-Za-z(])", r"\1*"),
)
"""What others write → what is read here, one after the other."""

_WITH_UNIT = re.compile(_NUMBER + rf"\s*({'|'.join(_UNITS)}|deg|°)(?!\w)")


def call_advice(name: str, arguments: Iterable[str]) -> str:
    """The end of a sentence that says what to write for a function that there is not; empty likewise."""
    meant = f"write {_CALLS[name]}" if name in _CALLS else MEANT["t"] if "t" in arguments else ""
    return f"; {meant}" if meant else ""


def advice(text: str, reads: Callable[[str], bool]) -> str:
    """The end of a sentence that says what to write for a text that is refused; empty where that is not known.

    Args:
        reads: whether a text parses.
    """
    if re.search(r"\d[jJ]\b", text):
        return (
            "; expressions are real: write real and imaginary parts as numbers of their own; a complex matrix goes in H"
        )
    if missing := text.count("(") - text.count(")"):
        return f"; a {'()'[missing > 0]} is missing"
    mended = text.strip()
    for sign, meant in _REPAIRS:
        mended = re.sub(sign, meant, mended)
    if mended == text.strip() or not mended.isascii() or "inf" in mended or not reads(mended):
        return ""
    units = " (numbers in expressions are in m, kg, s, rad and N)" if _WITH_UNIT.search(text) else ""
    return f"; write '{mended}'{units}"
