"""Samples of gaze as columns of pyarrow, straight from the recorded JSON of many chunks at once.

A message that pyarrow cannot read as our own encoder writes it is decoded and checked as every fact is, one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.json
from shift_schemas.codec import encode
from shift_schemas.errors import DamagedRecording, MalformedMessage
from shift_schemas.messages import Gaze, Session
from shift_schemas.messages.monitor import EYE_COLUMNS
from shift_schemas.timestamps import NS

from shift_recording.export.columns import Column
from shift_recording.export.hits import HitFinder
from shift_recording.mcap.reader import RecordedMessage, fact_of

RECORDED = pa.schema([
    ("source", pa.string()), ("seq", pa.int64()), ("segment", pa.int64()), ("outcome", pa.string()),
    ("stamp", pa.struct([("sec", pa.int64()), ("nsec", pa.int64())])),
    ("t", pa.list_(pa.float64())), ("x", pa.list_(pa.float64())), ("y", pa.list_(pa.float64())),
    ("valid", pa.list_(pa.bool_())), ("aoi", pa.list_(pa.string())),
    *((name, pa.list_(pa.float64())) for name in EYE_COLUMNS),
])  # fmt: skip
"""What is read of a message."""
POINT = ("x", "y", "valid")
"""The columns of points; a chunk of gaze on AOIs has none of them."""


NEEDED = ("source", "seq", "stamp", "t")
LEAST_EYE = {name: 0.0 if name.startswith("openness") else float(np.nextafter(0.0, 1.0)) for name in EYE_COLUMNS}
"""The least value that is not lost: a closed eye has the openness 0, and no pupil has the size 0."""


class Samples(NamedTuple):
    """Rows of the table ``gaze``, and the damage behind which no row was read."""

    rows: pa.Table
    damage: DamagedRecording | None


class GazeReader:
    """Reads messages of the topic ``gaze`` as rows of the table ``gaze``, one for each sample.

    Parameters
    ----------
    columns
        The columns of the table.
    schema
        Its schema.
    text_of
        Makes texts of times in ns since the epoch; None if times stay times.
    """

    def __init__(
        self, columns: Iterable[Column], schema: pa.Schema, text_of: Callable[[pa.Array], pa.Array] | None
    ) -> None:
        self._columns, self._schema, self._text_of = tuple(columns), schema, text_of

    def read(
        self, session: Session | None, messages: Sequence[RecordedMessage], hits: HitFinder | None = None
    ) -> Samples:
        """Return the samples of messages; behind a message that is not valid, nothing is read.

        ``hits`` finds their AOIs; without it the column ``hit`` is empty.
        """
        payloads, damage = [message.data for message in messages], None
        chunks = _parsed(payloads)
        if chunks is None:
            payloads, damage = _checked(messages)
            chunks = _parsed(payloads)
            assert chunks is not None, "an encoded fact is one line of JSON"
        return Samples(self._rows(chunks, session, hits), damage)

    def _rows(self, chunks: pa.Table, session: Session | None, hits: HitFinder | None) -> pa.Table:
        counts = pc.list_value_length(chunks["t"]).to_numpy()
        chunk_of = np.repeat(np.arange(len(counts)), counts)
        stamps = chunks["stamp"].combine_chunks()
        ns = pc.add(pc.multiply(stamps.field("sec"), NS), stamps.field("nsec"))
        times = ns.cast(self._schema.field("stamp_utc").type) if self._text_of is None else self._text_of(ns)
        same = {name: chunks[name].combine_chunks() for name in ("source", "segment", "seq", "outcome")}
        same["stamp_utc"] = times
        found = {name: values.take(pa.array(chunk_of)) for name, values in same.items()}
        found |= _varying(chunks, counts, ns.to_numpy(), session)
        found["hit"] = _hits_of(chunks, counts, found, hits)
        for name in ("session", "participant", "condition"):
            value = getattr(session, name) if session is not None else None
            found[name] = pa.repeat(pa.scalar(value, pa.string()), len(chunk_of))
        return pa.table([found[c.name] for c in self._columns], schema=self._schema)


def _hits_of(chunks: pa.Table, counts: Any, found: dict[str, pa.Array], hits: HitFinder | None) -> pa.Array:
    """Return the AOI of each sample."""
    x, y = (pc.fill_null(found[name], 0.0).to_numpy() for name in ("x", "y"))
    if hits is None or len(x) == 0:
        return pa.nulls(len(x), pa.string())
    seen = found["x"].is_valid().to_numpy(zero_copy_only=False)
    sources, segments = chunks["source"].to_pylist(), chunks["segment"].to_pylist()
    indices = hits.hits(sources, segments, counts, found["t_s"].to_numpy(), x, y, seen)
    return pa.array(hits.names, pa.string()).take(pa.array(indices))


def _parsed(payloads: list[bytes]) -> pa.Table | None:
    """Return the messages as columns, one row for each; None if one of them is not as our own encoder writes it."""
    if not payloads:
        return RECORDED.empty_table()
    text = b"\n".join(payloads)
    try:
        found = pa.json.read_json(
            pa.BufferReader(text),
            read_options=pa.json.ReadOptions(use_threads=False, block_size=len(text) + 1),
            parse_options=pa.json.ParseOptions(explicit_schema=RECORDED, unexpected_field_behavior="ignore"),
        )
    except pa.ArrowInvalid:
        return None
    if found.num_rows != len(payloads):
        return None
    for name, default in (("segment", 0), ("outcome", "applied")):
        found = found.set_column(found.schema.get_field_index(name), name, pc.fill_null(found[name], default))
    return found if _is_consistent(found) else None


def _is_consistent(chunks: pa.Table) -> bool:
    """Return whether every value is there, and every chunk has either points or AOIs for all of its samples."""
    stamps = chunks["stamp"].combine_chunks()
    if any(column.null_count for column in (*map(stamps.field, ("sec", "nsec")), *(chunks[n] for n in NEEDED))):
        return False
    if any(chunks[name].combine_chunks().flatten().null_count for name in ("t", *POINT, "aoi", *EYE_COLUMNS)):
        return False
    counts, *of_point, named = (_lengths(chunks, name) for name in ("t", *POINT, "aoi"))
    for name in EYE_COLUMNS:
        if not bool(np.all((_lengths(chunks, name) == counts) | chunks[name].is_null().to_numpy())):
            return False
    on_aoi = named > 0
    points = all(bool(np.all(length == np.where(on_aoi, 0, counts))) for length in of_point)
    return points and bool(np.all(counts > 0)) and bool(np.all(named == np.where(on_aoi, counts, 0)))


def _checked(messages: Iterable[RecordedMessage]) -> tuple[list[bytes], DamagedRecording | None]:
    """Return the messages before the first that is not valid, as our own encoder writes them, and what is wrong."""
    payloads: list[bytes] = []
    for message in messages:
        try:
            fact = fact_of(Gaze.subject, message.data)
            assert isinstance(fact, Gaze)
            _check_lengths(fact)
            payloads.append(encode(fact))
        except MalformedMessage as e:
            return payloads, DamagedRecording(f"{Gaze.subject} {message.sequence}: {e.detail}")
    return payloads, None


def _check_lengths(fact: Gaze) -> None:
    lengths = {name: len(getattr(fact, name)) for name in ("t", *POINT, "aoi")}
    count = lengths.pop("t")
    for name in EYE_COLUMNS:
        if (column := getattr(fact, name)) is not None and len(column) != count:
            raise MalformedMessage(f"t has {count} entries, and {name} has {len(column)}")
    if count == 0 or lengths not in (
        {**dict.fromkeys(POINT, count), "aoi": 0},
        {**dict.fromkeys(POINT, 0), "aoi": count},
    ):
        raise MalformedMessage(f"t has {count} entries, and the others must have as many, either aoi or {POINT}")


def _varying(chunks: pa.Table, counts: Any, ns: Any, session: Session | None) -> dict[str, pa.Array]:
    """Return the columns that differ within a chunk."""
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    t = _flat(chunks, "t").to_numpy()
    named = np.repeat(pc.fill_null(pc.list_value_length(chunks["aoi"]), 0).to_numpy() > 0, counts)
    valid = _spread(_flat(chunks, "valid").to_numpy(zero_copy_only=False), ~named)
    lost = named | ~valid
    aoi = np.cumsum(named) - 1
    found = {
        "sample": pa.array(np.arange(total) - np.repeat(ends - counts, counts)), "t_s": pa.array(t),
        "valid": pa.array(valid, mask=named), "aoi": _flat(chunks, "aoi").take(pa.array(aoi, mask=~named)),
    }  # fmt: skip
    for name, least in LEAST_EYE.items():
        found[name] = _of_eye(chunks, name, counts, least)
    for name in ("x", "y"):
        found[name] = pa.array(_spread(_flat(chunks, name).to_numpy(), ~named), mask=lost)
    if session is None:
        return found | {"session_s": pa.nulls(total, pa.float64())}
    applied_s = (ns - session.started.ns) / NS
    before_s = np.repeat(t[ends - 1], counts) - t
    return found | {"session_s": pa.array(np.repeat(applied_s, counts) - before_s)}


def _of_eye(chunks: pa.Table, name: str, counts: Any, least: float) -> pa.Array:
    """Return a column of an eye; a value below ``least`` stands for a lost one."""
    said = np.repeat(~chunks[name].is_null().to_numpy(), counts)
    values = _spread(_flat(chunks, name).to_numpy(), said)
    return pa.array(values, mask=~said | (values < least))


def _lengths(chunks: pa.Table, name: str) -> Any:
    return pc.fill_null(pc.list_value_length(chunks[name]), 0).to_numpy()


def _flat(chunks: pa.Table, name: str) -> pa.Array:
    return chunks[name].combine_chunks().flatten()


def _spread(values: Any, where: Any) -> Any:
    """Return an array of the length of ``where`` that has the values at its true places."""
    if len(values) == len(where):
        return values
    found = np.zeros(len(where), values.dtype)
    found[where] = values
    return found
