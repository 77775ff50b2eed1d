"""A study: one problem, solved for thousands of rows of varied values.

In: a study file, or a `Study`. Out: `Results`. The store keeps the solved rows, even if the process is killed.
Read `study` first, then `run`; `store` saves the rows.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
