"""Guides for users: descriptions of models and files, the JSON Schema of files for editors, and example files.

In: a model, a problem, a file, or the name of an example. Out: a `Description`, a JSON Schema, texts of files. Open
`describing` first: it describes a model.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
