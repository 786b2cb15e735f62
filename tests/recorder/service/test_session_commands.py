"""Commands of the recorder: a start gets its study and its software, and needs room on the disk."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from shift_recorder.service import session_commands as module
from shift_recorder.service.session_commands import LEAST_FREE_BYTES, SessionCommands, software
from shift_schemas.errors import InvalidStudy, Unavailable
from shift_schemas.messages import Mark, StartSession

START = StartSession(command_id="start", session="s1", participant="P1", study="default")


def test_start_gets_its_study_and_its_software(tmp_path: Path) -> None:
    prepared = SessionCommands(tmp_path).prepare("s1", START)
    assert isinstance(prepared.study, dict)
    assert json.dumps(prepared.study)
    assert (prepared.software, prepared.revision) == software()
    assert (tmp_path / "recordings").is_dir()
    assert (tmp_path / "segments").is_dir()


def test_study_of_the_folder_is_found_by_name(tmp_path: Path) -> None:
    (tmp_path / "studies").mkdir()
    (tmp_path / "studies" / "mine.yaml").write_text("study: mine\n")
    prepared = SessionCommands(tmp_path).prepare("s1", START.model_copy(update={"study": "mine"}))
    assert prepared.study["study"] == "mine"


def test_unknown_study_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidStudy, match="there is no study of that name"):
        SessionCommands(tmp_path).prepare("s1", START.model_copy(update={"study": "nobody"}))


def test_other_command_stays_as_it_is(tmp_path: Path) -> None:
    mark = Mark(command_id="m1", session="s1", text="")
    assert SessionCommands(tmp_path).prepare("s1", mark) is mark
    assert list(tmp_path.iterdir()) == []


def test_start_without_room_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=LEAST_FREE_BYTES - 1))
    with pytest.raises(Unavailable, match="has 63 MB left; no session starts below 64 MB"):
        SessionCommands(tmp_path).prepare("s1", START)


def test_start_in_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "recordings").write_text("a file")
    with pytest.raises(Unavailable, match=r"the recorder cannot write to .*recordings: File exists"):
        SessionCommands(tmp_path).prepare("s1", START)


def test_start_in_a_read_only_folder_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module.os, "access", lambda path, mode: False)
    with pytest.raises(Unavailable, match="the folder is read-only"):
        SessionCommands(tmp_path).prepare("s1", START)


def test_revision_comes_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    software.cache_clear()
    monkeypatch.setenv("SHIFT_REVISION", "abc")
    assert software()[1] == "abc"
    software.cache_clear()
