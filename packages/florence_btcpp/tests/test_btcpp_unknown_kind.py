"""A kind of node that Florence has and the exchange does not know yet."""

from dataclasses import dataclass
from typing import ClassVar

import pytest
from florence_btcpp.exporter import export_mission

from florence_bt.core.errors import ConfigError
from florence_bt.trees import kinds
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Node, Wrapper
from florence_bt.trees.language.node_kind import NodeKind
from florence_bt.trees.language.outcomes import SUCCEEDS


@dataclass(frozen=True, kw_only=True, eq=False)
class EveryOther(Wrapper):
    kind: ClassVar = NodeKind("every_other", "runs a node every other time", "½", {})

    @classmethod
    def read(cls, form):
        return cls(child=form.reader.node(form.value), **form.fields)

    def outcomes(self, known, skip_fails):
        return known.of(self.child, skip_fails=skip_fails)


@dataclass(frozen=True, kw_only=True, eq=False)
class Nothing(Node):
    kind: ClassVar = NodeKind("nothing", "does nothing", "0", {})

    @classmethod
    def read(cls, form):
        return cls(**form.fields)

    def outcomes(self, known, skip_fails):
        return SUCCEEDS


@pytest.mark.parametrize(
    ("node", "written"), [(EveryOther, "{every_other: {wait: 1 s}}"), (Nothing, "{nothing: }")]
)
def test_its_word_and_its_place_are_told(node, written, tmp_path, monkeypatch):
    monkeypatch.setitem(kinds.BY_WORD, node.kind.word, node)
    (tmp_path / "m.yaml").write_text(f"mission: m\ntree: {{sequence: [{{wait: 1 s}}, {written}]}}\n")
    library = MissionLibrary.load([tmp_path], built_in=False)
    with pytest.raises(ConfigError) as caught:
        export_mission("m", library, {})
    assert (caught.value.line, caught.value.column) == (2, 33)
    assert (
        caught.value.problem == f"{node.kind.word!r} has no element for BehaviorTree.CPP, and none of our own"
    )
