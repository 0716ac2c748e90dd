"""Maps of the running system to files."""
