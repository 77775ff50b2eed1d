"""What click's context keeps for all commands: the words of the command line, and whether text has colours."""

import os
import sys

import click

COLOUR, WORDS = "tmsopt.colour", "tmsopt.words"
"""Keys of what --color says, and of the words of the command line."""


SPELLINGS = {"token_normalize_func": lambda word: "color" if word == "colour" else word}
"""A setting of click's context, by which --colour is --color."""


def colour_option() -> click.Option:
    """--color of every command, and of all of them."""

    def keep(context: click.Context, _: click.Parameter, value: str | None) -> None:
        context.meta[COLOUR] = value or context.meta.get(COLOUR)

    kind, text = click.Choice(["auto", "always", "never"]), "Colour the text.  [default: auto]"
    return click.Option(["--color"], type=kind, callback=keep, expose_value=False, help=text)


def is_coloured() -> bool:
    """Whether --color, or else the terminal and its environment, ask for colours."""
    context = click.get_current_context(silent=True)
    asked = context and context.meta.get(COLOUR)
    if asked in ("always", "never"):
        return bool(asked == "always")
    return sys.stdout.isatty() and os.environ.get("TERM") != "dumb" and not os.environ.get("NO_COLOR")
