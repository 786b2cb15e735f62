"""The simulated partner as a Gymnasium environment: ``gymnasium.make("shift/Partner-v0", user="B")``.

It is for agents from outside the project. Gymnasium is an optional extra. Importing this module registers the
environment, and so does ``import shift_simulator`` after ``import gymnasium``.
``gymnasium.make("shift_simulator.env:shift/Partner-v0")`` imports, registers and makes the environment.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from shift_model.vocabulary import TRIPLES
from shift_study.scoring import suggestions
from shift_study.study import Study

from shift_simulator import ENV_ID
from shift_simulator.batched_sessions import BatchedPersons
from shift_simulator.random_streams import draws_of
from shift_simulator.users import ACTIONS, PAPER_USERS, User, paper_user, parse_user


class PartnerEnv(gymnasium.Env[np.int64, np.int64]):
    """A simulated partner who listens to explanations of tasks.

    ## Description
    An agent chooses how each explanation is phrased. Then the partner succeeds or fails in the task. Capacity, gaze
    and awareness change as in the paper's simulation (``batched_sessions``). The agent sees what the decider sees.

    ## Action space
    ``Discrete(6)``: (affirmation, none), (affirmation, hesitation), (negation+affirmation, none),
    (negation+affirmation, hesitation), (negation, none), (negation, hesitation).

    ## Observation space
    ``Discrete(30)`` with ``observation="triples"``: 15 x capacity + 5 x gaze + awareness. ``Discrete(6)`` with
    ``observation="states"``: the cognitive state, which is the scoring system's suggested action.

    ## Rewards
    The paper's reward: success (+1, -1) x exp(-0.1 T), as the mean of both dimensions.

    ## Starting state
    High capacity, focused gaze, and unknown awareness for every task.

    ## Episode end
    An episode is truncated after ``episodes`` interactions. It never terminates. ``info`` holds the name of the
    ``triple`` and the ``suggested`` action.

    ## Arguments
    ``user``: A, B, C, D, the path of a user file or a ``User``. ``observation`` and ``episodes``: see above.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 (Gymnasium's own attribute)

    def __init__(
        self,
        user: str | User = "A",
        observation: Literal["states", "triples"] = "triples",
        episodes: int = 100,
        render_mode: None = None,
    ) -> None:
        self.render_mode = render_mode
        self._user = _user(user)
        self._study = Study(study="gymnasium")
        self._suggested = suggestions(self._study.scoring)
        self._states = observation == "states"
        self._episodes = episodes
        self._done = 0
        self.action_space = spaces.Discrete(ACTIONS)
        self.observation_space = spaces.Discrete(ACTIONS if self._states else len(TRIPLES))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.int64, dict[str, Any]]:
        """Start a new session; the environment's generator draws its seed."""
        super().reset(seed=seed)
        seeds = self.np_random.integers(2**53, size=1)
        self._partners = BatchedPersons(self._user, self._study, draws_of(seeds, self._episodes + 1))
        self._done = 0
        return self._observe()

    def step(self, action: np.int64) -> tuple[np.int64, float, bool, bool, dict[str, Any]]:
        """Explain with this action; return the next observation, the reward and the end of the episode."""
        reward = self._partners.perform(self._done, np.array([int(action)]))
        self._done += 1
        observation, info = self._observe()
        return observation, float(reward[0]), False, self._done >= self._episodes, info

    def _observe(self) -> tuple[np.int64, dict[str, Any]]:
        triple = int(self._partners.triple(self._done)[0])
        suggested = self._suggested[triple]
        info = {"triple": TRIPLES[triple].name, "suggested": suggested}
        return np.int64(suggested if self._states else triple), info


def _user(user: str | User) -> User:
    if isinstance(user, User):
        return user
    return paper_user(user) if user in PAPER_USERS else parse_user(Path(user).read_text(encoding="utf-8"), user)


def register() -> None:
    """Register the environment with Gymnasium; a repeat changes nothing."""
    if ENV_ID not in gymnasium.registry:
        gymnasium.register(id=ENV_ID, entry_point="shift_simulator.env:PartnerEnv")


register()
