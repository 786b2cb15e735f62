"""The dialogue of ``shift-mesh demo --robot``: what the mesh sees, what the robot says, and what the person does."""

from __future__ import annotations

import secrets
import time
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.markup import escape
from shift_runtime.rest_client import RestClient
from shift_schemas.errors import InvalidSettings
from shift_simulator.live import LiveEpisode, drive
from shift_simulator.users import ACTIONS, User

SPEAKERS = {"Mesh": "blue", "Robot": "bold cyan", "Person": "green", "Learner": "magenta"}
CHOSEN_BY = {
    "learner": "chosen by the learner",
    "last_policy": "chosen by the learner's last policy",
    "scoring": "suggested by the scoring table",
    "override": "chosen by the experimenter",
}


@dataclass
class Dialogue:
    """A robot explains the tasks of a study to a simulated person, line by line."""

    console: Console
    study: dict[str, Any]
    """The study, as a start takes it."""
    user: User
    episodes: int
    pause_s: float
    """The time between two lines, seconds."""

    def run(self, shift: RestClient, seed: int) -> dict[str, Any]:
        """Run a session on the mesh and print it; return the answer to its end.

        Raises
        ------
        InvalidSettings
            The study's actions or tasks are not those of the simulated person.
        ShiftError
            The mesh refused a request or did not answer.
        """
        session = f"demo-robot-{secrets.token_hex(3)}"
        self._introduce()
        shift.start("P00", session=session, study=self.study, seed=seed)
        done: list[LiveEpisode] = []
        try:
            for episode in drive(shift, session, self.user, self.episodes):
                self._show(episode)
                done.append(episode)
        finally:
            ended = shift.end(session)
        self._conclude(done)
        return ended

    def tell(self, text: str) -> None:
        """Print a line of the narrator."""
        self.console.print(text, markup=False)

    def _introduce(self) -> None:
        actions = 1
        for strategy in self.study["scoring"]["strategies"].values():
            actions *= len(strategy["levels"]) if strategy else 1
        if actions != ACTIONS:
            raise InvalidSettings(
                f"study {self.study['study']} has {actions} actions, and the simulated person knows {ACTIONS}"
            )
        title = self.study["title"] or self.study["study"]
        self.console.print(
            f"\n[bold]{escape(title)}[/]: the robot explains, simulated person {self.user.user} answers."
        )
        self.tell("SHIFT watches the person's gaze and results, and decides how the robot phrases its next sentence.")

    def _show(self, episode: LiveEpisode) -> None:
        """Print one interaction."""
        decision, performance, outcome = episode
        seen = decision["observation"]
        state = decision["cognitive_state"].replace("_", " ")
        strategy = ", ".join(decision["strategy"].values())
        chance = "" if decision["propensity"] is None else f" with probability {decision['propensity']:.2f}"
        tries = ", to try it" if decision["explored"] else ""
        self.console.print(f"\n[bold]{decision['n']}. {escape(decision['task'])}[/]")
        self._say(
            "Mesh", f"capacity {seen['capacity']}, gaze {seen['gaze']}, awareness {seen['awareness']}: {state}",
        )  # fmt: skip
        self._say("", f"{strategy}: {CHOSEN_BY[decision['policy_source']]}{chance}{tries}")
        text = decision["text"]
        self._say("Robot", f"“{text}”" if text else f"(the study has no sentence for {strategy})")
        self._say("Person", f"does it after {outcome.enabledness_s:.0f} s" if outcome.success else "does not manage it")
        total = performance["cumulative_reward"]
        self._say("Learner", f"reward {performance['reward']:+.2f}, in total {total:+.2f}")

    def _say(self, speaker: str, text: str) -> None:
        style = SPEAKERS.get(speaker, "dim")
        label = f"[{style}]{speaker:>8}[/]"
        body = f"[{style}]{escape(text)}[/]" if speaker in ("Robot", "") else escape(text)
        self.console.print(f"{label}  {body}")
        time.sleep(self.pause_s)

    def _conclude(self, done: list[LiveEpisode]) -> None:
        half = len(done) // 2
        parts = [done[:half], done[half:]] if half else [done]
        counts = [f"{sum(e.outcome.success for e in part)} of {len(part)}" for part in parts]
        said = " of the first explanations and ".join(counts) + (" of the last ones" if half else " explanations")
        self.tell(f"\nThe person managed {said}. Every message was recorded.")
