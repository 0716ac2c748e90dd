"""What the robot says and is answered, over real ROS: a listener, and a button of the home sensors."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from florence_interfaces.msg import HomeEvent
from std_msgs.msg import String

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.core.outcome import success
from florence_bt.ros.conversions import stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE
from florence_bt.skills.home_sensors.node import HomeSensorsNode
from florence_bt.skills.speech.node import SpeechNode

pytestmark = pytest.mark.ros


def test_a_text_that_is_said_is_heard_and_a_button_answers(ros, tmp_path):
    hotspots, home = tmp_path / "hotspots.yaml", tmp_path / "home.yaml"
    hotspots.write_text("hotspots:\n- {label: kitchen, x: 1, y: 1}\n")
    home.write_text("sensors:\n  kitchen_button: {room: kitchen, kind: button}\n")
    server, house = ros.add(FlorenceNode("missions")), ros.add(FlorenceNode("house"))
    ros.add(HomeSensorsNode(parameters={"home_file": str(home), "hotspots_file": str(hotspots)}))
    heard = []
    house.create_subscription(String, "say", lambda message: heard.append(message.data), RELIABLE)
    events = house.create_publisher(HomeEvent, "home_sensors/event", RELIABLE)
    ros.add(SpeechNode())
    skills = make_skills(server)
    said = skills["say"].start({"text": "Please drink something."})
    ros.spin_until(lambda: heard and said.poll(), what="the text")
    assert (heard, said.poll()) == (["Please drink something."], success())

    ros.spin_until(events.get_subscription_count, what="the home sensors")
    ros.spin_until(lambda: server.count_publishers("answer"), what="the button")
    waiting = skills["wait_for_answer"].start({"time_limit": 600.0, "choices": ()})
    earlier = stamp_to_ros(house.timebase.now() - 60.0)

    def pressed():
        events.publish(HomeEvent(sensor="kitchen_button", active=True, stamp=earlier))
        events.publish(HomeEvent(sensor="kitchen_button", active=False))
        assert waiting.poll() is None, "an old press is no answer, nor is the release of a button"
        events.publish(HomeEvent(sensor="kitchen_button", active=True))
        ros.spin_until(waiting.poll, what="the answer")

    pressed()
    assert waiting.poll() == success(answer="kitchen_button")
