"""Remedies for infeasible problems: limits in conflict, changes that help, required speeds.

The input is a problem that has no feasible end; the result is a `Relaxation` or a `RequiredValue`. Open `infeasible`
first.
"""
