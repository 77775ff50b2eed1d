"""Laws by which multiple roots split, judged by roots at 120 digits at two changes of each parameter.

Every system has a closed form of its multiple root, in exact numbers; its roots near there are found by mpmath from a
matrix or a polynomial written here again, whose roots are isolated in balls.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import flint
from mpmath import mp

from benchmarks.suites.statements.case import Answer, Case

_DIGITS = 240
_CHANGES = ("1e-20", "1e-24")
_SAME = 0.02  # of a shift, from its law; the next term is ε^(1/12) smaller at most, but all those here are far less
_STAYS = mp.mpf("1e-30")

Values = Mapping[str, Any]


@dataclass(frozen=True)
class System:
    """A system as a file states it, and again by its own formula.

    Attributes:
        text: of the file.
        point: parameter → its exact value at the multiple root, in mpmath.
        root: the multiple root, of a complex H an eigenfrequency, in mpmath.
        fold: its multiplicity.
        roots: values → coefficients of the polynomial of all roots, or eigenfrequencies.
    """

    text: str
    point: Callable[[], Values]
    root: Callable[[], Any]
    fold: int
    roots: Callable[[Values], Sequence[Any]]


def _judge(system: System, answer: Answer) -> str:
    with mp.workdps(_DIGITS):
        root, point = mp.mpc(system.root()), {n: mp.mpf(x) for n, x in system.point().items()}
        found = min(answer.data["diagnosis"], key=lambda d: abs(_place(d) - root))
        if found["algebraic"] != system.fold or abs(_place(found) - root) > 1e-6 * max(1, abs(root)):
            return f"{found['algebraic']}-fold root at {_place(found)}, not {system.fold}-fold at {mp.nstr(root, 8)}"
        told = {r["parameter"]: r for r in found["responses"]}
        wrong = [f"{n} is missing" for n in point if n not in told]
        for name in point:
            if name in told and (text := _compared(system, point, root, told[name])):
                wrong.append(f"{name}: {text}")
        return "; ".join(wrong)


def _place(found: Mapping[str, Any]) -> Any:
    z = found.get("eigenfrequency", found)
    return mp.mpc(z["re"], z["im"])


def _compared(system: System, point: Values, root: Any, told: Mapping[str, Any]) -> str:
    name, relative = told["parameter"], told["change"] == "relative"
    if relative and point[name] == 0:
        return "a relative change of what is 0"
    if told.get("unresolved"):
        return "not resolved"
    for text in _CHANGES:
        eps = mp.mpf(text)
        values = {**point, name: point[name] * (1 + eps) if relative else point[name] + eps}
        shifts = _shifts(system.roots(values), root)[: system.fold][::-1]
        for law in told["laws"]:
            numerator, _, denominator = law["exponent"].partition("/")
            size = law["size"] * eps ** (mp.mpf(numerator) / mp.mpf(denominator or 1))
            group, shifts = shifts[: law["roots"]], shifts[law["roots"] :]
            if not group or abs(group[0] - size) > _SAME * size:
                return f"{law['size']:.3g} ε^({law['exponent']}) at ε = {text}: {mp.nstr(size, 4)} for " + (
                    mp.nstr(group[0], 4) if group else "no root"
                )
        if len(shifts) != told["unmoved"] or any(t > _STAYS for t in shifts):
            return f"{told['unmoved']} stay at ε = {text}, but {len(shifts)} move by {mp.nstr(max(shifts), 4)}"
    return ""


def _eigenvalues(rows: Sequence[Sequence[Any]]) -> list[Any]:
    """Coefficients of the characteristic polynomial, descending, by Faddeev and LeVerrier."""
    A = mp.matrix(rows)
    n = A.rows
    M, found = mp.zeros(n), [mp.mpc(1)]
    for k in range(1, n + 1):
        M = A * M + found[-1] * mp.eye(n)
        found.append(-sum((A * M)[i, i] for i in range(n)) / k)
    return found


def _shifts(coefficients: Sequence[Any], root: Any) -> list[Any]:
    """|t| of all roots root + t, ascending; coefficients that are 0 but for rounding are roots that stay."""
    c = [mp.mpc(x) for x in coefficients]
    for end in range(len(c), 1, -1):
        for k in range(1, end):
            c[k] += root * c[k - 1]
    zeros = 0
    while len(c) > 1 and abs(c[-1]) <= mp.mpf(10) ** (20 - _DIGITS) * max(1, abs(root)) ** (len(c) - 1):
        c.pop()
        zeros += 1
    if len(c) == 3:
        half = -c[1] / (2 * c[0])
        apart = mp.sqrt(half**2 - c[2] / c[0])
        return [mp.mpf(0)] * zeros + sorted([abs(half - apart), abs(half + apart)])
    with flint.ctx.workdps(_DIGITS):
        balls = [flint.acb(*(flint.arb(mp.nstr(x, _DIGITS)).mid() for x in (z.real, z.imag))) for z in c[::-1]]
        found = flint.acb_poly(balls).roots() if len(c) > 1 else []
        sizes = [mp.mpf(abs(z).str(60, radius=False)) for z in found]
    return [mp.mpf(0)] * zeros + sorted(sizes)


def _product(roots: Sequence[Any]) -> list[Any]:
    found = [mp.mpc(1)]
    for z in roots:
        found = [a - z * b for a, b in zip([*found, 0], [0, *found], strict=True)]
    return found


def _pencil(M: Any, D: Any, K: Any) -> list[Any]:
    """Roots of det (M s² + D s + K) by the companion matrix."""
    M, D, K = (mp.matrix(x) for x in (M, D, K))
    n = M.rows
    top = [[mp.mpf(j == i + n) for j in range(2 * n)] for i in range(n)]
    both = [(-(M**-1) * X) for X in (K, D)]
    return _eigenvalues(
        [*top, *([*(both[0][i, j] for j in range(n)), *(both[1][i, j] for j in range(n))] for i in range(n))]
    )


def _text(key: str, rows: Any) -> str:
    def entry(x: Any) -> str:
        return f'"{x}"' if isinstance(x, str) else repr(x)

    if rows and not isinstance(rows[0], list):
        return f"{key} = [{', '.join(map(entry, rows))}]\n"
    return f"{key} = [{', '.join('[' + ', '.join(map(entry, row)) + ']' for row in rows)}]\n"


def _file(matrices: Mapping[str, Any], parameters: Mapping[str, Any], locate: str = "") -> str:
    lines = "".join(_text(key, rows) for key, rows in matrices.items())
    each = "".join(
        f"{n} = {{ min = {x[0]}, max = {x[1]} }}\n" if isinstance(x, tuple) else f"{n} = {x}\n"
        for n, x in parameters.items()
    )
    return f"[model]\n{lines}\n[parameters]\n{each}" + (f'\n[objective]\nlocate = "{locate}"\n' if locate else "")


def _spin(size: int, unit: str = "1", digits: int = 0) -> System:
    """unit (S_x + i g S_z) of spin (size − 1)/2: eigenvalues m unit √(1 − g²); roots as decimals of some digits."""
    j = mp.mpf(size - 1) / 2
    m = [j - a for a in range(size)]
    squares = [int(4 * (j * (j + 1) - m[a] * m[a + 1])) for a in range(size - 1)]  # of 4 S_x
    rows: list[list[Any]] = [[0] * size for _ in range(size)]
    for a in range(size):
        rows[a][a] = f"{unit}*{float(m[a])}j*g" if m[a] else 0
        if a + 1 < size:
            rows[a][a + 1] = rows[a + 1][a] = (
                f"{unit}*sqrt({squares[a]})/4" if not digits else float(mp.nstr(mp.sqrt(squares[a]) / 4, digits))
            )
    text = _file({"H": rows}, {"g": (0.6, 1.7)}, f"EP{size}")
    factor = mp.mpf(unit)
    return System(
        text, lambda: {"g": 1}, lambda: 0, size, lambda v: _product([factor * x * mp.sqrt(1 - v["g"] ** 2) for x in m])
    )


def _block(size: int, at: tuple[int, int], root: int = -1, second: int = 0) -> System:
    """A Jordan block, and one of another eigenvalue, with a parameter d added at a place; also e at the last corner."""
    n = size + second

    def matrix(d: Any, e: Any) -> list[list[Any]]:
        rows: list[list[Any]] = [[0] * n for _ in range(n)]
        for i in range(size):
            rows[i][i] = root
            if i + 1 < size:
                rows[i][i + 1] = 1
        for i in range(size, n):
            rows[i][i] = root - 2 - i
        return [
            [_plus(_plus(x, d, (i, j) == at), e, (i, j) == (n - 1, 0)) for j, x in enumerate(row)]
            for i, row in enumerate(rows)
        ]

    def numbers(v: Values) -> list[Any]:
        return _eigenvalues(matrix(v["d"], v["e"]))

    return System(
        _file({"A": matrix("d", "e")}, {"d": 0, "e": 0}), lambda: {"d": 0, "e": 0}, lambda: root, size, numbers
    )


def _plus(x: Any, y: Any, there: bool) -> Any:
    if not there:
        return x
    return (f"{x} + {y}" if x else y) if isinstance(y, str) or isinstance(x, str) else x + y


def _systems() -> dict[str, System]:
    return {
        **{f"spin chain of order {n}": _spin(n) for n in (3, 4, 5, 6)},
        "spin chain of order 6, twice as strong": _spin(6, "2"),
        "spin chain of order 6, twenty-fold": _spin(6, "20"),
        "spin chain of order 6, in doubles": _spin(6, digits=17),
        "spin chain of order 5, in doubles": _spin(5, digits=17),
        "spin chain of order 4, in 15 digits": _spin(4, digits=15),
        "spin chain of order 4, in megahertz": _spin(4, "1000000"),
        "loss-only dimer": System(
            _file(
                {"H": [["d - 1j*a", "k"], ["k", "-1j*b"]]}, {"d": (-1, 1), "k": (0.05, 2), "a": 1.3, "b": 0.1}, "EP2"
            ),
            lambda: {"d": 0, "k": mp.mpf("0.6"), "a": mp.mpf("1.3"), "b": mp.mpf("0.1")},
            lambda: mp.mpc(0, mp.mpf("-0.7")),
            2,
            lambda v: _eigenvalues([[v["d"] - 1j * v["a"], v["k"]], [v["k"], -1j * v["b"]]]),
        ),
        "balanced dimer, off resonance": System(
            _file({"H": [["w + 1j*g", "k"], ["k", "w - 1j*g"]]}, {"g": (0.1, 2), "w": 3, "k": 0.7}, "EP2"),
            lambda: {"g": mp.mpf("0.7"), "w": 3, "k": mp.mpf("0.7")},
            lambda: 3,
            2,
            lambda v: _eigenvalues([[v["w"] + 1j * v["g"], v["k"]], [v["k"], v["w"] - 1j * v["g"]]]),
        ),
        "balanced trimer": System(
            _file(
                {"H": [["e + 1j*g", "k", 0], ["k", 0, "k"], [0, "k", "-1j*g"]]}, {"g": (0.5, 2), "k": 1, "e": 0}, "EP3"
            ),
            lambda: {"g": mp.sqrt(2), "k": 1, "e": 0},
            lambda: 0,
            3,
            lambda v: _eigenvalues([[v["e"] + 1j * v["g"], v["k"], 0], [v["k"], 0, v["k"]], [0, v["k"], -1j * v["g"]]]),
        ),
        "one-way coupled pair": System(
            _file({"H": [["a + 1j*b", 1], [0, 0]]}, {"a": (-1, 1), "b": (-1, 1)}, "EP2"),
            lambda: {"a": 0, "b": 0},
            lambda: 0,
            2,
            lambda v: [1, -v["a"] - 1j * v["b"], 0],
        ),
        "crossing of two modes": System(
            _file({"H": [["d", "k"], ["k", "-d"]]}, {"d": 0, "k": 0}),
            lambda: {"d": 0, "k": 0},
            lambda: 0,
            2,
            lambda v: [1, 0, -(v["d"] ** 2) - v["k"] ** 2],
        ),
        "Jordan block of 3, corner and first": _block(3, (0, 0)),
        "Jordan block of 4, one before the corner": _block(4, (2, 0)),
        "Jordan block of 5, two before the corner": _block(5, (2, 0), root=-3),
        "Jordan block of 6 beside two eigenvalues": _block(6, (5, 0), second=2),
        "Jordan block of 4, second row of the first column": _block(4, (1, 0), root=-2),
        "companion form of (s + 1)^4": System(
            _file(
                {"A": [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], ["-1 - x", "-4 - y", -6, "-4 - x*y"]]},
                {"x": 0, "y": 0},
            ),
            lambda: {"x": 0, "y": 0},
            lambda: -1,
            4,
            lambda v: ([1, 4 + v["x"] * v["y"], 6, 4 + v["y"], 1 + v["x"]]),
        ),
        "(s + 1)^12": System(
            _file(
                {"coefficients": [1, 12, 66, 220, 495, 792, 924, 792, 495, 220, 66, "12 + y", "1 + x + y"]},
                {"x": 0, "y": 0},
            ),
            lambda: {"x": 0, "y": 0},
            lambda: -1,
            12,
            _twelve,
        ),
        "(s + 1)^2 = x^2 - y": System(
            _file({"coefficients": [1, 2, "1 - x**2 + y"]}, {"x": 0, "y": 0}),
            lambda: {"x": 0, "y": 0},
            lambda: -1,
            2,
            lambda v: [1, 2, 1 - v["x"] ** 2 + v["y"]],
        ),
        "symmetric matrix at a crossing": System(
            _file({"A": [["x - 1", "y", 0], ["y", "-x - 1", "z"], [0, "z", -4]]}, {"x": 0, "y": 0, "z": 0}),
            lambda: {"x": 0, "y": 0, "z": 0},
            lambda: -1,
            2,
            lambda v: _eigenvalues([[v["x"] - 1, v["y"], 0], [v["y"], -v["x"] - 1, v["z"]], [0, v["z"], -4]]),
        ),
        "two equal oscillators": System(
            _file(
                {"M": [["m", 0], [0, 1]], "D": [["d", 0], [0, 0.1]], "K": [["k + c", "-c"], ["-c", "2 + c"]]},
                {"m": 1, "d": 0.1, "k": 2, "c": 0},
            ),
            lambda: {"m": 1, "d": mp.mpf("0.1"), "k": 2, "c": 0},
            lambda: mp.mpc(mp.mpf("-0.05"), mp.sqrt(2 - mp.mpf("0.0025"))),
            2,
            lambda v: _pencil(
                [[v["m"], 0], [0, 1]],
                [[v["d"], 0], [0, mp.mpf("0.1")]],
                [[v["k"] + v["c"], -v["c"]], [-v["c"], 2 + v["c"]]],
            ),
        ),
        "critical damping": System(
            _file({"M": [["m"]], "D": [["c"]], "K": [["k"]]}, {"m": 2, "c": (1, 9), "k": 3}, "EP2"),
            lambda: {"m": 2, "c": mp.sqrt(24), "k": 3},
            lambda: -mp.sqrt(mp.mpf(3) / 2),
            2,
            lambda v: ([v["m"], v["c"], v["k"]]),
        ),
        "oscillators with gain and loss": System(
            _file(
                {"M": [[1, 0], [0, 1]], "D": [["g", 0], [0, "-g"]], "K": [[1, "k"], ["k", 1]]},
                {"g": (0.3, 0.9), "k": 0.6},
                "CEP2",
            ),
            lambda: {"g": mp.sqrt(mp.mpf("0.4")), "k": mp.mpf("0.6")},
            lambda: mp.mpc(0, mp.sqrt(mp.mpf("0.8"))),
            2,
            lambda v: _pencil([[1, 0], [0, 1]], [[v["g"], 0], [0, -v["g"]]], [[1, v["k"]], [v["k"], 1]]),
        ),
        "Ziegler's pendulum": System(
            _file({"M": [[3, 1], [1, 1]], "K": [["2 - p", "p - 1"], [-1, 1]]}, {"p": (1, 3)}, "CEP2"),
            lambda: {"p": mp.mpf(7) / 2 - mp.sqrt(2)},
            lambda: mp.mpc(0, mp.mpf("0.5") ** (mp.mpf(1) / 4)),
            2,
            lambda v: _pencil([[3, 1], [1, 1]], mp.zeros(2).tolist(), [[2 - v["p"], v["p"] - 1], [-1, 1]]),
        ),
        "bicycle of two masses on skates": System(
            _file(
                {},
                {
                    "mu": 0.1,
                    "chi_H": 1,
                    "zeta_B": -0.4,
                    "zeta_H": -0.2,
                    "Fr": (0.5, 8),
                    "chi_B": (1, 2),
                    "lambda_s": (0, 1.2),
                },
                "EP4",
            ).replace("[model]", 'model = "tms"'),
            _bicycle,
            lambda: -1 / mp.mpf("0.08") ** (mp.mpf(1) / 4),
            4,
            _skates,
        ),
        "chains of two and one": System(
            _file({"A": [[-1, 1, 0], ["d", -1, 0], [0, "f", "f - 1"]]}, {"d": 0, "f": 0}),
            lambda: {"d": 0, "f": 0},
            lambda: -1,
            3,
            lambda v: _eigenvalues([[-1, 1, 0], [v["d"], -1, 0], [0, v["f"], v["f"] - 1]]),
        ),
    }


def _bicycle() -> Values:
    """The EP4 at chi_H = 1, by the closed form of Kirillov (2018) in r = √(ζ_B/ζ_H) and h = √(ζ_B ζ_H)."""
    r, h = mp.sqrt(2), mp.sqrt(mp.mpf("0.08"))
    q = r**2 + 6 * r + 1
    return {
        "Fr": q / (4 * mp.sqrt(h) * (r + 1)),
        "mu": mp.mpf("0.1"),
        "chi_B": r,
        "chi_H": 1,
        "zeta_B": mp.mpf("-0.4"),
        "zeta_H": mp.mpf("-0.2"),
        "lambda_s": mp.atan((r - 1) * q / (16 * h * (r + 1))),
    }


def _skates(v: Values) -> list[Any]:
    """det (M s² + V s + P) of two masses on skates, as printed there, but for a factor."""
    Fr, mu, xB, xH, zB, zH = (v[n] for n in ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H"))
    cos, sin = mp.cos(v["lambda_s"]), mp.sin(v["lambda_s"])
    nu = (xH - 1) * cos - zH * sin
    a = (mu * zH**2 + zB**2, 0, mu * zH + zB)
    b = (-mu * zH * nu, -(mu * xH * zH + xB * zB) * Fr * cos, -(Fr**2) * cos * (mu * zH + zB) - mu * nu)
    c = (-mu * zH * nu, 0, -mu * nu)
    d = (mu * nu**2, mu * xH * nu * Fr * cos, mu * (Fr**2 * cos - sin) * nu)
    return [sum(a[i] * d[k - i] - b[i] * c[k - i] for i in range(max(0, k - 2), min(k, 2) + 1)) for k in range(5)]


def _twelve(v: Values) -> list[Any]:
    return [mp.binomial(12, k) + (v["y"] if k > 10 else 0) + (v["x"] if k == 12 else 0) for k in range(13)]


with mp.workdps(_DIGITS):
    _ALL = _systems()

CASES: tuple[Case, ...] = tuple(
    Case(
        name=name,
        files={"system.toml": system.text},
        arguments=("solve", "system.toml", "--full", "--json"),
        judge=partial(_judge, system),
        truth="roots of the closed form at two changes, mpmath at 240 digits",
    )
    for name, system in _ALL.items()
)
