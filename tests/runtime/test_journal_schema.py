"""The journal's schema: old journals are migrated as a whole, and newer ones are refused."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from shift_runtime.journal import Batch, Journal, digest_of, same_content
from shift_runtime.journal_schema import MIGRATIONS, NewerJournal, check_journals, migrate, schema_version
from shift_schemas.errors import InvalidSettings
from support.runtime_fixtures import row

VERSION = len(MIGRATIONS)
START = ("s1", "start_session", "start")
CONTENT = '{"seed":7}'
OLD_TABLES = """
CREATE TABLE outbox (session TEXT, seq INTEGER, subject TEXT, payload TEXT, PRIMARY KEY (session, seq)) WITHOUT ROWID;
CREATE TABLE cursor (session TEXT, owner TEXT, seq INTEGER, PRIMARY KEY (session, owner)) WITHOUT ROWID;
CREATE TABLE state (session TEXT PRIMARY KEY, data TEXT, closed INTEGER DEFAULT 0) WITHOUT ROWID;
CREATE TABLE answer (session TEXT, procedure TEXT, command_id TEXT, digest TEXT, result TEXT,
    PRIMARY KEY (session, procedure, command_id)) WITHOUT ROWID;
"""
"""The tables of shift-mesh 0.1.0, whose journals are in tests/data/v0.1."""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "data" / "state").mkdir(parents=True)
    return tmp_path / "data" / "state" / "monitor.sqlite"


def make_old(path: Path, tried_disk: int = 0) -> None:
    """Write a journal as shift-mesh 0.1.0 did; it counted in ``user_version`` how often it tried a full disk."""
    with closing(sqlite3.connect(path)) as db:
        db.executescript(OLD_TABLES)
        db.execute("INSERT INTO outbox VALUES ('s1', 1, 'marker', ?)", (row(1).payload,))
        db.execute("INSERT INTO cursor VALUES ('s1', 'decider', 4)")
        db.execute("INSERT INTO state VALUES ('s1', 'state of s1', 0)")
        db.execute("INSERT INTO answer VALUES (?, ?, ?, ?, ?)", (*START, digest_of(CONTENT), '{"n":1}'))
        db.execute(f"PRAGMA user_version = {tried_disk}")
        db.commit()


def make_newer(path: Path, version: int) -> None:
    Journal(path, "monitor").close()
    with closing(sqlite3.connect(path)) as db:
        db.execute(f"PRAGMA user_version = {version}")


def version_of(path: Path) -> int:
    with closing(sqlite3.connect(path)) as db:
        return schema_version(db)


def columns_of_answers(path: Path) -> list[str]:
    with closing(sqlite3.connect(path)) as db:
        return [column[1] for column in db.execute("PRAGMA table_info(answer)")]


def test_new_journal_has_the_newest_version(path: Path) -> None:
    Journal(path, "monitor").close()
    assert version_of(path) == VERSION


@pytest.mark.parametrize("tried_disk", [0, 1, VERSION, VERSION + 1, 2**31 - 1])
def test_journal_of_version_0_1_is_migrated_and_keeps_its_content(path: Path, tried_disk: int) -> None:
    make_old(path, tried_disk)
    assert version_of(path) == 0
    for _ in range(2):
        journal = Journal(path, "monitor")
        assert version_of(path) == VERSION
        assert journal.heads == {"s1": 1}
        assert journal.state("s1") == "state of s1"
        assert journal.cursors() == {("s1", "decider"): 4}
        stored = journal.answer(START)
        assert stored is not None
        assert same_content(stored.content, CONTENT)
        journal.close()


def test_migrated_journal_has_the_schema_of_a_new_one(tmp_path: Path, path: Path) -> None:
    make_old(path)
    new = tmp_path / "new" / "state" / "monitor.sqlite"
    schemas = []
    for each in (path, new):
        Journal(each, "monitor").close()
        with closing(sqlite3.connect(each)) as db:
            tables = [name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY 1")]
            schemas.append({name: db.execute(f"PRAGMA table_info({name})").fetchall() for name in tables})
    assert schemas[0] == schemas[1]
    assert set(schemas[0]) == {"outbox", "cursor", "state", "answer", "place", "part"}


@pytest.mark.parametrize("done", range(VERSION + 1))
def test_only_missing_migrations_run(path: Path, done: int) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        migrate(db, path, MIGRATIONS[:done])
        assert schema_version(db) == done
        ran: list[int] = []
        migrate(db, path, tuple(lambda _, n=n: ran.append(n) for n in range(VERSION)))
        assert ran == list(range(done, VERSION))
        assert schema_version(db) == VERSION


def test_trying_the_disk_keeps_the_version(path: Path) -> None:
    journal = Journal(path, "monitor")
    for _ in range(3):
        journal.check()
    assert version_of(path) == VERSION


# --- a newer journal ---


def test_newer_journal_is_refused_with_folder_versions_and_remedy(path: Path) -> None:
    make_newer(path, VERSION + 4)
    before = path.read_bytes()
    for refused in (lambda: Journal(path, "monitor"), lambda: check_journals(path.parent.parent)):
        with pytest.raises(NewerJournal) as found:
            refused()
        assert isinstance(found.value, InvalidSettings), "its exit code is that of other wrong data folders"
        assert found.value.detail == (
            f"the data folder {path.parent.parent} was written by a newer shift-mesh: its journal monitor.sqlite has "
            f"schema version {VERSION + 4}, and this shift-mesh reads versions up to {VERSION}; start the newer "
            "shift-mesh, or use another data folder (--data or SHIFT_DATA)"
        )
    assert path.read_bytes() == before


def test_newer_journal_that_was_not_closed_is_refused(path: Path) -> None:
    """Its version stands in the write-ahead log only."""
    journal = Journal(path, "monitor")
    journal._db.execute(f"PRAGMA user_version = {VERSION + 1}")
    with pytest.raises(NewerJournal):
        check_journals(path.parent.parent)
    journal.close()


def test_folder_without_newer_journals_passes(path: Path) -> None:
    check_journals(path.parent.parent / "not-there")
    make_old(path, tried_disk=99)
    Journal(path.with_name("decider.sqlite"), "decider").close()
    path.with_name("learner.sqlite").write_bytes(b"something else" * 100)
    check_journals(path.parent.parent)
    assert version_of(path) == 0, "a check migrates nothing"


# --- a migration that does not come to its end ---


def test_migration_that_fails_leaves_the_old_version(path: Path) -> None:
    make_old(path)

    def fail(db: sqlite3.Connection) -> None:
        db.execute("DELETE FROM outbox")
        raise sqlite3.OperationalError("database or disk is full")

    with (
        closing(sqlite3.connect(path, isolation_level=None)) as db,
        pytest.raises(sqlite3.OperationalError, match="full"),
    ):
        migrate(db, path, (*MIGRATIONS, fail))
    assert version_of(path) == 0
    assert "digest" in columns_of_answers(path)
    assert Journal(path, "monitor").heads == {"s1": 1}


DYING = """
import os, signal, sys
from pathlib import Path
from shift_runtime import journal, journal_schema
from shift_runtime.journal import Journal
def die(db):
    db.execute("DELETE FROM outbox")
    db.execute("PRAGMA user_version = 77")
    os.kill(os.getpid(), signal.SIGKILL)
migrations = (*journal_schema.MIGRATIONS, die)
journal.migrate = lambda db, path: journal_schema.migrate(db, path, migrations)
Journal(Path(sys.argv[1]), "monitor")
"""


def test_crash_in_the_middle_of_a_migration_leaves_the_old_version(path: Path) -> None:
    make_old(path)
    process = subprocess.run([sys.executable, "-c", DYING, str(path)], capture_output=True, text=True)
    assert process.returncode == -signal.SIGKILL, process.stderr
    assert version_of(path) == 0
    assert "digest" in columns_of_answers(path)
    journal = Journal(path, "monitor")
    assert version_of(path) == VERSION
    journal.commit(Batch(rows=[row(2)]))
    assert journal.heads == {"s1": 2}


def test_journal_that_another_process_locks_is_refused_unchanged(path: Path) -> None:
    make_old(path)
    with closing(sqlite3.connect(path, isolation_level=None)) as locked:
        locked.execute("PRAGMA journal_mode=WAL")
        locked.execute("BEGIN IMMEDIATE")
        with pytest.raises(InvalidSettings, match=r"monitor\.sqlite cannot be opened: database is locked"):
            Journal(path, "monitor")
        locked.execute("ROLLBACK")
    assert version_of(path) == 0
