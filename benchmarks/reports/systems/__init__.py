"""Reports on systems of any degree: random ones, and a 6-fold root.

In: a suite. Out: Markdown.
"""
