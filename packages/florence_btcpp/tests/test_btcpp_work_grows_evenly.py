"""Twice as large a file costs about twice the work: counted in calls of functions."""

import cProfile

import pytest
from florence_btcpp.exporter import export_mission
from florence_btcpp.importer import import_trees

from florence_bt.trees.language.loader import MissionLibrary
from tests.sweeps import sweep


def calls_of(function, *arguments):
    profile = cProfile.Profile()
    profile.runcall(function, *arguments)
    return sum(entry.callcount for entry in profile.getstats())


def caller(name, *called):
    return f"mission: {name}\ntree:\n  sequence:\n" + "".join(f"    - run: {each}\n" for each in called)


def switches(n):
    branches = "<A/><B/><C/></Switch2>"
    return "".join(f'<Switch2 variable="{{k{i}}}" case_1="1" case_2="2">{branches}' for i in range(n))


def scripts(n):
    return "".join(f'<Script code="k{i} := k{i - 1} + 1; z{i} := k{i} * 3.5"/>' for i in range(n))


def guarded(n):
    return "<Sequence>" * 5 + "".join(f'<A _skipIf="a{i} == 1"/>' for i in range(n)) + "</Sequence>" * 5


@pytest.mark.slow
@pytest.mark.parametrize("shape", sweep([scripts, switches, guarded], every=3))
def test_importing(tmp_path, shape):
    calls = []
    for n in (150, 300):
        file = tmp_path / f"m{n}.xml"
        body = f'<BehaviorTree ID="M"><Sequence>{shape(n)}</Sequence></BehaviorTree>'
        file.write_text(f'<root BTCPP_format="4">{body}</root>')
        calls.append(calls_of(import_trees, file, {}))
    assert calls[1] < 2.6 * calls[0]


def test_exporting_missions_that_call_the_next_one_twice(tmp_path):
    calls = []
    for n in (10, 20):
        folder = tmp_path / str(n)
        folder.mkdir()
        for i in range(n):
            (folder / f"m{i}.yaml").write_text(caller(f"m{i}", f"m{i + 1}", f"m{i + 1}"))
        (folder / f"m{n}.yaml").write_text(f"mission: m{n}\ntree: {{wait: 1 s}}\n")
        library = MissionLibrary.load([folder], built_in=False)
        calls.append(calls_of(export_mission, "m0", library, {}))
    assert calls[1] < 2.6 * calls[0]
