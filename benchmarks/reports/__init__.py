"""Reports: what is measured, a section of results.md each.

In: a command and whether it is to be quick. Out: Markdown.
"""
