"""Hard problems: small machines in SI, slivers, poles, kinks, tight equalities, stated systems, roots at zero."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from benchmarks.suites.hard_frames import Frame, best_frame, native, number, robot, wheeled
from benchmarks.suites.hard_systems import chain, feedback, polynomial
from benchmarks.suites.hard_texts import CURVED, EQUAL, KINKED, NATIVE, POLES, RATIOS, ROOT_KINKS, SI, TRIG, WHIPPLE
from tmsopt import Problem

HARD_SEED = 1
HARD_COUNT = 300

Goal = tuple[str, str]


def hard_problem(index: int, seed: int = HARD_SEED) -> Problem:
    """One problem of the suite, the same whatever the others are: 1 to 7 free parameters, 0 to 4 constraints."""
    rng = np.random.default_rng([seed, index, 11])
    (sense, objective), constraints, frame = _MAKERS[hard_family(index)](rng, index)
    return Problem(
        model=frame.model,
        fixed=frame.fixed,
        free=frame.free,
        constraints={f"c{k}": text for k, text in enumerate(constraints[:4], start=1)},
        title=f"hard design {index} of seed {seed}: {hard_family(index)}",
        minimize=objective if sense == "minimize" else None,
        maximize=objective if sense == "maximize" else None,
    )


def hard_family(index: int) -> str:
    """Its kind: every third is a machine in SI, in turn with and without a limit of the steer arm."""
    if index % 3 == 0:
        return _MACHINES[index // 3 % len(_MACHINES)]
    return _OTHERS[(index - index // 3 - 1) % len(_OTHERS)]


Asked = tuple[Goal, Sequence[str], Frame]


def _free(rng: np.random.Generator, least: int = 1, most: int = 7) -> int:
    return int(rng.integers(least, most + 1))


def _machine(rng: np.random.Generator, index: int, armed: bool, wheels: bool) -> Asked:
    count = _free(rng, 2)
    frame = best_frame(rng, partial(wheeled if wheels else robot, count=count))
    constraints = []
    if armed:
        arm = frame.at_anchor("u_H")
        least = number(min(rng.uniform(0.002, 0.01), 0.7 * abs(arm)), 2)
        both = rng.random() < 0.4
        constraints.append(f"abs(u_H) >= {least}" if both else f"u_H >= {least}" if arm > 0 else f"u_H <= {-least}")
    quantities = WHIPPLE if wheels else SI
    draw = rng.random()
    if draw < 0.4:
        goal = ("minimize", "abscissa")
    elif draw < 0.58:  # heavy damping is common here: then the fastest of the heavily damped ones
        heavy = bool(np.max(frame.worth("damping_ratio")) == 1)
        goal = (
            "maximize",
            f"damping_ratio - {number(rng.uniform(0.05, 0.5), 2)}*abscissa" if heavy else "damping_ratio",
        )
    elif draw < 0.68:
        goal = _kink(frame)
    else:
        goal = _goal(rng, frame, quantities)
        constraints.append(_on_roots(rng, frame))
    wanted = len(constraints) + int(rng.integers(0, 3))
    limits = (
        "N_F",
        "N_R",
        "m_H",
        "x_B",
        "z_B",
        "lambda_s",
        "abs(lambda_s)",
        "u_H",
        quantities[1],
        "x_H - x_B",
        "v*m_H",
    )
    for _ in range(20):
        if len(constraints) >= wanted:
            break
        text = frame.some_of([t for t in limits if not (t == "u_H" and not armed)])
        comparison = "<=" if rng.random() < 0.4 else ">="
        if text != goal[1] and not any(c.startswith(f"{text} ") for c in constraints):
            constraints.append(frame.limit(text, comparison))
    return goal, constraints, frame


def _goal(rng: np.random.Generator, frame: Frame, texts: Sequence[str]) -> Goal:
    return str(rng.choice(["minimize", "maximize"], p=[0.65, 0.35])), frame.some_of(texts)


def _on_roots(rng: np.random.Generator, frame: Frame) -> str:
    kind = rng.random()
    if kind < 0.6:
        return frame.limit("abscissa", "<=")
    return frame.limit("damping_ratio", ">=") if kind < 0.85 else frame.limit("abscissa + 0.2*damping_ratio", "<=")


def _kink(frame: Frame) -> Goal:
    """An objective with kinks in the root quantities, some of them beside what the box has."""
    best = abs(frame.least)
    text = str(frame.rng.choice(ROOT_KINKS)).replace("{n}", str(number(best * frame.rng.uniform(0.3, 1.1), 2)))
    text = frame.filled(text)
    return ("maximize" if text.startswith("min(damping") else "minimize"), text


def _rooted(rng: np.random.Generator) -> Goal:
    return ("minimize", "abscissa") if rng.random() < 0.65 else ("maximize", "damping_ratio")


def _any_frame(rng: np.random.Generator, least: int, most: int = 7) -> Frame:
    """Skates without units mostly; or a stated system."""
    count, kind = _free(rng, least, most), rng.random()
    if kind < 0.55:
        return best_frame(rng, partial(native, count=count))
    make = polynomial if kind < 0.7 else chain if kind < 0.85 else feedback
    return best_frame(rng, partial(make, count=count))


def _mixed(rng: np.random.Generator, index: int, templates: Sequence[str], least: int = 1) -> Asked:
    """One to three limits of one kind, perhaps one on the roots."""
    frame = _any_frame(rng, least)
    constraints = [
        frame.limit(frame.one_of(templates), str(rng.choice(["<=", ">="]))) for _ in range(int(rng.integers(1, 4)))
    ]
    if rng.random() < 0.6:
        return _rooted(rng), constraints, frame
    return _goal(rng, frame, [frame.one_of(CURVED)]), [*constraints, _on_roots(rng, frame)], frame


def _sliver(rng: np.random.Generator, index: int) -> Asked:
    """Of which 1e-3 to 1e-5 of the box is feasible."""
    frame = _any_frame(rng, 2)
    share, bands = 10.0 ** rng.uniform(-5, -3), int(rng.integers(1, 3))
    constraints = [frame.band(frame.one_of(TRIG + RATIOS + CURVED), share ** (1 / bands)) for _ in range(bands)]
    if rng.random() < 0.3:
        constraints.append(frame.limit(frame.one_of(CURVED), "<="))
    if rng.random() < 0.7:
        return _rooted(rng), constraints, frame
    return _goal(rng, frame, [frame.one_of(CURVED)]), [*constraints, _on_roots(rng, frame)], frame


def _equality(rng: np.random.Generator, index: int, count: int) -> Asked:
    frame = _any_frame(rng, count + 1)
    constraints = [frame.limit(frame.one_of(EQUAL), "==") for _ in range(count)]
    if rng.random() < 0.4:
        constraints.append(frame.limit(frame.one_of(CURVED + TRIG), "<=", 0.3))
    if rng.random() < 0.7:
        return _rooted(rng), constraints, frame
    return _goal(rng, frame, [frame.one_of(CURVED)]), [*constraints, _on_roots(rng, frame)], frame


def _pole(rng: np.random.Generator, index: int) -> Asked:
    """Limits that only a neighbourhood of a pole meets."""
    frame = _any_frame(rng, 2)
    text = frame.filled(str(rng.choice(POLES)))
    least = {"log": 4.0, "1/s": 300.0, "tan": 2000.0}.get(text[:3], 30.0) * 2 ** rng.uniform(-1, 1)
    if "0.001" in text:
        least = 400.0
    constraints = [f"{text} >= {number(least, 2)}"]
    if rng.random() < 0.5:
        constraints.append(frame.limit(frame.one_of(CURVED), str(rng.choice(["<=", ">="])), 0.4))
    if rng.random() < 0.75:
        return _rooted(rng), constraints, frame
    return _goal(rng, frame, [frame.one_of(CURVED)]), [*constraints, frame.limit("abscissa", "<=", 0.3)], frame


def _kinks(rng: np.random.Generator, index: int) -> Asked:
    frame = _any_frame(rng, 1)
    return _kink(frame), [frame.limit(frame.one_of(CURVED + KINKED), "<=") for _ in range(_free(rng, 0, 2))], frame


def _tilts(rng: np.random.Generator, index: int) -> Asked:
    frame = best_frame(rng, partial(native, count=_free(rng, 2), tilt="either"))
    least = number(rng.uniform(0.005, 0.04), 2)
    constraints = [f"abs(nu_H) >= {least}"] if rng.random() < 0.7 and frame.usable("nu_H") else []
    constraints += [frame.limit(frame.some_of(NATIVE), str(rng.choice(["<=", ">="])))]
    if rng.random() < 0.6:
        return _rooted(rng), constraints, frame
    return _goal(rng, frame, [*NATIVE, "lambda_s*nu_H"]), [*constraints, _on_roots(rng, frame)], frame


def _quantities(rng: np.random.Generator, index: int) -> Asked:
    frame = best_frame(rng, partial(native, count=_free(rng)))
    constraints = [_on_roots(rng, frame)]
    constraints += [frame.limit(frame.some_of(NATIVE), str(rng.choice(["<=", ">="]))) for _ in range(_free(rng, 0, 2))]
    return _goal(rng, frame, NATIVE), constraints, frame


def _stated(rng: np.random.Generator, index: int, make: Callable[..., Frame]) -> Asked:
    frame = best_frame(rng, partial(make, count=_free(rng)))
    constraints = [frame.limit(frame.one_of(CURVED + TRIG + KINKED), "<=") for _ in range(_free(rng, 0, 2))]
    draw = rng.random()
    if draw < 0.6:
        return _rooted(rng), constraints, frame
    if draw < 0.8:
        return _kink(frame), constraints, frame
    return _goal(rng, frame, [frame.one_of(CURVED)]), [*constraints, _on_roots(rng, frame)], frame


def _zero(rng: np.random.Generator, index: int) -> Asked:
    """A root at 0 for every design: no abscissa is below 0, and that of all that do not grow is 0."""
    make = (polynomial, feedback, chain)[int(rng.integers(3))]
    frame = best_frame(rng, partial(make, count=_free(rng, 2, 6), zero=True))
    extra = [frame.limit(frame.one_of(CURVED + TRIG), "<=") for _ in range(_free(rng, 0, 1))]
    if rng.random() < 0.3:
        return ("minimize", "abscissa"), extra, frame
    least = 0.0 if frame.least < 1e-6 else number(1.05 * frame.least)
    bound = "abscissa <= 0" if least == 0 else f"abscissa <= {least}"
    return _goal(rng, frame, [frame.one_of(CURVED + TRIG)]), [*extra, bound], frame


def _unstable(rng: np.random.Generator, index: int) -> Asked:
    make = (polynomial, feedback, chain)[int(rng.integers(3))]
    frame = make(rng, count=_free(rng, 1, 6), push=rng.uniform(1.8, 3.0))
    extra = [frame.limit(frame.one_of(CURVED), "<=") for _ in range(_free(rng, 0, 2))]
    if rng.random() < 0.7:
        return _rooted(rng), extra, frame
    return _goal(rng, frame, [frame.one_of(CURVED)]), [*extra, frame.limit("abscissa", "<=", 0.1)], frame


def _infeasible(rng: np.random.Generator, index: int) -> Asked:
    """Limits that contradict each other, most of them certainly."""
    frame = _any_frame(rng, 2)
    draw = int(rng.integers(6))
    if draw == 0:
        pair = [frame.filled("sin(5*{a}) + cos(5*{a})") + f" >= {number(np.sqrt(2) + 0.002, 5)}"]
    elif draw == 1:
        text = frame.one_of(CURVED + TRIG)
        value = frame.at_anchor(text)
        pair = [f"{text} >= {number(value)}", f"{text} <= {number(number(value) - 0.01 * frame.iqr(text), 5)}"]
    elif draw == 2:
        pair = [f"damping_ratio >= {number(1.001 + 0.1 * rng.random(), 4)}"]
    elif draw == 3:  # beyond what random designs have; may be feasible in a corner
        text = frame.one_of(CURVED + TRIG + RATIOS)
        found = frame.worth(text)
        pair = [f"{text} >= {number(float(np.nanmax(found) + 0.3 * np.ptp(found[np.isfinite(found)])))}"]
    elif draw == 4:
        text = "({a} + 2)*({b} + 2)"
        drawn = dict(zip("ab", (f"({frame.unit(n)})" for n in frame.free), strict=False))
        pair = [
            f"{text.format(**drawn)} >= 4",
            f"{drawn['a']} + {drawn['b']} <= {number(-0.01 * rng.random() - 0.001, 2)}",
        ]
    else:  # the sum of the roots of the mean: no abscissa is below it
        bound = f"-a1/({frame.model.degree}*a0)"
        pair = [f"abscissa <= {bound} - {number(0.001 + 0.05 * rng.random(), 2)}"]
    return _rooted(rng), [*pair, frame.limit(frame.one_of(CURVED), "<=")][: 1 + int(rng.integers(1, 3))], frame


def _root_equality(rng: np.random.Generator, index: int) -> Asked:
    """A root quantity is given, or two of them are."""
    frame = _any_frame(rng, 2)
    kinds = ("abscissa", "damping_ratio", "abscissa*damping_ratio", "abscissa + damping_ratio/3")
    text = frame.some_of(kinds[: 2 + 2 * (rng.random() < 0.4)])
    constraints = [frame.limit(text, "==")]
    if rng.random() < 0.5:
        constraints.append(frame.limit(frame.one_of(CURVED), "<=", 0.3))
    other = "damping_ratio" if text == "abscissa" else "abscissa"
    if rng.random() < 0.4:
        return ("maximize" if other == "damping_ratio" else "minimize", other), constraints, frame
    return _goal(rng, frame, [frame.one_of(CURVED + TRIG)]), constraints, frame


def _open(rng: np.random.Generator, index: int) -> Asked:
    """An objective with a pole in the box, so that there is no best design, or beside it."""
    frame = _any_frame(rng, 2, 5)
    text = frame.filled(
        str(
            rng.choice(
                [
                    "1/({a} - {b})",
                    "{b}/({a} + 0.2)",
                    "tan(3*{a}) + {b}",
                    "{c}/({a} - {b})**2",
                    "{b}/({a} + 1.3)",
                    "1/({a}**2 + {b}**2)",
                ]
            )
        )
    )
    return (str(rng.choice(["minimize", "maximize"])), text), [_on_roots(rng, frame)], frame


def _flat(rng: np.random.Generator, index: int) -> Asked:
    """A feasible set without interior: a limit at the very best that one parameter allows, or opposite limits."""
    frame = _any_frame(rng, 2)
    text = frame.one_of(CURVED + TRIG + RATIOS)
    value = number(frame.at_anchor(text))
    constraints = [f"{text} >= {value}", f"{text} <= {value}"]
    if rng.random() < 0.5:
        constraints.append(frame.limit(frame.one_of(KINKED), "<=", 0.3))
    return _rooted(rng), constraints, frame


_MAKERS: Mapping[str, Callable[[np.random.Generator, int], Asked]] = {
    "machine, arm limited": partial(_machine, armed=True, wheels=False),
    "machine, arm free": partial(_machine, armed=False, wheels=False),
    "wheels, arm limited": partial(_machine, armed=True, wheels=True),
    "wheels, arm free": partial(_machine, armed=False, wheels=True),
    "trigonometry": partial(_mixed, templates=TRIG),
    "ratios": partial(_mixed, templates=RATIOS),
    "sliver": _sliver,
    "equality": partial(_equality, count=1),
    "two equalities": partial(_equality, count=2),
    "pole": _pole,
    "kinked objective": _kinks,
    "kinked limits": partial(_mixed, templates=KINKED),
    "both tilts": _tilts,
    "quantities": _quantities,
    "polynomial": partial(_stated, make=polynomial),
    "matrices": partial(_stated, make=chain),
    "feedback": partial(_stated, make=feedback),
    "root at zero": _zero,
    "unstable": _unstable,
    "infeasible": _infeasible,
    "root equality": _root_equality,
    "open": _open,
    "no interior": _flat,
}
_MACHINES = (
    "machine, arm limited",
    "machine, arm free",
    "machine, arm limited",
    "machine, arm free",
    "machine, arm limited",
    "machine, arm free",
    "machine, arm limited",
    "machine, arm free",
    "wheels, arm limited",
    "wheels, arm free",
)
_OTHERS = (*(name for name in _MAKERS if name[:5] not in ("machi", "wheel")), "sliver")
