"""Closed forms with constants that no double is: every enclosure that `prove` and `--all` print holds the truth."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from mpmath import mp

from benchmarks.suites.statements.case import Answer, Case

_DIGITS = 60
_WIDEST = 1e-25

Truth = Mapping[str, Callable[[], Any]]
"""Parameter → its value at the working precision."""


def _enclosed(answer: Answer, truth: Truth) -> str:
    """What of a proof is false: an enclosure without the truth, or one too wide to say much."""
    data = answer.data
    if not data["proved"]:
        return f"not proved: {data['reason']}"
    for name, value in truth.items():
        found = data["parameters"][name]
        with mp.workdps(_DIGITS):
            off = abs(mp.mpf(found["value"]) - value())
            if off > mp.mpf(found["radius"]):
                return f"{name} = {found['value']} ± {found['radius']} is {mp.nstr(off, 3)} from the truth"
        if float(found["radius"]) > _WIDEST:
            return f"{name} is known to {found['radius']} only"
    return ""


def _every(answer: Answer, truth: Truth) -> str:
    """What is false of a list of all designs: one that is missing, or off by more than a double's rounding."""
    data = answer.data
    if data["complete"] is not True:
        return "not proved complete"
    (only,) = data["solutions"]
    for name, value in truth.items():
        with mp.workdps(_DIGITS):
            off = float(abs(mp.mpf(only["parameters"][name]) - value()))
            if off > 1e-15 * float(abs(value())):
                return f"{name} is {off:.1e} off"
    return ""


def _case(name: str, model: str, free: str, pattern: str, truth: Truth, words: str, all_designs: bool = False) -> Case:
    text = f'[model]\n{model}\n[parameters]\n{free}\n[objective]\nlocate = "{pattern}"\n'
    command = ("solve", "problem.toml", "--all", "--json") if all_designs else ("prove", "problem.toml", "--json")
    judge = partial(_every if all_designs else _enclosed, truth=truth)
    return Case(name, {"problem.toml": text}, command, judge, words)


CONSTANTS: Mapping[str, Callable[[], Any]] = {
    '"8/3"': lambda: mp.mpf(8) / 3,
    '"7/3"': lambda: mp.mpf(7) / 3,
    '"sqrt(5)"': lambda: mp.sqrt(5),
    "0.07": lambda: mp.mpf("0.07"),
    '"pi"': lambda: +mp.pi,
    "1.8": lambda: mp.mpf("1.8"),
    '"sqrt(2)/3"': lambda: mp.sqrt(2) / 3,
    '"exp(1)"': lambda: +mp.e,
    '"sin(1)"': lambda: mp.sin(1),
    '"2*pi/7"': lambda: 2 * mp.pi / 7,
    '"1e-3/7"': lambda: mp.mpf("0.001") / 7,
    '"0.1 + 0.2"': lambda: mp.mpf("0.3"),
    '"atan(1)"': lambda: mp.pi / 4,
    '"log(2)"': lambda: mp.log(2),
    '"3.33333333333333333333333333"': lambda: mp.mpf("3.33333333333333333333333333"),
    '"0.3**0.5"': lambda: mp.sqrt(mp.mpf("0.3")),
    '"max(0.7, 2/3)"': lambda: mp.mpf("0.7"),
    '"cos(pi/7)"': lambda: mp.cos(mp.pi / 7),
}
"""As written in a file → what is meant."""


def _oscillator(constant: str, value: Callable[[], Any]) -> Case:
    """s² + c s + K has a double root at c = 2√K."""
    free = "c = { min = 0.001, max = 9 }"
    model = f'coefficients = [1, "c", {constant}]'
    return _case(f"K = {constant}", model, free, "EP2", {"c": lambda: 2 * mp.sqrt(value())}, "c = 2√K")


def _cubic(constant: str, value: Callable[[], Any]) -> Case:
    """s³ + c s² + d s + K has a triple root where c³ = 27 K and d = c²/3."""
    truth: Truth = {"c": lambda: 3 * mp.cbrt(value()), "d": lambda: 3 * mp.cbrt(value()) ** 2}
    free = "c = { min = 0.001, max = 9 }\nd = { min = 0.001, max = 9 }"
    return _case(
        f"triple root, K = {constant}",
        f'coefficients = [1, "c", "d", {constant}]',
        free,
        "EP3",
        truth,
        "(s + K^(1/3))³",
    )


def _machine(mass: str, stiffness: str, m: Callable[[], Any], k: Callable[[], Any]) -> Case:
    """m q″ + c q′ + k q = 0 is critically damped at c = 2√(m k)."""
    model = f'M = [[{mass}]]\nD = [["c"]]\nK = [[{stiffness}]]'
    return _case(
        f"m = {mass}, k = {stiffness}",
        model,
        "c = { min = 0.001, max = 20 }",
        "EP2",
        {"c": lambda: 2 * mp.sqrt(m() * k())},
        "c = 2√(m k)",
    )


def _states(a: str, value: Callable[[], Any]) -> Case:
    """The eigenvalues of [[0, 1], [−a/3, −c]] meet at c = 2√(a/3)."""
    model = f'A = [[0, 1], ["-({a})/3", "-c"]]'
    return _case(
        f"A with ({a})/3",
        model,
        "c = { min = 0.001, max = 9 }",
        "EP2",
        {"c": lambda: 2 * mp.sqrt(value() / 3)},
        "c = 2√(a/3)",
    )


def _dimer(g1: str, g2: str, truth: Callable[[], Any]) -> Case:
    """Two modes with losses g1 and g2 meet at d = 0, k = |g1 − g2|/2."""
    model = f'H = [["d - 1j*({g1})", "k"], ["k", "-1j*({g2})"]]'
    free = "d = { min = -1, max = 1 }\nk = { min = 0.01, max = 3 }"
    return _case(f"losses {g1} and {g2}", model, free, "EP2", {"k": truth}, "k = |g1 − g2|/2")


def _skates(zeta_B: str, zeta_H: str) -> Case:
    """The EP4 of the two-mass-skate bicycle with χ_H = 1, in closed form (Kirillov 2018)."""
    file = f"""model = "tms"
[parameters]
chi_H = 1.0
zeta_H = {zeta_H}
zeta_B = {zeta_B}
mu = 0.1
chi_B = {{ min = 1.01, max = 5 }}
Fr = {{ min = 0.01, max = 10 }}
lambda_s = {{ min = 0.02, max = 1.4 }}
[objective]
locate = "EP4"
"""

    def ratio() -> Any:
        return mp.sqrt(mp.mpf(zeta_B) / mp.mpf(zeta_H))

    def height() -> Any:
        return mp.sqrt(mp.mpf(zeta_B) * mp.mpf(zeta_H))

    truth: Truth = {
        "chi_B": ratio,
        "Fr": lambda: ((r := ratio()) ** 2 + 6 * r + 1) / (4 * mp.sqrt(height()) * (r + 1)),
        "lambda_s": lambda: mp.atan(((r := ratio()) - 1) * (r**2 + 6 * r + 1) / (16 * height() * (r + 1))),
    }
    judge = partial(_enclosed, truth=truth)
    words = "χ_B = r, Fr = (r² + 6 r + 1)/(4 √h (r + 1)), tan λ_s = (r − 1)(r² + 6 r + 1)/(16 h (r + 1))"
    return Case(
        f"tms, {zeta_B} and {zeta_H}", {"problem.toml": file}, ("prove", "problem.toml", "--json"), judge, words
    )


CASES = (
    *(_oscillator(text, value) for text, value in CONSTANTS.items()),
    *(_cubic(text, CONSTANTS[text]) for text in ('"7/3"', '"sqrt(5)"', "0.07", '"pi"', '"0.1 + 0.2"', '"log(2)"')),
    _machine("1.8", '"7/3"', lambda: mp.mpf("1.8"), lambda: mp.mpf(7) / 3),
    _machine('"1/3"', "0.7", lambda: mp.mpf(1) / 3, lambda: mp.mpf("0.7")),
    _machine('"sqrt(3)"', '"pi**2"', lambda: mp.sqrt(3), lambda: mp.pi**2),
    _machine("0.1", "0.3", lambda: mp.mpf("0.1"), lambda: mp.mpf("0.3")),
    _states("0.2", lambda: mp.mpf("0.2")),
    _states("sqrt(2)", lambda: mp.sqrt(2)),
    _states("10/7", lambda: mp.mpf(10) / 7),
    _dimer("0.7", "0.1", lambda: mp.mpf("0.3")),
    _dimer("sqrt(3)", "1/3", lambda: (mp.sqrt(3) - mp.mpf(1) / 3) / 2),
    _dimer("pi/4", "0.2", lambda: (mp.pi / 4 - mp.mpf("0.2")) / 2),
    _dimer("1.1", "2/7", lambda: (mp.mpf("1.1") - mp.mpf(2) / 7) / 2),
    _skates("-0.7", "-0.3"),
    _skates("-0.55", "-0.1"),
    _skates("-1.3", "-0.9"),
    _skates("-0.31", "-0.07"),
    _case(
        "all, K = 8/3",
        'coefficients = [1, "c", "8/3"]',
        "c = { min = 0.001, max = 9 }",
        "EP2",
        {"c": lambda: 2 * mp.sqrt(mp.mpf(8) / 3)},
        "c = 2√K",
        True,
    ),
    _case(
        "all, K = pi",
        'coefficients = [1, "c", "pi"]',
        "c = { min = 0.001, max = 9 }",
        "EP2",
        {"c": lambda: 2 * mp.sqrt(mp.pi)},
        "c = 2√K",
        True,
    ),
)
