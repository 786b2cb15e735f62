"""The other door: SHIFT as a ROS 2 node, with and without ROS installed (docs/ros2.md)."""
