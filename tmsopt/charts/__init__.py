"""Charts: classes, roots and quantities over grids of designs, in memory or in a folder.

Input: a problem with two or three free parameters. Result: a `Chart`. It has layers, which are arrays with one number
per design. Read `chart` first; `survey` computes the layers tile by tile, and `folder` stores them on disk.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
