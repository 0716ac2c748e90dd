"""The voice of a robot that has none: shows what it says, and sends what you type as an answer."""

import contextlib
import sys
import threading

import rclpy
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import String


def main() -> None:
    """Print the texts of the topic `say`, and publish each line of the standard input on `answer`."""
    rclpy.init()
    node = rclpy.create_node("voice")
    answers = node.create_publisher(String, "answer", 10)

    def show(message: String) -> None:
        print(f"robot: {message.data}", flush=True)

    def send_lines() -> None:
        for line in sys.stdin:
            answers.publish(String(data=line.strip()))

    node.create_subscription(String, "say", show, 10)
    threading.Thread(target=send_lines, daemon=True).start()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
