"""Solve: parts of the box, multistart, outcome, relaxation, all designs."""
