"""How the emulated scanner writes: check sums, encoded numbers, lines; from the manual, not our driver."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

DATA_LINE = 64
SECOND_ECHO_MM = 500


def summed(line: str) -> str:
    """A line with its check character: the low six bits of the sum of its bytes, plus 0x30."""
    return line + chr((sum(line.encode("latin-1")) & 0x3F) + 0x30)


def encode_number(value: int, width: int) -> str:
    """A number as ``width`` characters of six bits, most significant first."""
    return "".join(chr(((value >> (6 * place)) & 0x3F) + 0x30) for place in reversed(range(width)))


def encode_numbers(values: NDArray[np.int32], width: int) -> str:
    """Many numbers in a row, as :func:`encode_number`."""
    shifts = np.arange(6 * (width - 1), -1, -6)
    digits = ((values[:, np.newaxis] >> shifts) & 0x3F) + 0x30
    return digits.astype(np.uint8).tobytes().decode("ascii")


def reply(echo: str, status: str, lines: Iterable[str] = ()) -> bytes:
    """A whole reply: echo, status with its sum, lines that are ready to send, a blank line."""
    return "\n".join([echo, summed(status), *lines, "", ""]).encode("latin-1")


def information_lines(fields: Mapping[str, str]) -> list[str]:
    """The lines of VV, PP and II: the check character is that of the text before the semicolon."""
    return [f"{text};{summed(text)[-1]}" for text in (f"{tag}:{value}" for tag, value in fields.items())]


def encode_echoes(values: NDArray[np.int32], numbers: int, minimum_mm: int) -> str:
    """Every echo of each step: what follows an ampersand belongs to the step before it.

    Each tenth step that measures something has a second echo half a metre behind the first, as of a pane of
    glass; the world itself tells one distance a step.

    Args:
        values: Shape (steps * numbers,).
        numbers: Numbers an echo: 1, or 2 with intensities.
        minimum_mm: DMIN; smaller distances are codes.
    """
    echoes = []
    for step, echo in enumerate(values.reshape(-1, numbers)):
        echoes.append(encode_numbers(echo, 3))
        if step % 10 == 0 and echo[0] >= minimum_mm:
            echo = echo.copy()
            echo[0] += SECOND_ECHO_MM
            echoes.append("&" + encode_numbers(echo, 3))
    return "".join(echoes)


def scan_lines(timestamp_ms: int, text: str) -> list[str]:
    """The time stamp and the encoded values in lines of at most 64 characters."""
    blocks = [text[start : start + DATA_LINE] for start in range(0, len(text), DATA_LINE)]
    return [summed(encode_number(timestamp_ms, 4)), *map(summed, blocks)]


def spoil_last_sum(data: bytes) -> bytes:
    """A reply with another check character in its last line, which stands before the two closing LF."""
    return data[:-3] + bytes([0x30 + (data[-3] - 0x30 + 1) % 64]) + data[-2:]
