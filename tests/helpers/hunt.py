"""Global searches that share nothing with the solver: differential evolution on eigenvalues, in shrinking boxes.

The model is `laws.copo`, the roots are eigenvalues of companion matrices, and the numbers of a problem file are read
here by `tomllib`. Nothing of `tmsopt.problem` is used. A search is no proof, but one that agrees with a
solver of another kind, from another start, on another formulation, leaves little room.
"""

import re
import tomllib
from math import pi

import numpy as np
from helpers.places import PROBLEMS
from scipy.optimize import differential_evolution

from tmsopt import laws

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "kg": 1.0, "m/s": 1.0, "deg": pi / 180}
GRAVITY = 9.81
NATIVE = ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")


# Problem files


def number(written):
    """A number, or a text with a unit, in SI and radians."""
    if not isinstance(written, str):
        return float(written)
    value, unit = re.fullmatch(r"(\S+) (\S+)", written).groups()  # type: ignore[union-attr]
    return float(value) * UNITS[unit]


def read(name):
    """Fixed values and boxes of a problem file."""
    written = tomllib.loads((PROBLEMS / f"{name}.toml").read_text(encoding="utf-8"))["parameters"]
    fixed = {n: number(v) for n, v in written.items() if not isinstance(v, dict)}
    box = {n: (number(v["min"]), number(v["max"])) for n, v in written.items() if isinstance(v, dict)}
    return fixed, box


# Designs


def native(design):
    """The dimensionless parameters of a design in SI; of a dimensionless one, its parameters."""
    if "w" not in design:
        return {n: design[n] for n in NATIVE}
    d, w = design, design["w"]
    return {
        "Fr": d["v"] / np.sqrt(d.get("g", GRAVITY) * w),
        "mu": d["m_H"] / d["m_B"],
        "chi_B": d["x_B"] / w,
        "chi_H": d["x_H"] / w,
        "zeta_B": d["z_B"] / w,
        "zeta_H": d["z_H"] / w,
        "lambda_s": d["lambda_s"],
    }


def roots(design):
    """Roots of the characteristic polynomials, shape (..., 4)."""
    a = laws.copo(**native(design))
    companion = np.zeros((*a.shape[1:], 4, 4))
    with np.errstate(divide="ignore", invalid="ignore"):
        companion[..., 0, :] = np.moveaxis(np.nan_to_num(-a[1:] / a[0], nan=1e9, posinf=1e9, neginf=-1e9), 0, -1)
    companion[..., (1, 2, 3), (0, 1, 2)] = 1.0
    return np.linalg.eigvals(companion)


def abscissa(design):
    """Largest real part of the roots; scattered by 4e-4 at an EP4, 1e-5 at an EP3, 1e-8 at an EP2."""
    return roots(design).real.max(axis=-1)


def damping_ratio(design):
    """Least -Re s/|s| of the roots."""
    s = roots(design)
    return (-s.real / np.abs(s)).min(axis=-1)


def centre(design):
    """chi_T, the centre of mass of the whole bicycle: the share of the weight on the front wheel."""
    d = native(design)
    return (d["chi_B"] + d["mu"] * d["chi_H"]) / (1 + d["mu"])


def arm(design):
    """nu_H, the distance of the front mass from the steer axis, per wheelbase."""
    d = native(design)
    return (d["chi_H"] - 1) * np.cos(d["lambda_s"]) - d["zeta_H"] * np.sin(d["lambda_s"])


# Searches


def judge(sense, expression, limits, quantities):
    """A function of designs: what is to be least, and the violation of the limits, as Python itself reads their texts.

    Its quantities are given as functions of designs, by name.
    """
    asked = {n: function for n, function in quantities.items() if any(n in text for text in (expression, *limits))}

    def judged(design):
        at = {**design, **{n: function(design) for n, function in asked.items()}}
        value = eval(expression, {}, at)
        violations = [0 * value]
        for text in limits:
            less, more = text.split("<=") if "<=" in text else reversed(text.split(">="))
            violations.append(eval(less, {}, at) - eval(more, {}, at))
        return -value if sense == "maximize" else value, np.max(np.broadcast_arrays(*violations), axis=0)

    return judged


def least(
    merit,
    fixed,
    box,
    seed=1,
    generations=150,
    rounds=6,
    shrink=0.2,
    population=12,
):
    """The best design and its value: differential evolution in the box, then `rounds` times in a smaller one around it."""
    names = list(box)
    low, high = np.array([box[n] for n in names]).T

    def cost(points):
        value, violation = merit({**fixed, **dict(zip(names, np.atleast_2d(points.T).T, strict=True))})
        return np.where(violation > 0, 1e3 + violation, value)

    centre_, width, best = None, 1.0, np.inf
    for turn in range(rounds + 1):
        around = centre_ if centre_ is not None else (low + high) / 2
        half = (high - low) / 2 * width
        lower, upper = np.maximum(low, around - half), np.minimum(high, around + half)
        inside = 1e-14 * (upper - lower) + 1e-15 * (abs(lower) + abs(upper))  # SciPy may round a start beyond its bound
        known = None if centre_ is None else np.clip(centre_, lower + inside, upper - inside)
        found = differential_evolution(
            cost,
            list(zip(lower, upper, strict=True)),
            maxiter=generations,
            popsize=population,
            tol=0,
            atol=1e-13,
            rng=seed + turn,
            vectorized=True,
            updating="deferred",
            polish=False,
            mutation=(0.4, 0.9),
            recombination=0.9,
            x0=known,
        )
        if found.fun <= best:
            centre_, best = found.x, float(found.fun)
        width *= shrink
    assert centre_ is not None
    return {**fixed, **dict(zip(names, map(float, centre_), strict=True))}, best
