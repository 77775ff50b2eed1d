"""Study: one problem solved for thousands of rows of varied values.

In: a study file, or a `Study`. Out: `Results`; the store of its rows survives a kill of the process. Read `study`
first, then `run`; `store` saves the rows.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
