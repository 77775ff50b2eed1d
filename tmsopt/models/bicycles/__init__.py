"""The bicycles: two masses on skates (tms) and Whipple's with wheels, by parameters, matrices and quantities.

In: parameters by name. Out: coefficients and quantities in any arithmetic. Open `tms.toml` first: parameters, units and
quantities. The matrices are in `tms_equations`; quantities that are not plain expressions are in `tms_quantities`.
"""
