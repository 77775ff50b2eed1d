"""Suggests what to write instead of a wrong name, key or line, and which limits to relax.

In: the text that the user wrote. Out: the end of an error message; it is empty without a suggestion. Open `names`
first: it lists every name that an expression may use, with its meaning.
"""
