"""The ``Say`` skill of ROS4HRI: what the robot says becomes a goal for the robot's speech stack.

The skill is an action server on ``/skill/say`` with the type ``communication_skills/action/Say``. Its goal has the
sentence in ``input`` and who asked for it in ``meta.caller``. The package is in no package index, so that the client is
tested with a stand-in for its types only.
"""

from __future__ import annotations

from typing import Any

import structlog

log = structlog.get_logger()
CALLER = "shift"


class SaySkill:
    """A client of the skill.

    Parameters
    ----------
    client
        An action client of rclpy for the skill's action.
    action
        The action's type, whose ``Goal`` it makes.
    name
        The name of the action, for the log.
    """

    def __init__(self, client: Any, action: Any, name: str) -> None:
        self._client = client
        self._action = action
        self._name = name
        self._absent = False

    def say(self, text: str) -> None:
        """Send the sentence as a goal. Without a server it is not sent, which the log says once for each absence."""
        if not self._client.server_is_ready():
            if not self._absent:
                log.warning("nobody serves the Say skill; sentences are on the topic shift/say only", action=self._name)
            self._absent = True
            return
        self._absent = False
        goal = self._action.Goal()
        goal.input = text
        goal.meta.caller = CALLER
        self._client.send_goal_async(goal).add_done_callback(self._on_answer)

    def _on_answer(self, future: Any) -> None:
        error = future.exception()
        if error is not None or not future.result().accepted:
            log.warning("the Say skill refused a sentence", action=self._name, error=str(error or "not accepted"))


def say_skill_of(node: Any, name: str) -> SaySkill | None:
    """Return a client of the skill on an rclpy node; None if the skill's package is not installed."""
    try:
        from communication_skills.action import Say
    except ImportError:
        return None
    from rclpy.action import ActionClient

    return SaySkill(ActionClient(node, Say, name), Say, name)
