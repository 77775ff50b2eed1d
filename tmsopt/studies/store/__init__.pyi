from .opening import check_same as check_same, open_store as open_store, read_store as read_store
from .store import Store as Store
