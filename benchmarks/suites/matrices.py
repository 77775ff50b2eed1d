"""Sixty matrices with known exceptional points, ten without, and a judge of 60 digits.

In: nothing. Out: `systems`, and `judge` for parameters and an eigenvalue. Nothing here uses tmsopt. The points are
known in closed form, from the roots of an equation in one unknown, or from the roots of a discriminant.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np

from benchmarks.suites.fresh.formulas import DIGITS, MANY_DIGITS, evaluate

ERROR = 1e-14
"""Of parameters and eigenvalues, as a share of the norm of the matrix. A change of the matrix by a share of 1e-16 moves
them by at most 2e-15, to first order, so a rounding error of a few units counts as right."""

_CHAIN = "constructed from Hatano, Nelson, Phys. Rev. Lett. 77 (1996) 570"
_SMALL = Path(__file__).with_suffix(".toml")

Rows = Sequence[Sequence[str]]


@dataclass(frozen=True)
class System:
    """A matrix whose entries depend on parameters.

    Attributes:
        source: who published it, or *constructed*.
        free: the ranges of the parameters.
        locate: the pattern to find.
        points: values of the parameters, in the order of `free`, and the eigenvalue, for all exceptional points of
            this order in the ranges, and perhaps for others. A matrix with semisimple crossings only has none.
        matrices: H, or A, or M, K and perhaps D.
    """

    name: str
    source: str
    free: Mapping[str, tuple[float, float]]
    locate: str
    points: Rows
    matrices: Mapping[str, Rows]

    @property
    def order(self) -> int:
        """Multiplicity of the eigenvalue."""
        return int(self.locate.lstrip("CEP"))

    @property
    def dimension(self) -> int:
        """Number of eigenvalues."""
        return len(next(iter(self.matrices.values()))) * (1 + ("M" in self.matrices))

    @cached_property
    def known(self) -> list[list[Any]]:
        """The points in the ranges, in numbers."""
        with mp.workdps(DIGITS):
            numbers = [[evaluate(x, {"pi": +mp.pi}, MANY_DIGITS) for x in point] for point in self.points]
        ranges = self.free.values()
        return [p for p in numbers if all(a <= x <= b for x, (a, b) in zip(p[:-1], ranges, strict=True))]

    @cached_property
    def size(self) -> float:
        """Norm of the matrix at the first of the points."""
        return float(np.linalg.norm(_doubles(self.matrix(self.known[0][:-1])), 2))

    def matrix(self, parameters: Sequence[Any]) -> Any:
        """H or A; for M, D and K the matrix of the states q and q′."""
        values = dict(zip(self.free, parameters, strict=True))
        parts = {
            key: mp.matrix([[evaluate(x, values, MANY_DIGITS) if x != "0" else 0 for x in row] for row in rows])
            for key, rows in self.matrices.items()
        }
        if "M" not in parts:
            return next(iter(parts.values()))
        n, inverse = parts["M"].rows, parts["M"] ** -1
        states = mp.zeros(2 * n)
        states[:n, n:], states[n:, :n] = mp.eye(n), -inverse * parts["K"]
        states[n:, n:] = -inverse * parts.get("D", mp.zeros(n))
        return states


@dataclass(frozen=True)
class Verdict:
    """What parameters and an eigenvalue are worth. All numbers are shares of the norm of the matrix.

    Attributes:
        errors: distances of the parameters and of the eigenvalue from the nearest point.
        backward: norm of a change of the matrix that makes the eigenvalue defective to its order.
        second: second smallest singular value of the matrix minus the eigenvalue: 0 for two eigenvectors.
    """

    errors: tuple[float, ...]
    backward: float
    second: float


def judge(system: System, parameters: Sequence[Any], eigenvalue: Any) -> Verdict:
    """The verdict, from the parameters and the eigenvalue alone."""
    with mp.workdps(DIGITS):
        s = mp.mpc(eigenvalue)
        s = mp.mpc(s.real, abs(s.imag)) if system.locate.startswith("C") else s
        found = [*map(mp.mpf, parameters), s]
        distances = [[abs(a - b) / system.size for a, b in zip(found, point, strict=True)] for point in system.known]
        matrix = system.matrix(found[:-1])
        return Verdict(tuple(map(float, min(distances, key=max))), *_defect(matrix - s * mp.eye(matrix.rows), system))


def _defect(matrix: Any, system: System) -> tuple[float, float]:
    """Norm of a change after which a matrix has a chain of the order of a system for 0, and its second singular value.

    Let b and c be the singular vectors of the smallest singular value. In A x₀ + b f₀ = 0 and A x_j + b f_j = x_(j−1)
    with c* x₀ = 1 and c* x_j = 0 for j > 0, the change b w* with w* x_j = f_j is the least one. There is none if the
    x_j depend on each other, as at a simple eigenvalue of a diagonal matrix.
    """
    n, k = matrix.rows, system.order
    left, values, right = np.linalg.svd(_doubles(matrix))
    bordered = mp.zeros(n + 1)
    bordered[:n, :n], bordered[:n, n], bordered[n, :n] = matrix, mp.matrix(left[:, -1]), mp.matrix(right[-1]).T
    chain, side = mp.zeros(n + 1, k), mp.matrix([0] * n + [1])
    try:
        factors, order = mp.mp.LU_decomp(bordered)
        for j in range(k):
            chain[:, j] = mp.mp.U_solve(factors, mp.mp.L_solve(factors, side, order))
            side = mp.matrix([*chain[:n, j], 0])
        x, f = chain[:n, :], chain[n, :].H
        square = (f.H * mp.lu_solve(x.H * x, f))[0]
    except (ZeroDivisionError, TypeError):  # mpmath raises both if the matrix is exactly singular
        square = mp.inf
    return float(mp.sqrt(abs(square))) / system.size, float(values[-2]) / system.size


def _doubles(matrix: Any) -> Any:
    return np.array(matrix.tolist(), dtype=complex)


def _rows(text: str) -> Rows:
    return [[entry.strip() for entry in row.split(",")] for row in text.split(";")]


def _system(
    name: str, free: str, locate: str, points: Rows | str = (), source: str = "constructed", **matrices: Rows | str
) -> System:
    """Commas separate columns, semicolons rows."""
    ranges = {n: (float(a), float(b)) for n, a, b in (words.split() for words in free.split(","))}
    tables = {key: _rows(x) if isinstance(x, str) else x for key, x in {"points": points, **matrices}.items()}
    return System(name, source, ranges, locate, tables.pop("points"), tables)


def _chain(diagonal: Sequence[str], up: Sequence[str], down: Sequence[str], corners: Sequence[str] = "00") -> Rows:
    """Neighbours in a row, coupled by `up` above the diagonal and by `down` below it, in turn; and the two ends."""
    n = len(diagonal)
    rows = [["0"] * n for _ in diagonal]
    rows[0][-1], rows[-1][0] = corners
    for i, x in enumerate(diagonal):
        rows[i][i] = x
        if i + 1 < n:
            rows[i][i + 1], rows[i + 1][i] = up[i % len(up)], down[i % len(down)]
    return rows


def _text(number: Any) -> str:
    parts = [mp.nstr(part, DIGITS) for part in (mp.re(number), mp.im(number))]
    return " + 1j*".join(parts if mp.im(number) else parts[:1])


def _spin(n: int) -> System:
    """S_x + i g S_z."""
    off = [f"sqrt({(i + 1) * (n - 1 - i)})/2" for i in range(n - 1)]
    H = _chain([f"1j*g*{(n - 1) / 2 - i}" for i in range(n)], off, off)
    return _system(f"spin, {n}", "g 0.3 1.7", f"EP{n}", "1, 0", "Graefe and others, J. Phys. A 41 (2008) 255206", H=H)


def _ends(n: int, right: str) -> System:
    """At g² = r l the eigenvalue 0 is double if n is even; it is triple at g² = r l (n + 1)/(n − 1) if n is odd."""
    point = f"sqrt({right}*{n + n % 2}/{n - n % 2}), 0"
    H = _chain(["1j*g", *["0"] * (n - 2), "-1j*g"], ["1"], [right])
    source = "Jin, Song, Phys. Rev. A 80 (2009) 052107"
    return _system(f"gain and loss at the ends, {n}", "g 0.7 1.4", f"EP{2 + n % 2}", point, source, H=H)


def _middle(n: int) -> System:
    """At g = 1 the polynomial is the square of that of half the chain."""
    half = n // 2
    empty, source = ["0"] * (half - 1), "Joglekar and others, Phys. Rev. A 82 (2010) 030103"
    H = _chain([*empty, "1j*g", "-1j*g", *empty], ["1"], ["1"])
    points = [["1", f"2*cos({k}*pi/{half + 1})"] for k in range(1, half + 1)]
    return _system(f"gain and loss in the middle, {n}", "g 0.5 1.5", "EP2", points, source, H=H)


def _halves(n: int, *starts: tuple[float, float]) -> System:
    """Gain in one half and loss in the other. The starts are values of g and of the eigenvalue."""

    def polynomial(g: Any, x: Any) -> Any:
        outer, inner = (abs(mp.chebyu(m, (x - 1j * g) / 2)) ** 2 for m in (n // 2, n // 2 - 1))
        return outer - inner

    def equations(g: Any, x: Any) -> list[Any]:
        return [polynomial(g, x), mp.diff(lambda y: polynomial(g, y), x)]

    found = [mp.findroot(equations, start) for start in starts]
    H = _chain(["1j*g"] * (n // 2) + ["-1j*g"] * (n // 2), ["1"], ["1"])
    points = [[_text(g), _text(sign * x)] for g, x in found for sign in (1, -1)]
    return _system(f"gain and loss in halves, {n}", "g 0.05 0.9", "EP2", points, H=H)


def _alternate(n: int) -> System:
    """The squares of the eigenvalues are those of the chain without gain, less g²."""
    points = [[f"2*cos({k}*pi/{n + 1})", "0"] for k in range(1, n // 2 + 1)]
    H = _chain(["1j*g", "-1j*g"] * (n // 2), ["1"], ["1"])
    source = "Li, Kevrekidis, Phys. Rev. E 83 (2011) 066608"
    return _system(f"gain and loss in turn, {n}", "g 0.1 2", "EP2", points, source, H=H)


def _condensed(cells: int) -> System:
    """A chain of Su, Schrieffer and Heeger. At t = 1/2 pairs with the eigenvalues ±1 are coupled one way."""
    source = "Martinez Alvarez and others, Phys. Rev. B 97 (2018) 121401"
    H = _chain(["0"] * 2 * cells, ["t + 1/2", "1"], ["t - 1/2", "1"])
    return _system(f"cells, {cells}", "t 0.2 1", f"EP{cells - 1}", "1/2, 1; 1/2, -1", source, H=H)


def _feedback(n: int) -> System:
    """The matrix of a polynomial whose roots are equal; only their sum is fixed."""
    s, names = mp.mpc(0.5, -0.25), range(n - 1)
    numbers = [-mp.binomial(n, j) * (-s) ** (n - j) for j in names]
    H = [["1" if j == i + 1 else "0" for j in range(n)] for i in names]
    H.append([*(f"x{j} + 1j*y{j}" for j in names), _text(n * s)])
    point = [_text(part) for c in numbers for part in (c.real, c.imag)]
    free = ", ".join(f"x{j} -4 4, y{j} -4 4" for j in names)
    return _system(f"chain with feedback, {n}", free, f"EP{n}", [[*point, _text(s)]], H=H)


def _round(n: int) -> System:
    """The nth power of each eigenvalue is x + i y."""
    H = _chain(["0"] * n, ["1"], ["0"], ["0", "x + 1j*y"])
    return _system(f"one way round, {n}", "x -0.4 0.5, y -0.5 0.4", f"EP{n}", "0, 0, 0", H=H)


def _boundary(n: int, right: str) -> System:
    """An eigenvalue is 2 √r cos q where e = r^(1 − n/2) sin((n + 1) q)/sin q. At a point, the slope of e(q) is 0."""
    r, points = mp.mpf(right), []
    for k in range(1, n):
        ends = [mp.pi * j / (n + 1) for j in (k, k + 1)]
        q = mp.findroot(lambda q: n * mp.sin((n + 2) * q) - (n + 2) * mp.sin(n * q), ends, solver="anderson")
        points.append([_text(r ** (1 - n / 2) * mp.sin((n + 1) * q) / mp.sin(q)), _text(2 * mp.sqrt(r) * mp.cos(q))])
    A = _chain(["0"] * n, ["1"], [right], ["e", "0"])
    return _system(f"weak link, {n}", "e 0.01 0.3", "EP2", points, _CHAIN, A=A)


def _impurity(n: int, right: str) -> System:
    """The same with x + i y = √r sin((n + 1) q)/sin(n q)."""
    t, m, points = mp.sqrt(mp.mpf(right)), 2 * n + 1, []

    def condition(q: Any) -> Any:
        return mp.sin(m * q) - m * mp.sin(q)

    def slope(q: Any) -> Any:
        return m * (mp.cos(m * q) - mp.cos(q))

    for k in range(1, n):
        start = mp.mpc(mp.pi * (2 * k + 0.5), mp.log(2 * m * mp.sin(2 * k * mp.pi / m))) / m
        q = mp.findroot(condition, start, solver="newton", df=slope)
        z, s = t * mp.sin((n + 1) * q) / mp.sin(n * q), 2 * t * mp.cos(q)
        points.append([*map(_text, (z.real, -z.imag, mp.conj(s)))])
    H = _chain(["x + 1j*y", *["0"] * (n - 1)], ["1"], [right])
    return _system(f"impurity, {n}", "x -2 2, y 0 2", "EP2", points, _CHAIN, H=H)


def _pencil(n: int) -> System:
    """H₀ + z H₁: eigenvalues meet at the roots of the discriminant, a polynomial of degree n (n − 1) in z."""
    one, other = (np.random.default_rng(n).integers(-99, 100, (2, n, n, 2)) @ [1, 1j]).tolist()
    degree, points = n * (n - 1), []

    def eigenvalues(z: Any) -> Any:
        return mp.eig((mp.matrix(one) + z * mp.matrix(other)) / 100, left=False, right=False)

    with mp.workdps(2 * DIGITS):
        turns = [mp.expjpi(mp.mpf(2 * k) / (degree + 1)) for k in range(degree + 1)]
        values = [mp.fprod((a - b) ** 2 for a, b in combinations(eigenvalues(z), 2)) for z in turns]
        powers = [mp.fdot(values, [z**-k for z in turns]) for k in reversed(range(degree + 1))]
        for z in mp.polyroots(powers, maxsteps=500, extraprec=500):
            pair = min(combinations(eigenvalues(z), 2), key=lambda pair: abs(pair[0] - pair[1]))
            points.append([*map(_text, (z.real, z.imag, sum(pair) / 2))])
    H = [[f"({a} + (x + 1j*y)*{b})/100" for a, b in zip(*rows, strict=True)] for rows in zip(one, other, strict=True)]
    return _system(f"pencil, {n}", "x -2 2, y -2 2", "EP2", points, H=H)


def _gyroscopes(cells: int) -> System:
    """Gyroscopes on hills, in a row. A mode with stiffnesses −a and −b becomes stable at W = (√a + √b)/2."""
    points, n = [], 2 * cells
    for k in range(1, cells + 1):
        a, b = (f"({x} - 0.4*sin({k}*pi/{n + 2})**2)" for x in (1, 2))
        points.append([f"(sqrt{a} + sqrt{b})/2", f"1j*sqrt(sqrt({a}*{b}))"])
    springs = ["0" if i == cells else "-0.1" for i in range(1, n)]
    K = _chain(["-0.8"] * cells + ["-1.8"] * cells, springs, springs)
    D = [[{cells: "2*W", -cells: "-2*W"}.get(j - i, "0") for j in range(n)] for i in range(n)]
    source = "Kirillov, Nonconservative Stability Problems of Modern Physics (2013), for one"
    return _system(f"gyroscopes, {n}", "W 0.9 1.4", "CEP2", points, source, M=_chain(["1"] * n, "0", "0"), D=D, K=K)


def _masses(n: int) -> System:
    """Each mode has a critical damping."""
    modes = [f"sqrt(1 + 4*sin({k}*pi/{2 * n + 2})**2)" for k in range(1, n + 1)]
    M, D, K = (_chain([x] * n, [y], [y]) for x, y in (("1", "0"), ("c", "0"), ("3", "-1")))
    return _system(f"masses, {n}", "c 0.5 6", "EP2", [[f"2*{w}", f"-{w}"] for w in modes], M=M, D=D, K=K)


@cache
def systems() -> tuple[System, ...]:
    """Sixty systems with points, then ten without."""
    with mp.workdps(DIGITS):
        large = [
            *map(_spin, (3, 4, 6, 10, 20)),
            *map(_ends, (20, 21, 100), ("1.25", "1", "1.04")),
            _middle(20),
            _halves(4, (0.56, 1.09)),
            _halves(12, (0.1025, 1.851), (0.257, 1.313), (0.356, 0.474)),
            _alternate(10),
            *map(_condensed, (4, 10)),
            *map(_feedback, (3, 5)),
            *map(_round, (10, 30)),
            *map(_boundary, (20, 40, 100), ("1.25", "1.1", "1.05")),
            *map(_impurity, (20, 100), ("1.25", "1.04")),
            *map(_pencil, (2, 3, 4)),
            *map(_gyroscopes, (5, 20)),
            _masses(40),
        ]
    none = _system("chain with a detuned end", "v -2 2", "EP2", H=_chain(["v", *["0"] * 19], ["1"], ["1"]))
    return (*large, *small("systems"), none)


def small(key: str) -> list[System]:
    """The systems of a table of the file: `systems`, or `examples` of EasterEig."""
    return [_system(**table) for table in tomllib.loads(_SMALL.read_text(encoding="utf-8"))[key]]
