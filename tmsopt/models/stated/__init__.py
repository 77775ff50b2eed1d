"""Systems that a user states, by matrices, coefficients or a complex H, of numbers, texts and expressions of CasADi.

In: entries. Out: a `Model`. Open `user_defined` first: models from plain data. `closed_loop` adds a controller,
`real_form` makes the real system of a complex H; `texts` and `pairs` read entries, and `degree` says how large an
expression may become.
"""
