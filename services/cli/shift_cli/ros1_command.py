"""``shift-mesh ros1``: the bridge to ROS 1."""

from __future__ import annotations

from typing import Annotated

import typer

from shift_cli.ros2_command import run_bridge


def ros1(
    context: typer.Context,
    session: Annotated[str | None, typer.Option(help="Id of the session.", envvar="SHIFT_SESSION")] = None,
    zenoh: Annotated[str | None, typer.Option(help="Endpoint of the mesh's router.", envvar="SHIFT_ZENOH")] = None,
    master: Annotated[
        str | None,
        typer.Option(
            help="URI of the ROS master; left out: ROS_MASTER_URI or http://localhost:11311.", envvar="SHIFT_MASTER"
        ),
    ] = None,
) -> None:
    """Run the bridge to ROS 1 until Ctrl-C: a rospy node with topics and a service, for robots and for RISE.

    \b
    shift-mesh ros1 --session s1                                  # a session that exists
    shift-mesh ros1 _session:=s1 _create_session:=true            # start it if needed
    shift-mesh ros1 __ns:=/lab shift/gaze:=/tracker/gaze          # names and remaps as in ROS 1
    shift-mesh ros1 _rise_memory:=true _rise_event:=true          # for the scenario manager RISE
    """
    run_bridge(context, {"session": session, "zenoh": zenoh, "master": master}, "--backend", "rospy")
