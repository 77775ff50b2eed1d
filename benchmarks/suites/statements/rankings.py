"""Rows ranked, and numbers printed, by the clock: eigenvalues of the paper's polynomial times √(g/w), by NumPy."""

import csv
import math
import re
from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.suites.statements.case import Answer, Case
from benchmarks.suites.statements.paper import coefficients

_DEGREES = math.pi / 180
_FIXED = {"m_B": 10.0, "m_H": 1.0, "x_B": 1.3, "z_B": -0.4, "x_H": 1.01, "z_H": -0.2}
_NAMES = ("w", "g", "v", "m_B", "m_H", "x_B", "z_B", "x_H", "z_H", "lambda_s")


def _roots(p: Mapping[str, float]) -> np.ndarray:
    """In 1/s, the rightmost first."""
    w, rate = p["w"], math.sqrt(p["g"] / p["w"])
    ratios = (p["m_H"] / p["m_B"], p["x_B"] / w, p["x_H"] / w, p["z_B"] / w, p["z_H"] / w)
    a = coefficients(p["v"] / (rate * w), *ratios, math.tan(p["lambda_s"]))
    found = np.roots([float(c) for c in a]) * rate
    return found[np.argsort(-found.real)]


def _rows(answer: Answer) -> list[dict[str, float]]:
    """Parameters of each row, by their bare names, with what it says of itself."""
    with (answer.folder / "rows.csv").open(encoding="utf-8", newline="") as file:
        listed = list(csv.DictReader(file))
    return [{head.split(" ")[0]: float(x) for head, x in row.items() if _is_number(x)} for row in listed]


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _best_row(answer: Answer) -> str:
    decays = [_roots(row)[0].real for row in _rows(answer)]
    truth = int(np.argmin(decays))
    found = re.search(r"best: row (\d+), (-?[\d.]+) (\S+)", answer.stdout)
    if not found:
        return "names no best row"
    if int(found[1]) != truth:
        return (
            f"row {found[1]} is called the best, with {decays[int(found[1])]:.4g} 1/s; {decays[truth]:.4g} in {truth}"
        )
    return "" if found[3] == "1/s" and abs(float(found[2]) / decays[truth] - 1) < 1e-3 else f"says {found[0]}"


def _median(answer: Answer) -> str:
    decays = sorted(_roots(row)[0].real for row in _rows(answer))
    found = re.search(r"abscissa in (\S+) at most.*?50\s+%\s+(-?[\d.]+)", answer.stdout, re.DOTALL)
    if not found:
        return "gives no median"
    truth = decays[math.ceil(len(decays) / 2) - 1]
    return (
        "" if found[1] == "1/s" and abs(float(found[2]) / truth - 1) < 1e-4 else f"{found[2]} {found[1]}, not {truth}"
    )


def _given(p: Mapping[str, float]) -> Callable[[Answer], str]:
    """Abscissa and roots of a design that was given, in 1/s first."""

    def judge(answer: Answer) -> str:
        roots = _roots(p)
        head = re.search(r"abscissa = (-?[\d.]+) (\S+)", answer.stdout)
        line = re.search(r"roots: (-?[\d.]+).*in (\S+?)[;\s]", answer.stdout)
        if not head or not line:
            return "no abscissa or no roots"
        for name, found in (("abscissa", head), ("root", line)):
            if found[2] != "1/s" or abs(float(found[1]) / roots[0].real - 1) > 1e-4:
                return f"{name} {found[1]} {found[2]}, where the clock says {roots[0].real:.5g} 1/s"
        return ""

    return judge


def _weave(p: Mapping[str, float]) -> Callable[[Answer], str]:
    def judge(answer: Answer) -> str:
        found = re.search(r"weave +([\d.]+) +± ([\d.]+)i", answer.stdout)
        if not found or "root 1/s" not in answer.stdout:
            return "no root in 1/s at the weave speed"
        roots = _roots({**p, "v": float(found[1])})
        off = min(abs(z - 1j * float(found[2])) for z in roots)
        return "" if off < 1e-6 else f"± {found[2]}i is {off:.2g} 1/s off"

    return judge


def _file(p: Mapping[str, float], extra: str = "", objective: str = 'minimize = "abscissa"') -> str:
    numbers = "\n".join(f"{n} = {x!r}" for n, x in p.items())
    return f"[parameters]\n{numbers}\n{extra}\n[objective]\n{objective}\n"


_FREE_SPEED = "v = { min = 1, max = 12 }"


def _over(name: str, values: list[float], tilt: float) -> Case:
    """One bicycle on several planets: per √(g/w) all decay alike, or the lightest best, by the clock not."""
    own = {"w": 1.0, "g": 9.81, **_FIXED, "lambda_s": tilt * _DEGREES}
    study = f'problem = "p.toml"\n[study]\nstarts = 8\n[vary]\n{name} = {values}\n'
    return Case(
        f"best over {name}, {len(values)} rows, {tilt:g} deg",
        {"p.toml": _file(own, _FREE_SPEED), "s.toml": study},
        ("study", "s.toml", "--export", "rows.csv"),
        _best_row,
        "eigenvalues of each row times √(g/w)",
    )


def _sizes(scales: list[float], tilts: list[float]) -> Case:
    """Similar bicycles of several sizes, the larger with a slightly better tilt."""
    columns = {n: [round(x * s, 9) for s in scales] for n, x in {"w": 1.0, **_FIXED}.items() if n[0] in "wxz"}
    columns["lambda_s"] = [t * _DEGREES for t in tilts]
    varied = "\n".join(f"{n} = {xs}" for n, xs in columns.items())
    own = {"g": 9.81, "w": 1.0, **_FIXED, "lambda_s": 0.2}
    study = f'problem = "p.toml"\n[study]\nmethod = "list"\nstarts = 8\n[vary]\n{varied}\n'
    return Case(
        f"best of {len(scales)} sizes, from {min(scales):g} m",
        {"p.toml": _file(own, _FREE_SPEED), "s.toml": study},
        ("study", "s.toml", "--export", "rows.csv"),
        _best_row,
        "eigenvalues of each row times √(g/w)",
    )


def _drawn(tolerances: Mapping[str, float], speed: float) -> Case:
    own = {"w": 1.0, "g": 9.81, "v": speed, **_FIXED, "lambda_s": 15 * _DEGREES}
    allowed = "\n".join(f"{n} = {x}" for n, x in tolerances.items())
    study = f'problem = "p.toml"\n[study]\nmethod = "monte_carlo"\nrows = 101\n[tolerances]\n{allowed}\n'
    return Case(
        f"median of products off in {', '.join(tolerances)}",
        {"p.toml": _file(own), "s.toml": study},
        ("study", "s.toml", "--export", "rows.csv"),
        _median,
        "eigenvalues of each row times √(g/w)",
    )


def _design(**changes: float) -> dict[str, float]:
    own = {"w": 1.0, "g": 9.81, "v": 4.0, **_FIXED, "lambda_s": 15 * _DEGREES}
    return {**own, **changes}


_DESIGNS = (
    _design(),
    _design(g=1.62),
    _design(w=1.02, v=3.5),
    _design(g=24.8, v=6.0),
    _design(lambda_s=0.1, v=5.0),
)
_BAND = """[parameters]
w = 1.0
m_B = 10
m_H = 1
x_B = 1.3
z_B = -0.4
x_H = 1.01
z_H = -0.2
lambda_s = "15 deg"
[scenarios]
v = { min = 4.5, max = 8, points = 3 }
[objective]
minimize = "abscissa"
"""


def _says(pattern: str) -> Callable[[Answer], str]:
    return lambda answer: "" if re.search(pattern, answer.stdout) else f"nowhere '{pattern}'"


def _slowest(answer: Answer) -> str:
    """The speed before the decay time is one at which it is that."""
    found = re.search(r"at v = ([\d.]+) m/s: decay time ([\d.]+) s", answer.stdout)
    if not found:
        return "does not say at which speed the decay time is"
    truth = -1 / _roots(_design(v=float(found[1])))[0].real
    return (
        "" if abs(float(found[2]) / truth - 1) < 1e-3 else f"{found[2]} s at {found[1]} m/s, where it is {truth:.4g} s"
    )


CASES: tuple[Case, ...] = (
    _over("g", [1.62, 3.71, 9.81], 15.0),
    _over("g", [9.81, 1.62], 10.0),
    _over("g", [3.7, 8.87, 9.8, 11.15], 12.0),
    _over("g", [24.79, 9.81, 3.71], 20.0),
    _over("g", [0.5, 1.0, 2.0, 4.0], 15.0),
    _sizes([2.0, 1.0, 0.5], [15.0, 14.0, 13.0]),
    _sizes([1.2, 0.4], [16.0, 15.0]),
    _sizes([0.3, 0.6, 1.2, 2.4], [11.0, 12.0, 13.0, 14.0]),
    _sizes([1.0, 0.8], [15.0, 14.8]),
    _drawn({"w": 0.005}, 4.0),
    _drawn({"g": 1.0}, 4.0),
    _drawn({"x_B": 0.05}, 5.0),
    *(
        Case(
            f"a design at g = {p['g']:g}, v = {p['v']:g}",
            {"p.toml": _file(p)},
            ("solve", "p.toml"),
            _given(p),
            "eigenvalues times √(g/w)",
        )
        for p in _DESIGNS
    ),
    Case(
        "root at the weave speed",
        {"p.toml": _file(_design())},
        ("speeds", "p.toml"),
        _weave(_design()),
        "eigenvalues at that speed",
    ),
    Case(
        "root at the weave speed on the moon",
        {"p.toml": _file(_design(g=1.62))},
        ("speeds", "p.toml"),
        _weave(_design(g=1.62)),
        "eigenvalues at that speed",
    ),
    Case("peaks and their speed", {"p.toml": _file(_design())}, ("simulate", "p.toml"), _says("at v = 4 m/s"), "file"),
    Case("a band's decay time and its speed", {"p.toml": _BAND}, ("solve", "p.toml"), _slowest, "eigenvalues there"),
)
