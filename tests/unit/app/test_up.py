"""What ``florence up`` says, with a system that is ready at once."""

from types import SimpleNamespace

import pytest

from florence_bt.app.bringup import up
from florence_bt.app.bringup.options import BringUp
from florence_bt.ros.environment import PROFILES, RANGE


class ReadySystem:
    """Ready at once, and ended at once."""

    def __init__(self, options, report, fork_server):
        self.client = self.robot = self
        self.node = SimpleNamespace(create_subscription=lambda *arguments, **options: None, steady=None)

    def listen_to_diagnostics(self, take):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *details):
        pass

    def wait_ready(self):
        return 0.0

    def missions(self):
        return SimpleNamespace(findings=["the skill 'sing' is missing: no voice"])

    def follow_speech(self, show):
        show("I am here.")

    def keep_up(self):
        pass

    def knows_pose(self):
        return True

    def spin_until(self, done, budget_s, watch):
        pass


@pytest.mark.parametrize(("chosen", "said"), [("SUBNET", True), ("LOCALHOST", False)])
def test_it_says_when_others_can_connect(monkeypatch, capsys, tmp_path, chosen, said):
    monkeypatch.setattr(up, "System", ReadySystem)
    monkeypatch.setenv(RANGE, chosen)
    monkeypatch.delenv(PROFILES, raising=False)
    up.run_up(BringUp(str(tmp_path)), fork_server=None)
    told = capsys.readouterr().out
    assert ("open to the network (ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET)" in told) is said
    assert told.index("the skill 'sing' is missing: no voice") < told.index("ready after")


class SlowWorld(ReadySystem):
    """A rehearsal whose world makes half a second a second."""

    truth = None

    def follow_truth(self):
        self.truth = {"time": 0.0, "monotonic": 0.0}

    def spin_until(self, done, budget_s, watch):
        for wall in range(20):
            if self.truth:
                self.truth = {"time": 0.5 * wall, "monotonic": float(wall)}
            watch()


@pytest.mark.parametrize("rehearsal", [True, False])
def test_a_rehearsal_on_a_machine_that_is_too_slow_says_so_once(monkeypatch, capsys, tmp_path, rehearsal):
    monkeypatch.setattr(up, "System", SlowWorld)
    monkeypatch.setattr(up, "MissingServers", lambda *rest: SimpleNamespace(look=lambda: None))
    up.run_up(BringUp(str(tmp_path), simulated=not rehearsal, emulated=rehearsal), fork_server=None)
    told = " ".join(capsys.readouterr().out.split())
    assert told.count("too slow for a rehearsal") == int(rehearsal)
    assert ("florence up --sim waits" in told) is rehearsal
