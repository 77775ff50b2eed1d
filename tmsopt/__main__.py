"""Runs the command `tmsopt` as ``python -m tmsopt``."""

from tmsopt.cli import main

main(prog_name="tmsopt")
