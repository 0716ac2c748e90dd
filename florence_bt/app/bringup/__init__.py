"""``florence up``: the processes of the system, their start, their supervision and their end."""
