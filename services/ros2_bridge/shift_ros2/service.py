"""The process of the bridge: its settings, its sessions with the mesh and with ROS, and its signals."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress

import structlog
from shift_runtime.bus.zenoh import ZenohBus, open_buses
from shift_runtime.clock import SystemClock
from shift_runtime.logs import configure_logs
from shift_runtime.mesh_api import MeshApi
from shift_runtime.mesh_client import MeshClient
from shift_runtime.metrics import Metrics
from shift_runtime.process import run_loop
from shift_runtime.read_model import ReadModel
from shift_schemas.codec import encode
from shift_schemas.errors import ShiftError
from shift_schemas.keys import ServiceKey, build_key
from shift_schemas.messages import Health

from shift_ros2.backend import Backend
from shift_ros2.bridge import Bridge
from shift_ros2.settings import BridgeSettings, bridge_settings

log = structlog.get_logger()
SERVICE = "ros2_bridge"
DRAIN_S = 2.0


def run_bridge(line: Sequence[str]) -> None:
    """Run the bridge until SIGINT or SIGTERM. Exit with 0, or with 2 if a setting is not valid."""
    try:
        settings = bridge_settings(line)
        configure_logs(SERVICE, settings)
        run_loop(serve(settings))
    except ShiftError as e:
        sys.stderr.write(f"shift_ros2: {e.detail}\n")
        sys.exit(2)


async def serve(settings: BridgeSettings) -> None:
    """Serve the mesh and ROS until a signal arrives."""
    stop = asyncio.Event()
    _on_signal(stop.set)
    buses = await open_buses(settings.zenoh, settings.listen, settings.shards)
    metrics = Metrics(SERVICE)
    read_model = ReadModel(buses, metrics.dropped, metrics.link_lost)
    bridge = Bridge(settings, MeshApi(MeshClient(buses, settings.patience_s), read_model), metrics, SystemClock())
    read_model.reader.start()
    pulling = asyncio.create_task(read_model.reader.run())
    try:
        bridge.backend = await open_backend(settings, bridge)
        _on_signal(stop.set)  # rclpy's executor replaces the signal handlers
        for bus in buses:
            _serve_health(bus, bridge, metrics)
        log.info(
            "started", node=settings.node, namespace=settings.namespace, session=bridge.session,
            backend=settings.backend, mesh=settings.zenoh,
            ros=_graph(settings),
        )  # fmt: skip
        running = asyncio.create_task(bridge.run())
        stopping = asyncio.create_task(stop.wait())
        await asyncio.wait({running, stopping}, return_when=asyncio.FIRST_COMPLETED)
        if running.done():
            await running
        await bridge.drain(DRAIN_S)
        running.cancel()
        with suppress(asyncio.CancelledError):
            await running
        await bridge.backend.close()
    finally:
        pulling.cancel()
        await asyncio.gather(*(bus.close() for bus in buses))
        log.info("stopped")


async def open_backend(settings: BridgeSettings, bridge: Bridge) -> Backend:
    """Return the backend that the settings name. The others are not imported."""
    if settings.backend == "rospy":
        from shift_ros2.rospy_backend import RospyBackend

        return await RospyBackend.open(settings, bridge)
    if settings.backend == "rclpy":
        from shift_ros2.rclpy_backend import RclpyBackend

        return await RclpyBackend.open(settings, bridge)
    from shift_ros2.native_backend import NativeBackend

    return await NativeBackend.open(settings, bridge)


def _graph(settings: BridgeSettings) -> str:
    """Return where the bridge meets the ROS nodes."""
    match settings.backend:
        case "native":
            return settings.ros_router
        case "rclpy":
            return f"domain {settings.domain}"
        case "rospy":
            return settings.master


def _on_signal(stop: Callable[[], None]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop)


def _serve_health(bus: ZenohBus, bridge: Bridge, metrics: Metrics) -> None:
    def health() -> Health:
        state = bridge.diagnostics.state
        return Health(service=SERVICE, ready=state == "ready", detail="" if state == "ready" else state, sessions=1)

    bus.serve(build_key(ServiceKey(SERVICE, "health")), lambda r: r.reply(encode(health())))
    bus.serve(build_key(ServiceKey(SERVICE, "metrics")), lambda r: r.reply(metrics.text()))
    bus.token(build_key(ServiceKey(SERVICE, "alive")))
