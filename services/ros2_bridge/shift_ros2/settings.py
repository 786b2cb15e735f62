"""Settings of the bridge: ``--ros-args -p`` and flags, then a parameter file, the environment, the default."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import Field
from shift_runtime.settings import ClientSettings, read_settings
from shift_schemas.errors import InvalidSettings
from shift_schemas.ids import Id, is_id, not_an_id

from shift_ros2.arguments import Parameters, RosArguments, parameters_of, parse_ros_args
from shift_ros2.interfaces import INTERFACES
from shift_ros2.names import Remap, check_namespace, check_node, resolved

DEFAULT_ROS_ROUTER = "tcp/localhost:7447"
DEFAULT_MASTER = "http://localhost:11311"
DEFAULT_SESSION = "ros"
Reliability = Literal["best_effort", "reliable"]


class BridgeSettings(ClientSettings):
    """The settings of the bridge. Each name is a ROS parameter, and ``SHIFT_NAME`` in the environment."""

    backend: Literal["native", "rclpy", "rospy"] = Field(
        default="native", description="How it speaks to ROS 2; rospy speaks to ROS 1."
    )
    master: str = Field(default=DEFAULT_MASTER, description="rospy: the ROS master; else ROS_MASTER_URI.")
    ros_router: str = Field(default=DEFAULT_ROS_ROUTER, description="native: the Zenoh router that ROS nodes meet at.")
    ros_listen: str = Field(
        default="tcp/localhost:0", description="native: where ROS nodes link directly; empty: all goes by the router."
    )
    node: str = Field(default="shift", description="Name of the node.")
    namespace: str = Field(default="/", description="Its namespace.")
    domain: int = Field(default=0, ge=0, le=232, description="ROS domain; else ROS_DOMAIN_ID.")
    distribution: str = Field(
        default="rolling", pattern=r"^[a-z]+$", description="Of the ROS nodes, for the type hash; else ROS_DISTRO."
    )
    session: Id | None = Field(default=None, description="The session; left out: the namespace's last part, or ros.")
    create_session: bool = Field(default=False, description="Begin the session where there is none.")
    participant: Id = Field(default="P00", description="Pseudonym of the participant of a session begun here.")
    study: Id = Field(default="default", description="Its study.")
    condition: Id | None = Field(default=None, description="Its condition.")
    seed: int | None = Field(default=None, ge=0, lt=2**53, description="Its seed.")
    task: Id | None = Field(default=None, description="What requests are about until /shift/task says otherwise.")
    source: Id = Field(default="ros", description="Gaze source of messages that name none.")
    gaze_reliability: Reliability = Field(default="best_effort", description="QoS of the gaze subscription.")
    gaze_depth: int = Field(default=1000, ge=1, le=100_000, description="QoS: how much gaze may wait.")
    reliability: Reliability = Field(default="reliable", description="QoS of everything else.")
    depth: int = Field(default=10, ge=1, le=10_000, description="QoS: history of everything else.")
    gaze_chunk: int = Field(default=10, ge=1, le=1000, description="So many single samples become one chunk.")
    gaze_wait_s: float = Field(default=0.03, ge=0, le=1, description="How long a sample waits for others, s.")
    diagnostics_s: float = Field(default=1.0, gt=0, le=3600, description="Diagnostics at most this often, s.")
    ros4hri: bool = Field(default=True, description="Take what hri_msgs topics say of persons as markers.")
    say_skill: str = Field(
        default="/skill/say", description="rclpy: ROS4HRI's Say skill, which speaks each sentence; empty: not used."
    )
    rise_memory: bool = Field(default=False, description="rospy: assign each decision in RISE's memory.")
    rise_event: bool = Field(default=False, description="rospy: raise RISE's event shift_decision for each decision.")
    rise_action: str = Field(
        default="", description="rospy: file with the definition of RISE's DomainTaskAction; empty: the built-in one."
    )
    rise_goal: str = Field(default="/rise/set/domainTask/goal", description="rospy: the topic of RISE's goals.")
    patience_s: float = Field(default=4.0, gt=0, le=300, description="How long a service may take to come back, s.")
    remaps: tuple[tuple[str, str], ...] = Field(default=(), description="Remap rules, (old, new).")

    @property
    def bound_session(self) -> str:
        """The session of messages that name none. Raises :class:`InvalidSettings`."""
        if self.session is not None:
            return self.session
        named = self.namespace.rpartition("/")[2] or DEFAULT_SESSION
        if not is_id(named):
            rule = f"{not_an_id(named)}; set parameter session"
            raise InvalidSettings(f"namespace {self.namespace} does not end with a session's id: {rule}")
        return named

    @property
    def names(self) -> dict[str, str]:
        """The full ROS name of each interface."""
        rules = [Remap(old, new) for old, new in self.remaps]
        return {i.topic: resolved(i.name, self.namespace, self.node, rules) for i in INTERFACES}


PARAMETERS: frozenset[str] = frozenset(BridgeSettings.model_fields) - {"remaps", "node", "namespace"}
"""The parameters that ``-p`` and parameter files can set; node and namespace are set by remapping, as in ROS."""
_FLAGS = {
    "--backend": "backend", "--session": "session", "--zenoh": "zenoh", "--ros-router": "ros_router", "--data": "data",
    "--master": "master",
}  # fmt: skip


def bridge_settings(line: Sequence[str]) -> BridgeSettings:
    """Return the settings of a command line and the environment.

    Raises
    ------
    InvalidSettings
        A flag, parameter, file or name is not valid.
    """
    arguments = parse_ros_args(line)
    given: dict[str, Any] = _flags(arguments.rest)
    found = read_settings(BridgeSettings)
    assert isinstance(found, BridgeSettings)
    node = check_node(arguments.node or found.node)
    namespace = check_namespace(arguments.namespace or found.namespace)
    parameters = _parameters(arguments, f"{namespace.rstrip('/')}/{node}")
    given = {**_ros_environment(), **parameters, **given, "node": node, "namespace": namespace}
    given["remaps"] = tuple((r.old, r.new) for r in arguments.remaps) or found.remaps
    if arguments.log_level:
        given["log_level"] = arguments.log_level
    settings = read_settings(BridgeSettings, **given)
    assert isinstance(settings, BridgeSettings)
    _ = settings.names, settings.bound_session
    return settings


def _ros_environment() -> Parameters:
    """Return the settings that every ROS node takes from the environment; settings of the bridge override them."""
    variables = {
        "domain": ("SHIFT_DOMAIN", "ROS_DOMAIN_ID"),
        "distribution": ("SHIFT_DISTRIBUTION", "ROS_DISTRO"),
        "master": ("SHIFT_MASTER", "ROS_MASTER_URI"),
    }
    return {
        name: os.environ[theirs]
        for name, (ours, theirs) in variables.items()
        if os.environ.get(theirs) and ours not in os.environ
    }


def _flags(words: list[str]) -> dict[str, str]:
    given = {}
    while words:
        word, _, value = words.pop(0).partition("=")
        if word not in _FLAGS:
            raise InvalidSettings(f"{word!r} is not a flag of the bridge; write one of {', '.join(_FLAGS)}, --ros-args")
        if not value and not words:
            raise InvalidSettings(f"{word} has no value; write one after it")
        given[_FLAGS[word]] = value or words.pop(0)
    return given


def _parameters(arguments: RosArguments, full_name: str) -> Parameters:
    found: Parameters = {}
    for file in arguments.files:
        try:
            text = Path(file).read_text()
        except (OSError, UnicodeDecodeError) as e:
            raise InvalidSettings(f"--params-file {file} cannot be read: {e}") from e
        found |= parameters_of(text, file, full_name, PARAMETERS.__contains__)
    if unknown := sorted(set(arguments.parameters) - PARAMETERS):
        raise InvalidSettings(
            f"{unknown[0]!r} is not a parameter of the bridge; it has {', '.join(sorted(PARAMETERS))}"
        )
    return found | arguments.parameters
