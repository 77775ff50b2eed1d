"""Shows a problem as one page for a browser: sliders, chart, roots, growth rates, the bicycle in motion.

In: a problem, its file or its solution. Out: an `Explorer`, which a notebook displays, and which is saved as one HTML
file that needs no other file. Read `explore` first; `javascript` writes formulas. The files in `page/` are the same for
every page.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
