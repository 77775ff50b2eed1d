"""Explain: optimality, multipliers of limits, rounding, warnings."""
