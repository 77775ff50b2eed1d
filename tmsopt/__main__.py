"""``python -m tmsopt``: the command by another way."""

from tmsopt.cli import main

main(prog_name="tmsopt")
