"""Where the elements of a tree stand relative to each other, found once for the whole tree."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable

from florence_bt.btcpp.xml_source import Element

CONCURRENT = frozenset(
    {
        "FlorenceParallel",
        "Parallel",
        "ParallelAll",
        "PipelineSequence",
        "ReactiveFallback",
        "ReactiveSequence",
        "WhileDoElse",
    }
)
"""Controls that go on with several of their nodes, or come back to earlier ones."""


class Places:
    """The numbers of all elements in the order of the file, and where the part below each ends.

    Args:
        root: The root of the tree.
    """

    def __init__(self, root: Element) -> None:
        self._spans: dict[int, tuple[int, int]] = {}
        self._outer: dict[int, Element | None] = {}
        waiting: list[tuple[Element, Element | None, bool]] = [(root, None, False)]
        begun: dict[int, int] = {}
        count = 0
        while waiting:
            element, outer, is_done = waiting.pop()
            if is_done:
                self._spans[id(element)] = begun[id(element)], count
                continue
            begun[id(element)] = count
            count += 1
            self._outer[id(element)] = outer
            inner = outer or (element if element.tag in CONCURRENT else None)
            waiting.append((element, outer, True))
            waiting.extend((child, inner, False) for child in reversed(element.children))

    def numbers(self, elements: Iterable[Element]) -> list[int]:
        """The numbers of some elements, in order."""
        return sorted(self._spans[id(element)][0] for element in elements)

    def any_below(self, numbers: list[int], element: Element) -> bool:
        """Whether one of the numbered elements is an element or stands below it."""
        first, end = self._spans[id(element)]
        at = bisect_left(numbers, first)
        return at < len(numbers) and numbers[at] < end

    def concurrent_above(self, element: Element) -> Element | None:
        """The outermost control above an element that goes on with several of its nodes."""
        return self._outer[id(element)]
