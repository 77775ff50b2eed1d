"""Converts a problem of point masses on skates to Whipple's bicycle, whose bodies have rotational inertia."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from tmsopt.errors import Fault, InputError, short, suggest
from tmsopt.guide.problem_text import toml_problem
from tmsopt.models import CONSTANTS, FUNCTIONS, controlled, whipple
from tmsopt.problem import Posed, Problem
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.units import parse_quantity

INERTIAS = ("boxes", "none")
"""What a point mass becomes: a solid box around its centre of mass, or again a point mass."""

_BOX_PER_WHEELBASE = {"B": (1 / 2, 1 / 4, 3 / 8), "H": (1 / 8, 1 / 8, 3 / 8)}
"""Body → default length, width and height of its box, divided by the wheelbase."""

_INERTIA_SHARE = 0.9
"""Widens the range of an inertia that follows from a mass, so that the limits of the mass become active first.

The low end of the range is multiplied by this number, and the high end is divided by it.
"""

_COUNTERPARTS = {
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
"""Name in an expression about point masses → the same quantity in Whipple's model. SI parameters keep their names."""

_SIZE = re.compile(r"\s*([\d.]+)\s*[x×]\s*([\d.]+)\s*[x×]\s*([\d.]+)\s*(\D+)")

Size = tuple[float, float, float]


def convert(
    given: ProblemSource,
    to: str = "whipple",
    inertia: str = "boxes",
    body: str | Size | None = None,
    front: str | Size | None = None,
) -> Problem:
    """Convert a problem of point masses on skates, in SI, to a model whose bodies have inertia.

    Parameters, ranges, limits, cases and the objective stay the same; there are no wheels and no trail. If a mass is
    free, the inertia of its box is free too, and an equality ties it to the mass.

    Args:
        given: a problem of the model ``tms``, the path of its file, or a solution.
        to: ``whipple``.
        inertia: ``boxes``: the rear frame and the front assembly are solid boxes; ``none``: they stay point masses.
        body: length, width and height of the rear frame in m, or as ``"40x20x30 cm"``. By default 1/2, 1/4 and 3/8 of
            the wheelbase, and no higher than twice the height of its centre of mass.
        front: the same for the front assembly; by default 1/8, 1/8 and 3/8.

    Raises:
        InputError: listing everything that has no counterpart in the other model.

    Example:
        >>> robot = tmsopt.convert("problems/point_mass_robot.toml", body="40x20x30 cm")
        >>> robot.model.name, robot.fixed["I_Bxx"]  # 20 kg (0.2² + 0.3²)/12
        ('whipple', 0.216667)

    More: docs/how_to/inertia.md
    """
    problem = pose(given)
    if faults := [*_list_unconvertible(problem, to, inertia)]:
        raise InputError(faults)
    sizes, faults = _choose_sizes(problem, inertia, body, front), [*_list_missing_counterparts(problem)]
    for letter in sizes:
        if f"m_{letter}" in problem.scenarios:
            message = "varies, and the inertia of a box would vary with it; give it one value, or --inertia none"
            faults.append(Fault(message, ("scenarios", f"m_{letter}")))
    if faults:
        raise InputError(faults)
    fixed, free = dict(problem.fixed), dict(problem.free)
    limits = {name: _translate(problem, text) for name, text in problem.constraints.items()}
    for letter, (length, width, height) in sizes.items():
        mass = f"m_{letter}"
        for axes, per_mass in (("xx", (width**2 + height**2) / 12), ("zz", (length**2 + width**2) / 12)):  # m²
            name = f"I_{letter}{axes}"
            if mass in problem.free:
                low, high = problem.free[mass]
                free[name] = (_round(_INERTIA_SHARE * per_mass * low), _round(per_mass * high / _INERTIA_SHARE))
                limits[_choose_new_name(f"box_{name}", limits)] = f"{name} == {per_mass:.12g}*{mass}"
            else:
                fixed[name] = _round(per_mass * problem.fixed[mass])
    return replace(
        problem.problem,
        model=whipple,
        fixed=fixed,
        free=free,
        constraints=limits,
        minimize=_translate_objective(problem, problem.minimize),
        maximize=_translate_objective(problem, problem.maximize),
        pareto=tuple(str(_translate_objective(problem, text)) for text in problem.pareto),
    )


def converted_file(given: ProblemSource, **options: Any) -> str:
    """Write a converted problem file with comments on the assumptions; `options` are those of `convert`."""
    problem = pose(given)
    converted, sizes = convert(problem, **options), _choose_sizes(problem, **options)
    lines = ["The two masses of the model tms in the model whipple, without wheels and trail."]
    for name, size in zip(("rear frame", "front assembly"), sizes.values(), strict=False):
        size_text = " x ".join(f"{100 * x:.4g}" for x in size)
        lines.append(f"The {name} is a solid box of {size_text} cm (length, width, height) about its centre of mass.")
    if sizes:
        lines.append("I_xx = m (width^2 + height^2)/12, I_zz = m (length^2 + width^2)/12, in kg m^2, and I_xz = 0.")
    radius = 0.125 * _find_middle(problem, "w")
    lines += [
        "Example: a front wheel of 1 kg, a solid disc, under [parameters]; for the rear wheel, write R instead of F:",
        f"  r_F = {radius:.4g}",
        "  m_F = 1",
        f"  I_Fxx = {radius**2 / 4:.4g}    # m r^2/4 about a diameter",
        f"  I_Fyy = {radius**2 / 2:.4g}    # m r^2/2 about its axle",
    ]
    return toml_problem(converted.posed, lines)


def _list_unconvertible(problem: Posed, to: str, inertia: str) -> Iterator[Fault]:
    """List faults for a model, a parameter set or an option that cannot be converted."""
    if problem.model.name != "tms":
        yield Fault(f"found the model {short(problem.model.name)}; accepted: tms", ("model",))
    elif problem.parameter_set.rate is None:
        names = ", ".join(problem.parameter_set.names[:3])
        message = f"uses numbers without units ({names}, …), but a body has a size and a mass"
        yield Fault(f"{message}; write it in SI: w, v, m_B, x_B, …", ("parameters",))
    if to != whipple.name:
        yield Fault(f"found {short(to)}; accepted: {whipple.name}", ("to",))
    if inertia not in INERTIAS:
        yield Fault(f"found {short(inertia)}; {suggest(inertia, INERTIAS)}", ("inertia",))


def _list_missing_counterparts(problem: Posed) -> Iterator[Fault]:
    """List faults for names in the objective and the constraints that Whipple's model does not have."""
    objectives = {"minimize": problem.minimize, "maximize": problem.maximize, "pareto": " ".join(problem.pareto)}
    expressions = {("objective", sense): text or "" for sense, text in objectives.items()}
    expressions |= {("constraints", name): text for name, text in problem.constraints.items()}
    for key, text in expressions.items():
        for name in sorted({*_WORD.findall(text)} - set(_find_counterparts(problem))):
            yield Fault(f"{name} has no counterpart in the model whipple", key)


_WORD = re.compile(r"\b[A-Za-z_]\w*")


def _find_counterparts(problem: Posed) -> dict[str, str]:
    """Return name in an expression → its replacement."""
    parameter_set, bicycle = problem.parameter_set, controlled(whipple, problem.parameter_set.names)
    names = (*parameter_set.names, *(q.name for q in parameter_set.quantities))
    bicycle_names = {*bicycle.sets[0].names, *bicycle.quantity_names(bicycle.sets[0])}
    return {name: name for name in names if name in bicycle_names} | _COUNTERPARTS


def _translate(problem: Posed, text: str) -> str:
    counterparts = _find_counterparts(problem)
    return _WORD.sub(lambda word: counterparts[word[0]], text)


def _translate_objective(problem: Posed, text: str | None) -> str | None:
    """Translate an objective; the objective ``abscissa`` stays unchanged if its factor √(g/w) is constant."""
    if text is None or (text.strip() == "abscissa" and not {"g", "w"} & {*problem.free, *problem.scenarios}):
        return text
    return _translate(problem, text)


def _choose_sizes(
    problem: Posed,
    inertia: str = "boxes",
    body: str | Size | None = None,
    front: str | Size | None = None,
    **_options: str,
) -> dict[str, Size]:
    """Return body → length, width and height of its box; empty without boxes."""
    sizes, faults = {}, []
    for letter, option, size in (("B", "body", body), ("H", "front", front)) if inertia == "boxes" else ():
        if size is None:
            length, width, height = (share * _find_middle(problem, "w") for share in _BOX_PER_WHEELBASE[letter])
            centre = f"z_{letter}"
            centre_height = -problem.free[centre][1] if centre in problem.free else -problem.fixed[centre]
            sizes[letter] = (_round(length), _round(width), _round(min(height, 2 * centre_height)))
        else:
            try:
                sizes[letter] = _parse_size(size)
            except ValueError as error:
                faults.append(Fault(str(error), (option,)))
    if faults:
        raise InputError(faults)
    return sizes


def _parse_size(size: str | Size) -> Size:
    """Parse three lengths in m.

    Raises:
        ValueError: if `size` is not three positive lengths.
    """
    accepted = 'accepted: length, width and height, such as "40x20x30 cm"'
    parts = _SIZE.fullmatch(size) if isinstance(size, str) else None
    try:
        a, b, c = (parse_quantity(f"{x} {parts[4]}", "m") for x in parts.groups()[:3]) if parts else map(float, size)
    except (TypeError, ValueError):
        raise ValueError(f"found {short(size)}; {accepted}") from None
    if not all(0 < x < float("inf") for x in (a, b, c)):
        raise ValueError(f"found {short(size)}; {accepted}, each more than 0")
    return a, b, c


def _find_middle(problem: Posed, name: str) -> float:
    """Return the middle of the range of a free parameter, or the value of a fixed parameter."""
    return sum(problem.free[name]) / 2 if name in problem.free else problem.fixed[name]


def _round(x: float) -> float:
    return float(f"{x:.6g}")


def _choose_new_name(name: str, names: Mapping[str, str]) -> str:
    return _choose_new_name(f"{name}_", names) if name in names else name
