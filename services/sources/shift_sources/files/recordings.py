"""One recording of a table that holds several: rows of two persons must never become one gaze. Pure."""

from __future__ import annotations

from collections.abc import Iterable

from shift_schemas.errors import InvalidSettings

from shift_sources.files.table import Row


class OneRecording:
    """Tells the rows of one recording of a table, see ``--recording``. A new one is needed for each reading.

    Parameters
    ----------
    columns
        The columns that may tell recordings apart; the first one that the table has is used.
    recording
        How the text in that column begins; empty: the table must hold one recording only.
    """

    def __init__(self, columns: Iterable[str], recording: str) -> None:
        self.columns, self.recording = tuple(columns), recording
        self.taken: str | None = None

    def __call__(self, row: Row) -> bool:
        """Return whether the row is of the recording. Raise :class:`InvalidSettings` if it could be of two."""
        column = next((name for name in self.columns if name in row.columns), None)
        if column is None:
            return True
        text = row.text(column)
        if not text or not text.startswith(self.recording):
            return not text and not self.recording
        if self.taken not in (None, text):
            raise InvalidSettings(
                f"{row.file} holds several recordings, the second one from line {row.line}: take one with --recording "
                f"and the beginning of its text in the column {column}"
            )
        self.taken = text
        return True
