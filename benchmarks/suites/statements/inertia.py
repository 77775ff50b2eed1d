"""How much rotational inertia point masses on skates bear, and the same problems for bodies that have some."""

import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from benchmarks.judges.whipple import largest_real_part
from benchmarks.suites.statements.case import Answer, Case

INERTIAS = ("I_Bxx", "I_Bzz", "I_Hxx", "I_Hzz")
_NEAR = 0.01
_EIGENVALUES = "eigenvalues of Whipple's matrices, written independently, 1 % below and above"
_PROBLEMS = Path(__file__).parents[3] / "problems"
_EXAMPLES = ("point_mass_robot", "childs_bicycle", "physical_machine", "workshop", "benchmark")
_SEED, _PASSIVE, _DRIVEN, _LAGGING = 37, 20, 3, 2
_STEADY = -0.05
"""In 1/s: what decays more slowly is not drawn."""

_UNITS: tuple[Mapping[str, tuple[float, str]], ...] = (
    {},
    {"w": (100, "cm"), "v": (3.6, "km/h")},
    {"m_H": (1000, "g"), "x_H": (1000, "mm")},
)
_SOLVE = ("solve", "problem.toml", "--json")


def _margin(answer: Answer) -> str:
    """What is false of the inertia that a design bears: stable with less, down to none, and unstable with more."""
    design, margin = answer.data["parameters"], answer.data["inertia_margin"]
    if largest_real_part(design) >= 0:
        return "" if margin is None else "a margin of a design that is not stable"
    if set(margin) != set(INERTIAS):
        return f"margins of {', '.join(margin)}"
    for name, found in margin.items():
        most = 1e3 * design["m_B"] * design["w"] ** 2 if found is None else (1 - _NEAR) * found
        for x in (*np.geomspace(1e-6 * most, most, 60), *np.linspace(0, most, 60)):
            if largest_real_part({**design, name: x}) >= 0:
                return f"unstable with {name} = {x:.4g}, and {found} is said"
        if found is not None and largest_real_part({**design, name: (1 + _NEAR) * found}) <= 0:
            return f"still stable with {name} 1 % above {found}"
    return ""


def _file(design: Mapping[str, float], units: Mapping[str, tuple[float, str]], gains: Mapping[str, float]) -> str:
    rows = [
        f'{n} = "{x * units[n][0]:.9g} {units[n][1]}"' if n in units else f"{n} = {x:.9g}" for n, x in design.items()
    ]
    return "\n".join(["[parameters]", *rows, "[feedback]", *(f"{n} = {x:.9g}" for n, x in gains.items()), ""])


def _design(rng: np.random.Generator) -> dict[str, float]:
    w = rng.uniform(0.3, 2.5)
    return {
        "w": w,
        "v": rng.uniform(0.5, 4) * np.sqrt(9.81 * w),
        "lambda_s": rng.uniform(-1, 1),
        "m_B": 10 ** rng.uniform(0, 2),
        "x_B": rng.uniform(0.1, 2) * w,
        "z_B": -rng.uniform(0.1, 1) * w,
        "m_H": 10 ** rng.uniform(-1, 1),
        "x_H": rng.uniform(0.7, 1.3) * w,
        "z_H": -rng.uniform(0.1, 1) * w,
    }


def _gains(rng: np.random.Generator, of: Mapping[str, float], lag: bool) -> dict[str, float]:
    lean, rate = 0.4 * of["m_B"] * 9.81 * of["w"], 0.3 * of["m_B"] * of["w"]
    gains = {"k_phi": -rng.uniform(0, lean), "k_phidot": -rng.uniform(0, rate)}
    gains |= {"k_delta": rng.uniform(-1, 1), "k_deltadot": rng.uniform(0, 0.3)}
    return gains | ({"lag": 0.05} if lag else {})


def _stable() -> Iterator[tuple[str, dict[str, float], dict[str, float]]]:
    """Name, design and gains of stable ones, of passive ones as many with normal as with reversed rake."""
    rng = np.random.default_rng(_SEED)
    kinds = {"normal rake": _PASSIVE // 2, "reversed rake": _PASSIVE // 2, "a motor": _DRIVEN, "a lag": _LAGGING}
    for kind, count in kinds.items():
        left = count
        while left:
            design = _design(rng)
            gains = _gains(rng, design, kind == "a lag") if kind.startswith("a ") else {}
            fits = kind.startswith("a ") or (design["lambda_s"] > 0) == (kind == "normal rake")
            if fits and largest_real_part({**design, **gains}) < _STEADY:
                yield f"{kind} {left}", design, gains
                left -= 1


def _designs() -> Iterator[Case]:
    for name in _EXAMPLES:
        file = _PROBLEMS / f"{name}.toml"
        yield Case(name, {"problem.toml": file.read_text(encoding="utf-8")}, _SOLVE, _margin, _EIGENVALUES)
    for k, (name, design, gains) in enumerate(_stable()):
        text = _file(design, _UNITS[k % len(_UNITS)], gains)
        yield Case(name, {"problem.toml": text}, _SOLVE, _margin, _EIGENVALUES)


_TWO_MASSES = """[parameters]
w = "80 cm"
v = { min = "1 m/s", max = "4 m/s" }
m_B = "20 kg"
m_H = MASS
x_B = { min = "20 cm", max = "60 cm" }
z_B = "-30 cm"
x_H = { min = "50 cm", max = "110 cm" }
z_H = "-60 cm"
lambda_s = { min = "-35 deg", max = "35 deg" }
[objective]
GOAL
[constraints]
arm = "abs(LENGTH) >= 0.02"
"""


def _two_masses(mass: str = '"3 kg"', goal: str = 'minimize = "abscissa"', length: str = "u_H") -> dict[str, str]:
    text = _TWO_MASSES.replace("MASS", mass).replace("GOAL", goal).replace("LENGTH", length)
    return {"problem.toml": text, "there.toml": "mine"}


def _has(answer: Answer, **expected: float) -> str:
    """What is false of a converted file: its parameters, in SI."""
    found = tomllib.loads(answer.stdout)
    given = {n: found["parameters"].get(n, 0.0) for n in expected}
    right = all(np.isclose(given[n], x, rtol=1e-5) for n, x in expected.items())
    return "" if right and found["model"] == "whipple" else f"found {given}"


def _by_default(answer: Answer) -> str:
    """3 kg of 10, 10 and 30 cm, 20 kg of 40, 20 and 30 cm: of a wheelbase of 80 cm."""
    return _has(answer, I_Hxx=0.025, I_Hzz=0.005, I_Bxx=20 * 0.13 / 12, I_Bzz=20 * 0.2 / 12)


def _by_size(answer: Answer) -> str:
    return _has(answer, I_Hxx=0.25 * (0.2**2 + 0.4**2), I_Hzz=0.25 * (0.1**2 + 0.2**2), I_Bxx=20 * 0.5 / 12)


def _without(answer: Answer) -> str:
    found = tomllib.loads(answer.stdout)["parameters"]
    return ", ".join(set(INERTIAS) & set(found))


def _tied(answer: Answer) -> str:
    """The inertia of a free mass is free, and is that of a box of 10, 10 and 30 cm of each mass."""
    found = tomllib.loads(answer.stdout)
    ties = [text for text in found["constraints"].values() if text.startswith("I_Hxx ==")]
    share = float(ties[0].split("==")[1].split("*")[0])
    return "" if abs(share - 0.1 / 12) < 1e-9 and isinstance(found["parameters"]["I_Hxx"], dict) else f"found {ties}"


def _refused(*words: str) -> Callable[[Answer], str]:
    def judge(answer: Answer) -> str:
        missing = [word for word in words if word not in answer.stderr]
        kept = (answer.folder / "there.toml").read_text() == "mine"
        return "" if answer.status == 2 and kept and not missing else f"status {answer.status}; {answer.stderr[:200]}"

    return judge


def _conversions() -> Iterator[Case]:
    convert, box = ("convert", "problem.toml"), "m (b² + h²)/12 and m (l² + b²)/12"
    sizes = ("--body", "20x50x50 cm", "--front", "100x200x400 mm")
    yield Case("boxes by default", _two_masses(), convert, _by_default, box)
    yield Case("boxes by size", _two_masses(), (*convert, *sizes), _by_size, box)
    yield Case("none", _two_masses(), (*convert, "--inertia", "none"), _without, "point masses have none")
    yield Case("a free mass", _two_masses('{ min = "1 kg", max = "6 kg" }'), convert, _tied, box)
    words = ("constraints.arm", "a2")
    yield Case(
        "a word that is not there", _two_masses(length="a2"), convert, _refused(*words), "the list of quantities"
    )
    named = (*convert, "-o", "there.toml")
    yield Case("a file that is there", _two_masses(), named, _refused("there.toml"), "it is not written over")


CASES = (*_designs(), *_conversions())
"""Thirty designs, then conversions."""
