"""What RISE gets of a decision, and the example scenario: topics, types, fields and values as documented."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from shift_ros2.interfaces import INTERFACES
from shift_ros2.mapping import performance_of, task_of
from shift_ros2.rise import DEFINITION, EVENT, FIELDS, Goal, definition_of, goals_of
from shift_schemas.errors import InvalidSettings

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "docs" / "rise" / "coffee.xml"
DECISION = {
    "session": "s1", "decision_id": "d1", "n": 3, "task": "grasp", "cognitive_state": "uncertain",
    "strategy": {"negation": "negation", "hesitation": "none"}, "text": "Nimm nicht die grüne, nimm die rote Tasse.",
    "probabilities": [0.5, 0.5],
}  # fmt: skip
DOCUMENTED = {"startCommunicationRobotAct", "stopCommunicationRobotAct", "startInteractionRule",
              "stopInteractionRule", "raiseEventTopic", "assignValue"}  # fmt: skip


def test_value_comes_before_its_event() -> None:
    value, event = goals_of(DECISION, memory=True, event=True)
    assert value.function == "assignValue"
    assert json.loads(value.behavior) == {"shift": {field: DECISION[field] for field in FIELDS}}
    assert event == Goal("shift-d1-event", "shift_decision", "raiseEventTopic")
    assert {value.function, event.function} <= DOCUMENTED


def test_each_goal_is_switched_on_by_itself() -> None:
    assert [goal.function for goal in goals_of(DECISION, memory=True, event=False)] == ["assignValue"]
    assert [goal.function for goal in goals_of(DECISION, memory=False, event=True)] == ["raiseEventTopic"]


def test_decision_without_a_text_has_none_in_the_memory() -> None:
    (value,) = goals_of(DECISION | {"text": None}, memory=True, event=False)
    assert "text" not in json.loads(value.behavior)["shift"]


def test_definition_has_the_goal_without_comments() -> None:
    goal = definition_of(DEFINITION.read_text()).rpartition("MSG: ros_tcp_endpoint/DomainTaskGoal\n")[2]
    assert goal.split("\n") == ["string domain_task_behavior", "string function_type", "string calling_type"]


@pytest.mark.parametrize("text", ["", "string a", "string a\n---\n", "a\n---\nb\n---\nc\n---\nd"])
def test_definition_without_three_parts_is_refused(text: str) -> None:
    with pytest.raises(InvalidSettings, match="three parts"):
        definition_of(text)


def test_example_uses_the_bridge_as_it_is() -> None:
    scenario = ElementTree.parse(EXAMPLE).getroot()
    inputs = {f"/{i.name}" for i in INTERFACES if i.direction == "in"}
    read = {"/shift/task": task_of, "/shift/task_performance": performance_of}
    published = [(e.get("topic"), e.get("type"), e.text or "") for e in scenario.iter("publish")]
    assert {topic for topic, _, _ in published} == set(read) <= inputs
    for topic, kind, text in published:
        assert kind == "std_msgs/String"
        read[topic or ""](re.sub(r"\{shift\.(\w+)\}", lambda found: str(DECISION[found[1]]), text))
    called = [(e.get("name"), e.get("type")) for e in scenario.iter("callService")]
    assert called == [(f"/{i.name}", "std_srvs/Trigger") for i in INTERFACES if i.direction == "service"]
    assert EVENT in [e.get("event") for e in scenario.iter("transition")]
    started = [e.text for e in scenario.iter("startCommunicationRobotAct")]
    assert started == [e.get("id") for e in scenario.iter("communicationRobotAct")]


def test_names_in_the_memory_are_those_of_a_decision() -> None:
    named = set(re.findall(r"\{shift\.(\w+)\}", EXAMPLE.read_text()))
    assert named == {"text", "decision_id"} <= set(FIELDS)
