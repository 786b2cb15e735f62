"""Durable files: data is on the disk when ``sync`` returns, and errors repeat what the operating system reported.

The files have no buffer of their own, so after a full disk no data is left that a later ``close`` would
try to write again.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

from shift_schemas.errors import Unavailable


class StorageFailed(Unavailable):
    """The disk is full, read-only, over a limit or broken. The error code is ``unavailable`` (503)."""

    title: ClassVar[str] = "The recording cannot be written"


@contextlib.contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Translate an ``OSError`` about ``path`` into :class:`StorageFailed`."""
    try:
        yield
    except OSError as e:
        raise StorageFailed(f"{path} cannot be written: {e.strerror or e}") from e


class DurableFile:
    """A file that is only appended to. Synced data stays; data after a failed write is cut off again.

    It has the ``write``, ``tell`` and ``flush`` that an MCAP writer needs.

    Raises
    ------
    StorageFailed
        From every method, if the disk refuses a write.
    """

    def __init__(self, path: Path, *, new: bool) -> None:
        """Open ``path``; with ``new`` the file must not exist yet (else ``FileExistsError``)."""
        self.path = path
        self._written = 0
        self._synced = 0
        flags = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | (os.O_EXCL if new else os.O_TRUNC)
        try:
            self._fd = os.open(path, flags, 0o644)
        except FileExistsError:
            raise
        except OSError as e:
            raise StorageFailed(f"{path} cannot be made: {e.strerror or e}") from e

    def write(self, data: bytes) -> int:
        """Write all of ``data``."""
        rest = memoryview(data)
        with storage_errors(self.path):
            while rest:
                n = os.write(self._fd, rest)
                self._written += n
                rest = rest[n:]
        return len(data)

    def tell(self) -> int:
        """Return the number of bytes written so far."""
        return self._written

    def flush(self) -> None:
        """Do nothing, since there is no buffer. Use :meth:`sync` for durability."""

    def sync(self) -> None:
        """Sync everything that was written to the disk."""
        if self._synced != self._written:
            with storage_errors(self.path):
                os.fsync(self._fd)
            self._synced = self._written

    def cut_back(self) -> None:
        """Cut off what was written after the last sync, if the disk allows it."""
        with contextlib.suppress(OSError):
            os.ftruncate(self._fd, self._synced)
            os.lseek(self._fd, self._synced, os.SEEK_SET)
        self._written = self._synced

    def close(self) -> None:
        """Close the file; a second call has no effect."""
        fd, self._fd = self._fd, -1
        if fd >= 0:
            with storage_errors(self.path):
                os.close(fd)


def make_folder(folder: Path) -> None:
    """Make ``folder`` and its parents; each entry in the parent folder is synced."""
    missing = [f for f in (folder, *folder.parents) if not f.exists()]
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for made in missing:
        sync_folder(made.parent)


def sync_folder(folder: Path) -> None:
    """Sync the entries of ``folder`` (files made, renamed, removed) to the disk."""
    with storage_errors(folder):
        fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)


def replace(temporary: Path, target: Path) -> None:
    """Replace ``target`` by ``temporary``, which is synced already, atomically and durably."""
    with storage_errors(target):
        os.replace(temporary, target)
    sync_folder(target.parent)


def write_durably(target: Path, data: bytes) -> None:
    """Write a whole file atomically: after a crash it has either its old content or ``data``.

    Raises
    ------
    StorageFailed
        The disk refuses the write; the old content stays.
    """
    make_folder(target.parent)
    temporary = target.with_name(f".{target.name}.partial")
    file = DurableFile(temporary, new=False)
    try:
        file.write(data)
        file.sync()
    finally:
        file.close()
    replace(temporary, target)
