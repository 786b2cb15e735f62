"""Many recordings: each is verified and described, and a damaged one does not stop the others."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest
from shift_verify.many import RecordingReport, report_on, report_on_many
from shift_verify.supplement import supplement

KEPT = sorted((Path(__file__).parents[1] / "data" / "v0.1").glob("*.mcap"))[:4]


@pytest.fixture(scope="module")
def reports() -> list[RecordingReport]:
    return list(report_on_many(KEPT, 1))


def test_report_says_whose_recording_it_is_and_how_good_its_gaze_is(reports: list[RecordingReport]) -> None:
    gaps = next(report for report in reports if report.verified.file == "gaps.mcap")
    assert (gaps.session, gaps.participant, gaps.format, gaps.software) == ("gaps", "P01", 1, "0.1.0")
    assert gaps.sha256 == hashlib.sha256((KEPT[0].parent / "gaps.mcap").read_bytes()).hexdigest()
    (source,) = gaps.gaze
    assert (source.samples, source.gaps, source.missing_chunks, source.late_chunks) == (210, 2, 12, 2)


def test_processes_give_what_one_process_gives(reports: list[RecordingReport]) -> None:
    assert list(report_on_many(KEPT, 2)) == reports


def test_damaged_recording_does_not_stop_the_others(tmp_path: Path) -> None:
    data = bytearray(KEPT[0].read_bytes())
    data[len(data) // 2] ^= 0x10
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(bytes(data))
    found = list(report_on_many((damaged, KEPT[0]), 1))
    assert [report.verified.ok for report in found] == [False, True]


def test_supplement_counts_and_names_every_recording(reports: list[RecordingReport]) -> None:
    wrong = replace(reports[0], verified=replace(reports[0].verified, ok=False, checksum="missing", file="x|y.mcap"))
    text = supplement([*reports, wrong], "1.2.3")
    assert "# Verification of 5 recordings" in text
    assert "by shift-mesh 1.2.3" in text
    assert "- 4 of 5 have no difference." in text
    assert "- 4 of 5 match the checksum" in text
    assert "| gaps.mcap | tx | 210 | 60 Hz | 0.0 % | - | 2 | 5.52 s | 0 | 2 / 12 | - |" in text
    assert "x\\|y.mcap" in text
    assert all(report.sha256 in text for report in reports)


def test_supplement_of_one_recording_without_gaze(tmp_path: Path) -> None:
    report = report_on(next(path for path in KEPT if path.name == "discount.mcap"))
    text = supplement([report], "1.2.3")
    assert "# Verification of 1 recording\n" in text
    assert "## Gaze" not in text
