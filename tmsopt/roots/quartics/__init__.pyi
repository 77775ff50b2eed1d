from .factors import largest_root as largest_root
