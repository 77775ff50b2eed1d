"""Reports on systems of any degree: random ones, and a 6-fold root.

In: a suite of systems. Out: pages of Markdown. Open `random_systems` first; `known` looks for the best values.
"""
