"""Reports on speed: how long things take beside what one would use instead, and what they survive.

In: what is asked for. Out: pages of Markdown. Open `charts` first; each room measures one verb.
"""
