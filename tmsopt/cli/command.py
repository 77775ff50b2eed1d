"""Commands as frozen dataclasses: a field states an argument or an option once, the docstring is the help."""

import sys
from collections.abc import Container, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from inspect import getdoc
from pathlib import Path
from typing import Any, Literal, dataclass_transform, get_args, get_origin

import click

from tmsopt.cli.context import colour_option
from tmsopt.cli.outputs import FIGURES, PAGES, check_output
from tmsopt.cli.terminal import progress_listener
from tmsopt.errors import MOST_STARTS, Fault, InputError

_COLUMN = 32  # columns of an option in a help
_OWN = {"text", "names", "endings", "example", "parse"}  # settings of tmsopt; click knows the others


def argument(default: Any = MISSING, **settings: Any) -> Any:
    """A field that is an argument, with settings of `click.Argument`."""
    return field(default=default, metadata=settings)


def option(text: str, default: Any = None, *names: str, **settings: Any) -> Any:
    """A field that is an option.

    Args:
        text: its help.
        names: further names.
        settings: `endings` of a file to write; an `example` of NAME=VALUE; a function that `parse`s the text; or
            settings of `click.Option`, such as the `type` of a number in a range.
    """
    return field(default=default, metadata={"text": text, "names": names, **settings})


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


def build_command(kind: type[Command], name: str) -> click.Command:
    """The command of a class."""
    from tmsopt.cli.answers import Reply, deliver

    def call(**values: Any) -> None:
        command = kind(**values)
        try:
            found = command.run()
        except InputError as error:
            raise InputError([_name_option(fault, options) for fault in error.faults]) from error
        if status := deliver(command, found) if isinstance(found, Reply) else found:
            sys.exit(status)

    options = {f.name for f in fields(kind) if "text" in f.metadata}  # type: ignore[arg-type]
    summary, _, rest = (getdoc(kind) or "").partition("\n\n")
    parameters = [*map(_build_parameter, fields(kind)), colour_option()]  # type: ignore[arg-type]
    return _ShortHelp(name, params=parameters, callback=call, help=summary, epilog=rest)


class _Option(click.Option):
    """An option without its range in the help; the message about a number outside has it."""

    def get_help_extra(self, ctx: click.Context) -> Any:
        return {key: value for key, value in super().get_help_extra(ctx).items() if key != "range"}


class _ShortHelp(click.Command):
    """A command whose help has one line for each option, and the examples as they stand."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        options = (p.get_help_record(ctx) for p in self.get_params(ctx) if isinstance(p, click.Option))
        with formatter.section("Options"):
            formatter.write_dl([record for record in options if record], _COLUMN)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        text = (self.epilog or "").replace("\n\nExit", "\nExit")
        formatter.write(f"\n{text}\nMore: docs/reference/commands.md\n")


def _flag_of(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _name_option(fault: Fault, options: Container[str]) -> Fault:
    """The fault of an argument of the library, under the option that gave it."""
    name, *rest = fault.key or ("",)
    return replace(fault, key=(_flag_of(name), *rest)) if name in options and not fault.file else fault


def _build_parameter(of: Field[Any]) -> click.Parameter:
    about = of.metadata
    settings = {key: value for key, value in about.items() if key not in _OWN}
    hint, default = of.type, None if of.default is MISSING else of.default
    if type(None) in get_args(hint):
        hint = get_args(hint)[0]
    if "text" not in about:
        return click.Argument([of.name], type=_type_of(hint), required=of.default is MISSING, **settings)
    flag, kind = _flag_of(of.name), hint
    if get_origin(hint) in (tuple, Mapping):
        kind, settings = get_args(hint)[0], {"multiple": True, **settings}
    elif hint is bool:
        settings["is_flag"], default = True, bool(default)
        flag += f"/--no-{of.name}" if default else ""

    def read(_context: click.Context, option: click.Parameter, value: Any) -> Any:
        """Refuse a value before any work is done."""
        if "endings" in about:
            check_output(option.opts[0], value, about["endings"])
        if "example" in about:
            texts = [value] if isinstance(value, str) else value or ()
            return _parse_pairs(option.opts[0], texts, get_args(hint)[1], about["example"])
        return about["parse"](value) if "parse" in about and value is not None else value

    settings = {"type": _type_of(kind), "show_default": hint is not bool, **settings}
    return _Option([of.name, flag, *about["names"]], default=default, help=about["text"], callback=read, **settings)


def _type_of(hint: Any) -> Any:
    if get_origin(hint) is Literal:
        return click.Choice(get_args(hint))
    return {Path: click.Path(path_type=Path), bool: None, Any: str}.get(hint, hint)


def _parse_pairs(option: str, texts: Sequence[str], kind: Any, example: str) -> dict[str, Any]:
    """The values of NAME=VALUE by name."""
    pairs: dict[str, Any] = {}
    faults = []
    for name, text in ([part.strip() for part in text.partition("=")[::2]] for text in texts):
        try:
            if not (name and text) or name in pairs:
                accepted = f"accepted: NAME=VALUE, such as {example}, each name once"
                faults.append(Fault(f"found '{name}'; {accepted}", (option,)))
            else:
                pairs[name] = kind(text)
        except ValueError:
            faults.append(Fault(f"found '{text}'; accepted: a number", (option, name)))
    if faults:
        raise InputError(faults)
    return pairs
