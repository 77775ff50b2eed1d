"""Families at the edge: no feasible design by construction, and barely one."""

import math
from collections.abc import Callable

from benchmarks.suites.fresh.bicycles import NU_H, TMS
from benchmarks.suites.fresh.draw import Draw, Parts, made, stated
from benchmarks.suites.fresh.problem import Problem, System

_SKATES = System("coefficients", ((TMS,),), (NU_H,))


def _two_masses(draw: Draw, dampers: tuple[str, str, str]) -> tuple[str, System]:
    """Two equal oscillators, coupled alike."""
    k, q, (a, b, c) = draw.number(0.5, 3), draw.number(0.1, 1), dampers
    return stated(
        "MDK",
        [["1", "0"], ["0", "1"]],
        [[f"{a} + {b}", f"-{b}"], [f"-{b}", f"{b} + {c}"]],
        [[f"{k} + {q}", f"-{q}"], [f"-{q}", f"{k} + {q}"]],
    )


def impossible(number: int) -> Problem:
    """Infeasible: by the sum or product of the roots, by signs, by limits that exclude each other."""
    draw = Draw("impossible", number)
    excess = draw.one([0.2, 0.02, 0.002])
    objective = "abscissa"
    match number % 6:
        case 0:
            n = int(draw.rng.integers(3, 6))
            decay = float(draw.number(0.5, 3, 2))
            names = [f"a{i}" for i in range(2, n + 1)]
            head, system = stated("coefficients", [["1", f"{n * decay:.6g}", *names]])
            free = {a: ("0", f"{2 * math.comb(n, i) * decay**i:.4g}") for i, a in enumerate(names, 2)}
            fixed: dict[str, str] = {}
            limits, why = {"fast": f"abscissa <= {-decay * (1 + excess):.9g}"}, "the roots have the mean value −c/n"
            objective = "a2"
        case 1 | 2 as kind:
            free = {"Fr": ("0.5", "6"), "chi_B": ("1.05", "3"), "lambda_s": ("0.05", "1.3")}
            fixed = {"mu": "0.1", "chi_H": "1", "zeta_B": draw.number(-1.2, -0.5), "zeta_H": draw.number(-0.4, -0.15)}
            head, system = 'model = "tms"', _SKATES
            if kind == 1:
                least = -((float(fixed["zeta_B"]) * float(fixed["zeta_H"])) ** -0.25)
                limits, why = {"fast": f"abscissa <= {least * (1 + excess):.9g}"}, "abscissa ≥ −(a4/a0)^(1/4)"
                objective = "Fr"
            else:
                free["chi_B"] = ("0.3", draw.number(0.9, 0.999))
                limits, why = {"stable": f"abscissa <= -{0.5 * excess:.3g}"}, "a3 < 0 < a0 for χ_B < χ_H = 1"
                objective = "lambda_s"
        case 3:
            head, system = _two_masses(draw, ("c0", "c1", "c2"))
            high = [draw.number(0.5, 2) for _ in range(3)]
            free, fixed = {f"c{i}": ("0", h) for i, h in enumerate(high)}, {}
            total = float(high[0]) + 2 * float(high[1]) + 0.5 * float(high[2])
            limits = {"much": f"c0 + 2*c1 + 0.5*c2 >= {total * (1 + excess):.9g}"}
            why = "the sum at the upper limits"
        case 4:
            head, system = _two_masses(draw, ("c0", "c1", "c2"))
            free, fixed = {"c0": ("0", "3"), "c2": ("0", "3")}, {"c1": "0.1"}
            r = float(draw.number(0.5, 2, 2))
            limits = {"disc": f"c0**2 + c2**2 <= {r:.9g}", "both": f"c0*c2 >= {0.5 * r * (1 + excess):.9g}"}
            why = "2 c0 c2 ≤ c0² + c2²"
        case _:
            head, system = _two_masses(draw, ("0", "c1", "0"))
            free, fixed = {"c1": ("0", draw.number(1, 5))}, {}
            limits, why = {"stable": f"abscissa <= -{0.05 * excess:.3g}"}, "both masses in phase meet no damper"
            objective = "c1"
    parts = Parts(head, system, free, fixed, "minimize", objective, limits)
    return made(draw.name, parts, infeasible=why)


def barely(number: int) -> Problem:
    """A small set of feasible designs, with one that is known."""
    draw = Draw("barely", number)
    slack = draw.one([1e-2, 3e-3, 1e-3])
    sense, objective = "minimize", "abscissa"
    match number % 4:
        case 0:
            n = int(draw.rng.integers(3, 5))
            decay = float(draw.number(0.5, 3, 2))
            names = [f"a{i}" for i in range(2, n + 1)]
            head, system = stated("coefficients", [["1", f"{n * decay:.6g}", *names]])
            at = {a: math.comb(n, i) * decay**i for i, a in enumerate(names, 2)}
            free = {a: ("0", f"{x * draw.rng.uniform(1.3, 8):.4g}") for a, x in at.items()}
            fixed: dict[str, str] = {}
            limits, objective = {"fast": f"abscissa <= {-decay * (1 - slack):.9g}"}, names[-1]
        case 1:
            fixed = {"mu": "0.1", "chi_H": "1", "zeta_B": draw.number(-0.9, -0.5), "zeta_H": draw.number(-0.4, -0.2)}
            b, h = float(fixed["zeta_B"]), float(fixed["zeta_H"])
            w = -((b * h) ** -0.25)
            tan = w**2 * (b - h) / (16 * h) * ((b + h) * w**2 - 6) / ((b + h) * w**2 - 2)
            lever = math.sqrt(b / h)
            speed = 4 * w * h * tan * b / (b - h * lever)
            at = {"Fr": speed, "chi_B": lever, "lambda_s": math.atan(tan)}
            free = {
                "Fr": ("0.5", f"{2 * speed:.3g}"),
                "chi_B": ("1.01", f"{2 * lever:.3g}"),
                "lambda_s": ("0.01", "1.4"),
            }
            head, system = 'model = "tms"', _SKATES
            limits, objective = {"fast": f"abscissa <= {w * (1 - slack):.9g}"}, "Fr"
        case 2:
            head, system = _two_masses(draw, ("c0", draw.number(0.05, 0.5), "c2"))
            r = float(draw.number(0.5, 2, 2))
            free, fixed = {"c0": ("0", "3"), "c2": ("0", "3")}, {}
            at = {"c0": math.sqrt(r / 2), "c2": math.sqrt(r / 2)}
            sum_ = math.sqrt(2 * r) * (1 - slack**2)
            limits = {"disc": f"c0**2 + c2**2 <= {r:.9g}", "sum": f"c0 + c2 >= {sum_:.12g}"}
        case _:
            a, top = draw.number(1, 9), float(draw.number(1, 10, 2))
            head, system = stated("coefficients", [["1", "kd", f"kp - {a}"]])
            at = {"kp": float(a) + top**2 / 4, "kd": top * (1 - 0.1 * slack)}
            at["kp"] = float(a) + at["kd"] ** 2 / 4 * (1 - 1e-9)
            free, fixed = {"kp": ("0", f"{3 * at['kp']:.4g}"), "kd": ("0", f"{top:.6g}")}, {}
            limits = {"fast": f"abscissa <= {-top / 2 * (1 - slack):.9g}", "calm": f"damping_ratio >= {1 - slack:.9g}"}
            sense, objective = "minimize", "kp"
    return made(draw.name, Parts(head, system, free, fixed, sense, objective, limits), feasible=at)


EDGES: dict[str, Callable[[int], Problem]] = {"impossible": impossible, "barely": barely}
