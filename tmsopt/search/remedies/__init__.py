"""Remedies for problems without an answer: limits in conflict, changes of them, speeds.

In: the problem, and how it is solved again. Out: a `Relaxation` or a `Need` that was tried. Open `changes` first.
"""
