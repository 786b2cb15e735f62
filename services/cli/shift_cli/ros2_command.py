"""``shift-mesh ros2``: the bridge to ROS 2."""

from __future__ import annotations

import os
import sys
from typing import Annotated, Literal

import typer

CONTEXT = {"allow_extra_args": True, "ignore_unknown_options": True}


def ros2(
    context: typer.Context,
    backend: Annotated[
        Literal["native", "rclpy"] | None,
        typer.Option(
            help="native (the default) speaks rmw_zenoh itself and needs no ROS here; rclpy needs a ROS 2.",
            envvar="SHIFT_BACKEND",
        ),
    ] = None,
    session: Annotated[str | None, typer.Option(help="Id of the session.", envvar="SHIFT_SESSION")] = None,
    zenoh: Annotated[str | None, typer.Option(help="Endpoint of the mesh's router.", envvar="SHIFT_ZENOH")] = None,
    ros_router: Annotated[
        str | None,
        typer.Option(
            help="Endpoint of the ROS nodes' router; left out: tcp/localhost:7447.", envvar="SHIFT_ROS_ROUTER"
        ),
    ] = None,
) -> None:
    """Run the bridge to ROS 2 until Ctrl-C: a node with topics and a service, for robots.

    \b
    shift-mesh ros2 --session s1                                          # a session that exists
    shift-mesh ros2 --ros-args -p session:=s1 -p create_session:=true     # start it if needed
    shift-mesh ros2 --backend rclpy --ros-args -r __ns:=/lab -r shift/gaze:=/tracker/gaze
    """
    flags = {"backend": backend, "session": session, "zenoh": zenoh, "ros_router": ros_router}
    run_bridge(context, flags)


def run_bridge(context: typer.Context, flags: dict[str, str | None], *words: str) -> None:
    """Replace this process by the bridge, with the flags that stand on the command line."""
    given = list(words)
    for name, value in flags.items():  # the environment is read there, below what --ros-args says
        source = context.get_parameter_source(name)
        if value is not None and source is not None and source.name == "COMMANDLINE":
            given += [f"--{name.replace('_', '-')}", value]
    sys.stdout.flush()
    os.execv(sys.executable, [sys.executable, "-m", "shift_ros2", *given, *context.args])
