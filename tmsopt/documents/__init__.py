"""What a result shows of itself: one document for each, and its renderers as text, as HTML and as one line.

In: any result; `tmsopt.records.Printable` asks here. Out: text, Axes, HTML. Open `blocks` first: what documents are
made of; then `results`: the table of all results, and `solution`: the document that most readers meet.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
