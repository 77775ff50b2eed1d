"""Statements that closed forms or 80 digits can refute: limits of stored designs, split roots, enclosures, inertia.

Each is a problem file, a command and a judge of its JSON that shares no code with the package. Tables of matrices are
texts: entries between blanks, matrices between bars. Parameters are ``name=value`` or ``name=least:greatest``.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import isqrt
from pathlib import Path
from typing import Any

import flint
import mpmath as mp
import numpy as np

from benchmarks.suites.fresh.bicycles import BENCHMARK, SI, TMS, largest_real_part
from benchmarks.suites.fresh.draw import Parts, made, stated
from benchmarks.suites.fresh.formulas import MANY_DIGITS, Field, evaluate, sides
from benchmarks.suites.fresh.problem import Problem, System, measure_exactly, polynomial

KEPT, TOLD = 1e-9, 0.01
"""Relative: what a stored design may miss without a word, and how far the amount may be off that it is said to miss."""

WIDEST = 1e-25
"""Radius of an enclosure with 30 digits, at most."""

DIGITS, CHANGES, SAME, STAYS = 240, ("1e-20", "1e-24"), 0.02, 1e-30
"""Of split roots: digits, relative or absolute changes of a parameter, how far a law may be off, a root that stays."""

NEAR, STEADY = 0.01, -0.05
"""Distance from a margin of inertia at which the verdict must be right; in 1/s, the decay of designs that are drawn."""


@dataclass(frozen=True)
class Case:
    """One statement.

    Attributes:
        command: of ``tmsopt``; it gets the file and ``--json``.
        judge: nothing if JSON says the truth; else what is false, in a few words.
    """

    kind: str
    name: str
    text: str
    command: tuple[str, ...]
    judge: Callable[[Any], str]


def find_false(case: Case) -> str:
    """Nothing if the program says the truth; else what it says that is false."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "problem.toml")
        path.write_text(case.text, encoding="utf-8")
        command = [sys.executable, "-m", "tmsopt", case.command[0], str(path), *case.command[1:], "--json"]
        ran = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        return case.judge(json.loads(ran.stdout))
    except (KeyError, IndexError, TypeError, ValueError) as error:
        return f"no such statement: {type(error).__name__}: {error}; {ran.stderr[-200:]}"


def _table(kind: str, text: str) -> tuple[str, System]:
    """Head of the file and system."""
    parts = [part.split() for part in text.split("|")]
    sizes = [len(part) if kind == "coefficients" else isqrt(len(part)) for part in parts]
    return stated(kind, *([p[i : i + n] for i in range(0, len(p), n)] for p, n in zip(parts, sizes, strict=True)))


def _ranges(text: str) -> tuple[dict[str, tuple[str, str]], dict[str, str]]:
    """Free and fixed parameters."""
    every = dict(word.split("=") for word in text.split())
    free = {n: (x.split(":")[0], x.split(":")[1]) for n, x in every.items() if ":" in x}
    return free, {n: x for n, x in every.items() if n not in free}


_SKATES = 'model = "tms"', System("coefficients", ((TMS,),))
_METRES = 'model = "tms"', System("coefficients", ((TMS,),), SI, "sqrt(g/w)")
_WHEELS = 'model = "whipple"', System("whipple")


# Limits on the roots, of the design that is handed over


def _find_missed(problem: Problem, data: Any) -> str:
    """What a design misses without a word, or is wrongly said to miss."""
    if data["status"] != "optimal":
        return f"status {data['status']}"
    real, said = measure_exactly(problem, data["parameters"]), data.get("missed_as_stored") or {}
    for name, text in problem.limits.items():
        share, told = real.violations.get(name, 0.0), said.get(name)
        missed = share * max(1.0, abs(float(sides(text)[2])))
        if share > KEPT and (told is None or abs(told - missed) > TOLD * missed):
            return f"{name} is missed by {missed:.2g}; told: {told}"
        if share <= KEPT and told is not None:
            return f"{name} is said to be missed by {told:.2g}, and is kept"
    return ""


_POLE, _DAMPED = "abscissa <= -{}", "damping_ratio >= {}"
_TUNED = "1 0 0 m | d -d -d d | 1+q -q -q q"
_LIMITED = (
    ("coefficients", "1 a b", "0:400", "a + b", _POLE, "1.1 0.3"),
    ("coefficients", "1 a b c", "0:400", "a + b + c", _POLE, "1.1 0.7 2.3"),
    ("coefficients", "1 a b c d", "0:400", "a + b + c + d", _POLE, "1.1 0.7 0.3 2.3"),
    ("coefficients", "1 a b c d e", "0:400", "a + b + c + d + e", _POLE, "1.1 0.6"),
    ("coefficients", "1 a+b a*b+c b*c+0.5*d d", "0:20", "a + 2*b + c + d", _POLE, "0.9 0.35 0.6"),
    ("coefficients", "1 a b c 1", "0:30", "a + c", _DAMPED, "0.6 0.35 0.9"),
    ("coefficients", "1 a b 1.75", "0:30", "a + b", _DAMPED, "1"),
    ("coefficients", "1 a b c 1.75", "0:30", "a + b + c", _DAMPED, "1"),
    ("coefficients", "1 a b c+m", "0:20", "a + b + c", _POLE, "0.7 0.45"),
    ("coefficients", "1 a b c", "0:20", "EP3", "abscissa == -{}", "1.1 0.7 1.9"),
    ("coefficients", "1 a b c d", "0:40", "EP4", "abscissa == -{}", "1.1 0.7 1.9"),
    ("MDK", "1 | c | k", "0:20", "c + k", _POLE, "1.3 0.45"),
    ("MDK", "1 0 0 1 | c+d -d -d d | k+q -q -q q", "0:20", "c + d + k + q", _POLE, "0.4 1.1"),
    ("MDK", _TUNED, "0.05:5", "m", _POLE, "0.12 0.15 0.18"),
    ("MDK", _TUNED, "0.05:5", "m", _DAMPED, "0.15 0.2 0.25"),
    ("MDK", "1 0 0 0.5 | 0.25 0 r d | -2 1 p e", "-20:20", "p**2 + r**2 + d**2 + e**2", _POLE, "0.9 0.65"),
)
"""Kind, matrices, range of all parameters, objective or pattern, limit and its numbers; m in a polynomial is a band."""

_STANCE = "chi_H=1 zeta_H=-0.2 mu=0.1 chi_B=1.01:5 Fr=0.01:10 lambda_s=0.02:1.4 zeta_B="
_ROBOT = "w=1.25 v=0.5:9 g=9.8125 lambda_s=0.02:1.4 m_B=40 x_B=0.3:6 z_B=-2:-0.05 m_H=4 x_H=1.25 z_H=-0.25"
_MACHINES = (
    (_SKATES, f"{_STANCE}-2:-0.05", "zeta_B", _POLE, "1.4 1.55 1.7 1.9 2.1"),
    (_SKATES, f"{_STANCE}-0.4", "Fr", _POLE, "1.8 1.83 1.86"),
    (_SKATES, f"{_STANCE}-0.4", "Fr", _DAMPED, "1"),
    (_METRES, _ROBOT, "z_B", "decay_rate >= {}", "4 4.2 4.5"),
)
_GAINS = (
    ("1.75", "k_phi k_phidot k_delta k_deltadot", "3 4"),
    ("2.25", "k_phi k_phidot k_delta k_deltadot", "3.4"),
    ("5", "k_phi k_phidot k_delta k_deltadot", "2.9"),
    ("3.5", "k_phi k_phidot k_delta k_deltadot", "2.3"),
    ("2.5", "k_phidot k_delta k_deltadot", "0.55"),
    ("4", "k_phi k_phidot k_deltadot", "1.15"),
)
"""Speed in m/s, gains that are free, decays."""


def _limited() -> Iterator[Problem]:
    for kind, table, span, objective, limit, numbers in _LIMITED:
        system = _table(kind, table)
        letters = sorted(set(table) & set("abcdekmpqr"))
        band = ("m", ["0.25", "0.75"], True) if kind == "coefficients" and "m" in letters else None
        free, _ = _ranges(" ".join(f"{n}={span}" for n in letters if not (band and n == "m")))
        sense = "locate" if objective.startswith("EP") else "minimize"
        for number in numbers.split():
            limits = {"limit": limit.format(number)}
            yield made(f"{table}, {limits['limit']}", Parts(*system, free, {}, sense, objective, limits, (), band))
    for system, span, objective, limit, numbers in _MACHINES:
        for number in numbers.split():
            limits = {"limit": limit.format(number)}
            yield made(f"{objective}, {limits['limit']}", Parts(*system, *_ranges(span), "minimize", objective, limits))
    fixed = {**{n: str(x) for n, x in BENCHMARK.items()}, "lambda_s": "0.3125", "g": "9.81"}
    for speed, gains, numbers in _GAINS:
        free, held = dict.fromkeys(gains.split(), ("-100", "100")), {**fixed, "v": speed}
        for number in numbers.split():
            for form in ("abs({})", "{}**2"):
                objective, limits = " + ".join(map(form.format, free)), {"limit": _POLE.format(number)}
                name = f"{objective} at {speed} m/s, {number}"
                yield made(name, Parts(*_WHEELS, free, held, "minimize", objective, limits, tuple(free)))


# Laws by which multiple roots split


_SPLIT = (
    ("H", "d-1j*a k k -1j*b", "d=-1:1 k=0.05:2 a=1.3 b=0.1", "EP2", "d=0 k=0.6", "-0.7j", 2),
    ("H", "w+1j*g k k w-1j*g", "g=0.1:2 w=3 k=0.7", "EP2", "g=0.7", "3", 2),
    ("H", "e+1j*g k 0 k 0 k 0 k -1j*g", "g=0.5:2 k=1 e=0", "EP3", "g=sqrt(2)", "0", 3),
    ("H", "a+1j*b 1 0 0", "a=-1:1 b=-1:1", "EP2", "a=0 b=0", "0", 2),
    ("H", "d k k -d", "d=0 k=0", "", "", "0", 2),
    ("A", "0 1 0 0 0 0 1 0 0 0 0 1 -1-x -4-y -6 -4-x*y", "x=0 y=0", "", "", "-1", 4),
    ("coefficients", "1 12 66 220 495 792 924 792 495 220 66 12+y 1+x+y", "x=0 y=0", "", "", "-1", 12),
    ("coefficients", "1 2 1-x**2+y", "x=0 y=0", "", "", "-1", 2),
    ("A", "x-1 y 0 y -x-1 z 0 z -4", "x=0 y=0 z=0", "", "", "-1", 2),
    ("A", "-1 1 0 d -1 0 0 f f-1", "d=0 f=0", "", "", "-1", 3),
    ("MDK", "m 0 0 1 | d 0 0 0.1 | k+c -c -c 2+c", "m=1 d=0.1 k=2 c=0", "", "", "-0.05+1j*sqrt(1.9975)", 2),
    ("MDK", "m | c | k", "m=2 c=1:9 k=3", "EP2", "c=sqrt(24)", "-sqrt(3/2)", 2),
    ("MDK", "1 0 0 1 | g 0 0 -g | 1 k k 1", "g=0.3:0.9 k=0.6", "CEP2", "g=sqrt(0.4)", "1j*sqrt(0.8)", 2),
    ("MDK", "3 1 1 1 | 0 0 0 0 | 2-p p-1 -1 1", "p=1:3", "CEP2", "p=7/2-sqrt(2)", "1j*0.5**(1/4)", 2),
    ("A", "-1+d 1 0 0 -1 1 e 0 -1", "d=0 e=0", "", "", "-1", 3),
    ("A", "-1 1 0 0 0 -1 1 0 d 0 -1 1 e 0 0 -1", "d=0 e=0", "", "", "-1", 4),
    ("A", "-2 1 0 0 d -2 1 0 0 0 -2 1 e 0 0 -2", "d=0 e=0", "", "", "-2", 4),
    ("A", "-3 1 0 0 0 0 -3 1 0 0 d 0 -3 1 0 0 0 0 -3 1 e 0 0 0 -3", "d=0 e=0", "", "", "-3", 5),
)
"""Kind, matrices, parameters, pattern, the free ones at the multiple root, this root, its multiplicity."""


def _spin(size: int, unit: str) -> str:
    """unit (S_x + i g S_z) of spin (size − 1)/2: eigenvalues m unit √(1 − g²)."""
    m = [(size - 1) / 2 - k for k in range(size)]
    beside = {k: f"{unit}*sqrt({(k + 1) * (size - 1 - k)})/2" for k in range(size - 1)}
    return " ".join(
        (f"{unit}*{m[i]}j*g" if m[i] else "0") if i == j else beside[min(i, j)] if abs(i - j) == 1 else "0"
        for i in range(size)
        for j in range(size)
    )


_SPINS = ((3, "1"), (4, "1"), (5, "1"), (6, "1"), (6, "2"), (6, "20"), (4, "1000000"))
_FIELD = Field(MANY_DIGITS.number, {**MANY_DIGITS.functions, "atan": mp.atan, "max": max})
_EP4 = {
    "chi_B": "r",
    "Fr": "(r**2 + 6*r + 1)/(4*sqrt(h)*(r + 1))",
    "lambda_s": "atan((r - 1)*(r**2 + 6*r + 1)/(16*h*(r + 1)))",
}
"""The EP4 at χ_H = 1 (Kirillov 2018), r = √(ζ_B/ζ_H) and h = √(ζ_B ζ_H)."""


def _find_ep4(zeta_B: str, zeta_H: str) -> dict[str, Any]:
    of = {"r": _exact(f"sqrt(({zeta_B})/({zeta_H}))"), "h": _exact(f"sqrt(({zeta_B})*({zeta_H}))")}
    return {n: evaluate(text, of, _FIELD) for n, text in _EP4.items()}


def _exact(text: str) -> Any:
    with mp.workdps(DIGITS):
        return evaluate(text, {"pi": +mp.pi}, _FIELD)


def _split() -> Iterator[Case]:
    rows = [*_SPLIT, *(("H", _spin(n, unit), "g=0.6:1.7", f"EP{n}", "g=1", "0", n) for n, unit in _SPINS)]
    for kind, table, span, pattern, point, root, fold in rows:
        head, system = _table(kind, table)
        free, fixed = _ranges(span)
        at = {**fixed, **_ranges(point)[1]}
        yield _law(
            table[:60], (head, system), free, fixed, pattern, {n: _exact(at[n]) for n in (*fixed, *free)}, root, fold
        )
    free, fixed = _ranges(f"{_STANCE}-0.4")
    with mp.workdps(DIGITS):
        at = {n: _exact(x) for n, x in fixed.items()} | _find_ep4("-0.4", "-0.2")
    yield _law("tms", _SKATES, free, fixed, "EP4", at, "-0.08**(-1/4)", 4)


def _law(
    name: str,
    system: tuple[str, System],
    free: Mapping[str, tuple[str, str]],
    fixed: Mapping[str, str],
    pattern: str,
    at: Mapping[str, Any],
    root: str,
    fold: int,
) -> Case:
    text = made(name, Parts(*system, free, fixed, "locate", pattern)).text
    text = text if pattern else text.partition("[objective]")[0]
    judge = partial(_find_wrong_law, system[1], at, _exact(root), fold)
    return Case("splitting", name, text, ("solve", "--full"), judge)


def _find_wrong_law(system: System, at: Mapping[str, Any], root: Any, fold: int, data: Any) -> str:
    with mp.workdps(DIGITS):
        found = min(data["diagnosis"], key=lambda d: abs(_place(d) - root))
        if found["algebraic"] != fold or abs(_place(found) - root) > 1e-6 * max(1, abs(root)):
            return f"{found['algebraic']}-fold root at {_place(found)}, not {fold}-fold at {mp.nstr(root, 8)}"
        told = {r["parameter"]: r for r in found["responses"]}
        s = -1j * root if system.kind == "H" else root
        wrong = ((n, "is missing" if n not in told else _compare_law(system, at, s, told[n], fold)) for n in at)
        return "; ".join(f"{name}: {text}" for name, text in wrong if text)


def _place(found: Mapping[str, Any]) -> Any:
    z = found.get("eigenfrequency", found)
    return mp.mpc(z["re"], z["im"])


def _compare_law(system: System, at: Mapping[str, Any], root: Any, told: Mapping[str, Any], fold: int) -> str:
    name, relative = told["parameter"], told["change"] == "relative"
    if told.get("unresolved") or (relative and at[name] == 0):
        return "not resolved, or a relative change of what is 0"
    for text in CHANGES:
        eps = mp.mpf(text)
        values = {**at, name: at[name] * (1 + eps) if relative else at[name] + eps}
        shifts = _find_shifts(polynomial(system, values), root)[:fold][::-1]
        for law in told["laws"]:
            numerator, _, denominator = law["exponent"].partition("/")
            size = law["size"] * eps ** (mp.mpf(numerator) / mp.mpf(denominator or 1))
            group, shifts = shifts[: law["roots"]], shifts[law["roots"] :]
            if not group or abs(group[0] - size) > SAME * size:
                return f"ε^({law['exponent']}) at ε = {text}: {mp.nstr(size, 4)} for {mp.nstr(group[:1], 4)}"
        if len(shifts) != told["unmoved"] or any(t > STAYS for t in shifts):
            return f"{told['unmoved']} stay at ε = {text}, but {len(shifts)} move by {mp.nstr(max(shifts), 4)}"
    return ""


def _find_shifts(coefficients: Sequence[Any], root: Any) -> list[Any]:
    """|t| of all roots root + t, ascending; coefficients that are 0 but for rounding are roots that stay."""
    c = [mp.mpc(x) for x in coefficients]
    for end in range(len(c), 1, -1):
        for k in range(1, end):
            c[k] += root * c[k - 1]
    zeros = 0
    while len(c) > 1 and abs(c[-1]) <= mp.mpf(10) ** (20 - DIGITS) * max(1, abs(root)) ** (len(c) - 1):
        c.pop()
        zeros += 1
    if len(c) == 3:  # two equal roots cannot be isolated
        half = -c[1] / (2 * c[0])
        apart = mp.sqrt(half**2 - c[2] / c[0])
        return [mp.mpf(0)] * zeros + sorted([abs(half - apart), abs(half + apart)])
    with flint.ctx.workdps(DIGITS):
        balls = [flint.acb(*(flint.arb(mp.nstr(x, DIGITS)).mid() for x in (z.real, z.imag))) for z in c[::-1]]
        found = flint.acb_poly(balls).roots() if len(c) > 1 else []
        return [mp.mpf(0)] * zeros + sorted(mp.mpf(abs(z).str(60, radius=False)) for z in found)


# Enclosures of closed forms


_CONSTANTS = (
    "8/3 7/3 sqrt(5) 0.07 pi 1.8 sqrt(2)/3 exp(1) sin(1) 2*pi/7 1e-3/7 0.1+0.2 atan(1) log(2) "
    "3.33333333333333333333333333 0.3**0.5 max(0.7,2/3) cos(pi/7)"
)
_FEW = "7/3 sqrt(5) 0.07 pi 0.1+0.2 log(2)"
_C, _SKEW = "c=0.001:20", "d=-1:1 k=0.01:3"
_ENCLOSED = (
    *(("coefficients", f"1 c {x}", _C, "EP2", f"c=2*sqrt({x})") for x in _CONSTANTS.split()),
    *(
        ("coefficients", f"1 c d {x}", f"{_C} d=0.001:20", "EP3", f"c=3*({x})**(1/3) d=3*({x})**(2/3)")
        for x in _FEW.split()
    ),
    *(
        ("MDK", f"{m} | c | {k}", _C, "EP2", f"c=2*sqrt(({m})*({k}))")
        for m, k in (("1.8", "7/3"), ("1/3", "0.7"), ("sqrt(3)", "pi**2"), ("0.1", "0.3"))
    ),
    *(("A", f"0 1 -({x})/3 -c", _C, "EP2", f"c=2*sqrt(({x})/3)") for x in ("0.2", "sqrt(2)", "10/7")),
    *(
        ("H", f"d-1j*({a}) k k -1j*({b})", _SKEW, "EP2", f"k=(({a})-({b}))/2")
        for a, b in (("0.7", "0.1"), ("sqrt(3)", "1/3"), ("pi/4", "0.2"), ("1.1", "2/7"))
    ),
)
"""Kind, matrices, ranges, pattern, closed forms of the parameters."""


def _enclosed() -> Iterator[Case]:
    prove = "prove", ()
    every = [(*row, prove) for row in _ENCLOSED] + [(*row, ("solve", ("--all",))) for row in _ENCLOSED[:5:4]]
    for kind, table, span, pattern, truth, (verb, options) in every:
        free, fixed = _ranges(span)
        text = made(table, Parts(*_table(kind, table), free, fixed, "locate", pattern)).text
        exact = {n: _exact(x) for n, x in _ranges(truth)[1].items()}
        judge = _find_open if verb == "prove" else _find_incomplete
        yield Case("constants", f"{table} {verb}", text, (verb, *options), partial(judge, exact))
    for zeta_B, zeta_H in (("-0.7", "-0.3"), ("-0.55", "-0.1"), ("-1.3", "-0.9"), ("-0.31", "-0.07")):
        free, fixed = _ranges(f"{_STANCE}{zeta_B}".replace("zeta_H=-0.2", f"zeta_H={zeta_H}"))
        text = made("tms", Parts(*_SKATES, free, fixed, "locate", "EP4")).text
        with mp.workdps(DIGITS):
            judge = partial(_find_open, _find_ep4(zeta_B, zeta_H))
        yield Case("constants", f"tms, {zeta_B} and {zeta_H}", text, ("prove",), judge)


def _find_open(truth: Mapping[str, Any], data: Any) -> str:
    """An enclosure without the truth, or one too wide to say much."""
    if not data["proved"]:
        return f"not proved: {data['reason']}"
    for name, value in truth.items():
        found = data["parameters"][name]
        with mp.workdps(DIGITS):
            off = abs(mp.mpf(found["value"]) - value)
            if not off <= mp.mpf(found["radius"]) <= WIDEST:
                return f"{name} = {found['value']} ± {found['radius']} is {mp.nstr(off, 3)} from the truth"
    return ""


def _find_incomplete(truth: Mapping[str, Any], data: Any) -> str:
    """A list of all designs that lacks the only one, or has it off by more than a double's rounding."""
    if data["complete"] is not True:
        return "not proved complete"
    (only,) = data["solutions"]
    off = {name: float(abs(only["parameters"][name] / value - 1)) for name, value in truth.items()}
    return str({name: x for name, x in off.items() if x > 1e-15} or "")


# Margins of inertia


def _find_wrong_margin(data: Any) -> str:
    """What is false of the inertia that a design bears: stable with less, down to none, and unstable with more."""
    design, margin = data["parameters"], data["inertia_margin"]
    for name in ("I_Bxx", "I_Bzz", "I_Hxx", "I_Hzz"):
        found = margin[name]
        most = 1e3 * design["m_B"] * design["w"] ** 2 if found is None else (1 - NEAR) * found
        for x in (*np.geomspace(1e-6 * most, most, 60), *np.linspace(0, most, 60)):
            if largest_real_part({**design, name: x}) >= 0:
                return f"unstable with {name} = {x:.4g}, and {found} is said"
        if found is not None and largest_real_part({**design, name: (1 + NEAR) * found}) <= 0:
            return f"still stable with {name} 1 % above {found}"
    return ""


def _bears() -> Iterator[Case]:
    """Stable ones of 25: with normal and with reversed rake, with a motor, and with one that lags."""
    rng = np.random.default_rng(37)
    left = {"normal rake": 10, "reversed rake": 10, "a motor": 3, "a lag": 2}
    for kind in [kind for kind, count in left.items() for _ in range(count)]:
        while True:
            w, size = rng.uniform(0.3, 2.5), 10 ** rng.uniform(0, 2)
            x_B, z_B, x_H, z_H = w * rng.uniform([0.1, -1, 0.7, -1], [2, -0.1, 1.3, -0.1])
            design = {"w": w, "v": rng.uniform(0.5, 4) * np.sqrt(9.81 * w), "lambda_s": rng.uniform(-1, 1)}
            design |= {"m_B": size, "x_B": x_B, "z_B": z_B, "m_H": 10 ** rng.uniform(-1, 1), "x_H": x_H, "z_H": z_H}
            gains: dict[str, float] = {}
            if kind.startswith("a "):
                many = size * w * rng.uniform([-4, -0.3], 0)
                gains = {"k_phi": many[0], "k_phidot": many[1], "k_delta": rng.uniform(-1, 1)}
                gains |= {"k_deltadot": rng.uniform(0, 0.3), **({"lag": 0.05} if kind == "a lag" else {})}
            elif (design["lambda_s"] > 0) != (kind == "normal rake"):
                continue
            if largest_real_part({**design, **gains}) < STEADY:
                break
        lines = [f"{n} = {x:.9g}" for n, x in design.items()], [f"{n} = {x:.9g}" for n, x in gains.items()]
        text = "\n".join(["[parameters]", *lines[0], "[feedback]", *lines[1], ""])
        yield Case("inertia", f"{kind}, w = {w:.3g}", text, ("solve",), _find_wrong_margin)


def cases() -> list[Case]:
    """All of them."""
    stored = (Case("stored", p.name, p.text, ("solve",), partial(_find_missed, p)) for p in _limited())
    return [*stored, *_split(), *_enclosed(), *_bears()]
