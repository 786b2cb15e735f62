"""The journal: everything of a commit or nothing, pages of the outbox, reopening, kill -9, a full disk."""

from __future__ import annotations

import os
import resource
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from shift_runtime.journal import LOG_PAGES, PAGE_BYTES, Batch, Journal, StoredAnswer, digest_of, same_content
from shift_schemas.errors import InvalidSettings, Unavailable
from shift_schemas.messages import OutboxPage, OutboxQuery, OutboxRow
from support.runtime_fixtures import row

START = ("s1", "start_session", "start")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "state" / "monitor.sqlite"


def opened(path: Path) -> Journal:
    return Journal(path, "monitor")


def filled(path: Path, **rows: int) -> Journal:
    """A journal with that many facts in each session."""
    journal = opened(path)
    for session, count in rows.items():
        journal.commit(
            Batch(states={session: f"state of {session}"}, rows=[row(n, session) for n in range(1, count + 1)])
        )
    return journal


def seen(page: OutboxPage) -> list[tuple[str, int]]:
    return [(r.session, r.seq) for r in page.rows]


# --- a commit ---


def test_what_a_commit_held_is_there_after_reopening(path: Path) -> None:
    journal = opened(path)
    answer = StoredAnswer('{"task":"one"}', '{"session": "s1"}')
    journal.commit(
        Batch({"s1": "state"}, {("s1", "decider"): 7}, [row(1), row(2)], {START: answer}, {"s1"}),
    )
    for there in (journal, opened(path)):
        assert there.state("s1") == "state"
        assert list(there.sessions()) == [("s1", True)]
        assert there.closed("s1")
        assert there.heads == {"s1": 2}
        assert there.answer(START) == answer
        assert there.answer(("s1", "start_session", "other")) is None


def test_the_log_has_its_full_length_from_the_start_and_the_file_stays_small(path: Path) -> None:
    journal = filled(path, s1=1)
    assert path.with_name(f"{path.name}-wal").stat().st_size >= LOG_PAGES * PAGE_BYTES
    journal.close()
    assert path.stat().st_size < 20 * PAGE_BYTES


def test_cursors_of_closed_sessions_are_forgotten(path: Path) -> None:
    journal = opened(path)
    journal.commit(Batch(states={"s1": "", "s2": ""}, cursors={("s1", "decider"): 7, ("s2", "decider"): 3}))
    assert journal.cursors() == {("s1", "decider"): 7, ("s2", "decider"): 3}
    journal.commit(Batch(closed={"s1"}))
    assert journal.cursors() == opened(path).cursors() == {("s2", "decider"): 3}


def test_a_commit_that_breaks_in_its_middle_leaves_nothing_behind(path: Path) -> None:
    journal = filled(path, s1=2)
    answer = StoredAnswer('{"task":"one"}', "{}")
    with pytest.raises(Unavailable, match=r"the monitor cannot write its journal monitor\.sqlite"):
        journal.commit(Batch({"s1": "later"}, {("s1", "decider"): 9}, [row(3), row(2)], {START: answer}, {"s1"}))
    for there in (journal, opened(path)):
        assert there.state("s1") == "state of s1"
        assert there.cursors() == {}
        assert there.heads == {"s1": 2}
        assert there.answer(START) is None
        assert not there.closed("s1")
    journal.commit(Batch(rows=[row(3)]))
    assert opened(path).heads == {"s1": 3}


def test_the_first_answer_of_a_command_stays(path: Path) -> None:
    journal = opened(path)
    journal.commit(Batch(answers={START: StoredAnswer("first", '{"n":1}')}))
    with pytest.raises(Unavailable):
        journal.commit(Batch(answers={START: StoredAnswer("second", '{"n":2}')}))
    assert journal.answer(START) == StoredAnswer("first", '{"n":1}')


def test_the_same_fields_in_another_order_are_the_same_content() -> None:
    assert same_content('{"study": {"a": 1, "b": [2.0]}}', '{"study": {"b": [2], "a": 1}}')
    assert not same_content('{"study": {"a": 1}}', '{"study": {"a": true}}')
    assert not same_content('{"study": {"a": 1}}', '{"study": {}}')


def test_digest_of_a_content_is_the_same_content() -> None:
    assert same_content(digest_of('{"seed":7}'), '{"seed":7}')
    assert not same_content(digest_of('{"seed":7}'), '{"seed":8}')


def test_an_answer_that_is_a_fact_is_kept_once(path: Path) -> None:
    journal = opened(path)
    fact = row(2).model_copy(update={"payload": '{"n":2,"reason":"told once"}'})
    answer = StoredAnswer("{}", fact.payload, seq=2)
    journal.commit(Batch(rows=[row(1), fact], answers={START: answer}))
    for there in (journal, opened(path)):
        assert there.answer(START) == answer
    (text,) = sqlite3.connect(path).execute("SELECT result FROM answer").fetchone()
    assert text == "2"


def test_an_empty_batch_is_false_and_any_content_makes_it_true() -> None:
    assert not Batch()
    assert Batch(states={"s1": ""})
    assert Batch(cursors={("s1", "monitor"): 1})
    assert Batch(rows=[row(1)])
    assert Batch(answers={START: StoredAnswer("", "{}")})
    assert Batch(closed={"s1"})


def test_a_folder_that_cannot_be_one_is_a_mistake_in_the_settings(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidSettings, match="SHIFT_DATA"):
        opened(tmp_path / "file" / "monitor.sqlite")


def test_a_file_that_is_no_journal_is_a_mistake_in_the_settings(tmp_path: Path) -> None:
    (tmp_path / "monitor.sqlite").write_bytes(b"something else entirely" * 100)
    with pytest.raises(InvalidSettings, match="cannot be opened"):
        opened(tmp_path / "monitor.sqlite")


# --- the outbox ---


def test_a_page_holds_what_comes_after_the_cursors_oldest_first(path: Path) -> None:
    journal = filled(path, s1=3, s2=2)
    page = journal.page(OutboxQuery(cursors={"s1": 1}), {})
    assert seen(page) == [("s1", 2), ("s1", 3), ("s2", 1), ("s2", 2)]
    assert page.rows[0] == row(2)
    assert page.heads == {"s1": 3, "s2": 2}
    assert page.complete
    assert page.owner == "monitor"


@pytest.mark.parametrize("limit", [1, 2, 3, 5, 6, 100])
def test_pages_of_any_size_give_every_row_once_and_end(path: Path, limit: int) -> None:
    journal = filled(path, s1=3, s2=3)
    found: list[tuple[str, int]] = []
    cursors: dict[str, int] = {}
    for _ in range(20):
        page = journal.page(OutboxQuery(cursors=cursors, limit=limit), {})
        assert len(page.rows) <= limit
        found += seen(page)
        cursors |= dict(seen(page))
        if page.complete:
            break
    assert page.complete
    assert found == [(s, n) for s in ("s1", "s2") for n in (1, 2, 3)]


def test_a_page_of_named_sessions_holds_only_these_and_says_how_far_the_owner_has_read(path: Path) -> None:
    journal = filled(path, s1=2, s2=2)
    processed = {("s1", "decider"): 4, ("s2", "decider"): 5, ("s2", "learner"): 6}
    page = journal.page(OutboxQuery(only=["s2", "unheard-of"]), processed)
    assert seen(page) == [("s2", 1), ("s2", 2)]
    assert page.heads == {"s2": 2, "unheard-of": 0}
    assert page.cursors == {"s2": {"decider": 5, "learner": 6}, "unheard-of": {}}


def test_an_ended_session_is_told_of_only_by_name_or_to_who_has_begun_it_or_asks_for_all(path: Path) -> None:
    journal = filled(path, s1=2, s2=1)
    journal.commit(Batch(closed={"s1"}))
    for there in (journal, opened(path)):
        assert seen(there.page(OutboxQuery(), {})) == [("s2", 1)]
        assert seen(there.page(OutboxQuery(cursors={"s1": 1}), {})) == [("s1", 2), ("s2", 1)]
        assert seen(there.page(OutboxQuery(only=["s1"]), {})) == [("s1", 1), ("s1", 2)]
        assert seen(there.page(OutboxQuery(closed=True), {})) == [("s1", 1), ("s1", 2), ("s2", 1)]


# --- kill -9 ---

COMMITTING = """
import sys
sys.path[:0] = {path!r}
from pathlib import Path
from support.runtime_fixtures import row
from shift_runtime.journal import Batch, Journal, StoredAnswer
journal = Journal(Path(sys.argv[1]), "monitor")
n = journal.heads.get("s1", 0)
while True:
    rows = [row(n + i) for i in (1, 2, 3)]
    n += 3
    answer = {{("s1", "mark", f"m{{n}}"): StoredAnswer("", "{{}}")}}
    journal.commit(Batch({{"s1": str(n)}}, {{("s1", "decider"): n}}, rows, answer))
    sys.stdout.write(f"{{n}}\\n")
    sys.stdout.flush()
"""


def test_kill_9_in_the_middle_of_commits_leaves_1_to_n_and_all_that_was_acknowledged(path: Path) -> None:
    program = COMMITTING.format(path=[p for p in sys.path if p.endswith("/tests")])
    for life in range(6):
        worker = subprocess.Popen([sys.executable, "-c", program, str(path)], stdout=subprocess.PIPE, text=True)
        assert worker.stdout is not None
        for _ in range(20 + 7 * life):
            acknowledged = int(worker.stdout.readline())
        worker.send_signal(signal.SIGKILL)
        rest = worker.stdout.read().split("\n")
        worker.wait()
        worker.stdout.close()
        acknowledged = max([acknowledged, *map(int, filter(None, rest[:-1]))])
        journal = opened(path)
        head = journal.heads["s1"]
        rows = journal.page(OutboxQuery(limit=10_000), {}).rows
        assert [r.seq for r in rows] == list(range(1, head + 1))
        assert head >= acknowledged
        assert head % 3 == 0
        assert journal.state("s1") == str(head)
        assert journal.cursors() == {("s1", "decider"): head}
        assert journal.answer(("s1", "mark", f"m{head}")) is not None
        assert journal.answer(("s1", "mark", f"m{head + 3}")) is None
        journal.close()


# --- a full disk ---


@contextmanager
def files_up_to(size: int) -> Iterator[None]:
    """No file of this process may grow beyond ``size`` bytes, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def committed_until_full(journal: Journal) -> int:
    for n in range(1, 2000):
        try:
            journal.commit(Batch(states={"s1": str(n)}, rows=[row(n, text="x" * 2000)]))
        except Unavailable:
            return n - 1
    raise AssertionError("the disk was never full")


def checked_until_full(journal: Journal) -> None:
    for _ in range(100):
        journal.check()


def test_a_full_disk_refuses_whole_commits_and_what_was_committed_stays_readable(path: Path) -> None:
    journal = opened(path)
    with files_up_to(300_000):
        last = committed_until_full(journal)
        assert last > 10
        for _ in range(3):
            with pytest.raises(Unavailable, match="cannot write its journal"):
                journal.commit(Batch(states={"s1": "no"}, rows=[row(last + 1, text="x" * 2000)]))
        assert journal.state("s1") == str(last)
        assert [r.seq for r in journal.page(OutboxQuery(limit=10_000), {}).rows] == list(range(1, last + 1))
    journal.commit(Batch(states={"s1": str(last + 1)}, rows=[row(last + 1)]))
    again = opened(path)
    assert again.heads == {"s1": last + 1}
    assert again.state("s1") == str(last + 1)


def test_the_disk_s_room_is_tried_by_a_write_that_changes_nothing(path: Path) -> None:
    journal = opened(path)
    with files_up_to(300_000):
        last = committed_until_full(journal)
        with pytest.raises(Unavailable):
            checked_until_full(journal)
    journal.check()
    assert journal.heads == {"s1": last}
    assert journal.state("s1") == str(last)


@pytest.mark.skipif(os.geteuid() != 0, reason="mounts a small file system")
def test_a_disk_of_two_megabytes_that_fills_up_and_is_freed_again(tmp_path: Path) -> None:
    small = tmp_path / "small"
    small.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", small], capture_output=True).returncode:
        pytest.skip("no mounts here")
    try:
        (small / "ballast").write_bytes(bytes(900_000))
        journal = opened(small / "monitor.sqlite")
        last = committed_until_full(journal)
        assert [r.seq for r in journal.page(OutboxQuery(limit=10_000), {}).rows] == list(range(1, last + 1))
        (small / "ballast").unlink()
        journal.commit(Batch(states={"s1": str(last + 1)}, rows=[row(last + 1)]))
        journal.close()
        assert opened(small / "monitor.sqlite").heads == {"s1": last + 1}
    finally:
        subprocess.run(["umount", "--lazy", small], check=True)


def test_the_file_is_durable_at_each_commit(path: Path) -> None:
    opened(path)
    reading = sqlite3.connect(path)
    assert reading.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    assert opened(path)._db.execute("PRAGMA synchronous").fetchone() == (2,)
    reading.close()


def test_facts_are_found_by_their_fields_through_an_index(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "monitor.sqlite", "monitor", {"gaze": ("source", "seq")})
    payloads = [f'{{"source":"{source}","seq":{n}}}' for n in (0, 1, 0, 2**53) for source in "ab"]
    rows = [OutboxRow(session="s1", seq=n, subject="gaze", payload=p) for n, p in enumerate(payloads, start=1)]
    journal.commit(Batch(states={"s1": "{}"}, rows=rows))
    found = {(s, n): journal.recorded("s1", "gaze", {"source": s, "seq": n}) for s in "ab" for n in (0, 1, 2, 2**53)}
    assert found == {(s, n): [p for p in payloads if p == f'{{"source":"{s}","seq":{n}}}'] for s, n in found}
    assert journal.recorded("s2", "gaze", {"source": "a", "seq": 0}) == []
    plan = sqlite3.connect(tmp_path / "monitor.sqlite").execute(
        "EXPLAIN QUERY PLAN SELECT seq FROM outbox INDEXED BY outbox_gaze WHERE session = 's1' AND subject = 'gaze'"
        " AND json_extract(payload, '$.source') = 'a' AND json_extract(payload, '$.seq') = 1"
    )
    assert "outbox_gaze" in str(plan.fetchall())


def test_a_damaged_journal_is_refused_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "monitor.sqlite"
    journal = Journal(path, "monitor")
    rows = [OutboxRow(session="s1", seq=n, subject="gaze", payload="x" * 900) for n in range(1, 200)]
    journal.commit(Batch(states={"s1": "{}"}, rows=rows))
    journal.close()
    whole = path.read_bytes()
    for start in (0, 4096, len(whole) // 2):
        copy = tmp_path / f"copy-{start}" / path.name
        copy.parent.mkdir()
        copy.write_bytes(whole[:start] + bytes(4096 * 4) + whole[start + 4096 * 4 :])
        with pytest.raises(InvalidSettings, match="copied while a mesh used it"):
            Journal(copy, "monitor")
