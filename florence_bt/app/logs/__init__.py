"""``florence logs``: what the processes of a bring-up wrote, together and by time."""
