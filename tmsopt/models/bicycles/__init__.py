"""The bicycles: two masses on skates (tms) and Whipple's with wheels, by parameters, matrices and quantities.

In: parameters by name. Out: coefficients and quantities in any arithmetic. Open `tms.toml` first: its parameters, their
units, and what is derived; its matrices are in `tms_equations`, what no table can state in `tms_quantities`.
"""
