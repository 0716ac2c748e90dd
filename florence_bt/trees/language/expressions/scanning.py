"""Where an expression in ``${...}`` ends."""

from __future__ import annotations


def closing_brace(text: str, start: int) -> int | None:
    """The index of the first ``}`` from ``start`` on that stands in no quotes, None when there is none.

    Braces round a key, as in ``${key}``, belong together.
    """
    quote = ""
    depth = 0
    for index in range(start, len(text)):
        sign = text[index]
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "\"'":
            quote = sign
        elif sign == "{":
            depth += 1
        elif sign == "}":
            if depth == 0:
                return index
            depth -= 1
    return None
