"""A bicycle with a controller: torques on lean and steer from lean, lean rate, steer and steer rate, for either model.

M q″ + D q′ + K q = −G (φ, δ, φ′, δ′), q = (lean, steer), so the gains are parts of D and K. Through actuators with a
lag each torque follows as lag T′ + T = −G (…), and its row is multiplied by lag s + 1.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from tmsopt.algebra.kinds import absolute, pi, quotient, sqrt
from tmsopt.models.model import Computed, Feedback, Matrix, Model, Parameter, ParameterSet, Quantity, Range
from tmsopt.roots.polynomial import determinant

LAG = "lag"
_STATES = {"phi": "lean", "delta": "steer", "phidot": "lean rate", "deltadot": "steer rate"}
_TORQUES = {"lean": "lean torque, of a rider or a flywheel,", "k": "steer torque"}  # of the rows of M, D, K
_WRITTEN = ("phi", "phidot", "delta", "deltadot")
_STEER = tuple(f"k_{x}" for x in _WRITTEN)
_SLOPE = "_v"  # of the gains that grow with the speed


class _Gain(NamedTuple):
    torque: str
    state: str
    grows: str
    """`_SLOPE` of one that is multiplied by the speed."""

    @property
    def row(self) -> int:
        return list(_TORQUES).index(self.torque)

    @property
    def of_rate(self) -> bool:
        return self.state.endswith("dot")


_GAINS = {
    f"{torque}_{x}{grows}": _Gain(torque, x, grows)
    for grows in ("", _SLOPE)
    for torque in ("k", "lean")
    for x in _WRITTEN
}

FEEDBACK = (*_GAINS, LAG)
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
    found = torque(p) / rate(p) if _GAINS[name].of_rate else torque(p)
    return found / sqrt(p["g"] * p["w"]) if _GAINS[name].grows else found


def names_of(names: Iterable[str]) -> tuple[str, ...]:
    """Those of [feedback] among some names, of either set; all four of the steer torque if there is one."""
    given = set(names)
    found = {n for n in FEEDBACK if n in given or native_name(n) in given}
    return tuple(n for n in FEEDBACK if n in found or (found and n in _STEER))


def with_feedback(of: Steered, names: tuple[str, ...]) -> Model:
    """The bicycle with the parameters of a controller, those of `names_of`."""
    base, lagged = of.model, LAG in names
    listed = {n: _GAINS[n] for n in names if n != LAG}
    driven = tuple(sorted({gain.row for gain in listed.values()}))
    in_si = base.sets[0].rate is not None  # the native set

    def native(name: str) -> str:
        return name if in_si else native_name(name)

    def gains(p: Mapping[str, Any]) -> dict[tuple[int, str], Any]:
        """Row and state → the gain, of the native parameters."""
        found: dict[tuple[int, str], Any] = {}
        for n, gain in listed.items():
            at, term = (gain.row, gain.state), p[native(n)] * p[of.speed] if gain.grows else p[native(n)]
            found[at] = found[at] + term if at in found else term
        return found

    def algebraic(p: Mapping[str, Any]) -> dict[str, Any]:
        known = base.algebraic(p)
        own = {f"G_{row}_{x}": gain for (row, x), gain in gains(p).items()}
        return {**known, **own, "h": sqrt(1 + known["T"] * known["T"])} | ({LAG: p[native(LAG)]} if lagged else {})

    def polynomial(**values: Any) -> list[Any]:
        M, D, K = of.matrices(values)
        angle, square = of.unit(values, values["h"])
        unit = ((1, angle), (angle, square))
        rows = [[[M[i][j], D[i][j], K[i][j]] for j in (0, 1)] for i in (0, 1)]
        for i in driven if lagged else ():
            rows[i] = [_followed(values[LAG], entry) for entry in rows[i]]
        for i, x in {(gain.row, gain.state) for gain in listed.values()}:
            j, power = int("delta" in x), -2 if "dot" in x else -1
            rows[i][j][power] = rows[i][j][power] + values[f"G_{i}_{x}"] * unit[i][j]
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


def _followed(lag: Any, entry: list[Any]) -> list[Any]:
    """(lag s + 1) times a polynomial of degree 2."""
    a, b, c = entry
    return [lag * a, a + lag * b, b + lag * c, c]


def _first_order(M: Matrix, D: Matrix, K: Matrix, G: Matrix, lag: Any, driven: tuple[int, ...]) -> tuple[Matrix, ...]:
    """I and −A of the states φ, δ, φ′, δ′ and the torques that follow."""
    (a, b), (c, d) = M
    size = a * d - b * c
    inverse = [[quotient(d, size), quotient(-b, size)], [quotient(-c, size), quotient(a, size)]]
    forces = [[*stiff, *damped] for stiff, damped in zip(K, D, strict=True)]
    still = [0] * len(driven)
    minus = [[0, 0, -1, 0, *still], [0, 0, 0, -1, *still]]
    for one, other in inverse:
        moved = [one * x + other * y for x, y in zip(*forces, strict=True)]
        minus.append([*moved, *(-(one, other)[row] for row in driven)])
    for row in driven:
        follows = (quotient(1, lag) if row == k else 0 for k in driven)
        minus.append([*(quotient(g, lag) for g in G[row]), *follows])
    return [[int(i == j) for j in range(len(minus))] for i in range(len(minus))], minus


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
    gain = _GAINS[name]
    return ("N s^2/rad" if gain.of_rate else "N s/rad") if gain.grows else "N m s/rad" if gain.of_rate else "N m/rad"


def _parameter(name: str, unit: str, written: str) -> Parameter:
    if name == LAG:
        said = "time constant of the actuators" + (" per √(w/g)" if unit == "1" else "")
        return Parameter(written, unit, said, r"\tau", Range(lower=0.0, closed=False))
    torque, x, grows = _GAINS[name]
    said = f"{_TORQUES[torque]} against the {_STATES[x]}" + (" and the speed" if grows else "")
    dotted = rf"\dot\{x[:-3]}" if "dot" in x else rf"\{x}"
    symbol = r"\kappa" if written != name else "k" if torque == "k" else "l"
    latex = rf"{symbol}_{{{dotted}{', v' if grows else ''}}}"
    return Parameter(written, unit, said, latex, default=0.0)


def _quantities(names: tuple[str, ...], torques: Callable[..., Feedback], rate: Computed) -> Iterator[Quantity]:
    """What the controller has to give, in SI."""

    def per_degree(v: Mapping[str, Any]) -> Any:
        gain = v["k_phi"] + (v["k_phi_v"] * v["v"] if "k_phi_v" in names else 0)
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
