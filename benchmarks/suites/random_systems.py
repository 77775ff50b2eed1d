"""Random small systems of degree 3 to 12: oscillators, state matrices and polynomials, and what is asked of them."""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.judges import Entries, Roots, System, evaluated
from benchmarks.suites.random_designs import Box, rounded

SEED = 2018
COUNT = 100

_BOXES: Mapping[str, Box] = {"m": (0.4, 4.0), "d": (0.0, 4.0), "k": (0.3, 8.0), "g": (-1.5, 1.5), "n": (-0.5, 0.5)}
"""Masses, dampers, springs, gyroscopic and circulatory (follower) terms."""

_GIVEN: Mapping[str, Box] = {"m": (0.5, 3.0), "d": (0.02, 0.5), "k": (0.5, 5.0), "g": (-1.0, 1.0), "n": (-0.2, 0.2)}
_GAINS: Box = (-2.0, 2.0)
_LOCATED = ("EP3", "CEP2", "EP4", "CEP2", "EP2+EP2")
_SPREAD = 400  # designs of the box, one of the best few of which every limit admits


def random_systems(count: int = COUNT, seed: int = SEED) -> Iterator[System]:
    """2 to 6 degrees of freedom in turn, of all kinds, with 3 to 8 free parameters; each has a feasible design."""
    return (random_system(index, seed) for index in range(count))


def random_system(index: int, seed: int = SEED) -> System:
    """One of the suite, the same whatever the others are."""
    rng = np.random.default_rng([seed, index, 7])
    size, block = 2 + index % 5, index // 5 % len(_KINDS)
    free = 3 + (index // 5 + index % 5) % 6
    kind, make, goal = _KINDS[block]
    if kind == "unfolding":
        return _unfolding(index, rng, size)
    parts = make(rng, size)
    names = _free_names(rng, parts, free)
    system = System(
        index=index,
        kind=kind,
        matrices=parts.matrices,
        fixed={n: v for n, v in parts.given.items() if n not in names},
        free={n: _box(rng, n) for n in names},
        goal=goal,
    )
    return _constrained(rng, system)


@dataclass(frozen=True)
class _Parts:
    """Matrices, and a value for each name in them."""

    matrices: Mapping[str, Entries]
    given: Mapping[str, float]


class _Sums:
    """A square matrix of sums, under construction."""

    def __init__(self, size: int) -> None:
        self.terms: list[list[list[str]]] = [[[] for _ in range(size)] for _ in range(size)]

    def between(self, name: str, i: int, j: int | None) -> None:
        """A spring or damper from mass i to mass j, or to the ground."""
        self.terms[i][i].append(f"+ {name}")
        if j is not None:
            self.terms[j][j].append(f"+ {name}")
            self.terms[i][j].append(f"- {name}")
            self.terms[j][i].append(f"- {name}")

    def skew(self, name: str, i: int, j: int) -> None:
        """A gyroscopic or circulatory term."""
        self.terms[i][j].append(f"+ {name}")
        self.terms[j][i].append(f"- {name}")

    def text(self) -> Entries:
        """The entries."""
        return [[" ".join(entry).removeprefix("+ ") or "0" for entry in row] for row in self.terms]


def _masses(rng: np.random.Generator, size: int, *extras: str) -> _Parts:
    """Masses in a chain, with more springs and dampers across it (``mesh``), skew terms and a negative damper."""
    M, D, K = _Sums(size), _Sums(size), _Sums(size)
    given: dict[str, float] = {}

    def add(name: str) -> str:
        given[name] = rounded(float(rng.uniform(*_GIVEN[name[0]])))
        return name

    edges: list[tuple[int, int | None]] = [(0, None), *((i, i + 1) for i in range(size - 1))]
    edges += [(size - 1, None)] if rng.random() < 0.5 else []
    if "mesh" in extras:
        others = [e for e in itertools.combinations(range(size), 2) if e[1] > e[0] + 1]
        edges += [e for e in others if rng.random() < 0.4]
    for i in range(size):
        M.between(add(f"m{i + 1}"), i, None)
    for i, j in edges:
        K.between(add(f"k{i + 1}{'' if j is None else j + 1}"), i, j)
        if rng.random() < 0.8:
            D.between(add(f"d{i + 1}{'' if j is None else j + 1}"), i, j)
    for kind, letter, matrix in (("gyroscopic", "g", D), ("circulatory", "n", K)):
        for i in range(size - 1):
            if kind in extras and (i == 0 or rng.random() < 0.5):
                matrix.skew(add(f"{letter}{i + 1}{i + 2}"), i, i + 1)
    if "negative" in extras:  # as of a driven mode: a damper that feeds energy, at most as strong as the others
        D.terms[size - 1][size - 1].append(f"- {rounded(float(rng.uniform(0.05, 0.4)))}")
    return _Parts({"M": M.text(), "D": D.text(), "K": K.text()}, given)


def _feedback(rng: np.random.Generator, size: int, odd: bool) -> _Parts:
    """x′ = (A + Σ gain b cᵀ) x: a random plant with static output feedback through a few entries of b and c."""
    n = 2 * size - odd
    plant = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.5) - 0.7 * np.eye(n)
    text = [[f"{rounded(float(x))}" if x else "0" for x in row] for row in plant]
    given = {}
    for gain in range(1, 9):
        given[f"x{gain}"] = rounded(float(rng.normal() * 0.3))
        rows, columns = rng.choice(n, 2, replace=False), rng.choice(n, 2, replace=False)
        for (i, b), (j, c) in itertools.product(zip(rows, (1, 0.5), strict=True), zip(columns, (1, -1), strict=True)):
            text[i][j] += f" + {rounded(b * c * float(rng.uniform(0.5, 1.5)))}*x{gain}"
    return _Parts({"A": text}, given)


def _polynomials(rng: np.random.Generator, size: int, odd: bool) -> _Parts:
    """A random stable polynomial, each of whose coefficients moves with some gains, in products of two too."""
    n = 2 * size - odd
    base = np.poly(_roots(rng, n)).real
    text = [f"{rounded(float(a))}" for a in base]
    given = {f"x{k}": rounded(float(rng.normal() * 0.3)) for k in range(1, 9)}
    for gain in given:
        for k in rng.choice(np.arange(1, n + 1), min(n, 3), replace=False):
            text[k] += f" + {rounded(float(rng.normal() * 0.4 * base[k]))}*{gain}"
    for k in rng.choice(np.arange(1, n + 1), 2, replace=False):
        one, other = rng.choice(list(given), 2, replace=False)
        text[k] += f" + {rounded(float(rng.normal() * 0.2 * base[k]))}*{one}*{other}"
    return _Parts({"coefficients": [text]}, given)


def _roots(rng: np.random.Generator, n: int) -> Roots:
    pairs = [complex(-rng.uniform(0.1, 1.5), rng.uniform(0.3, 2.5)) for _ in range(n // 2)]
    alone = [complex(-rng.uniform(0.2, 2.0))] * (n % 2)
    return np.array([*(w for z in pairs for w in (z, z.conjugate())), *alone])


def _unfolding(index: int, rng: np.random.Generator, size: int) -> System:
    """A polynomial with an exceptional point at one design of the box, unfolded by the parameters; the cheapest one."""
    pattern, n = _LOCATED[size - 2], 2 * size
    a, b, w = (float(rng.uniform(0.5, 1.5)) for _ in range(3))
    multiple = {"EP3": [-a] * 3, "EP4": [-a] * 4, "EP2+EP2": [-a, -a, -a - b, -a - b]}
    core = multiple.get(pattern, [complex(-a, w), complex(-a, -w)] * 2)
    base = np.poly([*core, *_roots(rng, n - len(core))]).real
    names = [f"x{k}" for k in range(1, 6)]
    known = {name: rounded(float(rng.uniform(-0.7, 0.7))) for name in names}
    text = [repr(float(c)) for c in base]
    for name, at in known.items():
        for k in rng.choice(np.arange(1, n + 1), min(n, 4), replace=False):
            text[k] += f" + {rounded(float(rng.normal() * 0.3 * base[k]))}*({name} - {at!r})"
    cost = " + ".join(f"{rounded(float(rng.uniform(0.5, 2)))}*{name}**2" for name in names)
    return System(
        index=index,
        kind="unfolding",
        matrices={"coefficients": [text]},
        fixed={},
        free=dict.fromkeys(names, (-1.0, 1.0)),
        goal={"locate": pattern, "minimize": cost},
        known=known,
    )


def _free_names(rng: np.random.Generator, parts: _Parts, count: int) -> list[str]:
    """Names to be free, in their own order; at least one damper or gain."""
    names = list(parts.given)
    drawn = {str(n) for n in rng.choice(names, min(count, len(names)), replace=False)}
    dampers = [n for n in names if n[0] in "dx"]
    if dampers and not drawn & set(dampers):
        drawn = {*sorted(drawn)[1:], str(rng.choice(dampers))}
    return [n for n in names if n in drawn]


def _box(rng: np.random.Generator, name: str) -> Box:
    lower, upper = _BOXES.get(name[0], _GAINS)
    reach = float(rng.uniform(0.5, 1.0))
    return (0.0 if lower == 0 else rounded(lower * (reach if lower < 0 else 1 / reach)), rounded(upper * reach))


_TEMPLATES: tuple[tuple[str, str], ...] = (
    ("{0} + {1}", "<="),
    ("{0}**2 + {1}**2 + {2}**2", "<="),
    ("{0}*{1}", "<="),
    ("{0} - {1}", ">="),
    ("{0}*{1} + {2}", ">="),
    ("sqrt(1 + {0}**2) + {1}", "<="),
)
_ON_ROOTS = {"abscissa": ("damping_ratio", ">="), "damping_ratio": ("abscissa", "<=")}


def _constrained(rng: np.random.Generator, system: System) -> System:
    """With none to two limits that one good design meets, and perhaps one on the other root quantity."""
    names = list(system.free)
    lower, upper = np.array(list(system.free.values())).T
    designs = dict(zip(names, rng.uniform(lower, upper, (_SPREAD, len(names))).T, strict=True))
    worth, _ = system.judged(designs)
    anchor = int(rng.choice(np.argsort(system.sign * worth[system.objective])[:10]))
    limits = {}
    for number in range(int(rng.choice([0, 1, 2], p=[0.4, 0.35, 0.25]))):
        template, comparison = _TEMPLATES[int(rng.integers(len(_TEMPLATES)))]
        text = template.format(*(str(n) for n in rng.choice(names, 3, replace=False)))
        values = np.asarray(evaluated(text, designs), dtype=float)
        slack = float(rng.uniform(0, 0.2)) * float(np.ptp(values))
        limit = _outwards(float(values[anchor]), slack, comparison)
        limits[f"c{number + 1}"] = f"{text} {comparison} {limit}"
    if rng.random() < 0.15:
        name, comparison = _ON_ROOTS[system.objective]
        value = float(worth[name][anchor])
        limits["roots"] = f"{name} {comparison} {_outwards(value, 0.1 * abs(value), comparison)}"
    return replace(system, constraints=limits)


def _outwards(value: float, slack: float, comparison: str) -> float:
    """A limit with three digits that a value meets."""
    sign = 1.0 if comparison == "<=" else -1.0
    unit = 10.0 ** math.floor(math.log10(abs(value) + slack + 1e-3) - 2)
    return float(f"{unit * (math.ceil if sign > 0 else math.floor)((value + sign * slack) / unit):.6g}")


def _chain(*extras: str) -> Callable[[np.random.Generator, int], _Parts]:
    return lambda rng, size: _masses(rng, size, *extras)


_ABSCISSA, _DAMPING = {"minimize": "abscissa"}, {"maximize": "damping_ratio"}
_KINDS: tuple[tuple[str, Callable[[np.random.Generator, int], _Parts], Mapping[str, str]], ...] = (
    ("chain", _chain(), _ABSCISSA),
    ("gyroscopic", _chain("gyroscopic"), _ABSCISSA),
    ("chain", _chain(), _DAMPING),
    ("circulatory", _chain("circulatory"), _ABSCISSA),
    ("feedback, odd", lambda rng, size: _feedback(rng, size, True), _ABSCISSA),
    ("mesh", _chain("mesh"), _ABSCISSA),
    ("negative damping", _chain("negative"), _ABSCISSA),
    ("polynomial, odd", lambda rng, size: _polynomials(rng, size, True), _ABSCISSA),
    ("chain", _chain(), _ABSCISSA),
    ("feedback", lambda rng, size: _feedback(rng, size, False), _ABSCISSA),
    ("gyroscopic", _chain("gyroscopic"), _DAMPING),
    ("mesh", _chain("mesh"), _ABSCISSA),
    ("gyroscopic and circulatory", _chain("gyroscopic", "circulatory"), _ABSCISSA),
    ("chain", _chain(), _ABSCISSA),
    ("unfolding", _chain(), {}),
    ("negative damping", _chain("mesh", "negative"), _ABSCISSA),
    ("polynomial", lambda rng, size: _polynomials(rng, size, False), _ABSCISSA),
    ("mesh", _chain("mesh"), _DAMPING),
    ("feedback, odd", lambda rng, size: _feedback(rng, size, True), _ABSCISSA),
    ("everything", _chain("mesh", "gyroscopic", "circulatory", "negative"), _ABSCISSA),
)
