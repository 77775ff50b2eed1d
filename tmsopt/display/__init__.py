"""What a result shows of itself: its text, one line, a picture, a page of a notebook.

In: any result; `tmsopt.records.Shown` asks here. Out: text, Axes, HTML. Open `writers` first: the table of results.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
