"""Compare the batched simulation with the services' cores, step by step."""

from __future__ import annotations

from shift_learner.learner import Context
from shift_model.vocabulary import Triple
from shift_simulator.batched_learners import batch_learner
from shift_simulator.batched_sessions import simulate
from shift_simulator.random_streams import session_seeds
from shift_simulator.session import Episode, play
from shift_simulator.users import User
from shift_study.study import Study

EPISODES = 60


def triple_of(episode: Episode) -> int:
    seen = episode.decision.observation
    return Triple(seen.capacity, seen.gaze, seen.awareness).number


def check_agreement(user: User, study: Study, runs: int, episodes: int = EPISODES) -> None:
    seeds = session_seeds(3, runs)
    trace = simulate(user, study, batch_learner(Context(study), runs), seeds, episodes)
    for run, seed in enumerate(seeds):
        played = list(play(user, study, int(seed), episodes))
        assert [triple_of(e) for e in played] == trace.triple[:, run].tolist()
        assert [e.action for e in played] == trace.action[:, run].tolist()
        assert [e.performance.reward for e in played] == trace.reward[:, run].tolist()
        assert [e.performance.cumulative_reward for e in played] == trace.cumulative[:, run].tolist()
