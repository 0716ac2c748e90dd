"""The exit codes of the command ``florence``."""

from __future__ import annotations

OK, FAILED, USAGE, NOT_THERE, INTERRUPTED = 0, 1, 2, 3, 130
"""The last is that of a shell for a program that SIGINT has ended: 128 + 2."""
