"""Reports on speed: how long things take beside what one would use instead.

In: sizes. Out: Markdown.
"""
