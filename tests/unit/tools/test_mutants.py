"""Mutants: small changes of a module, of which none is idle, and the tests that could notice them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
import yaml

from tools.mutants.__main__ import EQUIVALENT
from tools.mutants.covering import files_over_ros, files_that_import, importers
from tools.mutants.covering import tests_near as files_near
from tools.mutants.mutations import Mutation, draw
from tools.mutants.trying import Verdict, by_folder
from tools.mutants.verdicts import Verdicts
from tools.tables import ROOT

SOURCE = '''
"""A module."""
from __future__ import annotations

from dataclasses import dataclass

LIMIT: int | None = 5


@dataclass(frozen=True)
class Counter:
    count: int = 0
    other: float | None

    def add(self, number: int | None, *, twice: bool) -> int | None:
        """Add what is not too much."""
        if number is None or number > LIMIT:
            raise ValueError("too much")
        for each in range(number):
            if each == 3:
                continue
            self.count += each
            self.note(each)
            self.get_logger().info(f"{each} were added")
        left, right = self.count, -number
        both = {**vars(self), **vars(number)}, [*range(left), *range(right)]
        return left * 2 - right
'''


@pytest.fixture(scope="module")
def mutants() -> list[Mutation]:
    return [each for seed in range(12) for each in draw("a.py", SOURCE, 40, str(seed))]


def test_every_mutant_is_another_module_that_parses(mutants: list[Mutation]) -> None:
    whole = ast.dump(ast.parse(SOURCE))
    assert all(ast.dump(ast.parse(each.text)) != whole for each in mutants)
    families = {each.family for each in mutants}
    assert families == {"arithmetic", "sign", "comparison", "logic", "loop", "number", "statement"}


def test_annotations_decorators_and_docstrings_stay(mutants: list[Mutation]) -> None:
    changed = {each.before for each in mutants}
    assert not any("def " in line or "@" in line or "other" in line or '"""' in line for line in changed)
    assert all("number: int | None, *, twice: bool" in each.text for each in mutants)


def test_notes_in_logs_stay(mutants: list[Mutation]) -> None:
    assert all('self.get_logger().info(f"{each} were added")' in each.text for each in mutants)


def test_a_name_is_never_left_unbound(mutants: list[Mutation]) -> None:
    left_out = {each.before for each in mutants if each.family == "statement"}
    assert left_out == {'raise ValueError("too much")', "self.count += each", "self.note(each)"}


def test_a_seed_draws_the_same_and_lines_are_kept_to() -> None:
    assert draw("a.py", SOURCE, 5, "x") == draw("a.py", SOURCE, 5, "x")
    only = draw("a.py", SOURCE, 40, "x", [range(17, 19)])
    assert {each.line for each in only} == {17, 18}


def test_tests_of_a_module_and_of_those_that_import_it_are_near() -> None:
    near = files_near(["florence_bt/skills/navigation/navigate/_wave_kernels.py"])
    assert "tests/unit/skills/test_planner.py" in near, "the planner imports the kernels"
    assert "tests/unit/trees/test_schema.py" not in near
    assert (
        near[0] == importers(["florence_bt/skills/navigation/navigate/_wave_kernels.py"], "tests/unit/*")[0]
    )


def test_compiled_code_is_tested_by_the_files_that_import_it() -> None:
    kernels = "florence_bt/skills/navigation/localisation/_kernels.py"
    assert "tests/unit/skills/test_localise_kernels.py" in files_that_import(kernels)


def test_what_imports_rclpy_is_tested_over_ros() -> None:
    assert "tests/ros/test_turtlebot_node.py" in files_over_ros("florence_bt/drivers/turtlebot/node.py")
    assert "tests/ros/test_mission_server.py" in files_over_ros("florence_bt/runtime/node/_triggers.py")
    assert files_over_ros("florence_bt/drivers/turtlebot/driver.py") == []


def test_the_lines_of_equivalent_mutants_are_still_there() -> None:
    entries = yaml.safe_load(EQUIVALENT.read_text())
    assert entries
    for entry in entries:
        lines = [line.strip() for line in (ROOT / entry["path"]).read_text().splitlines()]
        assert entry["before"] in " ".join(lines), entry
        assert entry["after"] != entry["before"] and entry["reason"]


def test_no_folder_is_come_to_twice() -> None:
    tests = ["t/a/x.py::1", "t/b/y.py::1", "t/z.py::1", "t/a/w.py::1", "t/b/y.py::2", "t/a/x.py::2"]
    assert by_folder(tests) == [
        "t/a/x.py::1",
        "t/a/x.py::2",
        "t/a/w.py::1",
        "t/b/y.py::1",
        "t/b/y.py::2",
        "t/z.py::1",
    ]


def test_what_tests_said_is_known_to_the_next_run(mutants: list[Mutation], tmp_path: Path) -> None:
    some, other = mutants[:2]
    Verdicts(tmp_path / "kept" / "verdicts.txt").keep(some, ["test_a.py"], Verdict.OVER_ROS)
    Verdicts(tmp_path / "kept" / "verdicts.txt").keep(other, ["test_a.py"], Verdict.UNNOTICED)
    kept = Verdicts(tmp_path / "kept" / "verdicts.txt")
    assert kept.of(some, ["test_a.py"]) is Verdict.OVER_ROS
    assert kept.of(other, ["test_a.py"]) is Verdict.UNNOTICED
    assert kept.of(some, ["test_a.py", "test_b.py"]) is None, "other tests may notice it"
