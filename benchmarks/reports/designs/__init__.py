"""Reports on designs: how often, how well and how fast problems are solved.

In: a suite. Out: Markdown.
"""
