from .store import Store as Store, open_store as open_store, read_store as read_store
