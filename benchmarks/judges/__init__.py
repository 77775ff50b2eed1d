"""Judges: what a claimed design is worth, by means that share nothing with the solver.

In: a problem or system and a design. Out: its value and violation, whether a claim holds.
"""
