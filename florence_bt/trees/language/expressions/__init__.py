"""The small language of conditions and sums: ``$distance < 1 m and not $found``. Parsed, never ``eval``.

``parser`` reads it, ``syntax`` is what it becomes, ``checking`` finds its kinds, ``printing`` writes it out
again and ``building`` makes the values that a tree computes with.
"""
