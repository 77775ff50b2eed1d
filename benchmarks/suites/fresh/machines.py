"""Families of bicycles: skates without units, robots in SI, Whipple's geometry, gains."""

from collections.abc import Callable

from benchmarks.suites.fresh.bicycles import BENCHMARK, NU_H, SI, TMS
from benchmarks.suites.fresh.draw import Draw, Parts, made
from benchmarks.suites.fresh.problem import Problem, System

_SKATES = {
    "Fr": (0.3, 1.5, 2.0, 4.0),
    "mu": (0.02, 0.1, 0.3, 2.0),
    "chi_B": (0.3, 0.9, 1.05, 2.0),
    "chi_H": (0.8, 0.95, 1.02, 1.3),
    "zeta_B": (-1.5, -0.8, -0.5, -0.25),
    "zeta_H": (-0.7, -0.4, -0.2, -0.05),
    "lambda_s": (-0.6, -0.1, 0.2, 1.2),
}
"""Between which numbers the lower limit is drawn, and the upper one."""

_ROBOT = {
    "w": (0.3, 0.6, 0.8, 1.3),
    "v": (0.8, 2.0, 3.0, 7.0),
    "m_B": (4.0, 10.0, 15.0, 40.0),
    "m_H": (0.5, 1.5, 2.0, 8.0),
    "x_B": (0.1, 0.3, 0.6, 1.1),
    "z_B": (-1.1, -0.7, -0.4, -0.15),
    "x_H": (0.3, 0.6, 0.8, 1.3),
    "z_H": (-0.9, -0.5, -0.3, -0.1),
    "lambda_s": (-0.7, -0.1, 0.1, 0.7),
}


def _ranges(
    draw: Draw, table: dict[str, tuple[float, float, float, float]], free: list[str]
) -> tuple[dict[str, tuple[str, str]], dict[str, str]]:
    moves = {n: (draw.number(*table[n][:2]), draw.number(*table[n][2:])) for n in free}
    return moves, {n: draw.number(table[n][1], table[n][2]) for n in table if n not in free}


def skates(number: int) -> Problem:
    """Skates without units, one to four parameters free."""
    draw = Draw("skates", number)
    free, fixed = _ranges(draw, _SKATES, draw.some(list(_SKATES), 1, 4))
    if "chi_H" in fixed and draw.chance(0.5):
        fixed["chi_H"] = "1"
    if "lambda_s" in fixed:
        fixed["lambda_s"] = draw.number(0.05, 0.8)
    limits = {"arm": f"{draw.one(['nu_H', 'nu_H', 'abs(nu_H)'])} >= {draw.number(0.01, 0.06, 2)}"}
    if {"chi_B", "chi_H"} & set(free) and draw.chance(0.3):
        limits["layout"] = f"chi_B - chi_H >= {draw.number(0.02, 0.15, 2)}"
    sense, objective = "minimize", "abscissa"
    if draw.chance(0.15):
        sense, objective = "maximize", "damping_ratio"
    elif "Fr" in free and draw.chance(0.4):
        objective, limits["fast"] = "Fr", f"abscissa <= {draw.number(-0.6, -0.05, 2)}"
    elif "lambda_s" in free and draw.chance(0.3):
        sense, objective, limits["fast"] = "maximize", "lambda_s", f"abscissa <= {draw.number(-0.4, 0, 2)}"
    band = None
    if "Fr" not in free and draw.chance(0.3):
        fixed.pop("Fr")
        low, middle, high = draw.number(1.2, 1.6), draw.number(1.8, 2.2), draw.number(2.4, 3.2)
        band = ("Fr", [low, middle, high], draw.chance(0.7))
    system = System("coefficients", ((TMS,),), (NU_H,))
    return made(draw.name, Parts('model = "tms"', system, free, fixed, sense, objective, limits, band=band))


def robots(number: int) -> Problem:
    """Robots on skates in SI, with wheel loads and a steer arm."""
    draw = Draw("robots", number)
    free, fixed = _ranges(draw, _ROBOT, draw.some(list(_ROBOT), 2, 4))
    limits = {"arm": f"abs(u_H) >= {draw.number(0.01, 0.04, 2)}"}
    if draw.chance(0.6):
        limits["rear"] = f"N_R >= {draw.number(1, 20, 2)}"
        limits["front"] = f"N_F >= {draw.number(1, 20, 2)}"
    sense, objective = draw.one([("minimize", "abscissa"), ("maximize", "decay_rate"), ("maximize", "decay_rate")])
    if "v" in free and draw.chance(0.25):
        sense, objective, limits["decay"] = "minimize", "v", f"decay_rate >= {draw.number(0.1, 1.5, 2)}"
    band = None
    if "v" not in free and draw.chance(0.3):
        fixed.pop("v")
        band = ("v", [draw.number(2, 2.6), draw.number(3, 3.6), draw.number(4, 5)], draw.chance(0.7))
    fixed["g"] = "9.81"
    system = System("coefficients", ((TMS,),), SI, "sqrt(g/w)")
    return made(draw.name, Parts('model = "tms"', system, free, fixed, sense, objective, limits, band=band))


def _wheels(draw: Draw) -> dict[str, str]:
    """Benchmark bicycle, each number moved by up to 15 %."""
    fixed = {n: f"{x * draw.rng.uniform(0.85, 1.15):.4g}" for n, x in BENCHMARK.items()}
    return {**fixed, "lambda_s": draw.number(0.15, 0.45), "g": "9.81"}


_GEOMETRY = {
    "c": (-0.12, -0.02, 0.05, 0.2),
    "lambda_s": (-0.2, 0.2, 0.5, 1.0),
    "v": (1.0, 4.0, 5.0, 9.0),
    "x_H": (0.7, 0.85, 0.95, 1.2),
    "z_H": (-1.0, -0.8, -0.6, -0.4),
    "m_H": (1.0, 3.0, 5.0, 12.0),
    "x_B": (0.2, 0.3, 0.4, 0.7),
    "z_B": (-1.1, -0.9, -0.7, -0.5),
}


def wheels(number: int) -> Problem:
    """Whipple's bicycle: geometry."""
    draw = Draw("wheels", number)
    fixed = _wheels(draw)
    chosen = draw.some(list(_GEOMETRY), 1, 4)
    free, _ = _ranges(draw, _GEOMETRY, chosen)
    fixed = {n: x for n, x in fixed.items() if n not in free}
    limits, sense, objective = {}, "minimize", "abscissa"
    if "v" in free and draw.chance(0.5):
        objective, limits["decay"] = "v", f"abscissa <= {draw.number(-0.3, 0, 2)}"
    elif draw.chance(0.3):
        sense, objective = "maximize", draw.one(["decay_rate", "damping_ratio"])
    band = None
    if "v" not in free and draw.chance(0.3):
        fixed.pop("v")
        band = ("v", [draw.number(4.2, 4.6), draw.number(5, 5.5), draw.number(6, 7)], draw.chance(0.7))
    parts = Parts('model = "whipple"', System("whipple"), free, fixed, sense, objective, limits, band=band)
    return made(draw.name, parts)


_GAINS = ("k_phi", "k_phidot", "k_delta", "k_deltadot")


def motors(number: int) -> Problem:
    """Gains of a motor at the handlebar of Whipple's bicycle, or of skates in SI."""
    draw = Draw("motors", number)
    skates = draw.chance(0.35)
    fixed = _wheels(draw)
    fixed["v"] = draw.number(0.8, 5)
    if skates:
        fixed = {n: draw.number(_ROBOT[n][1], _ROBOT[n][2]) for n in _ROBOT}
        fixed |= {"lambda_s": draw.number(0.05, 0.5), "x_H": f"{float(fixed['w']) * draw.rng.uniform(1, 1.2):.3g}"}
        fixed["g"] = "9.81"
    wide = draw.one([5, 20, 80, 200])
    chosen = draw.some(_GAINS, 1, 4)
    free = {n: (draw.number(-wide, -0.3 * wide), draw.number(0.3 * wide, wide)) for n in chosen}
    fixed |= {n: draw.number(-0.1 * wide, 0.1 * wide) for n in _GAINS if n not in chosen and draw.chance(0.3)}
    sense, objective, limits = "maximize", "decay_rate", {}
    if not skates and draw.chance(0.3):
        sense, objective = draw.one([("minimize", "abscissa"), ("maximize", "damping_ratio")])
    if draw.chance(0.25):
        sense, objective = "minimize", " + ".join(f"{n}**2" for n in chosen)
        limits = {"decay": f"decay_rate >= {draw.number(0.05, 0.6, 2)}"}
    band = None
    if draw.chance(0.25):
        fixed.pop("v")
        band = ("v", [draw.number(1, 1.5), draw.number(2, 3), draw.number(4, 5)], draw.chance(0.7))
    quantities, rate = ((("time", "sqrt(w/g)"),), "1/time") if skates else ((), "1")
    head = f'model = "{"tms" if skates else "whipple"}"'
    parts = Parts(
        head, System("whipple", quantities=quantities, rate=rate), free, fixed, sense, objective, limits, _GAINS, band
    )
    return made(draw.name, parts)


MACHINES: dict[str, Callable[[int], Problem]] = {"skates": skates, "robots": robots, "wheels": wheels, "motors": motors}
