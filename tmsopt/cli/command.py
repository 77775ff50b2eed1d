"""Commands as frozen dataclasses: a field states an argument or an option once, the docstring is the help."""

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from inspect import getdoc
from pathlib import Path
from typing import Any, Literal, dataclass_transform, get_args, get_origin

import click

from tmsopt.cli.answers import FIGURES, PAGES, Reply, check_output, deliver
from tmsopt.cli.terminal import progress_listener
from tmsopt.errors import MOST_STARTS, Fault, InputError, input_error

_OWN = {"names", "endings", "example"}  # settings of tmsopt; click knows the others


def argument(default: Any = MISSING, **settings: Any) -> Any:
    """A field that is an argument, with settings of `click.Argument`."""
    return field(default=default, metadata=settings)


def option(text: str, default: Any = None, *names: str, **settings: Any) -> Any:
    """A field that is an option.

    Args:
        text: its help.
        names: further names.
        settings: `endings` of a file to write; an `example` of NAME=VALUE; or settings of `click.Option`, such as the
            `type`: a number in a range, or a function of the text.
    """
    return field(default=default, metadata={"help": text, "names": names, **settings})


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(argument, option))
class Command:
    """A command with the values of its arguments and options; each subclass is a frozen dataclass."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, kw_only=True)(cls)

    def run(self) -> Any:
        """Do the work: an `Reply`, or an exit status, which is 0 for None."""
        raise NotImplementedError

    def select(self, names: str) -> dict[str, Any]:
        """The values that are there and not None, for a function with defaults of its own."""
        return {name: value for name in names.split() if (value := getattr(self, name, None)) is not None}

    def refuse_useless(self, *checks: tuple[object, str, str]) -> None:
        """Refuse options without an effect: whether they have none, their names, what to do.

        Raises:
            InputError: naming each of them.
        """
        wrong = {name: text for useless, names, text in checks if useless for name in names.split()}
        if faults := [Fault(wrong[n], (_flag_of(n),)) for n, value in vars(self).items() if n in wrong and value]:
            raise InputError(faults)


class OnFile(Command):
    file: Path = argument()


class WithPlot(Command):
    plot: Path | None = option("Draw it (png, pdf, svg).", endings=FIGURES)
    json: bool = option("Write JSON to stdout instead of text.")


class WithPage(Command):
    report: Path | None = option("Write a page with pictures (html).", endings=PAGES)


class WithCsv(Command):
    csv: Path | None = option("Write the table (csv).", endings=("csv",))


class WithSearch(Command):
    starts: int | None = option("Most starts to try.  [default: 64]", type=click.IntRange(1, MOST_STARTS))
    seed: int = option("Seed of the starts.", 0, type=click.IntRange(0))

    @property
    def search(self) -> dict[str, Any]:
        """What verbs that search take."""
        return {"progress": progress_listener(), **self.select("starts seed linear_solver")}


class WithIpopt(WithSearch):
    linear_solver: Literal["mumps", "spral"] = option("Linear solver of IPOPT.", "mumps")


# What options say


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


def take_nominal(problem: Any) -> Any:
    """The posed problem about one design; a note on stderr says that scenarios and tolerances are left out."""
    if problem.nominal is not problem:
        values = _list_scenarios(problem)
        click.echo(f"scenarios and tolerances are left aside{': ' + values if values else ''}", err=True)
    return problem.nominal


def note_scenarios(problem: Any, varied: Iterable[str] = ()) -> None:
    """Say on stderr in which scenario the design for several is looked at."""
    if values := _list_scenarios(problem, varied):
        click.echo(f"the design for all scenarios, looked at for {values}", err=True)


def _list_scenarios(problem: Any, varied: Iterable[str] = ()) -> str:
    return ", ".join(f"{n} = {problem.fixed[n]:.6g}" for n in problem.scenarios if n not in varied)


# Commands of click


def build_command(kind: type[Command], name: str) -> click.Command:
    """The command of a class."""
    of = fields(kind)  # type: ignore[arg-type]
    options = {f.name for f in of if "help" in f.metadata}

    def call(**values: Any) -> None:
        for f in of:  # a value is refused before any work is done
            flag, value = _flag_of(f.name), values[f.name]
            if "endings" in f.metadata:
                check_output(flag, value, f.metadata["endings"])
            if "example" in f.metadata:
                texts = [value] if isinstance(value, str) else value or ()
                values[f.name] = _parse_pairs(flag, texts, get_args(f.type)[1], f.metadata["example"])
        command = kind(**values)
        try:
            found = command.run()
        except InputError as error:
            raise InputError([name_option(fault) for fault in error.faults]) from error
        if status := deliver(command, found) if isinstance(found, Reply) else found:
            sys.exit(status)

    def name_option(fault: Fault) -> Fault:
        """The fault of an argument of the library, under the option that gave it."""
        first, *rest = fault.key or ("",)
        return replace(fault, key=(_flag_of(first), *rest)) if first in options and not fault.file else fault

    summary, _, rest = (getdoc(kind) or "").partition("\n\n")
    parameters = [*map(_build_parameter, of), colour_option()]
    return _Command(name, params=parameters, callback=call, help=summary, epilog=rest)


def colour_option() -> click.Option:
    """--color of every command, and of all of them."""

    def keep(context: click.Context, _: click.Parameter, value: str | None) -> None:
        if value:
            context.color = {"always": True, "never": False}.get(value)

    kind, text = click.Choice(["auto", "always", "never"]), "Colour the text.  [default: auto]"
    return click.Option(["--color"], type=kind, callback=keep, expose_value=False, help=text)


class _Option(click.Option):
    """An option without its range in the help; the message about a number outside has it."""

    def get_help_extra(self, ctx: click.Context) -> Any:
        return {key: value for key, value in super().get_help_extra(ctx).items() if key != "range"}


class _Command(click.Command):
    """A command whose help has the examples as they stand."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        text = (self.epilog or "").replace("\n\nExit", "\nExit")
        formatter.write(f"\n{text}\nMore: docs/reference/commands.md\n")


def _flag_of(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _build_parameter(of: Field[Any]) -> click.Parameter:
    hint, default = of.type, None if of.default is MISSING else of.default
    settings = {key: value for key, value in of.metadata.items() if key not in _OWN}
    if type(None) in get_args(hint):
        hint = get_args(hint)[0]
    if "help" not in settings:
        return click.Argument([of.name], type=_type_of(hint), required=of.default is MISSING, **settings)
    flag, kind = _flag_of(of.name), hint
    if get_origin(hint) in (tuple, Mapping):
        kind, settings = get_args(hint)[0], {"multiple": True, **settings}
    elif hint is bool:
        settings["is_flag"], default = True, bool(default)
        flag += f"/--no-{of.name}" if default else ""
    settings = {"type": _type_of(kind), "show_default": hint is not bool, **settings}
    return _Option([of.name, flag, *of.metadata["names"]], default=default, **settings)


def _type_of(hint: Any) -> Any:
    if get_origin(hint) is Literal:
        return click.Choice(get_args(hint))
    return click.Path(path_type=Path) if hint is Path else hint


def _parse_pairs(flag: str, texts: Sequence[str], kind: Any, example: str) -> dict[str, Any]:
    """The values of NAME=VALUE by name."""
    pairs: dict[str, Any] = {}
    faults = []
    for name, text in ([part.strip() for part in text.partition("=")[::2]] for text in texts):
        try:
            if not (name and text) or name in pairs:
                accepted = f"accepted: NAME=VALUE, such as {example}, each name once"
                faults.append(Fault(f"found '{name}'; {accepted}", (flag,)))
            else:
                pairs[name] = kind(text)
        except ValueError:
            faults.append(Fault(f"found '{text}'; accepted: a number", (flag, name)))
    if faults:
        raise InputError(faults)
    return pairs
