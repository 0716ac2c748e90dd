"""The small language of conditions and sums: ``$distance < 1 m and not $found``. Parsed, never ``eval``.

``parser`` reads it, ``syntax`` is what it becomes and writes it out again, ``checking`` finds its kinds and
``compiling`` makes the values that a tree computes with.
"""
