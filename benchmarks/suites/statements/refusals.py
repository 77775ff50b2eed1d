"""What a problem that cannot be read is told: the cause, and a way out; and numbers that can be read, exactly."""

import json
from collections.abc import Callable
from fractions import Fraction

from mpmath import mp

from benchmarks.suites.statements.case import Answer, Case

_DIGITS = 60


def _file(model: str, parameters: str, constraints: str = "", objective: str = 'minimize = "abscissa"') -> str:
    limits = f"[constraints]\n{constraints}\n" if constraints else ""
    return f"[model]\n{model}\n[parameters]\n{parameters}\n[objective]\n{objective}\n{limits}"


def _refusal(*words: str, never: tuple[str, ...] = ()) -> Callable[[Answer], str]:
    """Refused with exit status 2, all the words said and none of the others."""

    def judge(answer: Answer) -> str:
        if answer.status != 2:
            return f"not refused: status {answer.status}"
        missing = [w for w in words if w not in answer.stderr]
        wrong = [w for w in never if w in answer.stderr]
        return f"does not say {missing}" if missing else f"says {wrong}" if wrong else ""

    return judge


_C, _K = "c = { min = 0, max = 2 }", "k = 1.0"
_NO_PARAMETER = ("write e.g. s = ",)

_REFUSED: tuple[tuple[str, str, Callable[[Answer], str], str], ...] = (
    (
        "delay in a coefficient",
        _file('coefficients = [1, "c", "k*exp(-s*tau)"]', f"{_C}\n{_K}\ntau = 1.0"),
        _refusal("delay", "outside", "Padé", never=_NO_PARAMETER),
        "s² + cs + k e^(−sτ) is no polynomial",
    ),
    (
        "delay in A",
        _file('A = [["-c", "exp(-s*tau)"], [1, 0]]', f"{_C}\ntau = 0.5"),
        _refusal("delay", "outside", never=_NO_PARAMETER),
        "a matrix that depends on its eigenvalue",
    ),
    (
        "delay in K",
        _file('M = [[1]]\nD = [["c"]]\nK = [["k + exp(-s*tau)"]]', f"{_C}\n{_K}\ntau = 0.5"),
        _refusal("delay", "outside", never=_NO_PARAMETER),
        "the same of second order",
    ),
    (
        "viscoelastic entry",
        _file('M = [[1]]\nK = [["k*(1 + c/(s + 1))"]]', f"{_C}\n{_K}"),
        _refusal("nonlinear eigenproblem", never=_NO_PARAMETER),
        "rational in s: a nonlinear eigenproblem",
    ),
    (
        "polynomial in s",
        _file('coefficients = "s**2 + c*s + k"', f"{_C}\n{_K}"),
        _refusal("descending powers of s"),
        "coefficients are a list",
    ),
    (
        "eigenvalue as lambda",
        _file('coefficients = [1, "c", "exp(-lambda*tau)"]', f"{_C}\ntau = 1.0"),
        _refusal("nonlinear eigenproblem", "cannot treat"),
        "λ is the eigenvalue where there is no bicycle",
    ),
    (
        "eigenfrequency in H",
        _file('H = [["exp(-omega*tau)", 1], [1, "-1j*c"]]', f"{_C}\ntau = 1.0"),
        _refusal("eigenfrequency", "nonlinear eigenproblem"),
        "H that depends on its eigenvalue",
    ),
    (
        "time",
        _file('coefficients = [1, "c", "k + cos(t)"]', f"{_C}\n{_K}"),
        _refusal("time", "outside"),
        "a Mathieu equation has no characteristic polynomial",
    ),
    (
        "function of time",
        _file('A = [["-c", "k(t)"], [1, 0]]', _C),
        _refusal("time", "outside"),
        "coefficients that change",
    ),
    (
        "discrete time",
        _file('coefficients = [1, "c", "k + 1/z"]', f"{_C}\n{_K}"),
        _refusal("discrete time", "(1 + s)/(1 - s)"),
        "|z| < 1 is Re s < 0 under z = (1 + s)/(1 − s)",
    ),
    (
        "imaginary unit I",
        _file('A = [["I*c", 1], [0, "-c"]]', _C),
        _refusal("imaginary unit", "1j", "H"),
        "real matrices",
    ),
    (
        "Euler's number",
        _file('coefficients = [1, "c", "k*e**c"]', f"{_C}\n{_K}"),
        _refusal("exp(1)"),
        "e = exp(1)",
    ),
    (
        "flat matrix",
        _file('A = [0, 1, "-k", "-c"]', f"{_C}\n{_K}"),
        _refusal("[[0, 1], ['-k', '-c']]"),
        "four entries are two rows of two",
    ),
    (
        "chained comparison",
        _file('coefficients = [1, "c", "k"]', f"{_C}\n{_K}", 'a = "0.1 < c <= 1"'),
        _refusal("'0.1 <= c' and 'c <= 1'"),
        "both together say the same",
    ),
    (
        "largest of one",
        _file('coefficients = [1, "c", "k"]', f"{_C}\n{_K}", 'a = "max(abs(c)) <= 1"'),
        _refusal("abs(c) alone"),
        "max of one number is the number",
    ),
    (
        "largest real part",
        _file('coefficients = [1, "c", "k"]', f"{_C}\n{_K}", 'a = "real(c) <= 1"'),
        _refusal("abscissa"),
        "its name here",
    ),
    (
        "s in a constraint",
        _file('coefficients = [1, "c", "k"]', f"{_C}\n{_K}", 'a = "s <= -0.1"'),
        _refusal("eigenvalue", "abscissa"),
        "its name here",
    ),
    (
        "hyperbolic cosine",
        _file('coefficients = [1, "c", "cosh(k)"]', f"{_C}\n{_K}"),
        _refusal("(exp(x) + exp(-x))/2"),
        "its definition",
    ),
)

_NUMBERS: tuple[tuple[str, Callable[[], object]], ...] = (
    ("8/3", lambda: mp.mpf(8) / 3),
    ("sqrt(2)/2", lambda: mp.sqrt(2) / 2),
    ("2*pi/3", lambda: 2 * mp.pi / 3),
    ("exp(1)", lambda: mp.e),
    ("1/7 + 1/11", lambda: mp.mpf(18) / 77),
    ("0.1234567890123456789012345", lambda: mp.mpf("0.1234567890123456789012345")),
)
"""Constants k of s² + cs + k, which has a double root at c = 2√k."""


def _proved(truth: Callable[[], object]) -> Callable[[Answer], str]:
    def judge(answer: Answer) -> str:
        if answer.status != 0:
            return f"not proved: status {answer.status}: {answer.stderr.strip()[:80]}"
        c = json.loads(answer.stdout)["parameters"]["c"]
        with mp.workdps(_DIGITS):
            off = abs(Fraction(mp.nstr(2 * mp.sqrt(truth()), _DIGITS - 5)) - Fraction(c["value"]))
        return "" if off <= Fraction(c["radius"]) < Fraction(1, 10**25) else f"c is off by {float(off):.1e}"

    return judge


CASES: tuple[Case, ...] = (
    *(Case(name, {"file.toml": text}, ("solve", "file.toml"), judge, why) for name, text, judge, why in _REFUSED),
    *(
        Case(
            f'k = "{text}"',
            {
                "file.toml": _file(
                    'coefficients = [1, "c", "k"]',
                    f'c = {{ min = 0, max = 9 }}\nk = "{text}"',
                    objective='locate = "EP2"',
                )
            },
            ("prove", "file.toml", "--json"),
            _proved(truth),
            "c = 2√k by mpmath, 60 digits",
        )
        for text, truth in _NUMBERS
    ),
)
