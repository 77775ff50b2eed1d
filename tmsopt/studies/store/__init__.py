"""Where the rows of a study are kept: one SQLite file.

In: finished rows. Out: the same rows to the bit, whatever happened in between. Open `store` first.
"""

from tmsopt.studies.store.store import Store, open_store, read_store

__all__ = ["Store", "open_store", "read_store"]
