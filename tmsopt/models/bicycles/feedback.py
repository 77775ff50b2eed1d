"""Controllers of bicycles: torques on lean and steer from lean, lean rate, steer and steer rate.

The equations are M q″ + D q′ + K q = −G (φ, δ, φ′, δ′) with q = (lean, steer), so the gains are added to D and K. If
the actuators have a lag, a torque T follows lag T′ + T = −G (…), so each equation with a torque is multiplied by
lag s + 1.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from operator import add
from typing import Any, NamedTuple

from tmsopt.algebra.kinds import absolute, pi, quotient_or_nan, sqrt
from tmsopt.models.model import (
    Feedback,
    Matrices,
    Matrix,
    Model,
    NumberFunction,
    Parameter,
    ParameterSet,
    Quantity,
    Range,
)
from tmsopt.records import AnyNumbers
from tmsopt.roots.polynomial import determinant

LAG = "lag"
_STATES = {"phi": "lean", "delta": "steer", "phidot": "lean rate", "deltadot": "steer rate"}
_TORQUES = {
    "lean": "lean torque, of a rider or a flywheel,",
    "k": "steer torque",
}
"""Names of torques → description, in the order of the rows of M, D and K."""
_STATE_ORDER = ("phi", "phidot", "delta", "deltadot")
_STEER_GAINS = tuple(f"k_{x}" for x in _STATE_ORDER)


class _Gain(NamedTuple):
    """A gain: the torque is −gain · state, or −gain · speed · state if the gain is a slope over the speed."""

    torque: str
    state: str
    is_slope: bool

    @property
    def position(self) -> tuple[int, int]:
        """Row and column in G."""
        return list(_TORQUES).index(self.torque), list(_STATES).index(self.state)

    @property
    def is_rate(self) -> bool:
        return self.state.endswith("dot")


_GAINS = {
    f"{torque}_{x}{'_v' * is_slope}": _Gain(torque, x, is_slope)
    for is_slope in (False, True)
    for torque in ("k", "lean")
    for x in _STATE_ORDER
}

FEEDBACK = (*_GAINS, LAG)
"""Names of the parameters in the table [feedback], in SI."""

_UNCONTROLLED_QUANTITIES = ("v_weave", "v_capsize", "Fr_c", "v_c")
_ABSENT_ADVICE = (
    "its formula holds without a controller only; run `tmsopt speeds` for the stable speeds of this bicycle"
)
_NO_PEAK_ADVICE = "with a lag the torque starts at 0; run `tmsopt simulate` for its peak after a push"
_CONVENTION = (
    "A controller adds the steer torque −(k_phi φ + k_phidot φ′ + k_delta δ + k_deltadot δ′), to the right positive."
)


NO_CONTROLLER = {
    **dict.fromkeys(FEEDBACK, "gains of a controller belong in a table [feedback], such as k_phidot = -20"),
    **dict.fromkeys(
        ("torque_per_degree", "push_torque"), "there is no torque without a controller; add a table [feedback]"
    ),
}
"""Names that a bicycle without a controller does not have → advice on what to write."""


@dataclass(frozen=True)
class ControllableBicycle:
    """A bicycle with the data for adding a controller.

    Attributes:
        model: the bicycle without a controller.
        matrices: algebraic parameters → M, D, K. In the unit of the steer angle chosen here, they are polynomials.
        unit: algebraic parameters and √(1 + T²) with T = tan λ_s → this unit in radians, and its square.
        speed: name of the speed in the native set.
    """

    model: Model
    matrices: Callable[[AnyNumbers], Matrices]
    unit: Callable[[AnyNumbers, Any], tuple[Any, Any]]
    speed: str


def native_name(name: str) -> str:
    """The dimensionless counterpart of a name of [feedback], such as ``kappa_phi`` for ``k_phi``."""
    return "tau" if name == LAG else f"kappa_{name.removeprefix('k_')}"


def si_scale(name: str, p: AnyNumbers, rate: NumberFunction, torque: NumberFunction) -> Any:
    """The value in SI of a parameter of [feedback] whose dimensionless value is 1."""
    if name == LAG:
        return 1 / rate(p)
    scale = torque(p) / rate(p) if _GAINS[name].is_rate else torque(p)
    return scale / sqrt(p["g"] * p["w"]) if _GAINS[name].is_slope else scale


def feedback_names(names: Iterable[str]) -> tuple[str, ...]:
    """The names of [feedback] in SI for `names`, SI or dimensionless; with any of them, all four steer torque gains."""
    given_names = set(names)
    used_names = {n for n in FEEDBACK if n in given_names or native_name(n) in given_names}
    return tuple(n for n in FEEDBACK if n in used_names or (used_names and n in _STEER_GAINS))


def add_feedback(bicycle: ControllableBicycle, names: tuple[str, ...]) -> Model:
    """The bicycle with a controller.

    Args:
        names: parameters of the controller, as `feedback_names` returns them.
    """
    base, has_lag = bicycle.model, LAG in names
    gains_by_name = {n: _GAINS[n] for n in names if n != LAG}
    positions = {gain.position for gain in gains_by_name.values()}
    driven_rows = tuple(sorted({row for row, _ in positions}))
    is_native_si = base.sets[0].rate is not None  # the native set

    def native(name: str) -> str:
        return name if is_native_si else native_name(name)

    def gains(p: AnyNumbers) -> Matrix:
        """G from native parameters."""
        G: Matrix = [[0] * len(_STATES) for _ in _TORQUES]
        for n, gain in gains_by_name.items():
            i, j = gain.position
            G[i][j] = G[i][j] + (p[native(n)] * p[bicycle.speed] if gain.is_slope else p[native(n)])
        return G

    def algebraic(p: AnyNumbers) -> dict[str, Any]:
        base_values, G = base.algebraic(p), gains(p)
        gain_entries = {f"G_{i}_{j}": G[i][j] for i, j in positions}
        lag = {LAG: p[native(LAG)]} if has_lag else {}
        return {**base_values, **gain_entries, "h": sqrt(1 + base_values["T"] * base_values["T"]), **lag}

    def polynomial(**values: Any) -> list[Any]:
        matrices = bicycle.matrices(values)
        unit, unit_squared = bicycle.unit(values, values["h"])
        gain_units = ((1, unit), (unit, unit_squared))
        rows = [[[P[i][j] for P in matrices] for j in (0, 1)] for i in (0, 1)]
        for i in driven_rows if has_lag else ():
            rows[i] = [_multiply_by_lag(values[LAG], entry) for entry in rows[i]]
        for i, j in positions:
            entry, power = rows[i][j % 2], -1 - j // 2
            entry[power] = entry[power] + values[f"G_{i}_{j}"] * gain_units[i][j % 2]
        return determinant(rows)

    def feedback(p: AnyNumbers) -> Feedback:
        assert base.pencil is not None
        return Feedback(base.pencil(p)[0], gains(p), p[native(LAG)] if has_lag else None, driven_rows)

    def pencil(p: AnyNumbers) -> Matrices:
        assert base.pencil is not None
        M, D, K = base.pencil(p)
        G = gains(p)
        if has_lag:
            return _first_order(M, D, K, G, p[native(LAG)], driven_rows)
        D = [list(map(add, row, g[2:])) for row, g in zip(D, G, strict=True)]
        K = [list(map(add, row, g)) for row, g in zip(K, G, strict=True)]
        return M, D, K

    sets = tuple(_extend_set(s, names, native, feedback) for s in base.sets)
    removed_names = {*_UNCONTROLLED_QUANTITIES, *(("omega0",) if has_lag else ())}
    base_advice = {name: advice for name, advice in base.absent.items() if name not in NO_CONTROLLER}
    all_quantities = (*base.quantities, *(q for s in base.sets for q in s.quantities))
    absent = {q.name: _ABSENT_ADVICE for q in all_quantities if q.name in removed_names}
    absent |= {"push_torque": _NO_PEAK_ADVICE} if has_lag else {}
    return replace(
        base,
        title=f"{base.title} with a controller",
        degree=4 + len(driven_rows) * has_lag,
        sets=sets,
        algebraic=algebraic,
        polynomial=polynomial,
        compact=None,
        pencil=pencil,
        feedback=feedback,
        natural=False,
        quantities=tuple(q for q in base.quantities if q.name not in removed_names),
        conventions=(*base.conventions, _CONVENTION),
        absent=base_advice | absent,
    )


def _multiply_by_lag(lag: Any, entry: list[Any]) -> list[Any]:
    """(lag s + 1) times a polynomial of degree 2."""
    a, b, c = entry
    return [lag * a, a + lag * b, b + lag * c, c]


def _first_order(M: Matrix, D: Matrix, K: Matrix, G: Matrix, lag: Any, driven_rows: tuple[int, ...]) -> Matrices:
    """I and −A of x′ = A x, where the states x are φ, δ, φ′, δ′ and the delayed torques."""
    (a, b), (c, d) = M
    det_M = a * d - b * c
    inverse = [[quotient_or_nan(x, det_M) for x in row] for row in ((d, -b), (-c, a))]
    forces = [[*stiff, *damped] for stiff, damped in zip(K, D, strict=True)]
    zeros = [0] * len(driven_rows)
    minus_A = [[0, 0, -1, 0, *zeros], [0, 0, 0, -1, *zeros]]
    for first, second in inverse:
        accelerations = [first * x + second * y for x, y in zip(*forces, strict=True)]
        minus_A.append([*accelerations, *(-(first, second)[row] for row in driven_rows)])
    for row in driven_rows:
        decay = (quotient_or_nan(1, lag) if row == k else 0 for k in driven_rows)
        minus_A.append([*(quotient_or_nan(g, lag) for g in G[row]), *decay])
    return [[int(i == j) for j in range(len(minus_A))] for i in range(len(minus_A))], minus_A


def _extend_set(
    base: ParameterSet, names: tuple[str, ...], native: Callable[[str], str], feedback: Callable[..., Feedback]
) -> ParameterSet:
    """A parameter set with the gains, in SI or dimensionless."""
    if base.rate is None:
        gain_parameters = tuple(_parameter(n, "1", native(n)) for n in names)
        return replace(base, parameters=(*base.parameters, *gain_parameters))
    to_native, rate, torque = base.native, base.rate, base.torque
    assert torque is not None

    def to_native_with_gains(p: AnyNumbers) -> dict[str, Any]:
        gain_values = {native(n): p[n] if native(n) == n else p[n] / si_scale(n, p, rate, torque) for n in names}
        return {**to_native(p), **gain_values}

    gain_parameters = tuple(
        replace(_parameter(n, _unit(n), n), counterpart="" if native(n) == n else native(n)) for n in names
    )
    quantities = tuple(q for q in base.quantities if q.name not in _UNCONTROLLED_QUANTITIES)
    all_parameters = (*base.parameters, *gain_parameters)

    def torques(v: AnyNumbers) -> Feedback:
        return feedback(to_native_with_gains({p.name: v[p.name] for p in all_parameters}))

    quantities += tuple(_quantities(names, torques, rate))
    return replace(base, parameters=all_parameters, native=to_native_with_gains, quantities=quantities)


def _unit(name: str) -> str:
    if name == LAG:
        return "s"
    gain = _GAINS[name]
    return ("N s^2/rad" if gain.is_rate else "N s/rad") if gain.is_slope else "N m s/rad" if gain.is_rate else "N m/rad"


def _parameter(name: str, unit: str, public_name: str) -> Parameter:
    if name == LAG:
        meaning = "time constant of the actuators" + (" per √(w/g)" if unit == "1" else "")
        return Parameter(public_name, unit, meaning, r"\tau", Range(lower=0.0, closed=False))
    torque, x, is_slope = _GAINS[name]
    meaning = f"{_TORQUES[torque]} against the {_STATES[x]}" + (" and the speed" if is_slope else "")
    dotted = rf"\dot\{x[:-3]}" if "dot" in x else rf"\{x}"
    symbol = r"\kappa" if public_name != name else "k" if torque == "k" else "l"
    latex = rf"{symbol}_{{{dotted}{', v' if is_slope else ''}}}"
    return Parameter(public_name, unit, meaning, latex, default=0.0)


def _quantities(names: tuple[str, ...], torques: Callable[..., Feedback], rate: NumberFunction) -> Iterator[Quantity]:
    """Torques that the controller must provide, in SI."""

    def per_degree(v: AnyNumbers) -> Any:
        gain = v["k_phi"] + (v["k_phi_v"] * v["v"] if "k_phi_v" in names else 0)
        return gain * pi(gain) / 180

    def torque_after_push(v: AnyNumbers) -> Any:
        """Torque divided by the impulse of the push, which changes the rates at once by M⁻¹ (0, 1)."""
        feedback = torques(v)
        (a, b), (c, d) = feedback.mass
        _, gains = feedback.gains
        return quotient_or_nan(gains[3] * a - gains[2] * b, a * d - b * c) * rate(v)

    yield _magnitude("torque_per_degree", "N m", "steer torque per degree of lean", r"T_\delta/\phi", per_degree)
    if LAG not in names:
        meaning = "steer torque right after a push on the handlebar of 1 N m s"
        yield _magnitude("push_torque", "N m", meaning, r"T_\delta(0)", torque_after_push)


def _magnitude(name: str, unit: str, meaning: str, latex: str, signed: NumberFunction) -> Quantity:
    """The absolute value of a signed quantity."""
    return Quantity(
        name,
        unit,
        meaning,
        latex,
        lambda v: absolute(signed(v)),
        range=Range(lower=0.0),
        pieces=(signed, lambda v: -signed(v)),
    )
