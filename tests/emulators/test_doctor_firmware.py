"""The doctor asks the emulated base who it is and how it does: answers, silence, a dead port."""

from __future__ import annotations

import pytest

from florence_bt.app.doctor.finding import HealthFinding, HealthLevel
from florence_bt.app.doctor.firmware import check_firmware
from florence_bt.core.errors import DeviceLost
from florence_bt.simulation.emulators.create import CreateEmulator
from florence_bt.simulation.sensors.base_noise import PERFECT_BASE, BaseSensors

CONFIG = {"turtlebot_node": {"port": "/dev/create"}, "hokuyo_node": {"port": "/dev/hokuyo"}}


class Line:
    """A port whose other end is an emulator; reading is what makes the time pass."""

    def __init__(self, device=None) -> None:
        self.name = "/dev/create"
        self.device = device
        self.now = 0.0
        self.closed = False
        self._waiting = b""

    def read(self, timeout_s: float) -> bytes:
        data, self._waiting = self._waiting, b""
        if not data:
            self.now += timeout_s
            data = self.device.poll(self.now) if self.device else b""
        return data

    def write(self, data: bytes) -> None:
        if self.device:
            self._waiting += self.device.receive(data, self.now)

    def set_rts(self, level: bool) -> bool:
        return False

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def create(base):
    return CreateEmulator(base, BaseSensors(base, 0, PERFECT_BASE))


def ask(line: Line, free=lambda path: path == "/dev/create") -> list[HealthFinding]:
    found = list(check_firmware(CONFIG, free, lambda path, baud: line, lambda: line.now))
    assert line.closed == bool(found)
    return found


def test_a_base_answers_also_when_it_streams(create):
    line = Line(create)
    line.write(bytes([128, 148, 2, 7, 35]))
    firmware, battery = ask(line)
    assert firmware.level is HealthLevel.OK and "passive" in firmware.found and "V" in firmware.found
    assert battery == HealthFinding("battery", "base", HealthLevel.OK, "90% of 2700 mAh")


@pytest.mark.parametrize(("share", "level"), [(0.25, HealthLevel.WARNING), (0.1, HealthLevel.PROBLEM)])
def test_a_low_battery(create, share, level):
    create.battery.charge_mah = share * 2700
    assert ask(Line(create))[1].level is level


def test_a_silent_base_costs_two_seconds_and_says_what_to_do():
    line = Line()
    (finding,) = ask(line)
    assert finding.level is HealthLevel.PROBLEM and "nothing" in finding.found and "cable" in finding.advice
    assert line.now < 3.0


def test_a_port_that_cannot_be_opened_or_breaks_off():
    def fails(path, baud):
        raise DeviceLost("/dev/create: in use")

    (finding,) = check_firmware(CONFIG, lambda path: path == "/dev/create", fails, lambda: 0.0)
    assert finding.level is HealthLevel.PROBLEM and "in use" in finding.found

    class Broken(Line):
        def read(self, timeout_s):
            raise DeviceLost("unplugged")

    (finding,) = ask(Broken())
    assert "unplugged" in finding.found


def test_a_port_in_use_is_not_touched(create):
    assert ask(Line(create), free=lambda path: False) == []
