"""The tables of a recording as pandas frames."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from shift_schemas.errors import InvalidSettings

from shift_recording.export.export import EXTRA
from shift_recording.export.sources import open_sources
from shift_recording.export.tables import table_columns

if TYPE_CHECKING:
    import pandas as pd


class Frames(Mapping[str, "pd.DataFrame"]):
    """The tables of one or more recordings, each as a pandas frame, by name and as an attribute."""

    def __init__(self, frames: Mapping[str, pd.DataFrame]) -> None:
        self._frames = dict(frames)

    def __getitem__(self, table: str) -> pd.DataFrame:
        """Return a table."""
        return self._frames[table]

    def __getattr__(self, table: str) -> pd.DataFrame:
        """Return a table."""
        try:
            return self._frames[table]
        except KeyError:
            raise AttributeError(f"there is no table {table!r}; there are {', '.join(self._frames)}") from None

    def __iter__(self):  # type: ignore[no-untyped-def]
        """Iterate over the names of the tables."""
        return iter(self._frames)

    def __len__(self) -> int:
        """Return the number of tables."""
        return len(self._frames)


def frames(*recordings: str | Path, covariates: str | Path | None = None) -> Frames:
    """Return the tables of recordings, which can be files and folders.

    ``frames("s1.mcap").decisions`` has one row for each decision. Times are pandas timestamps in UTC.

    Raises
    ------
    InvalidSettings
        pyarrow or pandas is missing.
    UnknownThing, MalformedMessage
        A file does not exist, or the covariates are not valid.
    DamagedRecording
        A recording is damaged.
    """
    try:
        import pandas  # noqa: F401
        import pyarrow as pa

        from shift_recording.export.arrow_tables import batches, schema_of
    except ImportError as e:
        raise InvalidSettings(EXTRA) from e
    sources = open_sources(map(Path, recordings), Path(covariates) if covariates is not None else None, True)
    tables = table_columns(sources.names, sources.covariate_names)
    found: dict[str, list[pa.Table]] = {name: [schema_of(c, False).empty_table()] for name, c in tables.items()}
    for recording in sources.recordings():
        for batch in batches(recording, tables, False):
            found[batch.table].append(batch.rows)
    sources.report.raise_damage()
    return Frames({table: pa.concat_tables(rows).to_pandas() for table, rows in found.items()})
