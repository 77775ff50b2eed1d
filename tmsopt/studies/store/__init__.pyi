from .opening import open_store as open_store, read_store as read_store
from .store import Store as Store
