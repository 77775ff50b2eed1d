"""Suggests what to write instead of a wrong name, key or line, and which limits to relax.

In: the text as written. Out: the end of an error message, empty without a suggestion. Open `names` first: every name
that an expression may use, with its meaning.
"""
