"""A session's recording is made of its segments; its first and last policy are attached."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from shift_recorder.service.session_recording import first_and_last_policy
from shift_recording.mcap.schemas import subject_schemas
from shift_recording.segments import SegmentWriter
from shift_study.study import Study

SCHEMAS = subject_schemas(Study(study="mine"))


def segment(folder: Path, *policies: int) -> Path:
    """Write a segment with these policies, by number."""
    writer = SegmentWriter(folder, "s1", SCHEMAS)
    for n in policies:
        writer.write("policy", n, n, n, json.dumps({"n": n}).encode())
    writer.finish()
    return writer.path


def numbers(found: tuple[bytes, bytes] | None) -> list[int]:
    assert found is not None
    return [json.loads(data)["n"] for data in found]


@pytest.mark.parametrize("parts", [[[1, 2, 3]], [[1], [2, 3]], [[2, 3], [1]], [[3], [], [2, 1]]])
def test_first_and_last_policy_are_found_by_their_numbers(tmp_path: Path, parts: list[list[int]]) -> None:
    assert numbers(first_and_last_policy([segment(tmp_path, *part) for part in parts])) == [1, 3]


def test_session_without_a_policy_has_none(tmp_path: Path) -> None:
    assert first_and_last_policy([segment(tmp_path)]) is None
    assert first_and_last_policy([]) is None


def test_damaged_segment_is_passed_over(tmp_path: Path) -> None:
    damaged, whole = segment(tmp_path, 1, 9), segment(tmp_path, 1, 2)
    damaged.write_bytes(b"nothing")
    assert numbers(first_and_last_policy([damaged, whole])) == [1, 2]
