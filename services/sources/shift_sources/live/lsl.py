"""Lab Streaming Layer: finds streams, and reads gaze, AOI names and markers from them. ``pylsl`` is imported late."""

from __future__ import annotations

import ctypes
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import structlog
from shift_schemas.errors import InvalidSettings, UnknownThing

from shift_sources.files.options import ScreenSize
from shift_sources.files.samples import Sample, named_sample
from shift_sources.live.feed import Batch
from shift_sources.live.lsl_streams import Channel, GazeMapping, Stream, mapping_of

log = structlog.get_logger()
INSTALL = "Lab Streaming Layer needs pylsl: pip install 'shift-mesh[lsl]'"
WAIT_S = 0.02
"""How long a reading waits for its first sample, s."""
BUFFER_S = 360
"""What the inlet keeps while nobody reads, s."""
MOST_SAMPLES = 4096
CORRECT_EVERY_S = 2.0
"""How often the offset of the clocks is asked for; liblsl measures it about as often in the background."""
SAY_AGAIN_S = 0.25
"""How often the last AOI name is said again, since a name counts for a second at most."""
FIND_S = 1.0


@dataclass(frozen=True)
class LslOptions:
    """What is read."""

    name: str = ""
    """The name of the gaze stream; empty: the only gaze stream there is."""
    type: str = ""
    markers: str = ""
    """The name of a stream of markers that are recorded as markers."""
    aoi_stream: str = ""
    """The name of a stream of markers whose texts are AOI names."""
    aoi: bool = False
    """Whether AOI names are taken from the stream's channel ObjectId."""
    aoi_map: tuple[tuple[str, str], ...] = ()
    """What the stream calls an AOI, and the name of the study's; an empty name is no AOI."""
    screen: ScreenSize | None = None
    unit: str = ""
    origin: str = ""


CONFIGURATIONS = ("lsl_api.cfg", "~/lsl_api/lsl_api.cfg", "/etc/lsl_api/lsl_api.cfg")
"""Where liblsl looks for its configuration, after the file that LSLAPICFG names."""
WARNINGS_ONLY = "[log]\nlevel = -1\n"


@cache
def load() -> Any:
    """Return the module ``pylsl``. Raise :class:`InvalidSettings` if it is not installed or has no library.

    Without a configuration of one's own, liblsl says warnings and errors only.
    """
    try:
        import pylsl
    except (ImportError, RuntimeError) as e:
        raise InvalidSettings(f"{INSTALL} ({e})") from e
    if "LSLAPICFG" not in os.environ and not any(Path(name).expanduser().is_file() for name in CONFIGURATIONS):
        pylsl.set_config_content(WARNINGS_ONLY)
    return pylsl


def found_streams(wait_s: float = FIND_S) -> list[Stream]:
    """Return the streams there are, without their channels' descriptions."""
    return [_stream_of(info) for info in load().resolve_streams(wait_s)]


class LslFeed:
    """Reads one gaze stream, and the streams of markers that belong to it.

    A stream that is lost is looked for again by its name and type, until it is there.

    Raises
    ------
    UnknownThing
        There is no such stream, or there are several.
    InvalidSettings
        ``pylsl`` is missing, or the stream does not say what it must.
    """

    def __init__(self, options: LslOptions, find_s: float = 5.0) -> None:
        self._pylsl, self._options = load(), options
        self.reconnects = -1
        self._inlet: Any = None
        self._gaze: Stream | None = None
        self._lost = False
        self._mapping: GazeMapping | None = None
        self._names = dict(options.aoi_map)
        wanted = [name for name in (options.markers, options.aoi_stream) if name]
        self._texts = {name: _TextStream(self._pylsl, name) for name in dict.fromkeys(wanted)}
        self._aoi, self._aoi_said = "", 0.0
        if not options.aoi_stream:
            self._connect(_one_of(self._find(find_s), options))
        self._clock = _ClockOffset(self._pylsl)

    @property
    def about(self) -> str:
        """The stream, in a few words."""
        return f"stream {self._gaze.line}" if self._gaze else f"AOI names of stream {self._options.aoi_stream!r}"

    def read(self) -> Batch:
        """Return the samples and markers that came."""
        markers = [text for text, _ in self._texts_of(self._options.markers)]
        if self._options.aoi_stream:
            return Batch(self._aoi_samples(), markers, named=True)
        try:
            rows, times = self._inlet.pull_chunk(timeout=WAIT_S, max_samples=MOST_SAMPLES, min_samples=1)
        except self._pylsl.util.LostError:
            self._find_again()
            return Batch(markers=markers)
        assert self._mapping is not None
        offset_s, round_trip_s = self._clock.measured(self._inlet)
        named = self._options.aoi
        samples = [self._sample(t, row, named) for t, row in zip(times, rows, strict=True)]
        return Batch(samples, markers, named, round_trip_s, offset_s)

    def close(self) -> None:
        """Close the streams."""
        for stream in (self._inlet, *(text.inlet for text in self._texts.values())):
            if stream is not None:
                stream.close_stream()

    # --- the gaze stream ---

    def _find(self, wait_s: float) -> list[Any]:
        until = time.monotonic() + wait_s
        while True:
            found = self._pylsl.resolve_streams(min(FIND_S, wait_s))
            fitting = [info for info in found if _fits(_stream_of(info), self._options)]
            if fitting or time.monotonic() >= until:
                return fitting

    def _connect(self, info: Any) -> None:
        options = self._options
        self._inlet = self._pylsl.StreamInlet(info, max_buflen=BUFFER_S, recover=bool(info.source_id()))
        self._gaze = _stream_of(self._inlet.info(timeout=10.0))
        self._mapping = mapping_of(self._gaze, options.screen, options.unit, options.origin)
        if options.aoi and self._mapping.object_id is None:
            raise InvalidSettings(f"stream {self._gaze.name!r} has no channel ObjectId: it does not name AOIs")
        if not options.aoi and not (self._mapping.left or self._mapping.right or self._mapping.both):
            raise InvalidSettings(f"stream {self._gaze.name!r} has no points, only ObjectId: take AOI names with --aoi")
        self._inlet.open_stream(timeout=10.0)
        self.reconnects += 1

    def _find_again(self) -> None:
        """Look for the lost stream for a second; the next reading goes on with that."""
        if not self._lost:
            log.warning("the stream is lost; it is looked for", stream=self._gaze.name if self._gaze else "")
        self._lost = True
        found = self._find(FIND_S)
        if found:
            self._connect(found[0])
            self._lost = False
            log.info("the stream is there again")

    def _sample(self, t: float, row: Sequence[Any], named: bool) -> Sample:
        assert self._mapping is not None
        return named_sample(t, self._name(self._mapping.object(row))) if named else self._mapping.sample(t, row)

    def _name(self, given: str) -> str | None:
        return self._names.get(given, given) or None

    # --- streams of texts ---

    def _texts_of(self, name: str) -> list[tuple[str, float]]:
        return self._texts[name].read() if name else []

    def _aoi_samples(self) -> list[Sample]:
        """Return a sample for each AOI name that came, and the last one again after a while."""
        stream = self._texts[self._options.aoi_stream]
        samples = []
        for text, t in stream.read(WAIT_S):
            self._aoi, self._aoi_said = text.strip(), max(t, self._aoi_said)
            samples.append(named_sample(t, self._name(self._aoi)))
        now = self._pylsl.local_clock() - stream.offset_s()
        if not samples and self._aoi_said and now - self._aoi_said >= SAY_AGAIN_S:
            self._aoi_said = now
            samples.append(named_sample(now, self._name(self._aoi)))
        return samples


class _TextStream:
    """A stream of markers, which may not be there yet."""

    def __init__(self, pylsl: Any, name: str) -> None:
        self._pylsl = pylsl
        self.inlet: Any = None
        self._resolver = pylsl.ContinuousResolver("name", name)
        self._offset_s, self._measured = 0.0, -CORRECT_EVERY_S

    def read(self, wait_s: float = 0.0) -> list[tuple[str, float]]:
        """Return each text with its time; nothing while the stream is not there."""
        if self.inlet is None and not self._found():
            time.sleep(wait_s)
            return []
        try:
            rows, times = self.inlet.pull_chunk(timeout=wait_s, max_samples=MOST_SAMPLES, min_samples=1)
        except self._pylsl.util.LostError:
            self.inlet = None
            return []
        return [(str(row[0]), t) for row, t in zip(rows, times, strict=True)]

    def offset_s(self) -> float:
        """Return this computer's LSL clock minus the stream's."""
        now = time.monotonic()
        if self.inlet is not None and now - self._measured >= CORRECT_EVERY_S:
            self._measured = now
            self._offset_s = _time_correction(self._pylsl, self.inlet)[0] or 0.0
        return self._offset_s

    def _found(self) -> bool:
        found = self._resolver.results()
        if found:
            self.inlet = self._pylsl.StreamInlet(found[0], max_buflen=BUFFER_S, recover=bool(found[0].source_id()))
            self.inlet.open_stream(timeout=10.0)
        return bool(found)


class _ClockOffset:
    """The offset of the stream's clock, measured now and then."""

    def __init__(self, pylsl: Any) -> None:
        self._pylsl = pylsl
        self._measured = -CORRECT_EVERY_S

    def measured(self, inlet: Any) -> tuple[float | None, float | None]:
        """Return this computer's clock minus the stream's, and the round trip, s; None between two measurements."""
        now = time.monotonic()
        if now - self._measured < CORRECT_EVERY_S:
            return None, None
        self._measured = now
        correction, round_trip_s = _time_correction(self._pylsl, inlet)
        if correction is None:
            return None, None
        return time.time() - self._pylsl.local_clock() + correction, round_trip_s


def _time_correction(pylsl: Any, inlet: Any) -> tuple[float | None, float | None]:
    """Return what must be added to the stream's time for this computer's LSL clock, and the round trip, s."""
    remote, uncertainty, error = ctypes.c_double(), ctypes.c_double(), ctypes.c_int()
    library = pylsl.lib.lib
    library.lsl_time_correction_ex.restype = ctypes.c_double
    offset = library.lsl_time_correction_ex(
        ctypes.c_void_p(inlet.obj) if isinstance(inlet.obj, int) else inlet.obj, ctypes.byref(remote),
        ctypes.byref(uncertainty), ctypes.c_double(0.5), ctypes.byref(error),
    )  # fmt: skip
    return (None, None) if error.value else (float(offset), float(uncertainty.value))


# --- streams ---


def _stream_of(info: Any) -> Stream:
    channels = []
    channel = info.desc().child("channels").child("channel")
    while not channel.empty():

        def said(name: str, of: Any = channel) -> str:
            return str(of.child_value(name) or "")

        channels.append(
            Channel(said("label"), said("type") or said("metatype"), said("eye").lower(), said("unit"),
                    said("coordinate_system") or said("coordinatesystem"))
        )  # fmt: skip
        channel = channel.next_sibling("channel")
    while len(channels) < info.channel_count():
        channels.append(Channel())
    return Stream(
        info.name(), info.type(), info.nominal_srate(), info.channel_format() == 3, tuple(channels), info.hostname(),
        info.source_id(),
    )  # fmt: skip


def _fits(stream: Stream, options: LslOptions) -> bool:
    if options.name:
        return stream.name == options.name
    return stream.type == options.type if options.type else stream.has_gaze


def _one_of(found: list[Any], options: LslOptions) -> Any:
    """Return the only stream that fits. Raise :class:`UnknownThing` if there is none, or several."""
    which = f"named {options.name!r}" if options.name else f"of type {options.type!r}" if options.type else "with gaze"
    if not found:
        others = "; ".join(stream.line for stream in found_streams()) or "none"
        raise UnknownThing(f"there is no stream {which}; the streams there are: {others}")
    if len(found) > 1:
        lines = "; ".join(_stream_of(info).line for info in found)
        raise UnknownThing(f"there are {len(found)} streams {which}: {lines}; choose one with --name")
    return found[0]
