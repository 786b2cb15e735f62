"""Sample launch file: ``ros2 launch deploy/ros2/shift.launch.py session:=s1``.

Starts the bridge as a process (shift-mesh is a Python distribution, no ROS package). Nodes that are to talk
to it with backend native run with RMW_IMPLEMENTATION=rmw_zenoh_cpp; with backend:=rclpy any RMW does.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, ThisLaunchFileDir

ARGUMENTS = {
    "session": ("s1", "The session that messages without one belong to."),
    "backend": ("native", "native (rmw_zenoh's protocol) or rclpy (any RMW)."),
    "namespace": ("/", "Namespace of the node."),
    "mesh": ("tcp/127.0.0.1:7447", "Endpoint of the mesh's router."),
}


def generate_launch_description() -> LaunchDescription:
    """The bridge, started again when it ends."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    bridge = ExecuteProcess(
        cmd=[
            "shift-mesh", "ros2",
            "--backend", LaunchConfiguration("backend"),
            "--zenoh", LaunchConfiguration("mesh"),
            "--ros-args",
            "--params-file", PathJoinSubstitution([ThisLaunchFileDir(), "shift.yaml"]),
            "-p", ["session:=", LaunchConfiguration("session")],
            "-r", ["__ns:=", LaunchConfiguration("namespace")],
        ],
        output="screen",
        respawn=True,
        respawn_delay=1.0,
    )  # fmt: skip
    return LaunchDescription([*declared, bridge])
