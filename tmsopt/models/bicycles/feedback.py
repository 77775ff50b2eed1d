"""A bicycle with a controller: torques on lean and steer from lean, lean rate, steer and steer rate, for either model.

M q″ + D q′ + K q = −G (φ, δ, φ′, δ′), q = (lean, steer), so the gains are parts of D and K. Through actuators with a
lag each torque follows as lag T′ + T = −G (…), and its row is multiplied by lag s + 1.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from tmsopt.algebra.kinds import absolute, pi, quotient, sqrt
from tmsopt.models.model import Computed, Feedback, Matrix, Model, Parameter, ParameterSet, Quantity, Range
from tmsopt.roots.polynomial import determinant

LAG = "lag"
_STATES = {"phi": "lean", "delta": "steer", "phidot": "lean rate", "deltadot": "steer rate"}
_TORQUES = {"lean": "lean torque, of a rider or a flywheel,", "k": "steer torque"}
_ROWS = {torque: row for row, torque in enumerate(_TORQUES)}
_WRITTEN = ("phi", "phidot", "delta", "deltadot")
_STEER = tuple(f"k_{x}" for x in _WRITTEN)
_GAINS = {f"{torque}_{x}": (torque, x) for torque in ("k", "lean") for x in _WRITTEN}
_SLOPE = "_v"  # of the gains that grow with the speed

FEEDBACK = (*_GAINS, *(f"{n}{_SLOPE}" for n in _GAINS), LAG)
"""Names of [feedback], in SI."""

_PASSIVE = ("v_weave", "v_capsize", "Fr_c", "v_c")
_ABSENT = "its formula is that of a bicycle without a controller; `tmsopt speeds` finds where this one is stable"
_LATE = "through a lag the torque begins at 0; its peak after a push is told by `tmsopt simulate`"
_SAID = (
    "A controller adds the steer torque −(k_phi φ + k_phidot φ′ + k_delta δ + k_deltadot δ′), to the right positive."
)


UNCONTROLLED = {
    **dict.fromkeys(FEEDBACK, "a gain of a controller stands in a table [feedback], such as k_phidot = -20"),
    **dict.fromkeys(("torque_per_degree", "push_torque"), "without [feedback] there is no controller and no torque"),
}
"""Names that a bicycle without a controller does not know → what to write."""


@dataclass(frozen=True)
class Steered:
    """What a bicycle says of itself so that a controller can be added.

    Attributes:
        model: the bicycle without one.
        matrices: algebraic parameters → M, D, K for a steer angle in a unit in which they are polynomials.
        unit: algebraic parameters and √(1 + T²) → that unit in radians, and its square.
        speed: the parameter that is the speed, of the native set.
    """

    model: Model
    matrices: Callable[[Mapping[str, Any]], tuple[Matrix, Matrix, Matrix]]
    unit: Callable[[Mapping[str, Any], Any], tuple[Any, Any]]
    speed: str


def native_name(name: str) -> str:
    """The dimensionless counterpart of a name of [feedback], ``kappa_phi`` of ``k_phi``."""
    return "tau" if name == LAG else f"kappa_{name.removeprefix('k_')}"


def size(name: str, p: Mapping[str, Any], rate: Computed, torque: Computed) -> Any:
    """How much of a name of [feedback] in SI a dimensionless one of 1 is."""
    if name == LAG:
        return 1 / rate(p)
    found = torque(p) / rate(p) if "dot" in name else torque(p)
    return found / sqrt(p["g"] * p["w"]) if name.endswith(_SLOPE) else found


def names_of(names: Iterable[str]) -> tuple[str, ...]:
    """Those of [feedback] among some names, of either set; all four of the steer torque if there is one."""
    given = set(names)
    found = {n for n in FEEDBACK if n in given or native_name(n) in given}
    return tuple(n for n in FEEDBACK if n in found or (found and n in _STEER))


def with_feedback(of: Steered, names: tuple[str, ...]) -> Model:
    """The bicycle with the parameters of a controller, those of `names_of`."""
    base, lagged = of.model, LAG in names
    driven = tuple(_ROWS[t] for t in _TORQUES if any(n.startswith(f"{t}_") for n in names))
    in_si = base.sets[0].rate is not None  # the native set

    def native(name: str) -> str:
        return name if in_si else native_name(name)

    def gain(p: Mapping[str, Any], torque: str, x: str) -> Any:
        """Of the native parameters; None for one that is not there."""
        slope, own = (native(n) if n in names else None for n in (f"{torque}_{x}{_SLOPE}", f"{torque}_{x}"))
        parts = ([p[own]] if own else []) + ([p[slope] * p[of.speed]] if slope else [])
        return sum(parts[1:], parts[0]) if parts else None

    def gains(p: Mapping[str, Any]) -> dict[tuple[int, str], Any]:
        every = ((_ROWS[t], x, gain(p, t, x)) for t in _TORQUES for x in _STATES)
        return {(row, x): g for row, x, g in every if g is not None}

    def algebraic(p: Mapping[str, Any]) -> dict[str, Any]:
        known = base.algebraic(p)
        own = {f"G_{row}_{x}": g for (row, x), g in gains(p).items()}
        return {**known, **own, "h": sqrt(1 + known["T"] * known["T"])} | ({LAG: p[native(LAG)]} if lagged else {})

    def polynomial(**values: Any) -> list[Any]:
        M, D, K = of.matrices(values)
        angle, square = of.unit(values, values["h"])
        unit = ((1, angle), (angle, square))
        held = {(row, x): values[n] for row in driven for x in _STATES if (n := f"G_{row}_{x}") in values}
        rows = [[[M[i][j], D[i][j], K[i][j]] for j in (0, 1)] for i in (0, 1)]
        for i in driven if lagged else ():
            rows[i] = [_followed(values[LAG], entry) for entry in rows[i]]
        for (i, x), g in held.items():
            entry = rows[i][j := int("delta" in x)]
            entry[-2 if "dot" in x else -1] = entry[-2 if "dot" in x else -1] + g * unit[i][j]
        return determinant(rows)

    def feedback(p: Mapping[str, Any]) -> Feedback:
        held = gains(p)
        assert base.pencil is not None
        G = [[held.get((row, x), 0) for x in _STATES] for row in (0, 1)]
        return Feedback(base.pencil(p)[0], G, p[native(LAG)] if lagged else None, driven)

    def pencil(p: Mapping[str, Any]) -> tuple[Matrix, ...]:
        assert base.pencil is not None
        M, D, K = base.pencil(p)
        G = feedback(p).gains
        if lagged:
            return _first_order(M, D, K, G, p[native(LAG)], driven)
        D, K = (
            [[row[j] + g[j + at] for j in (0, 1)] for row, g in zip(B, G, strict=True)] for B, at in ((D, 2), (K, 0))
        )
        return M, D, K

    sets = tuple(_extended(s, names, native, feedback) for s in base.sets)
    lost = {*_PASSIVE, *(("omega0",) if lagged else ())}
    kept = {name: said for name, said in base.absent.items() if name not in UNCONTROLLED}
    every = (*base.quantities, *(q for s in base.sets for q in s.quantities))
    absent = {q.name: _ABSENT for q in every if q.name in lost} | ({"push_torque": _LATE} if lagged else {})
    return replace(
        base,
        title=f"{base.title} with a controller",
        degree=4 + len(driven) * lagged,
        sets=sets,
        algebraic=algebraic,
        polynomial=polynomial,
        compact=None,
        pencil=pencil,
        feedback=feedback,
        natural=False,
        quantities=tuple(q for q in base.quantities if q.name not in lost),
        conventions=(*base.conventions, _SAID),
        absent=kept | absent,
    )


def _sum(A: Matrix, B: Matrix) -> Matrix:
    return [[a + b for a, b in zip(*rows, strict=True)] for rows in zip(A, B, strict=True)]


def _followed(lag: Any, entry: list[Any]) -> list[Any]:
    """(lag s + 1) times a polynomial of degree 2."""
    a, b, c = entry
    return [lag * a, a + lag * b, b + lag * c, c]


def _first_order(M: Matrix, D: Matrix, K: Matrix, G: Matrix, lag: Any, driven: tuple[int, ...]) -> tuple[Matrix, ...]:
    """I and −A of the states φ, δ, φ′, δ′ and the torques that follow."""
    (a, b), (c, d) = M
    determinant = a * d - b * c
    inverse = [
        [quotient(d, determinant), quotient(-b, determinant)],
        [quotient(-c, determinant), quotient(a, determinant)],
    ]
    size = 4 + len(driven)
    minus: Matrix = [[0] * size for _ in range(size)]
    minus[0][2] = minus[1][3] = -1
    for i in (0, 1):
        for j in (0, 1):
            minus[2 + i][j] = inverse[i][0] * K[0][j] + inverse[i][1] * K[1][j]
            minus[2 + i][2 + j] = inverse[i][0] * D[0][j] + inverse[i][1] * D[1][j]
        for k, row in enumerate(driven):
            minus[2 + i][4 + k] = -inverse[i][row]
    for k, row in enumerate(driven):
        minus[4 + k][:4] = [quotient(g, lag) for g in G[row]]
        minus[4 + k][4 + k] = quotient(1, lag)
    return [[int(i == j) for j in range(size)] for i in range(size)], minus


def _extended(
    of: ParameterSet, names: tuple[str, ...], native: Callable[[str], str], feedback: Callable[..., Feedback]
) -> ParameterSet:
    """A set with the gains: in SI, or in the units of the native set."""
    if of.rate is None:
        own = tuple(_parameter(n, "1", native(n)) for n in names)
        return replace(of, parameters=(*of.parameters, *own))
    turn, rate, torque = of.native, of.rate, of.torque
    assert torque is not None

    def in_native(p: Mapping[str, Any]) -> dict[str, Any]:
        own = {native(n): p[n] if native(n) == n else p[n] / size(n, p, rate, torque) for n in names}
        return {**turn(p), **own}

    own = tuple(replace(_parameter(n, _unit(n), n), counterpart="" if native(n) == n else native(n)) for n in names)
    quantities = tuple(q for q in of.quantities if q.name not in _PASSIVE)
    every = (*of.parameters, *own)

    def torques(v: Mapping[str, Any]) -> Feedback:
        return feedback(in_native({p.name: v[p.name] for p in every}))

    quantities += tuple(_quantities(names, torques, rate))
    return replace(of, parameters=every, native=in_native, quantities=quantities)


def _unit(name: str) -> str:
    if name == LAG:
        return "s"
    of_speed = name.endswith(_SLOPE)
    return {True: "N s^2/rad" if of_speed else "N m s/rad", False: "N s/rad" if of_speed else "N m/rad"}["dot" in name]


def _parameter(name: str, unit: str, written: str) -> Parameter:
    if name == LAG:
        said = "time constant of the actuators" + (" per √(w/g)" if unit == "1" else "")
        return Parameter(written, unit, said, r"\tau", Range(lower=0.0, closed=False))
    torque, x = _GAINS[name.removesuffix(_SLOPE)]
    said = f"{_TORQUES[torque]} against the {_STATES[x]}" + (" and the speed" if name.endswith(_SLOPE) else "")
    dotted = rf"\dot\{x[:-3]}" if "dot" in x else rf"\{x}"
    symbol = r"\kappa" if written != name else "k" if torque == "k" else "l"
    latex = rf"{symbol}_{{{dotted}{', v' if name.endswith(_SLOPE) else ''}}}"
    return Parameter(written, unit, said, latex, default=0.0)


def _quantities(names: tuple[str, ...], torques: Callable[..., Feedback], rate: Computed) -> Iterator[Quantity]:
    """What the controller has to give, in SI."""

    def per_degree(v: Mapping[str, Any]) -> Any:
        slope = v[f"k_phi{_SLOPE}"] * v["v"] if f"k_phi{_SLOPE}" in names else 0
        gain = v["k_phi"] + slope
        return gain * pi(gain) / 180

    def kicked(v: Mapping[str, Any]) -> Any:
        """The torque per impulse: the rates jump by M⁻¹ (0, 1)."""
        found = torques(v)
        (a, b), (c, d) = found.mass
        _, gains = found.gains
        return quotient(gains[3] * a - gains[2] * b, a * d - b * c) * rate(v)

    yield _sized("torque_per_degree", "N m", "steer torque per degree of lean", r"T_\delta/\phi", per_degree)
    if LAG not in names:
        meaning = "steer torque right after a push on the handlebar of 1 N m s"
        yield _sized("push_torque", "N m", meaning, r"T_\delta(0)", kicked)


def _sized(name: str, unit: str, meaning: str, latex: str, signed: Computed) -> Quantity:
    """The size of a quantity of either sign."""
    return Quantity(
        name,
        unit,
        meaning,
        latex,
        lambda v: absolute(signed(v)),
        range=Range(lower=0.0),
        pieces=(signed, lambda v: -signed(v)),
    )
