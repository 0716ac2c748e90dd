from __future__ import annotations

import pytest

from florence_bt.app.bringup.simulated import hardware_mounts
from florence_bt.core.errors import ConfigError
from florence_bt.drivers.kinect.sources import SocketFrameSource
from florence_bt.drivers.serial_port import SerialPort
from florence_bt.simulation.hardware.ports import HardwareSettings
from florence_bt.simulation.hardware.server import HardwareServer
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.world import SimulatedWorld


@pytest.mark.parametrize("rate", [0.0, -1.0, 31.0, float("nan")])
def test_a_rate_that_no_kinect_has_is_refused(tmp_path, rate):
    with pytest.raises(ConfigError, match="kinect_rate"):
        HardwareSettings(tmp_path, kinect_rate=rate)


@pytest.mark.parametrize("folder", ["ports", "ä" * 60 + "/ports"], ids=["near", "deep"])
def test_ports_come_and_go_together(tmp_path, folder):
    settings = HardwareSettings(tmp_path / folder)
    server = HardwareServer(SimulatedWorld(load_flat()), hardware_mounts(), settings)
    server.open()
    assert {path.name for path in settings.folder.iterdir()} == {"create", "hokuyo", "kinect"}
    SocketFrameSource(str(settings.kinect_socket)).close()
    server.step()
    assert server.truth()["time"] > 0.0 and server.truth()["people"] == {}
    server.close()
    assert not any(settings.folder.iterdir())


def test_it_is_known_when_the_laser_spoke_last(tmp_path):
    settings = HardwareSettings(tmp_path / "ports")
    server = HardwareServer(SimulatedWorld(load_flat()), hardware_mounts(), settings)
    server.open()
    client = SerialPort(str(settings.laser_port), 115200)
    server.step()
    assert server.laser_sent_at == 0.0
    client.write(b"VV\n")
    while server.laser_sent_at == 0.0:
        server.step()
    sent_at = server.laser_sent_at
    assert sent_at == server.time
    server.step()
    assert server.laser_sent_at == sent_at
    client.close()
    server.close()


def test_when_one_port_cannot_be_made_none_is_left(tmp_path):
    settings = HardwareSettings(tmp_path / "ports")
    settings.kinect_socket.mkdir(parents=True)
    server = HardwareServer(SimulatedWorld(load_flat()), hardware_mounts(), settings)
    with pytest.raises(OSError):
        server.open()
    assert [path.name for path in settings.folder.iterdir()] == ["kinect"]
