"""The checksum file: what sha256sum writes is taken, whatever differs is named."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from shift_recording.checksum import Checksum, check, checksum_path, sha256_of, write_checksum
from shift_schemas.errors import DamagedRecording, UnknownThing


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Return a file with a checksum."""
    path = tmp_path / "s1.mcap"
    path.write_bytes(b"gaze" * 1000)
    return path


def test_a_recording_matches_its_checksum(recording: Path) -> None:
    assert write_checksum(recording, sha256_of(recording)) == checksum_path(recording)
    assert check(recording) is Checksum.MATCHES


def test_a_missing_checksum_is_no_damage(recording: Path) -> None:
    assert check(recording) is Checksum.MISSING


def test_damage_names_the_file_and_both_checksums(recording: Path) -> None:
    expected = sha256_of(recording)
    write_checksum(recording, expected)
    recording.write_bytes(b"gaze" * 999 + b"gazf")
    with pytest.raises(DamagedRecording) as raised:
        check(recording)
    assert all(part in str(raised.value) for part in ("s1.mcap", expected, sha256_of(recording)))


@pytest.mark.parametrize("text", ["", "nonsense", "abc  s1.mcap\n", "0" * 64])
def test_a_checksum_file_that_is_none_is_named(recording: Path, text: str) -> None:
    checksum_path(recording).write_text(text)
    with pytest.raises(DamagedRecording, match=r"s1\.mcap\.sha256"):
        check(recording)


def test_a_recording_that_is_not_there_is_unknown(tmp_path: Path) -> None:
    with pytest.raises(UnknownThing):
        check(tmp_path / "s9.mcap")


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="needs sha256sum")
def test_sha256sum_agrees_in_both_directions(recording: Path) -> None:
    write_checksum(recording, sha256_of(recording))
    subprocess.run(["sha256sum", "-c", "--strict", "s1.mcap.sha256"], cwd=recording.parent, check=True)
    said = subprocess.run(["sha256sum", "-b", "s1.mcap"], cwd=recording.parent, check=True, capture_output=True)
    checksum_path(recording).write_bytes(said.stdout)
    assert check(recording) is Checksum.MATCHES
