"""Rivals: what one would use without the package, on the same problems.

In: a problem. Out: where the rival ended, and when it was how good.
"""
