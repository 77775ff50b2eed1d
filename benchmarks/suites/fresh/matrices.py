"""Families of stated systems: chains, gyroscopes, output gains, polynomials, complex H."""

from collections.abc import Callable

import numpy as np

from benchmarks.suites.fresh.draw import Draw, Parts, made, stated, texts
from benchmarks.suites.fresh.problem import Problem


def _limit_of_decay(draw: Draw, names: list[str], high: float) -> tuple[str, str, dict[str, str]]:
    """Objective and limits: mostly the abscissa."""
    if draw.chance(0.2):
        return "maximize", "damping_ratio", {}
    if draw.chance(0.2):
        return "minimize", " + ".join(names), {"decay": f"abscissa <= {draw.number(-0.15, -0.02, 2)}"}
    if draw.chance(0.3):
        return "minimize", "abscissa", {"budget": f"{' + '.join(names)} <= {high * len(names) / 2:.3g}"}
    return "minimize", "abscissa", {}


def chains(number: int) -> Problem:
    """Masses in a row between springs and dampers, some of them free."""
    draw = Draw("chains", number)
    n = int(draw.rng.integers(2, 5))
    dampers = [draw.number(0.05, 0.8) if draw.chance(0.4) else f"c{i}" for i in range(n + 1)]
    springs = [draw.number(0.3, 3) for _ in range(n + 1)]
    if draw.chance(0.4):
        springs[int(draw.rng.integers(n + 1))] = "k"
    names = [d for d in dampers if d.startswith("c")][:4]
    dampers = [d if d in names or not d.startswith("c") else "0.2" for d in dampers]
    free = {c: ("0", draw.number(1, 4)) for c in names}
    if "k" in springs:
        free["k"] = ("0.1", draw.number(2, 6))
    if not free:
        dampers[0], free = "c0", {"c0": ("0", "3")}

    def chain(of: list[str]) -> list[list[str]]:
        found = [["0"] * n for _ in range(n)]
        for i in range(n):
            found[i][i] = f"{of[i]} + {of[i + 1]}"
            if i:
                found[i][i - 1] = found[i - 1][i] = f"-{of[i]}"
        return found

    mass = [["0"] * n for _ in range(n)]
    for i in range(n):
        mass[i][i] = draw.number(0.5, 2)
    head, system = stated("MDK", mass, chain(dampers), chain(springs))
    sense, objective, limits = _limit_of_decay(draw, list(free), 2)
    return made(draw.name, Parts(head, system, free, {}, sense, objective, limits))


def gyroscopes(number: int) -> Problem:
    """Two degrees of freedom with gyroscopic and circulatory forces."""
    draw = Draw("gyroscopes", number)
    values = {
        "d1": (0.0, 0.1, 0.5, 2.0),
        "d2": (0.0, 0.1, 0.5, 2.0),
        "gy": (-2.0, 0.0, 0.5, 4.0),
        "ci": (-1.0, -0.1, 0.1, 1.0),
        "k1": (0.2, 0.8, 1.0, 3.0),
        "k2": (0.2, 0.8, 1.0, 3.0),
    }
    chosen = draw.some(list(values), 2, 4)
    free = {n: (draw.number(*values[n][:2]), draw.number(*values[n][2:])) for n in chosen}
    fixed = {n: draw.number(values[n][1], values[n][2]) for n in values if n not in chosen}
    cross = draw.number(-0.3, 0.3)
    head, system = stated(
        "MDK",
        [["1", "0"], ["0", draw.number(0.5, 2)]],
        [["d1", "gy"], ["-gy", "d2"]],
        [["k1", f"ci + {cross}"], [f"-ci + {cross}", "k2"]],
    )
    sense, objective = ("maximize", "damping_ratio") if draw.chance(0.65) else ("minimize", "abscissa")
    limits = (
        {"budget": f"d1 + d2 <= {draw.number(0.6, 2, 2)}"} if {"d1", "d2"} & set(chosen) and draw.chance(0.5) else {}
    )
    return made(draw.name, Parts(head, system, free, fixed, sense, objective, limits))


def gains(number: int) -> Problem:
    """x' = (A + b K c) x of 4 to 8 states."""
    draw = Draw("gains", number)
    n, p = int(draw.rng.integers(4, 9)), int(draw.rng.integers(1, 4))
    a = draw.matrix(n, 0.8) - draw.rng.uniform(0, 1) * np.eye(n).round(3)
    inputs = [draw.rng.normal(0, 1, n).round(2) * (draw.rng.random(n) < 0.6) for _ in range(p)]
    outputs = [draw.rng.normal(0, 1, n).round(2) * (draw.rng.random(n) < 0.6) for _ in range(p)]
    table = texts(a)
    for k in range(p):
        for i in range(n):
            for j in range(n):
                product = round(float(inputs[k][i] * outputs[k][j]), 4)
                if product:
                    table[i][j] += f" + {product:g}*g{k + 1}"
    table = [[t.replace("+ -", "- ") for t in row] for row in table]
    wide = draw.one([2, 10, 50])
    free = {f"g{k + 1}": (draw.number(-wide, -0.3 * wide), draw.number(0.3 * wide, wide)) for k in range(p)}
    head, system = stated("A", table)
    sense, objective = ("maximize", "damping_ratio") if draw.chance(0.15) else ("minimize", "abscissa")
    return made(draw.name, Parts(head, system, free, {}, sense, objective))


def polynomials(number: int) -> Problem:
    """Coefficients with products, roots and exponentials of two or three parameters."""
    draw = Draw("polynomials", number)
    n = int(draw.rng.integers(3, 7))
    roots: list[complex] = [] if n % 2 == 0 else [-draw.rng.uniform(0.3, 2)]
    for _ in range(n // 2):
        s = complex(-draw.rng.uniform(0.1, 1), draw.rng.uniform(0.2, 2))
        roots += [s, s.conjugate()]
    base = [f"{x:.3g}" for x in np.poly(roots).real]
    names = ["a", "b", "c"][: int(draw.rng.integers(2, 4))]
    free = {x: (draw.number(-2, -0.3), draw.number(0.5, 2)) for x in names}
    forms = (
        "{k}*{x}*{y}",
        "{k}*sqrt(1 + {x}**2)",
        "{k}*exp(-{x})",
        "{k}*{x}",
        "{k}*{x}**3",
        "{k}*sin(2*{x} + {y})",
        "{k}*exp(-40*({x} - 0.3)**2)",
        "{k}*{x}/(1.5 + {y}**2)",
    )
    row = ["1"]
    for k in range(1, n + 1):
        text = base[k]
        for _ in range(int(draw.rng.integers(0, 3)) if k < n else 1):
            size = f"{abs(float(base[k])) * draw.rng.uniform(0.1, 0.7):.3g}"
            text += f" {draw.one('+-')} " + draw.one(forms).format(k=size, x=draw.one(names), y=draw.one(names))
        row.append(text)
    for k, x in enumerate(names):
        row[1 + k % n] += f" + 0.2*{x}"
    head, system = stated("coefficients", [row])
    sense, objective, limits = "minimize", "abscissa", {}
    if draw.chance(0.2):
        sense, objective = "maximize", "damping_ratio"
    elif draw.chance(0.2):
        objective, limits = f"{names[0]}**2 + {names[1]}**2", {"decay": f"abscissa <= {draw.number(-0.3, -0.1, 2)}"}
    return made(draw.name, Parts(head, system, free, {}, sense, objective, limits))


def modes(number: int) -> Problem:
    """Two to four coupled modes with gain and loss: a complex H."""
    draw = Draw("modes", number)
    n = int(draw.rng.integers(2, 5))
    table = [["0"] * n for _ in range(n)]
    free: dict[str, tuple[str, str]] = {}
    for i in range(n):
        detuned, loss = draw.number(-1, 1), draw.number(0.05, 1)
        if draw.chance(0.5) and len(free) < 4:
            detuned, free[f"d{i}"] = f"d{i}", (draw.number(-2, -0.2), draw.number(0.2, 2))
        if draw.chance(0.4) and len(free) < 4:
            loss, free[f"l{i}"] = f"l{i}", ("0", draw.number(0.5, 2))
        table[i][i] = f"{detuned} - 1j*{loss}"
        for j in range(i):
            k, both = draw.number(0.2, 1), draw.chance(0.75)
            if j == i - 1 and draw.chance(0.4) and len(free) < 4:
                k, free[f"k{i}"] = f"k{i}", (draw.number(-1, 0.1), draw.number(0.5, 2))
            if j == i - 1 or draw.chance(0.4):
                table[i][j], table[j][i] = k, k if both else draw.number(0.1, 1)
    if not free:
        table[0][0], free = "d0 - 1j*0.3", {"d0": ("-1.5", "1")}
    limits = {}
    losses = [x for x in free if x.startswith("l")]
    if losses and draw.chance(0.6):
        limits["budget"] = f"{' + '.join(losses)} <= {0.6 * len(losses):.2g}"
    head, system = stated("H", table)
    return made(draw.name, Parts(head, system, free, {}, limits=limits))


MATRICES: dict[str, Callable[[int], Problem]] = {
    "chains": chains,
    "gyroscopes": gyroscopes,
    "gains": gains,
    "polynomials": polynomials,
    "modes": modes,
}
