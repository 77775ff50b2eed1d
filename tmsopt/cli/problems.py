"""Problems that commands read, and numbers and parameters that options name."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import click

from tmsopt.errors import input_error

if TYPE_CHECKING:
    from tmsopt.problem import Posed


def parse_number(text: str, unit: str, *key: str) -> float:
    """A number of the command line, plain or with a unit."""
    from tmsopt.problem.units import parse_quantity

    try:
        return float(text)
    except ValueError:
        try:
            return parse_quantity(text, unit)
        except ValueError as error:
            raise input_error(str(error), *key) from None


def split_names(text: str) -> tuple[str, ...]:
    """Names separated by commas."""
    return tuple(name.strip() for name in text.split(","))


def choose_plane(problem: "Posed", axes: str | None) -> tuple[str, ...]:
    """Two parameters to draw over: the given ones, or the first two that are free.

    Raises:
        InputError: unless there are two, both free.
    """
    free = tuple(problem.free)
    names = free[:2] if axes is None else split_names(axes)
    if len(names) != 2 or len({*names}) != 2 or not {*names} <= {*free}:
        found = axes or ", ".join(names) or "none"
        raise input_error(f"found {found}; accepted: two of the free parameters ({', '.join(free)})", "--axes")
    return names


def take_nominal(problem: "Posed") -> "Posed":
    """The problem about one design; a note on stderr says that scenarios and tolerances are left out."""
    if problem.nominal is not problem:
        values = _list_scenarios(problem)
        click.echo(f"scenarios and tolerances are left aside{': ' + values if values else ''}", err=True)
    return problem.nominal


def note_scenarios(problem: "Posed", varied: Iterable[str] = ()) -> None:
    """Say on stderr in which scenario the design for several is looked at."""
    if values := _list_scenarios(problem, varied):
        click.echo(f"the design for all scenarios, looked at for {values}", err=True)


def _list_scenarios(problem: "Posed", varied: Iterable[str] = ()) -> str:
    return ", ".join(f"{n} = {problem.fixed[n]:.6g}" for n in problem.scenarios if n not in varied)
