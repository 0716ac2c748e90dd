"""The part that ``sequence`` and ``selector`` share: nodes that are started one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from florence_bt.trees.language.model import Composite, Node

if TYPE_CHECKING:
    from florence_bt.trees.language.form import Form


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class InOrder(Composite):
    """Starts its nodes one after the other; its kind says after which result the next one comes.

    Attributes:
        memory: Whether it goes on where it was; else the nodes before the one that runs are asked again.
    """

    memory: bool = True

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the nodes."""
        return cls(children=form.children(), memory=form.memory(), **form.fields)

    @property
    def details(self) -> tuple[str, ...]:
        """Say whether it has memory."""
        return () if self.memory else ("without memory",)

    @property
    def watched(self) -> tuple[Node, ...]:
        """All but the last one, without memory."""
        return () if self.memory else self.children[:-1]
