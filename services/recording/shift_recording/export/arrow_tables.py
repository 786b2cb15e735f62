"""Tables of pyarrow: batches of rows, and files of CSV and Parquet. The memory is bounded by the batch."""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from shift_recording.export.columns import Column
from shift_recording.export.tables import GazeChunkRow, Row

BATCH = 20_000
"""Rows of a table that are written at once. A choice: a few megabytes."""
TYPES = {
    "text": pa.string(), "number": pa.float64(), "integer": pa.int64(), "boolean": pa.bool_(),
    "time": pa.timestamp("ns", "UTC"),
}  # fmt: skip


def iso_utc(ns: Sequence[int]) -> list[str]:
    """Return times as ISO 8601 in UTC with nanoseconds, such as ``2026-11-27T02:41:11.123456789Z``."""
    texts = np.datetime_as_string(np.asarray(ns, dtype="datetime64[ns]"), unit="ns")
    return [f"{text}Z" for text in texts.tolist()]


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
        texts = iter(iso_utc([ns for ns in values if ns is not None]))
        values = [None if ns is None else next(texts) for ns in values]
    return pa.array(values, type=kind)


class GazeRows:
    """Chunks of gaze that become one batch of rows, one for each sample.

    Only flat lists of numbers and texts are kept: objects that stay alive make Python's garbage collection slow.
    """

    def __init__(self, columns: tuple[Column, ...], as_text: bool) -> None:
        self._columns = columns
        self._as_text = as_text
        self._same: dict[str, list[Any]] = {}
        """One value for each chunk."""
        self._each: dict[str, list[Any]] = {name: [] for name in ("t_s", "x", "y", "valid", "aoi")}
        """One value for each sample."""
        self._counts: list[int] = []
        self._ends: list[float] = []
        self._named: list[bool] = []
        self.samples = 0

    def add(self, chunk: GazeChunkRow) -> None:
        """Add a chunk."""
        fact, count = chunk.fact, len(chunk.fact.t)
        for name, value in chunk.same.items():
            self._same.setdefault(name, []).append(value)
        each = self._each
        each["t_s"].extend(fact.t)
        each["x"].extend(fact.x or fact.t)
        each["y"].extend(fact.y or fact.t)
        each["valid"].extend(fact.valid or [False] * count)
        each["aoi"].extend(fact.aoi or [None] * count)
        self._counts.append(count)
        self._ends.append(np.nan if chunk.session_s is None else chunk.session_s)
        self._named.append(bool(fact.aoi))
        self.samples += count

    def table(self) -> pa.Table:
        """Return the rows as a table of pyarrow."""
        schema = schema_of(self._columns, self._as_text)
        chunk_of = pa.array(np.repeat(np.arange(len(self._counts)), self._counts))
        each = self._varying()
        arrays = []
        for column, field in zip(self._columns, schema, strict=True):
            if column.name in each:
                arrays.append(each[column.name].cast(field.type))
            else:
                same = self._same.get(column.name, [None] * len(self._counts))
                arrays.append(_array(same, column, field.type, self._as_text).take(chunk_of))
        return pa.table(arrays, schema=schema)

    def _varying(self) -> dict[str, pa.Array]:
        """Return the columns that differ within a chunk."""
        counts = np.array(self._counts)
        ends = np.cumsum(counts)
        t = np.array(self._each["t_s"], dtype=float)
        last = np.repeat(t[ends - 1], counts)
        end, named = np.repeat(self._ends, counts), np.repeat(self._named, counts)
        valid = np.array(self._each["valid"], dtype=bool)
        lost = named | ~valid
        return {
            "sample": pa.array(np.arange(self.samples) - np.repeat(ends - counts, counts)),
            "t_s": pa.array(t), "session_s": pa.array(end - (last - t), mask=np.isnan(end)),
            "x": pa.array(np.array(self._each["x"], dtype=float), mask=lost),
            "y": pa.array(np.array(self._each["y"], dtype=float), mask=lost),
            "valid": pa.array(valid, mask=named), "aoi": pa.array(self._each["aoi"], type=pa.string()),
        }  # fmt: skip


class TableFiles:
    """One file for each table, written batch by batch; each appears under its name when it is finished.

    Parameters
    ----------
    kind
        ``csv`` or ``parquet``.
    """

    def __init__(self, out: Path, kind: str, tables: Mapping[str, tuple[Column, ...]]) -> None:
        self.out, self.kind, self.tables = out, kind, tables
        self.counts = dict.fromkeys(tables, 0)
        self._writers: dict[str, Any] = {}
        self._open = ExitStack()

    def __enter__(self) -> TableFiles:
        """Open the files under temporary names."""
        for name, columns in self.tables.items():
            schema, part = schema_of(columns, self.kind == "csv"), str(self._part(name))
            writer: Any = (
                pa.csv.CSVWriter(part, schema) if self.kind == "csv"
                else pa.parquet.ParquetWriter(part, schema, compression="zstd")
            )  # fmt: skip
            self._writers[name] = self._open.enter_context(writer)
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        """Finish the files and give them their names; after an error, remove them."""
        self._open.close()
        for name in self.tables:
            if kind is None:
                os.replace(self._part(name), self.path(name))
            else:
                self._part(name).unlink(missing_ok=True)

    def path(self, table: str) -> Path:
        """Return the path of a table's file."""
        return self.out / f"{table}.{self.kind}"

    def add(self, batch: Batch) -> None:
        """Write a batch."""
        self.counts[batch.table] += batch.rows.num_rows
        self._writers[batch.table].write_table(batch.rows)

    def _part(self, table: str) -> Path:
        return self.out / f".{table}.{self.kind}.part"


class Batch(NamedTuple):
    """Rows of one table."""

    table: str
    rows: pa.Table


def batches(
    rows: Iterable[tuple[str, Row]], tables: Mapping[str, tuple[Column, ...]], as_text: bool
) -> Iterator[Batch]:
    """Yield the rows of one recording in batches of about :data:`BATCH` rows; gaze is given by chunk."""
    waiting: dict[str, list[Row]] = {name: [] for name in tables}
    gaze = GazeRows(tables["gaze"], as_text)
    for table, row in rows:
        if table == "gaze":
            gaze.add(row["chunk"])
            if gaze.samples >= BATCH:
                yield Batch("gaze", gaze.table())
                gaze = GazeRows(tables["gaze"], as_text)
            continue
        waiting[table].append(row)
        if len(waiting[table]) >= BATCH:
            yield Batch(table, batch_of(waiting[table], tables[table], as_text))
            waiting[table] = []
    if gaze.samples:
        yield Batch("gaze", gaze.table())
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
