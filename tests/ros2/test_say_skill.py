"""ROS4HRI's Say skill, with a stand-in for its action client: its real types are in no package index."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

import pytest
import structlog
from shift_ros2.say_skill import SaySkill, say_skill_of


class Goal:
    """The fields of the goal that are set: who asks, and the sentence."""

    def __init__(self) -> None:
        self.meta = SimpleNamespace(caller="")
        self.input = ""


class Client:
    """An action client whose server is there or not, and accepts goals or not."""

    def __init__(self, ready: bool = True, answer: Callable[[Future[Any]], None] | None = None) -> None:
        self.ready = ready
        self.sent: list[Goal] = []
        self._answer = answer or (lambda future: future.set_result(SimpleNamespace(accepted=True)))

    def server_is_ready(self) -> bool:
        return self.ready

    def send_goal_async(self, goal: Goal) -> Future[Any]:
        self.sent.append(goal)
        future: Future[Any] = Future()
        self._answer(future)
        return future


def skill(client: Client) -> SaySkill:
    return SaySkill(client, SimpleNamespace(Goal=Goal), "/skill/say")


def test_sentence_becomes_a_goal() -> None:
    client = Client()
    with structlog.testing.capture_logs() as logs:
        skill(client).say("Nimm die rote Tasse.")
    assert [(goal.input, goal.meta.caller) for goal in client.sent] == [("Nimm die rote Tasse.", "shift")]
    assert logs == []


def test_absent_server_is_reported_once_for_each_absence() -> None:
    client = Client(ready=False)
    say = skill(client).say
    with structlog.testing.capture_logs() as logs:
        say("one")
        say("two")
        client.ready = True
        say("three")
        client.ready = False
        say("four")
    assert [goal.input for goal in client.sent] == ["three"]
    assert [log["event"].partition(";")[0] for log in logs] == ["nobody serves the Say skill"] * 2


@pytest.mark.parametrize(
    ("answer", "error"),
    [
        (lambda future: future.set_result(SimpleNamespace(accepted=False)), "not accepted"),
        (lambda future: future.set_exception(RuntimeError("no space")), "no space"),
    ],
)
def test_refusal_is_reported(answer: Callable[[Future[Any]], None], error: str) -> None:
    with structlog.testing.capture_logs() as logs:
        skill(Client(answer=answer)).say("one")
    assert [(log["event"], log["error"]) for log in logs] == [("the Say skill refused a sentence", error)]


def test_without_the_package_there_is_no_skill(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "communication_skills.action", None)
    assert say_skill_of(None, "/skill/say") is None


def test_with_the_package_the_client_is_made_for_the_name(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[tuple[Any, ...]] = []
    action = SimpleNamespace(Goal=Goal)
    monkeypatch.setitem(sys.modules, "communication_skills", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "communication_skills.action", SimpleNamespace(Say=action))
    monkeypatch.setitem(sys.modules, "rclpy", SimpleNamespace())
    client = Client()
    monkeypatch.setitem(
        sys.modules, "rclpy.action", SimpleNamespace(ActionClient=lambda *words: made.append(words) or client)
    )
    found = say_skill_of("node", "/nao/say")
    assert made == [("node", action, "/nao/say")]
    assert found is not None
    found.say("one")
    assert [goal.input for goal in client.sent] == ["one"]
