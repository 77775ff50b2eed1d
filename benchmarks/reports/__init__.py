"""Reports: what is measured, a section of results.md each.

In: what is asked for, `Asked`. Out: a page of Markdown. Open `tables` first; `designs`, `systems` and `speed` hold
the sections, listed in `benchmarks.command`.
"""

from benchmarks.reports.tables import Asked

__all__ = ["Asked"]
