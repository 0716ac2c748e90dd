"""What is made of a mission is kept for its next run, until a mission or a skill changes."""

from dataclasses import replace

from florence_bt.core.clock import ManualClock
from florence_bt.trees.language import compile as compiling
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.loader import MissionLibrary
from tests.ticking import make_context
from tests.unit.trees.language import DECLARATIONS

TEXT = """mission: m
keys: {n: {type: integer, default: 4}}
tree: {sequence: [{condition: $n < LIMIT}, {run: sub}]}
"""


class Compiler:
    """Compiles the mission of a folder again and again, and counts the expressions that are made."""

    def __init__(self, folder, monkeypatch):
        self.folder, self.made = folder, 0
        self.declarations = dict(DECLARATIONS)
        (folder / "sub.yaml").write_text("mission: sub\ntree: {move: {by: 1 m}}\n")
        self.write(5)
        self.library = MissionLibrary.load([folder], built_in=False)
        real = compiling.compile_expression
        monkeypatch.setattr(compiling, "compile_expression", lambda *given: self._count(real(*given)))

    def write(self, limit):
        (self.folder / "m.yaml").write_text(TEXT.replace("LIMIT", str(limit)))
        return self.folder / "m.yaml"

    def status(self):
        """Compile, and tick until the first node has answered."""
        context = make_context(ManualClock(), {}, self.declarations)
        tree = compile_mission(self.library.get("m"), self.library, {}, context)
        tree.root.tick_once()
        return tree.root.children[0].status.name

    def _count(self, made):
        self.made += 1
        return made


def test_a_second_run_makes_no_expression_again(tmp_path, monkeypatch):
    compiler = Compiler(tmp_path, monkeypatch)
    assert [compiler.status() for _ in range(3)] == ["SUCCESS"] * 3
    assert compiler.made == 1


def test_an_edit_counts_from_the_next_run_on(tmp_path, monkeypatch):
    compiler = Compiler(tmp_path, monkeypatch)
    assert compiler.status() == "SUCCESS"
    compiler.library.add_file(compiler.write(3))
    assert compiler.status() == "FAILURE"


def test_other_skills_count_from_the_next_run_on(tmp_path, monkeypatch):
    compiler = Compiler(tmp_path, monkeypatch)
    compiler.status()
    compiler.declarations["move"] = replace(DECLARATIONS["move"], summary="Move otherwise")
    compiler.status()
    assert compiler.made == 2
