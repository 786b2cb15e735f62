"""The command line of ROS nodes, parameter files, environment; names and remaps."""

from __future__ import annotations

from pathlib import Path

import pytest
from shift_ros2.arguments import parse_ros_args
from shift_ros2.interfaces import INTERFACES
from shift_ros2.names import Remap, expanded, resolved
from shift_ros2.settings import PARAMETERS, bridge_settings
from shift_schemas.errors import InvalidSettings

ROOT = Path(__file__).resolve().parent.parent.parent


@pytest.fixture(autouse=True)
def _bare_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ROS_DOMAIN_ID", "ROS_DISTRO", "SHIFT_SESSION", "SHIFT_ZENOH"):
        monkeypatch.delenv(name, raising=False)


def test_without_anything_it_is_the_node_of_the_documentation() -> None:
    settings = bridge_settings([])
    assert settings.names == {i.topic: f"/shift/{i.topic}" for i in INTERFACES}
    assert (settings.node, settings.namespace, settings.bound_session) == ("shift", "/", "ros")
    assert (settings.backend, settings.ros_router, settings.domain) == ("native", "tcp/localhost:7447", 0)


def test_a_line_as_ros_nodes_take_it() -> None:
    line = [
        *("--backend", "rclpy", "--zenoh", "tcp/127.0.0.1:1", "--ros-args", "-r", "__ns:=/lab", "-r", "__node:=robot"),
        *("-r", "shift/gaze:=/tracker/gaze", "-p", "create_session:=true", "-p", "seed:=7", "--param", "depth:=3"),
        *("--remap", "rosservice://shift/next_strategy:=~/strategy", "--log-level", "warn", "--"),
    ]
    settings = bridge_settings(line)
    assert settings.names["gaze"] == "/tracker/gaze"
    assert settings.names["next_strategy"] == "/lab/robot/strategy"
    assert settings.names["decision"] == "/lab/shift/decision"
    assert (settings.backend, settings.create_session, settings.seed, settings.depth) == ("rclpy", True, 7, 3)
    assert settings.bound_session == "lab", "the namespace binds to a session"
    assert settings.log_level == "warning"


def test_a_parameter_binds_to_a_session_whatever_the_namespace_is() -> None:
    assert bridge_settings(["--ros-args", "-r", "__ns:=/lab", "-p", "session:=s7"]).bound_session == "s7"
    assert bridge_settings(["--ros-args", "-p", "session:='12'"]).bound_session == "12"
    with pytest.raises(InvalidSettings, match="set parameter session"):
        bridge_settings(["--ros-args", "-r", "__ns:=/_lab"])


def test_line_before_file_before_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "shift.yaml"
    file.write_text(
        "/**:\n  ros__parameters: {use_sim_time: true, task: file, study: coffee, participant: 12}\n"
        "/lab/shift:\n  ros__parameters: {condition: adaptive, create_session: true}\n"
        "/other:\n  ros__parameters: {task: other, whatever: 1}\n"
    )
    monkeypatch.setenv("SHIFT_STUDY", "environment")
    monkeypatch.setenv("SHIFT_SOURCE", "tracker")
    monkeypatch.setenv("ROS_DOMAIN_ID", "42")
    monkeypatch.setenv("ROS_DISTRO", "humble")
    line = ["--ros-args", "--params-file", str(file), "-p", "task:=line", "-r", "__ns:=/lab"]
    settings = bridge_settings(line)
    assert (settings.task, settings.study, settings.source) == ("line", "coffee", "tracker")
    assert (settings.participant, settings.condition, settings.create_session) == ("12", "adaptive", True)
    assert (settings.domain, settings.distribution) == (42, "humble")
    monkeypatch.setenv("SHIFT_DOMAIN", "3")
    assert bridge_settings(line).domain == 3


@pytest.mark.parametrize("session", ["010", "no", "1e3", "2024-01-01", "off", "true"])
def test_a_name_in_a_parameter_file_stays_as_written(tmp_path: Path, session: str) -> None:
    file = tmp_path / "shift.yaml"
    for text in (session, f"'{session}'"):
        file.write_text(f"/**:\n  ros__parameters: {{session: {text}, task: null}}\n")
        assert bridge_settings(["--ros-args", "--params-file", str(file)]).bound_session == session


def test_a_parameter_file_that_is_not_yaml_or_holds_itself_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "shift.yaml"
    for text in ("/**: [", "/**: &a {ros__parameters: {session: *a}}"):
        file.write_text(text)
        with pytest.raises(InvalidSettings):
            bridge_settings(["--ros-args", "--params-file", str(file)])


def test_the_sample_parameter_file_is_valid() -> None:
    settings = bridge_settings(["--ros-args", "--params-file", str(ROOT / "deploy" / "ros2" / "shift.yaml")])
    assert settings.create_session


@pytest.mark.parametrize(
    ("line", "word"),
    [
        ("--sesion s1", "--sesion"),
        ("--session", "has no value"),
        ("--ros-args -p sesion:=s1", "not a parameter"),
        ("--ros-args -p session:=a/b", "SESSION"),
        ("--ros-args -p session:=**", "SESSION"),
        ("--ros-args -p depth:=many", "DEPTH"),
        ("--ros-args -p depth", "name:=value"),
        ("--ros-args -r __ns:=/a/**", "namespace"),
        ("--ros-args -r __node:=a/b", "node"),
        ("--ros-args -r shift/gaze:=/a/*/b", "name"),
        ("--ros-args -r shift/gaze:=/a//b", "name"),
        ("--ros-args --what", "--what"),
        ("--ros-args --params-file /nowhere.yaml", "/nowhere.yaml"),
        ("--ros-args -p domain:=300", "DOMAIN"),
        ("--backend dds", "BACKEND"),
    ],
)
def test_what_is_not_valid_is_said(line: str, word: str) -> None:
    with pytest.raises(InvalidSettings) as caught:
        bridge_settings(line.split())
    assert word in caught.value.detail


def test_names_are_expanded_as_in_ros() -> None:
    assert expanded("gaze", "/", "n") == "/gaze"
    assert expanded("a/gaze", "/lab", "n") == "/lab/a/gaze"
    assert expanded("/gaze", "/lab", "n") == "/gaze"
    assert expanded("~/gaze", "/lab", "n") == "/lab/n/gaze"
    assert resolved("shift/gaze", "/lab", "n", [Remap("/lab/shift/gaze", "x"), Remap("shift/gaze", "y")]) == "/lab/x"


def test_other_words_of_the_line_are_left() -> None:
    found = parse_ros_args(["--session", "s", "--ros-args", "-e", "/e", "-r", "n:a:=b", "--", "--backend", "rclpy"])
    assert found.rest == ["--session", "s", "--backend", "rclpy"]
    assert found.remaps == [Remap("a", "b")]


def test_every_parameter_is_documented() -> None:
    text = (ROOT / "docs" / "ros2.md").read_text()
    inherited = {"listen", "data", "log_level", "log_json"}
    assert [p for p in sorted(PARAMETERS - inherited) if f"`{p}`" not in text] == []


def test_words_of_ros_1_are_names_parameters_and_remaps() -> None:
    line = "__name:=tutor __ns:=/lab _session:=010 _create_session:=true shift/gaze:=/g __log:=/l __ip:=1.2.3.4"
    found = parse_ros_args([*line.split(), "__master:=http://robot:11311", "--zenoh", "tcp/a:1"])
    assert (found.node, found.namespace) == ("tutor", "/lab")
    assert found.parameters == {"session": "010", "create_session": "true", "master": "http://robot:11311"}
    assert found.remaps == [Remap("shift/gaze", "/g")]
    assert found.rest == ["--zenoh", "tcp/a:1"]


@pytest.mark.parametrize("word", ["_session:=", ":=x"])
def test_word_of_ros_1_without_a_part_is_refused(word: str) -> None:
    with pytest.raises(InvalidSettings, match="write name:=value"):
        parse_ros_args([word])


def test_master_is_that_of_every_ros_node(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://robot:11311")
    assert bridge_settings(["--backend", "rospy"]).master == "http://robot:11311"
    assert bridge_settings(["--backend", "rospy", "--master", "http://a:1"]).master == "http://a:1"
