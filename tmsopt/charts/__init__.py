"""Charts: classes, roots and quantities over grids of designs, in memory or in a folder.

In: a problem with two or three free parameters. Out: a `Chart` of layers. Open `chart` first; `survey` computes it tile
by tile, `folder` keeps it on disk.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
