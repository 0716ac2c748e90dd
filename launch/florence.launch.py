"""Starts Florence from ROS 2 launch: ``ros2 launch florence_bt florence.launch.py sim:=true``.

Its arguments are the options of ``florence up``, which it starts: the processes stay those of the supervisor,
which stops the robot when one of them dies or hangs, and ends them in their order. The launch system would do
neither. ``ros2 launch florence_bt florence.launch.py --show-args`` lists the arguments.
"""

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from florence_bt.cli.launch_arguments import NAMESPACE, command_words, launch_arguments
from launch import LaunchContext, LaunchDescription

END_BUDGET_S = "60"
"""Seconds that the system gets to end in after Ctrl-C. With the 5 s of launch, the robot's processes would be
killed amid their end."""


def generate_launch_description() -> LaunchDescription:
    """Describe the arguments, and the process that is started when their values are known."""
    arguments = [
        DeclareLaunchArgument(each.name, default_value=each.default, description=each.description)
        for each in launch_arguments()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_start)])


def _start(context: LaunchContext) -> list[Node]:
    values = {each.name: LaunchConfiguration(each.name).perform(context) for each in launch_arguments()}
    namespace = values.pop(NAMESPACE)
    return [
        Node(
            package="florence_bt",
            executable="florence",
            namespace=namespace,
            arguments=command_words(values),
            output="screen",
            emulate_tty=True,
            sigterm_timeout=END_BUDGET_S,
            sigkill_timeout=END_BUDGET_S,
        )
    ]
