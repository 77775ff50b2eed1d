"""Finding one's way: what a model or file is made of, the shape of files for editors, files to start from.

In: a model, a problem, a file, or the name of an example. Out: a `Description`, a JSON Schema, texts of files. Open
`describing` first: what is said of a model.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
