"""The journal: one SQLite file in which a service commits everything at once.

State, cursors of the inputs, outgoing facts (numbered 1, 2, 3 ... per session) and the answers of commands are written
in one transaction, before anything is published or replied. So a service may die at any moment: once a request is
answered, its data survives, and each input is applied once.
"""

from __future__ import annotations

import hashlib
import os
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from shift_schemas.conflicts import differences
from shift_schemas.errors import InvalidSettings, Unavailable
from shift_schemas.messages import OutboxPage, OutboxQuery, OutboxRow

from shift_runtime.claim import mesh_id
from shift_runtime.journal_schema import migrate, schema_version, transaction

LOG_PAGES, PAGE_BYTES = 1000, 4096
"""SQLite's defaults: after so many pages in the log, a checkpoint runs and the log is overwritten from its start."""
AnswerKey = tuple[str, str, str]
"""A session, a procedure and a command id."""


@dataclass(frozen=True)
class StoredAnswer:
    """The content of the first command with its id, and its result."""

    content: str
    """The command's content as JSON. A journal of version 0.1.0 has :func:`digest_of` it instead."""
    result: str
    """The result as JSON."""
    seq: int = 0
    """The number of the fact that is the result, which is not stored twice; 0 if the result is not a fact."""


@dataclass
class Batch:
    """The content of one commit."""

    states: dict[str, str] = field(default_factory=dict)
    cursors: dict[tuple[str, str], int] = field(default_factory=dict)
    rows: list[OutboxRow] = field(default_factory=list)
    answers: dict[AnswerKey, StoredAnswer] = field(default_factory=dict)
    closed: set[str] = field(default_factory=set)
    parts: dict[tuple[str, str], str | None] = field(default_factory=dict)
    """By session and name, the parts of states that changed; None for a part that is gone."""

    def __bool__(self) -> bool:
        return bool(self.states or self.cursors or self.rows or self.answers or self.closed)


def digest_of(content: str) -> str:
    """Return the digest of a command's content that a journal of version 0.1.0 stored."""
    return hashlib.sha256(content.encode()).hexdigest()[:32]


def _index(subject: str, fields: tuple[str, ...]) -> str:
    """Return the statement for a subject's index. Names come from the code, never from a message."""
    columns = "".join(f", json_extract(payload, '$.{name}')" for name in fields)
    return f"CREATE INDEX IF NOT EXISTS outbox_{subject} ON outbox (session{columns}) WHERE subject = '{subject}'"


def same_content(before: str, now: str) -> bool:
    """Return whether two contents of a command are equal; ``before`` may be a digest."""
    if before == now or before == digest_of(now):
        return True
    return before.startswith("{") and not differences(before, now)


class Journal:
    """The journal of one service. It must be used from one thread."""

    def __init__(
        self,
        path: Path,
        owner: str,
        lookups: Mapping[str, tuple[str, ...]] | None = None,
        data: Path | None = None,
    ) -> None:
        """Open the file, or create it; bring an older one to the current schema.

        Parameters
        ----------
        data
            The data folder of the mesh; left out, the folder above that of the file.
        lookups
            By subject, the fields by which :meth:`recorded` finds its facts. Each has an index, which is
            derived from the facts and thus not part of the schema's version.

        Raises
        ------
        InvalidSettings
            The folder cannot be written, or the file is damaged.
        NewerJournal
            A newer shift-mesh wrote the file.
        """
        self.owner = owner
        self.path = path
        self.data = data if data is not None else path.parent.parent
        self._lookups = lookups or {}
        self._open(path)
        self._closed = {s for (s,) in self._db.execute("SELECT session FROM state WHERE closed = 1")}
        self._answered: dict[str, set[tuple[str, str]]] = {}
        """Procedures and ids of the commands that were carried out, by session; read when first needed."""

    def _open(self, path: Path) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self.mesh = mesh_id(self.data / "state" if self.data != path.parent.parent else path.parent)
            self._db = sqlite3.connect(path, isolation_level=None, timeout=5.0)
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=FULL")
            migrate(self._db, path)
            self._check_copy()
            self.heads = self._heads()
            for subject, fields in self._lookups.items():
                self._db.execute(_index(subject, fields))
            self._grow_log()
        except (sqlite3.Error, OSError) as e:
            what = (
                "it is damaged, perhaps because its data folder was copied while a mesh used it; copy it again"
                if isinstance(e, sqlite3.DatabaseError) and not isinstance(e, sqlite3.OperationalError)
                else "set SHIFT_DATA to a folder for it"
            )
            raise InvalidSettings(f"the journal {path} cannot be opened: {e}; {what}") from e

    def _heads(self) -> dict[str, int]:
        """Return each session's last number. One look-up per session avoids reading all rows of a long study."""
        return dict(
            self._db.execute(
                "SELECT session, (SELECT MAX(seq) FROM outbox WHERE outbox.session = state.session) AS head"
                " FROM state WHERE head IS NOT NULL"
            )
        )

    def _check_copy(self) -> None:
        """Check a file that is a copy, once: a file that was copied while it was written can be damaged.

        Measured: 0.13 s for 94 MB. A file in its old place needs no check, because SQLite's log protects it.
        """
        found = os.stat(self.path)
        place = f"{found.st_dev}:{found.st_ino}"
        if self._db.execute("SELECT file FROM place").fetchone() == (place,):
            return
        (said,) = self._db.execute("PRAGMA quick_check(1)").fetchone()
        if said != "ok":
            raise InvalidSettings(
                f"the journal {self.path} is damaged ({said}): its data folder was copied while a mesh used it, or "
                "the disk is faulty; stop the mesh and copy the folder again, or go on with the original"
            )
        self._db.execute("INSERT OR REPLACE INTO place VALUES (1, ?)", (place,))

    def _grow_log(self) -> None:
        """Give the write-ahead log its full length now: a commit that overwrites syncs faster than one that appends.

        Measured: 330 us per commit, 420 us without. The full length is SQLite's limit before a checkpoint. The pages of
        a transaction that is rolled back fill the log and have no effect.
        """
        try:
            self._db.execute("PRAGMA cache_size = 10")
            self._db.execute("BEGIN IMMEDIATE")
            self._db.execute("CREATE TABLE room (data BLOB)")
            self._db.execute("INSERT INTO room VALUES (zeroblob(?))", (LOG_PAGES * PAGE_BYTES,))
            with open(f"{self.path}-wal", "rb") as log:
                os.fsync(log.fileno())
        except (sqlite3.Error, OSError):  # no room for it: then the log grows with each commit
            pass
        finally:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            self._db.execute("PRAGMA cache_size = -2000")

    # --- reading back ---

    def state(self, session: str) -> str | None:
        """Return the last committed state of a session, or None."""
        row = self._db.execute("SELECT data FROM state WHERE session = ?", (session,)).fetchone()
        return row[0] if row and row[0] is not None else None

    def parts(self, session: str) -> dict[str, str]:
        """Return the parts of a session's state that are kept apart, by name."""
        return dict(self._db.execute("SELECT name, data FROM part WHERE session = ?", (session,)))

    def sessions(self) -> Iterator[tuple[str, bool]]:
        """Yield every session that has a state, and whether it is closed."""
        yield from ((s, bool(c)) for s, c in self._db.execute("SELECT session, closed FROM state").fetchall())

    def cursors(self) -> dict[tuple[str, str], int]:
        """Return the last sequence number read by session and owner, of the open sessions."""
        rows = self._db.execute("SELECT session, owner, seq FROM cursor").fetchall()
        return {(s, o): n for s, o, n in rows if s not in self._closed}

    def answer(self, key: AnswerKey) -> StoredAnswer | None:
        """Return the first result of a command, or None if it was not carried out."""
        if key[1:] not in self._commands(key[0]):
            return None
        content, text = self._db.execute(
            "SELECT content, result FROM answer WHERE session = ? AND procedure = ? AND command_id = ?", key
        ).fetchone()
        if not text.isdigit():
            return StoredAnswer(content, text)
        (payload,) = self._db.execute(
            "SELECT payload FROM outbox WHERE session = ? AND seq = ?", (key[0], int(text))
        ).fetchone()
        return StoredAnswer(content, payload, int(text))

    def _commands(self, session: str) -> set[tuple[str, str]]:
        if session not in self._answered:
            rows = self._db.execute("SELECT procedure, command_id FROM answer WHERE session = ?", (session,))
            self._answered[session] = set(rows)
        return self._answered[session]

    def closed(self, session: str) -> bool:
        """Return whether the session has ended and its recording is finished."""
        return session in self._closed

    def recorded(self, session: str, subject: str, fields: Mapping[str, str | int]) -> list[str]:
        """Return the session's own facts of a subject whose fields have these values, as JSON, oldest first.

        ``fields`` are those of the subject's look-up, in its order.
        """
        where = "".join(f" AND json_extract(payload, '$.{name}') = ?" for name in fields)
        index = f"INDEXED BY outbox_{subject}" if subject in self._lookups else ""  # else by session only
        rows = self._db.execute(
            f"SELECT seq, payload FROM outbox {index} WHERE session = ? AND subject = '{subject}'{where}",
            (session, *fields.values()),
        )
        return [payload for _, payload in sorted(rows)]

    # --- writing ---

    def commit(self, batch: Batch) -> None:
        """Commit the whole batch or nothing.

        Raises
        ------
        Unavailable
            The disk is full or broken; nothing of the batch was committed.
        """
        with self._transaction():
            self._write(batch)
        for row in batch.rows:
            self.heads[row.session] = row.seq
        for session, procedure, command_id in batch.answers:
            self._commands(session).add((procedure, command_id))
        self._closed |= batch.closed
        for session in batch.closed:
            self._answered.pop(session, None)

    def check(self) -> None:
        """Check that the disk takes commits, with a write that changes nothing.

        Raises
        ------
        Unavailable
            It takes none.
        """
        with self._transaction():
            self._db.execute(f"PRAGMA user_version = {schema_version(self._db)}")  # SQLite writes it though it is equal

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        try:
            with transaction(self._db):
                yield
        except sqlite3.Error as e:
            raise Unavailable(f"the {self.owner} cannot write its journal {self.path.name}: {e}") from e

    def _write(self, batch: Batch) -> None:
        rows: dict[str, list[tuple[str | int, ...]]] = {
            "INSERT INTO state (session, data) VALUES (?, ?) ON CONFLICT DO UPDATE SET data = excluded.data": [
                *batch.states.items()
            ],
            "DELETE FROM part WHERE session = ? AND name = ?": [
                key for key, text in batch.parts.items() if text is None
            ],
            "INSERT OR REPLACE INTO part VALUES (?, ?, ?)": [
                (*key, text) for key, text in batch.parts.items() if text is not None
            ],
            "INSERT OR REPLACE INTO cursor VALUES (?, ?, ?)": [(*key, n) for key, n in batch.cursors.items()],
            "INSERT INTO outbox VALUES (?, ?, ?, ?)": [(r.session, r.seq, r.subject, r.payload) for r in batch.rows],
            "INSERT INTO answer VALUES (?, ?, ?, ?, ?)": [
                (*key, a.content, str(a.seq or a.result)) for key, a in batch.answers.items()
            ],
            "UPDATE state SET closed = 1 WHERE session = ?": [(s,) for s in batch.closed],
        }
        for statement, values in rows.items():
            if values:
                self._db.executemany(statement, values)

    # --- the outbox ---

    def page(self, query: OutboxQuery, cursors: dict[tuple[str, str], int]) -> OutboxPage:
        """Return what a reader has not read, oldest first per session, at most ``query.limit`` rows.

        Closed sessions are included only by name, with ``query.closed``, or for a reader that has begun them.
        """
        rows: list[OutboxRow] = []
        sessions = self._asked(query)
        for session in sessions:
            after = query.cursors.get(session, 0)
            if self.heads.get(session, 0) <= after:
                continue
            found = self._db.execute(
                "SELECT seq, subject, payload FROM outbox WHERE session = ? AND seq > ? ORDER BY seq LIMIT ?",
                (session, after, query.limit - len(rows)),
            )
            rows += [OutboxRow(session=session, seq=n, subject=s, payload=p) for n, s, p in found]
            if len(rows) >= query.limit:
                break
        return OutboxPage(
            owner=self.owner,
            rows=rows,
            heads={s: self.heads.get(s, 0) for s in sessions},
            cursors={s: {o: n for (of, o), n in cursors.items() if of == s} for s in query.only or ()},
            complete=len(rows) < query.limit,
        )

    def _asked(self, query: OutboxQuery) -> list[str]:
        if query.only is not None:
            return list(query.only)
        return [s for s in self.heads if query.closed or s not in self._closed or query.cursors.get(s)]

    def close(self) -> None:
        """Close the file."""
        self._db.close()
