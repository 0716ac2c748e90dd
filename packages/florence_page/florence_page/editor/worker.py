"""Looks at texts for the editor, as a process: each question is a line of JSON, and so is its answer.

What a browser sends may be meant to hurt, so it is read here: a process that takes too long, or too much
memory, is ended, and nobody else waits for it. ``python -m florence_page.editor.worker``
"""

from __future__ import annotations

import json
import os
import resource
import sys
from pathlib import Path
from typing import Any

from florence_bt.core.errors import FlorenceError
from florence_page.editor.looking import look_at
from florence_page.editor.words import words_of

MEMORY_BYTES = 2_000_000_000
NICENESS = 5


def answer(question: dict[str, Any]) -> dict[str, Any]:
    """Answer one question.

    Args:
        question: ``what`` is ``look`` or ``words``; the others are the arguments of :func:`look_at` and
            :func:`words_of`, paths as texts.
    """
    folders = [Path(folder) for folder in question["folders"]]
    hotspots = Path(question["hotspots"]) if question["hotspots"] else None
    try:
        if question["what"] == "words":
            return words_of(folders, hotspots)
        return look_at(question["text"], question["name"], folders, hotspots)
    except FlorenceError as error:
        return {"problem": str(error)}


def main() -> None:
    """Answer until the input ends."""
    os.nice(NICENESS)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
