"""Remedies for infeasible problems: limits in conflict, changes that help, required speeds.

In: the problem, and a function that solves it again. Out: a `Relaxation` or a `Need`. Open `infeasible` first.
"""
