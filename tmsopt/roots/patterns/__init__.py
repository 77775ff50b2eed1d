"""Which roots meet: patterns by name, structures, the nearest polynomial of one."""
