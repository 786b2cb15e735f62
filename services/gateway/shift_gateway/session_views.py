"""The gateway's replica is any door's; what it adds is the decider's state, which the preview runs on."""

from __future__ import annotations

from shift_decider.core import DeciderState
from shift_runtime.read_model import NOTIFICATION_WAIT_S, ReadModel, SessionView

__all__ = ["NOTIFICATION_WAIT_S", "ReadModel", "SessionView", "decider_state"]


def decider_state(view: SessionView) -> DeciderState:
    """The decider's state as the facts tell it: the preview runs its very core on this."""
    return DeciderState(
        session=view.fact.session, seed=view.fact.seed, phase=view.fact.state, config=view.config,
        observation=view.observation, policy=view.policy, n=view.n, overrides=dict(view.overrides),
        format=view.fact.format,
    )  # fmt: skip
