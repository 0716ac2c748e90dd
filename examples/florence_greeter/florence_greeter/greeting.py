"""What to say, and for how long. Plain Python: no robot, no ROS, no clock."""

from __future__ import annotations

GREETINGS: dict[str, tuple[str, str]] = {
    "en": ("Hello", "Good night"),
    "de": ("Hallo", "Gute Nacht"),
    "es": ("Hola", "Buenas noches"),
}
"""Language -> the words by day and in the evening."""
SECONDS_PER_LETTER = 0.07
"""How long a letter takes to speak, on average."""


class UnknownLanguage(ValueError):
    """There are no words in this language."""


def greeting(name: str, language: str = "en", *, evening: bool = False) -> str:
    """Choose the words for somebody.

    Args:
        name: Who is greeted; empty when nobody knows.
        language: One of :data:`GREETINGS`.
        evening: Whether it is late.

    Raises:
        UnknownLanguage: There are no words in this language; the message says which there are.
    """
    if language not in GREETINGS:
        raise UnknownLanguage(f"no words in {language!r}, only in {', '.join(sorted(GREETINGS))}")
    words = GREETINGS[language][evening]
    return f"{words}, {name}!" if name else f"{words}!"


def speaking_time(text: str) -> float:
    """Return how long a text takes to speak, in seconds."""
    return SECONDS_PER_LETTER * len(text)
