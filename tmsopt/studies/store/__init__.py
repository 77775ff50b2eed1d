"""Where the rows of a study are kept: one SQLite file.

In: finished rows. Out: the same rows to the bit, whatever happened in between. Open `store` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
