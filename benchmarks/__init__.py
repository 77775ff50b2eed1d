"""Benchmarks: honest numbers, failures kept.

In: ``python -m benchmarks``, see `command`. Out: sections of results.md. `suites` has the problems, `judges` say what
a design is worth, `rivals` are what one would use instead, `reports` put them beside each other.
"""
