"""Models whose roots can be designed: tms, whipple, and models of your own.

In: parameters by name. Out: coefficients and quantities in any arithmetic. Open `model` first, which defines a model;
then `bicycles`. `built_in` lists the models by name.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
