"""Systems that a user states, by matrices, coefficients or a complex H, of numbers, texts and expressions of CasADi.

In: entries. Out: a `Model`. Open `user_defined` first: models from plain data; `closed_loop` is
a controller, `hamiltonian` a complex H, `doubles` the real system that it becomes; `texts` and `pairs` read entries, `degree` says how large an expression may become.
"""
