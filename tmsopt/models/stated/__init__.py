"""Models of your own, from matrices, coefficients or a complex H of numbers, texts and CasADi expressions.

In: entries. Out: a `Model`. Open `user_defined` first: models from plain data. `closed_loop` adds a controller,
`real_form` makes the real system of a complex H, `texts` and `pairs` parse entries, and `degree` bounds the size of
expressions.
"""
