"""The bicycles: two masses on skates (tms) and Whipple's with wheels, by parameters, matrices and quantities.

In: parameters by name. Out: coefficients and quantities in any arithmetic. Open `tms` first: its parameters and their
units; its matrices are in `tms_equations`, what is derived in `tms_quantities`.
"""
