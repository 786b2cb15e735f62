"""The journal's schema: its version, and the migrations that bring an older journal to it.

To change the schema, append a migration; never change one that was released. All migrations that a journal lacks run in
one transaction, so that a crash leaves the old version whole.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from shift_schemas.errors import InvalidSettings
from shift_schemas.shards import Shard, every_shard

Migration = Callable[[sqlite3.Connection], None]

APPLICATION_ID = 0x53484654
"""``SHFT``, in the field of an SQLite file that names its application. The journals of shift-mesh 0.1 and 0.2 have 0
there, and their ``user_version`` counts how often a full disk was tried: it says nothing about their schema."""

_TABLES = """
CREATE TABLE IF NOT EXISTS outbox (
    session TEXT, seq INTEGER, subject TEXT, payload TEXT, PRIMARY KEY (session, seq)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS cursor (
    session TEXT, owner TEXT, seq INTEGER, PRIMARY KEY (session, owner)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS state (session TEXT PRIMARY KEY, data TEXT, closed INTEGER DEFAULT 0) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS answer (
    session TEXT, procedure TEXT, command_id TEXT, content TEXT, result TEXT,
    PRIMARY KEY (session, procedure, command_id)) WITHOUT ROWID;
"""


class NewerJournal(InvalidSettings):
    """A journal of a newer shift-mesh, which this one cannot read."""

    title = "The data folder is of a newer version"


def _create_tables(db: sqlite3.Connection) -> None:
    """Create the tables of a new journal; those of shift-mesh 0.1 and 0.2 have them."""
    for table in _TABLES.split(";"):  # not executescript, which commits
        db.execute(table)


def _rename_digest(db: sqlite3.Connection) -> None:
    """Rename the column in which shift-mesh 0.1 kept a digest of a command; 0.2 keeps the command's content there."""
    if any(column[1] == "digest" for column in db.execute("PRAGMA table_info(answer)")):
        db.execute("ALTER TABLE answer RENAME COLUMN digest TO content")


def _create_place(db: sqlite3.Connection) -> None:
    """Create the table that tells a copied file from one in its old place; shift-mesh 0.1 lacks it."""
    db.execute("CREATE TABLE IF NOT EXISTS place (one INTEGER PRIMARY KEY, file TEXT)")


def _create_part(db: sqlite3.Connection) -> None:
    """Create the table of the parts of states that most commits do not change."""
    db.execute("CREATE TABLE part (session TEXT, name TEXT, data TEXT, PRIMARY KEY (session, name)) WITHOUT ROWID")


MIGRATIONS: tuple[Migration, ...] = (_create_tables, _rename_digest, _create_place, _create_part)
"""The n-th migration, from 1, brings a journal from version n - 1 to n. A new file has version 0, as those of 0.1 and
0.2 have."""


def schema_version(db: sqlite3.Connection) -> int:
    """Return the schema version of a journal; 0 for a new one and for those of shift-mesh 0.1 and 0.2."""
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    return int(version) if application == APPLICATION_ID else 0


def migrate(db: sqlite3.Connection, path: Path, migrations: tuple[Migration, ...] = MIGRATIONS) -> None:
    """Bring a journal to the newest schema, or leave it as it was.

    Raises
    ------
    NewerJournal
        A newer shift-mesh wrote it.
    sqlite3.Error
        It cannot be read or written.
    """
    _check_version(db, path, len(migrations))
    if schema_version(db) == len(migrations):
        return
    with transaction(db):
        for migration in migrations[schema_version(db) :]:
            migration(db)
        db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        db.execute(f"PRAGMA user_version = {len(migrations)}")


def check_journals(data: Path) -> None:
    """Check the journals of a data folder before any service is started, so that the user is told once.

    A journal that cannot be read is left to its service, which says why.

    Raises
    ------
    NewerJournal
        A newer shift-mesh wrote one of them.
    """
    for path in sorted((data / "state").rglob("*.sqlite")):
        try:
            with closing(sqlite3.connect(f"file:{path.absolute()}?mode=rw", uri=True)) as db:
                _check_version(db, path, len(MIGRATIONS))
        except sqlite3.Error:
            continue


def check_no_live_sessions(state: Path, service: str, shard: Shard) -> None:
    """Check that no session is live in this service's journals of another number of shards: it would be lost from view.

    Raises
    ------
    InvalidSettings
        There is such a session.
    """
    own = {state / other.name / f"{service}.sqlite" for other in every_shard(shard.count)}
    for path in sorted({state / f"{service}.sqlite", *state.glob(f"shard-*/{service}.sqlite")} - own):
        live = _live_sessions(path)
        if live:
            count = re.fullmatch(r"shard-\d+-of-(\d+)", path.parent.name)
            workers = int(count[1]) if count else 1
            raise InvalidSettings(
                f"the data folder {state.parent} has a live session of a mesh with {workers} shard"
                f"{'s' if workers > 1 else ''}: {live[0]}; a session stays in its shard, so start the mesh with "
                f"{workers} again (--workers {workers}) and end it, or use another data folder"
            )


def _live_sessions(path: Path) -> list[str]:
    if not path.exists():
        return []
    try:
        with closing(sqlite3.connect(f"file:{path.absolute()}?mode=rw", uri=True)) as db:
            return [session for (session,) in db.execute("SELECT session FROM state WHERE closed = 0 LIMIT 1")]
    except sqlite3.Error:  # its service says why when it opens the journal
        return []


def _check_version(db: sqlite3.Connection, path: Path, known: int) -> None:
    found = schema_version(db)
    if found > known:
        raise NewerJournal(
            f"the data folder {path.parent.parent} was written by a newer shift-mesh: its journal {path.name} has "
            f"schema version {found}, and this shift-mesh reads versions up to {known}; start the newer shift-mesh, or "
            "use another data folder (--data or SHIFT_DATA)"
        )


@contextmanager
def transaction(db: sqlite3.Connection) -> Iterator[None]:
    """Commit what the block writes, or nothing of it if it raises."""
    db.execute("BEGIN IMMEDIATE")
    try:
        yield
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise
