"""Suites: the problems that everything is measured on, and the best values known of them.

In: a number. Out: always the same problem or system, with what is known of it.
"""
