"""Study: one problem solved for thousands of rows of varied values.

In: a study file, or `Study`. Out: `Results`, with rows kept in a store that survives any kill. Open `study` first,
then `run`; `store` keeps the rows.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
