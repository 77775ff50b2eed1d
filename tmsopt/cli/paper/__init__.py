"""The commands about the paper: its figures drawn, its claims recomputed.

In: words of a command line. Out: figures, text or JSON on stdout. Open `verify` first.
"""
