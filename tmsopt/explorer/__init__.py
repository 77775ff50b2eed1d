"""A problem as one page for a browser: sliders, chart, roots, growth, the bicycle in motion.

In: a problem, its file or its solution. Out: `Explorer`, which displays itself in a notebook and saves itself as one
HTML file that needs nothing else. Open `explore` first; `javascript` writes formulas; what is the same in every page
stands in `page/`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
