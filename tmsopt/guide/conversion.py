"""A problem for point masses on skates as one for Whipple's bicycle, whose bodies have rotational inertia."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from tmsopt.errors import Fault, InputError, short, suggest
from tmsopt.guide.problem_text import toml_problem
from tmsopt.models import CONSTANTS, FUNCTIONS, controlled, whipple
from tmsopt.problem import Posed, Problem
from tmsopt.problem.files import Given, pose
from tmsopt.problem.units import parse_quantity

INERTIAS = ("boxes", "none")
"""What a body becomes: a solid box about its centre of mass, or the point mass that it was."""

_PER_WHEELBASE = {"B": (1 / 2, 1 / 4, 3 / 8), "H": (1 / 8, 1 / 8, 3 / 8)}
"""Body → length, width and height of its box, per wheelbase, unless its size is given."""

_INSIDE = 0.9
"""Share of the range of an inertia that an equality ties to a mass, so that the ends of the mass are active first."""

_WORDS = {
    "Fr": "(v/sqrt(g*w))",
    "mu": "(m_H/m_B)",
    "chi_B": "(x_B/w)",
    "chi_H": "(x_H/w)",
    "zeta_B": "(z_B/w)",
    "zeta_H": "(z_H/w)",
    "nu_H": "(u_H/w)",
    "chi_T": "(x_T/w)",
    "omega0": "(omega0/sqrt(g/w))",
    "abscissa": "(abscissa/sqrt(g/w))",
    "angular_frequency": "(angular_frequency/sqrt(g/w))",
    "ballast_rear": "(m_ballast_rear/m_B)",
    "v_c": "v_weave",
    "Fr_c": "(v_weave/sqrt(g*w))",
    **{n: n for n in ("damping_ratio", "radius", "load_front", "load_rear", *FUNCTIONS, *CONSTANTS)},
}
"""Word of an expression about point masses → the same in Whipple's model; those in SI alone are the same."""

_SIZE = re.compile(r"\s*([\d.]+)\s*[x×]\s*([\d.]+)\s*[x×]\s*([\d.]+)\s*(\D+)")

Size = tuple[float, float, float]


def convert(
    given: Given,
    to: str = "whipple",
    inertia: str = "boxes",
    body: str | Size | None = None,
    front: str | Size | None = None,
) -> Problem:
    """A problem of point masses on skates, in SI, as the same problem for a model whose bodies have inertia.

    Parameters, ranges, limits, cases and the objective are kept; there are no wheels and there is no trail. Where a
    mass is free, the inertia of its box is free too, and an equality ties it to the mass.

    Args:
        given: a problem of the model ``tms``, the path of its file, or a solution.
        to: ``whipple``.
        inertia: ``boxes``: the rear frame and the front assembly are solid boxes; ``none``: they stay point masses.
        body: length, width and height of the rear frame in m, or as ``"40x20x30 cm"``. By default 1/2, 1/4 and 3/8 of
            the wheelbase, and no higher than twice the height of its centre of mass.
        front: likewise of the front assembly; by default 1/8, 1/8 and 3/8.

    Raises:
        InputError: naming all that has no counterpart in the other model.

    Example:
        >>> robot = tmsopt.convert("problems/point_mass_robot.toml", body="40x20x30 cm")
        >>> robot.model.name, robot.fixed["I_Bxx"]  # 20 kg (0.2² + 0.3²)/12
        ('whipple', 0.216667)

    More: docs/how_to/inertia.md
    """
    problem = pose(given)
    if faults := [*_not_taken(problem, to, inertia)]:
        raise InputError(faults)
    sizes, faults = _sizes(problem, inertia, body, front), [*_without_counterpart(problem)]
    for which in sizes:
        if f"m_{which}" in problem.scenarios:
            message = "varies, and the inertia of a box would vary with it; give it one value, or --inertia none"
            faults.append(Fault(message, ("scenarios", f"m_{which}")))
    if faults:
        raise InputError(faults)
    fixed, free = dict(problem.fixed), dict(problem.free)
    limits = {name: _translate(problem, text) for name, text in problem.constraints.items()}
    for which, (length, width, height) in sizes.items():
        mass = f"m_{which}"
        for axes, share in (("xx", (width**2 + height**2) / 12), ("zz", (length**2 + width**2) / 12)):  # m²
            name = f"I_{which}{axes}"
            if mass in problem.free:
                low, high = problem.free[mass]
                free[name] = (_round(_INSIDE * share * low), _round(share * high / _INSIDE))
                limits[_new(f"box_{name}", limits)] = f"{name} == {share:.12g}*{mass}"
            else:
                fixed[name] = _round(share * problem.fixed[mass])
    return replace(
        problem.problem,
        model=whipple,
        fixed=fixed,
        free=free,
        constraints=limits,
        minimize=_objective(problem, problem.minimize),
        maximize=_objective(problem, problem.maximize),
        pareto=tuple(str(_objective(problem, text)) for text in problem.pareto),
    )


def converted_file(given: Given, **options: Any) -> str:
    """The text of a converted problem file, with what was assumed in comments; options as of `convert`."""
    problem = pose(given)
    converted, sizes = convert(problem, **options), _sizes(problem, **options)
    lines = ["The two masses of the model tms in the model whipple, without wheels and trail."]
    for name, size in zip(("rear frame", "front assembly"), sizes.values(), strict=False):
        shown = " x ".join(f"{100 * x:.4g}" for x in size)
        lines.append(f"The {name} is a solid box of {shown} cm (length, width, height) about its centre of mass.")
    if sizes:
        lines.append("I_xx = m (width^2 + height^2)/12, I_zz = m (length^2 + width^2)/12, in kg m^2, and I_xz = 0.")
    radius = 0.125 * _middle(problem, "w")
    lines += [
        "A wheel of 1 kg, a solid disc, under [parameters]; likewise at the rear with R for F:",
        f"  r_F = {radius:.4g}",
        "  m_F = 1",
        f"  I_Fxx = {radius**2 / 4:.4g}    # m r^2/4 about a diameter",
        f"  I_Fyy = {radius**2 / 2:.4g}    # m r^2/2 about its axle",
    ]
    return toml_problem(converted.posed, lines)


def _not_taken(problem: Posed, to: str, inertia: str) -> Iterator[Fault]:
    """What cannot be converted at all."""
    if problem.model.name != "tms":
        yield Fault(f"found the model {short(problem.model.name)}; accepted: tms", ("model",))
    elif problem.parameter_set.rate is None:
        names = ", ".join(problem.parameter_set.names[:3])
        message = f"is written in numbers without units ({names}, …), and a body has a size and a mass"
        yield Fault(f"{message}; write it in SI: w, v, m_B, x_B, …", ("parameters",))
    if to != whipple.name:
        yield Fault(f"found {short(to)}; accepted: {whipple.name}", ("to",))
    if inertia not in INERTIAS:
        yield Fault(f"found {short(inertia)}; {suggest(inertia, INERTIAS)}", ("inertia",))


def _without_counterpart(problem: Posed) -> Iterator[Fault]:
    """Words of the objective and the constraints that Whipple's model does not have."""
    objectives = {"minimize": problem.minimize, "maximize": problem.maximize, "pareto": " ".join(problem.pareto)}
    asked = {("objective", sense): text or "" for sense, text in objectives.items()}
    asked |= {("constraints", name): text for name, text in problem.constraints.items()}
    for key, text in asked.items():
        for name in sorted({*_WORD.findall(text)} - set(_counterparts(problem))):
            yield Fault(f"{name} has no counterpart in the model whipple", key)


_WORD = re.compile(r"\b[A-Za-z_]\w*")


def _counterparts(problem: Posed) -> dict[str, str]:
    """Word of an expression → what to write for it."""
    of, other = problem.parameter_set, controlled(whipple, problem.parameter_set.names)
    own = (*of.names, *(q.name for q in of.quantities))
    theirs = {*other.sets[0].names, *other.quantity_names(other.sets[0])}
    return {name: name for name in own if name in theirs} | _WORDS


def _translate(problem: Posed, text: str) -> str:
    words = _counterparts(problem)
    return _WORD.sub(lambda word: words[word[0]], text)


def _objective(problem: Posed, text: str | None) -> str | None:
    """An objective; the abscissa alone stays as it is where √(g/w) is but a factor."""
    if text is None or (text.strip() == "abscissa" and not {"g", "w"} & {*problem.free, *problem.scenarios}):
        return text
    return _translate(problem, text)


def _sizes(
    problem: Posed,
    inertia: str = "boxes",
    body: str | Size | None = None,
    front: str | Size | None = None,
    **_options: str,
) -> dict[str, Size]:
    """Body → length, width and height of its box; empty without boxes."""
    found, faults = {}, []
    for which, option, size in (("B", "body", body), ("H", "front", front)) if inertia == "boxes" else ():
        if size is None:
            length, width, height = (share * _middle(problem, "w") for share in _PER_WHEELBASE[which])
            centre = f"z_{which}"
            least = -problem.free[centre][1] if centre in problem.free else -problem.fixed[centre]
            found[which] = (_round(length), _round(width), _round(min(height, 2 * least)))
        else:
            try:
                found[which] = _size(size)
            except ValueError as error:
                faults.append(Fault(str(error), (option,)))
    if faults:
        raise InputError(faults)
    return found


def _size(given: str | Size) -> Size:
    """Three lengths in m.

    Raises:
        ValueError: for anything else.
    """
    accepted = 'accepted: length, width and height, such as "40x20x30 cm"'
    parts = _SIZE.fullmatch(given) if isinstance(given, str) else None
    try:
        a, b, c = (parse_quantity(f"{x} {parts[4]}", "m") for x in parts.groups()[:3]) if parts else map(float, given)
    except (TypeError, ValueError):
        raise ValueError(f"found {short(given)}; {accepted}") from None
    if not all(0 < x < float("inf") for x in (a, b, c)):
        raise ValueError(f"found {short(given)}; {accepted}, each more than 0")
    return a, b, c


def _middle(problem: Posed, name: str) -> float:
    return sum(problem.free[name]) / 2 if name in problem.free else problem.fixed[name]


def _round(x: float) -> float:
    return float(f"{x:.6g}")


def _new(name: str, taken: Mapping[str, str]) -> str:
    return _new(f"{name}_", taken) if name in taken else name
