"""What a session of a simulated person must come to: its decisions, its counts, its recording."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from mcap.reader import make_reader
from shift_runtime.rest_client import RestClient
from shift_schemas.registry import OWNER_OF
from shift_simulator.live import LiveEpisode, drive
from shift_simulator.session import play
from shift_simulator.users import paper_user
from shift_study.loading import study_of

from support.whole_mesh import LiveMesh

STUDY = {"study": "interactions", "interactions": 100, "decider": {"wait_s": 30}}
"""A decision waits for all that it must have seen: so that a restart changes nothing."""
USER = "A"


class Played(NamedTuple):
    """A session that has ended."""

    decisions: list[dict[str, Any]]
    rewards: list[float]
    ended: dict[str, Any]


def interact(
    mesh: LiveMesh,
    session: str,
    seed: int,
    episodes: int = 100,
    after: Callable[[int], None] = lambda n: None,
    study: dict[str, Any] = STUDY,
) -> Played:
    """Run a session of ``episodes`` interactions over REST; ``after(n)`` is called after each."""
    with RestClient(mesh.url, patience_s=60.0) as shift:
        shift.start("P00", session=session, study=study, seed=seed)
        done = []
        for n, episode in enumerate(drive(shift, session, paper_user(USER), episodes), 1):
            done.append(episode)
            after(n)
        return played(done, shift.end(session))


def played(done: Iterable[LiveEpisode], ended: dict[str, Any]) -> Played:
    episodes = list(done)
    return Played([e.decision for e in episodes], [e.performance["reward"] for e in episodes], ended)


def expected(seed: int, episodes: int = 100, study: dict[str, Any] = STUDY) -> list[dict[str, Any]]:
    """Return the decisions and rewards of the same session from the cores alone."""
    return [
        essence(e.decision.model_dump(mode="json")) | {"reward": e.performance.reward}
        for e in play(paper_user(USER), study_of(study), seed, episodes)
    ]


def essence(decision: dict[str, Any]) -> dict[str, Any]:
    """Return what two runs with the same seed have in common: all but ids, stamps and versions."""
    kept = (
        "n", "task", "strategy", "observation", "scores", "cognitive_state", "suggested", "actions",
        "probabilities", "propensity", "explored", "policy_source", "stale", "state", "seed",
    )  # fmt: skip
    return {name: decision[name] for name in kept}


def essences(done: Played) -> list[dict[str, Any]]:
    return [essence(d) | {"reward": reward} for d, reward in zip(done.decisions, done.rewards, strict=True)]


def check_recording(mesh: LiveMesh, done: Played) -> dict[str, list[dict[str, Any]]]:
    """Check with the standard reader that a recording is complete, and return its messages by topic."""
    path = mesh.data / "recordings" / done.ended["recording"]
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert digest == done.ended["sha256"]
    assert path.with_name(f"{path.name}.sha256").read_text() == f"{digest}  {path.name}\n"
    messages = read_recording(path)
    counts = {topic: len(found) for topic, found in messages.items()}
    assert counts == done.ended["counts"]
    recorded = [d["decision_id"] for d in messages["decision"]]
    assert recorded == [d["decision_id"] for d in done.decisions]
    assert Counter(p["decision_id"] for p in messages["performance"]) == Counter(recorded)
    assert Counter(t["decision_id"] for t in messages["transition"]) == Counter(recorded)
    assert [essence(d) for d in messages["decision"]] == [essence(d) for d in done.decisions]
    return messages


def read_recording(path: Path) -> dict[str, list[dict[str, Any]]]:
    """Return the messages by topic from the standard reader; check that each owner's sequences are 1, 2, 3 ..."""
    messages: dict[str, list[dict[str, Any]]] = {}
    sequences: dict[str, list[int]] = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.chunk_indexes
        for _, channel, message in reader.iter_messages():
            messages.setdefault(channel.topic, []).append(json.loads(message.data))
            sequences.setdefault(OWNER_OF[channel.topic], []).append(message.sequence)
        assert summary.statistics is not None
        assert summary.statistics.message_count == sum(map(len, messages.values()))
    for owner, found in sequences.items():
        assert found == list(range(1, len(found) + 1)), owner
    return messages
