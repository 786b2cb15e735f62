"""Files that are on the disk when they say so, and errors that say what the disk said.

No file here has a buffer of its own: after a full disk there is nothing left behind that a later
``close`` would try to write once more.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

from shift_schemas.errors import Unavailable


class StorageFailed(Unavailable):
    """The disk refused: full, read-only, over a limit or broken. Travels as ``unavailable`` (503)."""

    title: ClassVar[str] = "The recording cannot be written"


@contextlib.contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Translates an ``OSError`` about ``path`` into :class:`StorageFailed`."""
    try:
        yield
    except OSError as e:
        raise StorageFailed(f"{path} cannot be written: {e.strerror or e}") from e


class DurableFile:
    """A file written from front to end; what was synced stays, what failed is cut off again.

    Has the ``write``, ``tell`` and ``flush`` that an MCAP writer asks for.

    Raises
    ------
    StorageFailed
        From every method, where the disk refuses.
    """

    def __init__(self, path: Path, *, new: bool) -> None:
        """Opens ``path``: with ``new`` it must not be there yet (else ``FileExistsError``)."""
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
        """Writes all of ``data``."""
        rest = memoryview(data)
        with storage_errors(self.path):
            while rest:
                n = os.write(self._fd, rest)
                self._written += n
                rest = rest[n:]
        return len(data)

    def tell(self) -> int:
        """Bytes written so far."""
        return self._written

    def flush(self) -> None:
        """Nothing: there is no buffer. :meth:`sync` is what lasts."""

    def sync(self) -> None:
        """Returns when all that was written is on the disk."""
        if self._synced != self._written:
            with storage_errors(self.path):
                os.fsync(self._fd)
            self._synced = self._written

    def cut_back(self) -> None:
        """Cuts off what came after the last sync; as far as the disk still lets us."""
        with contextlib.suppress(OSError):
            os.ftruncate(self._fd, self._synced)
            os.lseek(self._fd, self._synced, os.SEEK_SET)
        self._written = self._synced

    def close(self) -> None:
        """Closes it; a second time does nothing."""
        fd, self._fd = self._fd, -1
        if fd >= 0:
            with storage_errors(self.path):
                os.close(fd)


def make_folder(folder: Path) -> None:
    """Makes ``folder`` with its parents, each entered durably in the one above."""
    missing = [f for f in (folder, *folder.parents) if not f.exists()]
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for made in missing:
        sync_folder(made.parent)


def sync_folder(folder: Path) -> None:
    """Returns when the entries of ``folder`` (files made, renamed, removed) are on the disk."""
    with storage_errors(folder):
        fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)


def replace(temporary: Path, target: Path) -> None:
    """Puts ``temporary``, already synced, in the place of ``target``, at once and for good."""
    with storage_errors(target):
        os.replace(temporary, target)
    sync_folder(target.parent)


def write_durably(target: Path, data: bytes) -> None:
    """Write a whole file: after this it has ``data``, also after a crash; before, it is as it was.

    Raises
    ------
    StorageFailed
        The disk refuses.
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
