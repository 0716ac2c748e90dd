"""SCIP 2.0 as a sensor writes it, from the manual and without our codec: what the tests are fed with."""

from __future__ import annotations


def encode(value: int, width: int) -> bytes:
    """A number as this many characters."""
    return bytes(((value >> 6 * place) & 63) + 48 for place in range(width - 1, -1, -1))


def summed(line: bytes) -> bytes:
    """A line with its check character."""
    return line + bytes([(sum(line) & 63) + 48])


def information(command: bytes, *texts: bytes) -> bytes:
    """A reply to VV, PP or II."""
    lines = [text + b";" + summed(text)[-1:] for text in texts]
    return b"\n".join([command, b"00P", *lines, b"", b""])


def scan_bytes(distances: list[int], stamp: int = 1000, first: int = 44) -> bytes:
    """A scan of an endless MD stream."""
    last = first + len(distances) - 1
    data = b"".join(encode(distance, 3) for distance in distances)
    blocks = [summed(data[at : at + 64]) for at in range(0, len(data), 64)]
    head = [f"MD{first:04d}{last:04d}01000".encode(), b"99b", summed(encode(stamp, 4))]
    return b"\n".join([*head, *blocks, b"", b""])


PP = (
    b"PP\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nDMIN:20;4\nDMAX:5600;_\nARES:1024;\\\n"
    b"AMIN:44;7\nAMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n"
)
