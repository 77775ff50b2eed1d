"""Problems and solutions as data: expressions, units, problem files, validation.

In: a problem file, or the arguments of `Problem`. Out: a frozen `Problem` with valid numbers only, and the record
`Solution` for its answer. Open `problem` first, then `expression`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
