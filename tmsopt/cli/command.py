"""Commands as frozen dataclasses: each field defines an argument or an option, and the docstring is the help."""

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from inspect import getdoc
from pathlib import Path
from typing import Any, Literal, dataclass_transform, get_args, get_origin

import click

from tmsopt.cli.answers import FIGURE_ENDINGS, PAGE_ENDINGS, Reply, check_output, deliver
from tmsopt.cli.terminal import progress_listener
from tmsopt.errors import MOST_STARTS, Fault, InputError, input_error

_OWN_SETTINGS = {"names", "endings", "example"}  # settings of tmsopt; click knows the others


def argument(default: Any = MISSING, **settings: Any) -> Any:
    """A field for an argument, with settings of `click.Argument`."""
    return field(default=default, metadata=settings)


def option(text: str, default: Any = None, *names: str, **settings: Any) -> Any:
    """A field for an option.

    Args:
        text: its help.
        names: further names of the option.
        settings: the `endings` of a file to write, an `example` of NAME=VALUE, or settings of `click.Option`, such as
            the `type`, which is a range of numbers or a function that parses the text.
    """
    return field(default=default, metadata={"help": text, "names": names, **settings})


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(argument, option))
class Command:
    """A command with the values of its arguments and options; each subclass is a frozen dataclass."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, kw_only=True)(cls)

    def run(self) -> Any:
        """Do the work; return a `Reply`, or an exit status, where None means 0."""
        raise NotImplementedError

    def select(self, names: str) -> dict[str, Any]:
        """The values with these names that exist and are not None, for a function that has its own defaults."""
        return {name: value for name in names.split() if (value := getattr(self, name, None)) is not None}

    def refuse_useless(self, *checks: tuple[object, str, str]) -> None:
        """Refuse options that have no effect.

        Args:
            checks: in each check, whether options have no effect, their names with blanks between, and what to do.

        Raises:
            InputError: with a fault for each of these options.
        """
        advice = {name: text for is_useless, names, text in checks if is_useless for name in names.split()}
        if faults := [Fault(advice[n], (_make_flag(n),)) for n, value in vars(self).items() if n in advice and value]:
            raise InputError(faults)


class OnFile(Command):
    file: Path = argument()


class WithPlot(Command):
    plot: Path | None = option("Draw the result (png, pdf, svg).", endings=FIGURE_ENDINGS)
    json: bool = option("Write JSON to stdout instead of text.")


class WithPage(Command):
    report: Path | None = option("Write a web page with pictures (html).", endings=PAGE_ENDINGS)


class WithCsv(Command):
    csv: Path | None = option("Write the table (csv).", endings=("csv",))


class WithSearch(Command):
    starts: int | None = option("Largest number of starts.  [default: 64]", type=click.IntRange(1, MOST_STARTS))
    seed: int = option("Seed of the starts.", 0, type=click.IntRange(0))

    @property
    def search(self) -> dict[str, Any]:
        """Options of the functions that search for designs."""
        return {"progress": progress_listener(), **self.select("starts seed linear_solver")}


class WithIpopt(WithSearch):
    linear_solver: Literal["mumps", "spral"] = option("Linear solver of IPOPT.", "mumps")


# Values of options


def parse_number(text: str, unit: str, *key: str) -> float:
    """Parse a number of the command line, with or without a unit."""
    from tmsopt.problem.units import parse_quantity

    try:
        return float(text)
    except ValueError:
        try:
            return parse_quantity(text, unit)
        except ValueError as error:
            raise input_error(str(error), *key) from None


def split_names(text: str) -> tuple[str, ...]:
    """Split names that are separated by commas."""
    return tuple(name.strip() for name in text.split(","))


def take_nominal(problem: Any) -> Any:
    """The problem at its nominal values; a note on stderr says that scenarios and tolerances are left out."""
    if problem.nominal is not problem:
        values = _list_scenarios(problem)
        click.echo(f"scenarios and tolerances are ignored{'; values used: ' + values if values else ''}", err=True)
    return problem.nominal


def note_scenarios(problem: Any, varied: Iterable[str] = ()) -> None:
    """If a design was found for several scenarios, say on stderr for which one it is examined."""
    if values := _list_scenarios(problem, varied):
        click.echo(f"the design is for all scenarios; it is examined for {values}", err=True)


def _list_scenarios(problem: Any, varied: Iterable[str] = ()) -> str:
    return ", ".join(f"{n} = {problem.fixed[n]:.6g}" for n in problem.scenarios if n not in varied)


# Commands of click


def build_command(kind: type[Command], name: str) -> click.Command:
    """Build the command of a class for click."""
    command_fields = fields(kind)  # type: ignore[arg-type]
    options = {f.name for f in command_fields if "help" in f.metadata}

    def call(**values: Any) -> None:
        for f in command_fields:  # values are checked before any work is done
            flag, value = _make_flag(f.name), values[f.name]
            if "endings" in f.metadata:
                check_output(flag, value, f.metadata["endings"])
            if "example" in f.metadata:
                texts = [value] if isinstance(value, str) else value or ()
                values[f.name] = _parse_pairs(flag, texts, get_args(f.type)[1], f.metadata["example"])
        command = kind(**values)
        try:
            reply = command.run()
        except InputError as error:
            raise InputError([name_option(fault) for fault in error.faults]) from error
        if status := deliver(command, reply) if isinstance(reply, Reply) else reply:
            sys.exit(status)

    def name_option(fault: Fault) -> Fault:
        """A fault whose key is the option for an argument, instead of the name of the argument."""
        name, *rest = fault.key or ("",)
        return replace(fault, key=(_make_flag(name), *rest)) if name in options and not fault.file else fault

    summary, _, epilog = (getdoc(kind) or "").partition("\n\n")
    parameters = [*map(_build_parameter, command_fields), colour_option()]
    return _Command(name, params=parameters, callback=call, help=summary, epilog=epilog)


def colour_option() -> click.Option:
    """The option --color, for each command and for the group of all commands."""

    def set_colour(context: click.Context, _: click.Parameter, value: str | None) -> None:
        if value:
            context.color = {"always": True, "never": False}.get(value)

    choices, text = click.Choice(["auto", "always", "never"]), "Colour the text.  [default: auto]"
    return click.Option(["--color"], type=choices, callback=set_colour, expose_value=False, help=text)


class _Option(click.Option):
    """An option whose help does not show its range; the message about a number outside the range shows it."""

    def get_help_extra(self, ctx: click.Context) -> Any:
        return {key: value for key, value in super().get_help_extra(ctx).items() if key != "range"}


class _Command(click.Command):
    """A command whose help keeps the lines of the examples."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        text = (self.epilog or "").replace("\n\nExit", "\nExit")
        formatter.write(f"\n{text}\nMore: docs/reference/commands.md\n")


def _make_flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _build_parameter(field: Field[Any]) -> click.Parameter:
    hint, default = field.type, None if field.default is MISSING else field.default
    settings = {key: value for key, value in field.metadata.items() if key not in _OWN_SETTINGS}
    if type(None) in get_args(hint):
        hint = get_args(hint)[0]
    if "help" not in settings:
        return click.Argument([field.name], type=_choose_type(hint), required=field.default is MISSING, **settings)
    flag, kind = _make_flag(field.name), hint
    if get_origin(hint) in (tuple, Mapping):
        kind, settings = get_args(hint)[0], {"multiple": True, **settings}
    elif hint is bool:
        settings["is_flag"], default = True, bool(default)
        flag += f"/--no-{field.name}" if default else ""
    settings = {"type": _choose_type(kind), "show_default": hint is not bool, **settings}
    return _Option([field.name, flag, *field.metadata["names"]], default=default, **settings)


def _choose_type(hint: Any) -> Any:
    if get_origin(hint) is Literal:
        return click.Choice(get_args(hint))
    return click.Path(path_type=Path) if hint is Path else hint


def _parse_pairs(flag: str, texts: Sequence[str], kind: Any, example: str) -> dict[str, Any]:
    """Parse NAME=VALUE texts; a value is a text or a number."""
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
