"""SHIFT as a ROS 2 node, with and without an installation of ROS (docs/ros2.md)."""
