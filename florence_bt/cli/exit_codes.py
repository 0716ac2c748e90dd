"""The exit codes of the command ``florence``."""

from __future__ import annotations

OK, FAILED, USAGE, NOT_THERE, INTERRUPTED = 0, 1, 2, 3, 130
