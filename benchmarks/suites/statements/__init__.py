"""Statements of tmsopt that a closed form or an independent computation can refute, twenty or more of each kind.

One module for each kind, each with ``CASES``; open `case` first.
"""
