"""Tables of pyarrow: batches of rows, and files of CSV and Parquet. The memory is bounded by the batch."""

from __future__ import annotations

import datetime
import os
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from shift_schemas.timestamps import NS

from shift_recording.export.columns import Column
from shift_recording.export.tables import Row

BATCH = 20_000
"""Rows of a table that are written at once. A choice: a few megabytes."""
TYPES = {
    "text": pa.string(), "number": pa.float64(), "integer": pa.int64(), "boolean": pa.bool_(),
    "time": pa.timestamp("ns", "UTC"),
}  # fmt: skip


def iso_utc(ns: int) -> str:
    """Return a time as ISO 8601 in UTC with nanoseconds, such as ``2026-11-27T02:41:11.123456789Z``."""
    seconds = datetime.datetime.fromtimestamp(ns // NS, datetime.UTC)
    return f"{seconds:%Y-%m-%dT%H:%M:%S}.{ns % NS:09}Z"


def schema_of(columns: Iterable[Column], as_text: bool) -> pa.Schema:
    """Return the schema of a table; with ``as_text``, times are texts."""
    return pa.schema([(c.name, pa.string() if as_text and c.type == "time" else TYPES[c.type]) for c in columns])


def batch_of(rows: list[Row], columns: Iterable[Column], as_text: bool) -> pa.Table:
    """Return rows as a table of pyarrow. A row's missing values are empty."""
    columns = tuple(columns)
    data: list[list[Any]] = []
    for column in columns:
        values = [row.get(column.name) for row in rows]
        if as_text and column.type == "time":
            values = [None if ns is None else iso_utc(ns) for ns in values]
        data.append(values)
    schema = schema_of(columns, as_text)
    return pa.table([pa.array(v, type=f.type) for v, f in zip(data, schema, strict=True)], schema=schema)


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
        self._rows: dict[str, list[Row]] = {name: [] for name in tables}
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
        whole = False
        try:
            if kind is None:
                for name in self.tables:
                    self._flush(name)
                whole = True
        finally:
            self._open.close()
            for name in self.tables:
                if whole:
                    os.replace(self._part(name), self.path(name))
                else:
                    self._part(name).unlink(missing_ok=True)

    def path(self, table: str) -> Path:
        """Return the path of a table's file."""
        return self.out / f"{table}.{self.kind}"

    def add(self, table: str, row: Row) -> None:
        """Add a row."""
        rows = self._rows[table]
        rows.append(row)
        self.counts[table] += 1
        if len(rows) >= BATCH:
            self._flush(table)

    def _part(self, table: str) -> Path:
        return self.out / f".{table}.{self.kind}.part"

    def _flush(self, table: str) -> None:
        rows, self._rows[table] = self._rows[table], []
        if rows:
            self._writers[table].write_table(batch_of(rows, self.tables[table], self.kind == "csv"))
