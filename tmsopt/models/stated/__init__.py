"""Systems that a user states, by matrices, coefficients or a complex H, of numbers, texts and expressions of CasADi.

In: entries. Out: a `Model`. Open `user_defined` first: models from plain data. `closed_loop` adds a controller,
`hamiltonian` takes a complex H, `doubles` makes the real system of it; `texts` and `pairs` read entries, and `degree`
says how large an expression may become.
"""
