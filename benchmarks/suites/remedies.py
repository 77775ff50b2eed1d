"""Sixty problem files without an answer, for the remedies that are printed: each wants more than its ranges give."""

import json
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

PROBLEMS = Path(__file__).parents[2] / "problems"

File = dict[str, Any]
"""A problem file as TOML reads it."""

_SPAN: Mapping[str, tuple[float, float, str]] = {
    "v": (1, 6, "m/s"),
    "m_B": (10, 40, "kg"),
    "m_H": (1, 8, "kg"),
    "x_B": (20, 110, "cm"),
    "z_B": (-90, -20, "cm"),
    "x_H": (40, 120, "cm"),
    "z_H": (-80, -10, "cm"),
    "lambda_s": (-30, 40, "deg"),
}
"""Ranges of a robot, in the unit in which a builder writes them."""

_FEW: Mapping[str, tuple[float, float, str]] = {
    "v": (1, 5, "m/s"),
    "c": (-10, 15, "cm"),
    "lambda_s": (5, 60, "deg"),
    "w": (90, 130, "cm"),
}
"""Of the benchmark bicycle."""

_CHI: Mapping[str, tuple[float, float]] = {
    "Fr": (0.5, 2.5),
    "mu": (0.02, 0.2),
    "chi_B": (0.3, 1.3),
    "chi_H": (0.8, 1.2),
    "zeta_B": (-1.2, -0.3),
    "zeta_H": (-1.0, -0.1),
    "lambda_s": (-0.6, 0.7),
}


def infeasible_files(count: int = 60) -> Iterator[tuple[str, File]]:
    """Names and files; the same whatever the count."""
    for index in range(count):
        kind = _KINDS[index % len(_KINDS)]
        name = kind.__name__.strip("_")
        yield f"{name} {index}", kind(np.random.default_rng([37, index]), index // len(_KINDS))


def _drawn(rng: np.random.Generator, low: float, high: float) -> float:
    return float(f"{rng.uniform(low, high):.3g}")


def _range(rng: np.random.Generator, low: float, high: float, unit: str = "") -> dict[str, Any]:
    """A part of a range, as a table of a file."""
    ends = sorted(_drawn(rng, low, high) for _ in range(2))
    ends[1] = ends[1] if ends[1] > ends[0] else ends[0] + 0.1 * (high - low)
    return {e: f"{x:.6g} {unit}" if unit else x for e, x in zip(("min", "max"), ends, strict=True)}


def _robot(rng: np.random.Generator, fixed: int) -> dict[str, Any]:
    """Parameters of a two-mass skate in SI, some of them fixed."""
    held = set(rng.permutation(list(_SPAN))[:fixed])
    own = {
        n: f"{_drawn(rng, lo, hi):.6g} {u}" if n in held else _range(rng, lo, hi, u) for n, (lo, hi, u) in _SPAN.items()
    }
    return {"w": "80 cm", **own}


def _robots(rng: np.random.Generator, _: int) -> File:
    """A robot that must be quick, stand on both wheels and keep an arm."""
    limits = {
        "decay": f"decay_rate >= {_drawn(rng, 2, 9)}",
        "arm": f"abs(u_H) >= {_drawn(rng, 0.02, 0.2)}",
        "rear": f"N_R >= {_drawn(rng, 10, 80)}",
        "front": f"N_F >= {_drawn(rng, 10, 80)}",
        "total": f"m_B + m_H <= {_drawn(rng, 14, 30)}",
    }
    chosen = ["decay", *rng.permutation(list(limits)[1:])[:2]]
    objective = {"minimize": str(rng.choice(["abscissa", "v", "m_B + m_H", "lambda_s"]))}
    return {
        "parameters": _robot(rng, int(rng.integers(0, 5))),
        "objective": objective,
        "constraints": {n: limits[n] for n in chosen},
    }


def _loads(rng: np.random.Generator, _: int) -> File:
    """Limits of loads and masses that exclude each other, beside the fastest decay."""
    limits = {
        "rear": f"N_R >= {_drawn(rng, 120, 260)}",
        "front": f"N_F >= {_drawn(rng, 120, 260)}",
        "total": f"m_B + m_H <= {_drawn(rng, 20, 28)}",
        "arm": f"abs(u_H) >= {_drawn(rng, 0.02, 0.1)}",
    }
    return {"parameters": _robot(rng, 1), "objective": {"maximize": "decay_rate"}, "constraints": limits}


def _slow(rng: np.random.Generator, _: int) -> File:
    """A speed at which nothing decays as it should."""
    parameters = _robot(rng, 2) | {"v": f"{_drawn(rng, 1, 5)} km/h"}
    return {
        "parameters": parameters,
        "objective": {"minimize": "abscissa"},
        "constraints": {"decay": f"decay_time <= {_drawn(rng, 0.1, 1)}"},
    }


def _dimensionless(rng: np.random.Generator, _: int) -> File:
    limits = {
        "decay": f"abscissa <= {-_drawn(rng, 1, 3)}",
        "arm": f"nu_H >= {_drawn(rng, 0.02, 0.15)}",
        "rear": f"chi_T <= {_drawn(rng, 0.5, 1)}",
        "sway": f"damping_ratio >= {_drawn(rng, 0.5, 0.99)}",
    }
    chosen = rng.permutation(list(limits))[:3]
    parameters = {n: _range(rng, *ends) for n, ends in _CHI.items()}
    return {
        "parameters": parameters,
        "objective": {"minimize": str(rng.choice(["abscissa", "Fr", "mu"]))},
        "constraints": {str(n): limits[str(n)] for n in chosen},
    }


def _bicycles(rng: np.random.Generator, _: int) -> File:
    """The benchmark bicycle of Meijaard et al. (2007), asked for more than its frame gives."""
    own = {n: x for n, x in _read("whipple_trail")["parameters"].items() if n not in _FEW}
    limits = {
        "decay": f"abscissa <= {-_drawn(rng, 2, 6)}",
        "trail": f"c >= {_drawn(rng, 0.03, 0.1)}",
        "sway": f"damping_ratio >= {_drawn(rng, 0.3, 0.9)}",
        "pace": f"v <= {_drawn(rng, 2, 4)}",
    }
    chosen = rng.permutation(list(limits)[1:])[:2]
    parameters = own | {n: _range(rng, *span) for n, span in _FEW.items()}
    return {
        "model": "whipple",
        "parameters": parameters,
        "objective": {"minimize": str(rng.choice(["abscissa", "v", "c**2"]))},
        "constraints": {n: limits[str(n)] for n in ("decay", *map(str, chosen))},
    }


def _bands(rng: np.random.Generator, _: int) -> File:
    """A band of speeds that begins too low."""
    parameters = _robot(rng, 3)
    del parameters["v"]
    low = _drawn(rng, 1, 3)
    return {
        "parameters": parameters,
        "scenarios": {"v": {"min": low, "max": round(2 * low, 6), "points": 5}},
        "objective": {"minimize": "abscissa"},
        "constraints": {"decay": f"abscissa <= {-_drawn(rng, 0.2, 1)}", "arm": "abs(u_H) >= 0.02"},
    }


def _tolerances(rng: np.random.Generator, _: int) -> File:
    """Limits closer together than tolerances are wide, or a decay that errors of the workshop take away."""
    low = _drawn(rng, 0.5, 0.9)
    return {
        "parameters": _robot(rng, 0) | {"x_B": {"min": "20 cm", "max": "110 cm"}},
        "tolerances": {"x_B": "2 cm", "lambda_s": "1 deg"},
        "objective": {"minimize": "abscissa"},
        "constraints": {
            "ahead": f"x_B >= {low}",
            "behind": f"x_B <= {low + _drawn(rng, 0, 0.035):.6g}",
            "decay": f"abscissa <= {-_drawn(rng, 0.2, 2)}",
        },
    }


def _matrices(rng: np.random.Generator, _: int) -> File:
    """Two masses with dampers that are too weak for the decay that is asked of them."""
    model = {
        "M": [["m", "0"], ["0", "1"]],
        "D": [["c1 + c2", "-c2"], ["-c2", "c2"]],
        "K": [["k + 1", "-1"], ["-1", "1"]],
    }
    parameters = {
        n: _range(rng, lo, hi) for n, (lo, hi) in {"m": (0.5, 3), "c1": (0, 1), "c2": (0.1, 1), "k": (0.1, 4)}.items()
    }
    limits = {
        "decay": f"abscissa <= {-_drawn(rng, 0.4, 1.5)}",
        "sum": f"c1 + c2 <= {_drawn(rng, 0.2, 1)}",
        "sway": f"damping_ratio >= {_drawn(rng, 0.3, 0.9)}",
    }
    return {
        "model": model,
        "parameters": parameters,
        "objective": {"minimize": str(rng.choice(["abscissa", "k", "m"]))},
        "constraints": limits,
    }


def _given(rng: np.random.Generator, turn: int) -> File:
    """A problem of the gallery, with a limit that it does not reach."""
    name, limits = _TIGHT[turn % len(_TIGHT)]
    file = _read(name)
    return file | {"constraints": {**file.get("constraints", {}), **limits}}


_TIGHT: tuple[tuple[str, Mapping[str, str]], ...] = (
    ("delivery_robot", {"quick": "decay_rate >= 9", "light": "m_B + m_H <= 20.5"}),
    ("realistic", {"quick": "abscissa <= -2", "low": "lambda_s <= 0.2"}),
    ("least_speed", {"decay": "abscissa <= -1.9"}),
    ("brake_squeal", {"much": "Delta >= 1.5"}),
    ("physical_machine", {"little_sway": "damping_ratio >= 0.95", "low": "x_H <= 0.8"}),
    ("heavily_damped", {"slow": "Fr <= 0.5"}),
    ("ziegler", {"load": "p >= 2.5"}),
)


def _read(name: str) -> File:

    return tomllib.loads((PROBLEMS / f"{name}.toml").read_text(encoding="utf-8"))


_KINDS: tuple[Callable[[np.random.Generator, int], File], ...] = (
    _robots,
    _loads,
    _slow,
    _dimensionless,
    _bicycles,
    _bands,
    _tolerances,
    _matrices,
    _given,
    _robots,
)


def toml(file: File) -> str:
    """The text of a file."""
    plain = [f"{name} = {_text(value)}" for name, value in file.items() if not isinstance(value, dict)]
    tables = {name: value for name, value in file.items() if isinstance(value, dict)}
    for name, entries in tables.items():
        plain += [f"[{name}]", *(f"{key} = {_text(value)}" for key, value in entries.items())]
    return "\n".join([*plain, ""])


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {_text(entry)}' for key, entry in value.items())} }}"
    return json.dumps(value)
