"""Tables of pyarrow: batches of rows, and files of CSV and Parquet. The memory is bounded by the batch."""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet

from shift_recording.export.columns import Column
from shift_recording.export.gaze_samples import GazeReader
from shift_recording.export.sources import OneRecording
from shift_recording.export.tables import Row

BATCH = 20_000
"""Rows of a table that are written at once. A choice: a few megabytes."""
TYPES = {
    "text": pa.string(), "number": pa.float64(), "integer": pa.int64(), "boolean": pa.bool_(),
    "time": pa.timestamp("ns", "UTC"),
}  # fmt: skip


def iso_utc(ns: pa.Array) -> pa.Array:
    """Return times in ns as ISO 8601 in UTC with nanoseconds, such as ``2026-11-27T02:41:11.123456789Z``."""
    texts = ns.cast(TYPES["time"]).cast(pa.string())  # a space stands between date and time
    return pc.replace_substring(texts, " ", "T", max_replacements=1)


def schema_of(columns: Iterable[Column], as_text: bool) -> pa.Schema:
    """Return the schema of a table; with ``as_text``, times are texts."""
    return pa.schema([(c.name, pa.string() if as_text and c.type == "time" else TYPES[c.type]) for c in columns])


def batch_of(rows: list[Row], columns: Iterable[Column], as_text: bool) -> pa.Table:
    """Return rows as a table of pyarrow. A row's missing values are empty."""
    columns = tuple(columns)
    schema = schema_of(columns, as_text)
    arrays = [
        _array([row.get(c.name) for row in rows], c, f.type, as_text) for c, f in zip(columns, schema, strict=True)
    ]
    return pa.table(arrays, schema=schema)


def _array(values: list[Any], column: Column, kind: pa.DataType, as_text: bool) -> pa.Array:
    if as_text and column.type == "time":
        return iso_utc(pa.array(values, type=pa.int64()))
    return pa.array(values, type=kind)


def _repeated(columns: Iterable[Column]) -> list[str]:
    """Return the columns whose values repeat, for which Parquet's dictionaries pay; measured numbers do not."""
    return [column.name for column in columns if column.type in ("text", "integer")]


class TableFiles:
    """One file for each table, written batch by batch; each appears under its name when it is finished.

    Parameters
    ----------
    kind
        ``csv`` or ``parquet``.
    """

    def __init__(self, out: Path, kind: str, tables: Mapping[str, tuple[Column, ...]]) -> None:
        self.out, self.kind, self.tables = out, kind, tables
        self.as_text = kind == "csv"
        """Whether times are written as texts."""
        self.counts = dict.fromkeys(tables, 0)
        self._writers: dict[str, Any] = {}
        self._open = ExitStack()
        self._thread = ThreadPoolExecutor(1, "table-files")
        """Writes a batch while the next one is read: pyarrow lets Python go on meanwhile."""
        self._writing: Future[None] | None = None

    def __enter__(self) -> TableFiles:
        """Open the files under temporary names."""
        for name, columns in self.tables.items():
            schema, part = schema_of(columns, self.as_text), str(self._part(name))
            writer: Any = (
                pa.csv.CSVWriter(part, schema) if self.kind == "csv"
                else pa.parquet.ParquetWriter(part, schema, compression="zstd", use_dictionary=_repeated(columns))
            )  # fmt: skip
            self._writers[name] = self._open.enter_context(writer)
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        """Finish the files and give them their names; after an error, remove them."""
        try:
            self._wait()
        except BaseException:
            kind = True
            raise
        finally:
            self._thread.shutdown()
            self._open.close()
            for name in self.tables:
                if kind is None:
                    os.replace(self._part(name), self.path(name))
                else:
                    self._part(name).unlink(missing_ok=True)

    def path(self, table: str) -> Path:
        """Return the path of a table's file."""
        return self.out / f"{table}.{self.kind}"

    def write(self, found: Iterable[Batch]) -> None:
        """Write batches as they come."""
        for batch in found:
            self.counts[batch.table] += batch.rows.num_rows
            self._wait()
            self._writing = self._thread.submit(self._writers[batch.table].write_table, batch.rows)

    def _wait(self) -> None:
        """Wait for the batch that is being written. Raise what went wrong with it."""
        writing, self._writing = self._writing, None
        if writing is not None:
            writing.result()

    def _part(self, table: str) -> Path:
        return self.out / f".{table}.{self.kind}.part"


class Batch(NamedTuple):
    """Rows of one table."""

    table: str
    rows: pa.Table


def gaze_reader(columns: Iterable[Column], as_text: bool) -> GazeReader:
    """Return what reads gaze as rows with these columns; with ``as_text``, times are texts."""
    columns = tuple(columns)
    return GazeReader(columns, schema_of(columns, as_text), iso_utc if as_text else None)


def batches(recording: OneRecording, tables: Mapping[str, tuple[Column, ...]], as_text: bool) -> Iterator[Batch]:
    """Yield the rows of one recording in batches of about :data:`BATCH` rows."""
    waiting: dict[str, list[Row]] = {name: [] for name in tables}
    for table, row in recording.rows_of(gaze_reader(tables["gaze"], as_text)):
        if isinstance(row, pa.Table):
            yield Batch(table, row)
            continue
        waiting[table].append(row)
        if len(waiting[table]) >= BATCH:
            yield Batch(table, batch_of(waiting[table], tables[table], as_text))
            waiting[table] = []
    for table, rest in waiting.items():
        if rest:
            yield Batch(table, batch_of(rest, tables[table], as_text))


def store(found: Iterable[Batch], path: Path) -> None:
    """Write batches to a temporary file, from which :func:`stored` reads them."""
    with open(path, "wb") as file:
        for batch in found:
            with pa.BufferOutputStream() as sink:
                with pa.ipc.new_stream(sink, batch.rows.schema) as writer:
                    writer.write_table(batch.rows)
                pickle.dump((batch.table, sink.getvalue().to_pybytes()), file)


def stored(path: Path) -> Iterator[Batch]:
    """Yield the batches of a file that :func:`store` wrote."""
    with open(path, "rb") as file:
        while True:
            try:
                table, data = pickle.load(file)
            except EOFError:
                return
            yield Batch(table, pa.ipc.open_stream(data).read_all())
