"""Millions of quartics at once, NumPy or numba."""
