"""The decider's state as the gateway has read it, for the preview."""

from __future__ import annotations

from shift_decider.core import DeciderState
from shift_runtime.read_model import SessionView


def decider_state(view: SessionView) -> DeciderState:
    """Return the decider's state as its facts define it. The preview runs the decider's own core on this state."""
    return DeciderState(
        session=view.fact.session, seed=view.fact.seed, phase=view.fact.state, config=view.config,
        observation=view.observation, policy=view.policy, n=view.n, overrides=dict(view.overrides),
        format=view.fact.format,
    )  # fmt: skip
