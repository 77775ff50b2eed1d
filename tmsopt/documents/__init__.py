"""Documents: one for each kind of result, and their renderers as text, as HTML and as one line.

In: any result; the methods of `tmsopt.records.Printable` call this package. Out: text, Axes, HTML. Open `blocks` first:
it defines what documents consist of. Then open `results`, the table of all results, and `solution`, the main report.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
