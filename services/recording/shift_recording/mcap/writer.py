"""Write MCAP: one ``json`` channel per subject, zstd chunks, and every checksum.

The profile is empty, the library is ``shift-mesh/x.y`` and schema ids are not zero. :class:`RecordingWriter` writes
segments and finished files; its callers decide when a chunk ends and what the file is called.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from mcap.writer import CompressionType, Writer
from shift_schemas.errors import MalformedMessage, TooLarge, shorten
from shift_schemas.registry import SUBJECTS

from shift_recording.durable_file import DurableFile
from shift_recording.mcap.records import MAXIMUM_BYTES, MAXIMUM_SMALL_BYTES, Attachment
from shift_recording.mcap.schemas import schema_name

MAXIMUM_PAYLOAD = 8 * 2**20
"""Bytes of one message. The gateway accepts 256 KB, and a chunk must stay below the limit of the reader."""

SESSION_METADATA = "shift:session"
CONFIG_METADATA = "shift:config"


def library() -> str:
    """Return the name and the version of this program, such as ``shift-mesh/0.2.0``."""
    try:
        return f"shift-mesh/{version('shift-mesh')}"
    except PackageNotFoundError:
        return "shift-mesh/unknown"


class RecordingWriter:
    """Writes one MCAP file from its beginning to its end. Use it from one thread at a time.

    Parameters
    ----------
    file
        The file to write to; the caller syncs and closes it.
    schemas
        The schema of each subject, from :func:`shift_recording.mcap.schemas.subject_schemas`.
    chunk_bytes
        A chunk ends when its uncompressed size is larger than this.
    """

    def __init__(self, file: DurableFile, schemas: Mapping[str, bytes], chunk_bytes: int) -> None:
        self._writer: Any = Writer(  # Any: half of mcap's methods have no types
            file,  # type: ignore[arg-type]  # it uses write, tell and flush only
            chunk_size=chunk_bytes,
            compression=CompressionType.ZSTD,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        self._writer.start(profile="", library=library())
        self._channels = {subject: self._channel(subject, schemas[subject]) for subject in SUBJECTS}

    def _channel(self, subject: str, schema: bytes) -> int:
        schema_id = self._writer.register_schema(schema_name(subject), "jsonschema", schema)
        channel: int = self._writer.register_channel(subject, "json", schema_id)
        return channel

    def message(self, subject: str, sequence: int, log_time: int, publish_time: int, data: bytes) -> None:
        """Write one message. ``sequence`` is its owner's number and is kept modulo 2^32; times are in ns.

        Everything is checked first, because a number that does not fit would leave half a record in the chunk.

        Raises
        ------
        MalformedMessage
            The subject is unknown, the sequence is negative, or a time is not an unsigned 64 bit number.
        TooLarge
            The payload is larger than ``MAXIMUM_PAYLOAD``.
        """
        channel = self._channels.get(subject)
        if channel is None:
            raise MalformedMessage(f"{shorten(subject)!r} is none of {', '.join(self._channels)}")
        if sequence < 0 or not (0 <= log_time < 2**64 and 0 <= publish_time < 2**64):
            raise MalformedMessage(f"{subject} {sequence}: sequence and times must be 0 or more")
        _readable(f"{subject} {sequence}", len(data), MAXIMUM_PAYLOAD)
        self._writer.add_message(
            channel, log_time=log_time, data=data, publish_time=publish_time, sequence=sequence & 0xFFFFFFFF
        )

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record. Raises :class:`TooLarge` above the limit of the reader."""
        size = sum(len(f"{key}{value}".encode()) + 8 for key, value in values.items()) + len(name) + 8
        _readable(f"metadata {name}", size, MAXIMUM_SMALL_BYTES)
        self._writer.add_metadata(name, dict(values))

    def attachment(self, a: Attachment) -> None:
        """Write an attachment. Raises :class:`TooLarge` above the limit of the reader."""
        _readable(f"attachment {a.name}", len(a.data) + 1024, MAXIMUM_BYTES)
        self._writer.add_attachment(a.log_time, a.log_time, a.name, a.media_type, a.data)

    def close_chunk(self) -> None:
        """Write the open chunk if it has messages; until then it is in memory only."""
        self._writer.flush()

    def finish(self) -> None:
        """Write the last chunk, the indexes, the statistics and the footer."""
        self._writer.finish()


def _readable(what: str, size: int, most: int) -> None:
    if size > most:
        raise TooLarge(f"{what} has {size} bytes; at most {most} are recorded")
