"""Systems that a user states, by matrices or coefficients, each entry a number, a text or an expression of CasADi.

In: entries. Out: a `Model`. Open `user_defined` first: models from plain data; then `texts`, entries and quantities in
text, and `degree`, how large an expression may become.
"""
