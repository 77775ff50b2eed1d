"""Exceptional points in closed form, by construction or by a scan, and systems that have none."""

import math
from collections.abc import Callable

import numpy as np

from benchmarks.suites.fresh.draw import Draw, Parts, made, stated
from benchmarks.suites.fresh.problem import Problem


def points(number: int) -> Problem:
    """One of eight kinds."""
    kinds = (_dimer, _pair, _trimer, _scanned, _constructed, _symmetric, _crossing, _complex)
    return kinds[number % 8](Draw("points", number))


def _dimer(draw: Draw) -> Problem:
    """(h11 − h22)² + 4 k² = 0 where the gain is 2 k − loss."""
    k, loss, shift = draw.number(0.2, 1), draw.number(0.1, 1), draw.number(-1, 1)
    head, system = stated("H", [[f"{shift} + d + 1j*g", k], [k, f"{shift} - 1j*{loss}"]])
    top = 2 * float(k) - float(loss)
    free = {"d": ("-1.3", "1.1"), "g": (f"{top - 0.37:.6g}", f"{top + 1.13:.6g}")}
    return made(draw.name, Parts(head, system, free, {}, "locate", "EP2"), points=({"d": 0.0, "g": top},))


def _pair(draw: Draw) -> Problem:
    """(s² + a)(s² + c s + w) − k² = (s² + b s + a)² where b = k/√a, c = 2 b, w = a + k²/a."""
    a, k = draw.number(0.5, 3), draw.number(0.05, 0.5)
    table = [["1", "0"], ["0", "1"]], [["0", "0"], ["0", "c"]], [[a, f"-{k}"], [f"-{k}", "w"]]
    head, system = stated("MDK", *table)
    b, q = float(k) / math.sqrt(float(a)), float(k) ** 2 / float(a)
    free = {"c": ("0.01", f"{5 * b:.3g}"), "w": ("0.1", f"{float(a) + 3 * q + 1:.3g}")}
    at = {"c": 2 * b, "w": float(a) + q}
    return made(draw.name, Parts(head, system, free, {}, "locate", "CEP2"), points=(at,))


def _trimer(draw: Draw) -> Problem:
    """Demange and Graefe (2012): gain and loss are √2 k."""
    k, wide = draw.number(0.3, 1.2), draw.number(0.1, 1)
    head, system = stated("H", [["d1 + 1j*gain", k, "0"], [k, "0", k], ["0", k, "d3 - 1j*loss"]])
    top = math.sqrt(2) * float(k)
    free = {"gain": (f"{0.3 * top:.3g}", f"{2 * top:.3g}"), "loss": (f"{0.4 * top:.3g}", f"{2.2 * top:.3g}")}
    free |= {"d1": ("-0.9", wide), "d3": (f"-{wide}", "1")}
    at = {"gain": top, "loss": top, "d1": 0.0, "d3": 0.0}
    return made(draw.name, Parts(head, system, free, {}, "locate", "EP3"), points=(at,))


def _scanned(draw: Draw) -> Problem:
    """A0 + x A1, of which a scan finds where real roots meet."""
    n = int(draw.rng.integers(2, 5))
    head, system = stated("A", _pencil(draw, n, ("x",)))
    return made(draw.name, Parts(head, system, {"x": (draw.number(-3, -1), draw.number(1, 3))}, {}, "locate", "EP2"))


def _constructed(draw: Draw) -> Problem:
    """(s + r)³ (s + t), with terms that are 0 at one point."""
    r, t = float(draw.number(0.4, 2, 2)), float(draw.number(2.1, 4, 2))
    x, y = float(draw.number(-0.8, 0.8, 2)), float(draw.number(-0.8, 0.8, 2))
    u, v = f"(x - ({_decimal(x)}))", f"(y - ({_decimal(y)}))"
    terms = [f"0.5*{u}", f"{u} + 0.7*{v}", f"{v} - 0.4*{u}*{v}", f"{u}*{v} + 0.3*{u}"]
    base = np.poly([-r, -r, -r, -t])[1:].round(10)
    row = ["1", *(f"{_decimal(float(c))} + {f}" for c, f in zip(base, terms, strict=True))]
    head, system = stated("coefficients", [row])
    free = {"x": ("-1.05", "1.13"), "y": ("-1.07", "1.11")}
    return made(draw.name, Parts(head, system, free, {}, "locate", "EP3"), points=({"x": x, "y": y},))


def _symmetric(draw: Draw) -> Problem:
    """Real symmetric matrices are never defective."""
    table = _pencil(draw, 3, ("x", "y"))
    table = [[table[max(i, j)][min(i, j)] for j in range(3)] for i in range(3)]
    head, system = stated("A", table)
    free = {"x": ("-2", "1.9"), "y": ("-1.8", "2.1")}
    return made(draw.name, Parts(head, system, free, {}, "locate", "EP2"), defective=False)


def _crossing(draw: Draw) -> Problem:
    """Hermitian: at d = k = 0 the eigenvalues cross."""
    p, q, shift = draw.number(0.5, 2), draw.number(0.5, 2), draw.number(0.1, 1)
    head, system = stated("H", [[f"{p}*d + {shift}", "k"], ["k", f"{shift} - {q}*d"]])
    free = {"d": (draw.number(-2, -0.5), "1"), "k": ("-0.9", draw.number(0.5, 2))}
    return made(draw.name, Parts(head, system, free, {}, "locate", "EP2"), defective=False)


def _complex(draw: Draw) -> Problem:
    """x + i y = h22 ± 2 √(−k k')."""
    k, back, re, im = draw.number(0.2, 1), draw.number(0.2, 1), draw.number(-0.5, 0.5), draw.number(0.1, 1)
    sign = draw.one(["", "-"])
    head, system = stated("H", [["x + 1j*y", k], [f"{sign}{back}", f"{re} - 1j*{im}"]])
    half = 2 * math.sqrt(float(k) * float(back))
    x, y = float(re), -float(im)
    at = tuple({"x": x + way, "y": y} if sign else {"x": x, "y": y + way} for way in (-half, half))
    free = {"x": ("-3.1", "3.2"), "y": ("-3.3", "3.4")}
    return made(draw.name, Parts(head, system, free, {}, "locate", "EP2"), points=at)


def _pencil(draw: Draw, n: int, names: tuple[str, ...]) -> list[list[str]]:
    """A constant matrix plus one for each name."""
    parts = [draw.matrix(n).round(2) for _ in range(1 + len(names))]

    def entry(i: int, j: int) -> str:
        return f"{parts[0][i, j]:g}" + "".join(f" + ({m[i, j]:g})*{x}" for x, m in zip(names, parts[1:], strict=True))

    return [[entry(i, j) for j in range(n)] for i in range(n)]


def _decimal(x: float) -> str:
    return np.format_float_positional(x, trim="-")


MEETINGS: dict[str, Callable[[int], Problem]] = {"points": points}
