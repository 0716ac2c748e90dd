"""The trigger of a mission whose file was deleted: it answers once more, then it is gone."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.ros


def test_the_trigger_of_a_deleted_mission_answers_and_the_server_lives(bench_of):
    bench = bench_of()
    name = "/florence_bt/missions/be_quick"

    def served():
        return dict(bench.node.get_service_names_and_types_by_node("florence_bt", "/"))

    bench.ros.spin_until(lambda: name in served(), what="the trigger")
    (bench.missions / "be_quick.yaml").unlink()
    answer = bench.trigger("be_quick")
    assert not answer.success and "there is no mission 'be_quick'" in answer.message
    bench.ros.spin_until(lambda: name not in served(), what="the end of the trigger")
    assert bench.status().state == "" and bench.run("drive_once").accepted
