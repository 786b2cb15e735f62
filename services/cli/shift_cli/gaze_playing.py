"""What ``shift-mesh gaze play`` does with a gaze file that was read: describe it and stream it in its own time."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from shift_runtime.rest_client import RestClient
    from shift_schemas.messages import GazeChunk
    from shift_sources.files.formats import GazeFile
    from shift_sources.files.samples import Marker, Sample

PIECE_S = 0.05
"""A chunk holds what a tracker would have seen in this much real time; chosen: no delay that a person notices."""
LARGEST_CHUNK = 1000
"""Samples; with pupils and openness that is 160 KB, and the gateway takes 256 KB."""
LONGEST_MARKER = 10_000
"""Characters of a marker's text, as the mesh accepts it."""


class Described(NamedTuple):
    """A description of a recording; shares are of its samples, 0..1."""

    rate_hz: float
    length_s: float
    lost: float
    off_stimulus: float
    """With AOI names: the share that is on no AOI."""
    sentence: str


def describe(found: Sequence[Sample], named: bool = False) -> Described:
    """Return rate, length and shares of a recording's samples, and a sentence about them."""
    length_s = found[-1].t - found[0].t
    rate_hz = (len(found) - 1) / length_s if length_s > 0 else 0.0
    seen = [s for s in found if s.valid]
    off = sum(s.aoi is None if named else not _is_on_stimulus(s) for s in seen)
    lost, off_stimulus = 1 - len(seen) / len(found), off / len(found)
    sentence = (
        f"{len(found)} samples at {rate_hz:.4g} Hz, {length_s:.1f} s of gaze, lost {lost:.1%}, "
        f"{'on no AOI' if named else 'off the stimulus'} {off_stimulus:.1%}"
    )
    return Described(rate_hz, length_s, lost, off_stimulus, sentence)


def _is_on_stimulus(sample: Sample) -> bool:
    return sample.x is not None and sample.y is not None and 0.0 <= sample.x <= 1.0 and 0.0 <= sample.y <= 1.0


def stream(
    shift: RestClient, session: str, found: GazeFile, source: str, name: str, speed: float
) -> list[str]:  # fmt: skip
    """Send each sample and each marker at its time; return the warnings of the last answer and of restarts."""
    from rich.console import Console
    from rich.progress import Progress
    from shift_schemas.messages import Mark
    from shift_sources.files.samples import Marker

    samples = found.samples
    length_s = samples[-1].t - samples[0].t
    per_chunk = min(LARGEST_CHUNK, max(1, round(len(samples) / max(length_s, 1e-9) * PIECE_S * speed)))
    answer: dict[str, Any] = {}
    begun_anew: list[str] = []
    with Progress(console=Console(stderr=True)) as progress:
        bar = progress.add_task(f"{name} at {speed:g}x", total=len(samples))
        begun = time.monotonic()
        for due_s, what in in_order(found, per_chunk, source):
            time.sleep(max(0.0, begun + (due_s - samples[0].t) / speed - time.monotonic()))
            if isinstance(what, Marker):
                shift.command(Mark, session, text=what.text[:LONGEST_MARKER])
                continue
            answer = shift.gaze(session, what)
            begun_anew += [w for w in answer.get("warnings", ()) if "segment" in w]
            progress.advance(bar, len(what.t))
    return list(dict.fromkeys([*begun_anew, *answer.get("warnings", ())]))


def in_order(found: GazeFile, per_chunk: int, source: str) -> Iterator[tuple[float, GazeChunk | Marker]]:
    """Yield chunks and markers in the order of their times, in seconds; a chunk's time is its last sample's.

    A chunk ends at a marker, so that all gaze before a marker is sent before it, and no other.
    """
    from shift_sources.files.samples import chunk_of

    seq = begin = 0
    samples, markers = found.samples, sorted(found.markers, key=lambda marker: marker.t)
    for marker in [*markers, None]:
        end = begin
        while end < len(samples) and (marker is None or samples[end].t <= marker.t):
            end += 1
        for first in range(begin, end, per_chunk):
            part = samples[first : min(first + per_chunk, end)]
            yield part[-1].t, chunk_of(part, source, seq, found.named)
            seq += 1
        begin = end
        if marker is not None:
            yield marker.t, marker


def check_names(found: GazeFile, config: dict[str, Any], name: str) -> None:
    """Raise :class:`MalformedMessage` if the file names an AOI that the study in force does not have."""
    from shift_schemas.errors import MalformedMessage
    from shift_schemas.suggestions import did_you_mean

    known = [aoi["name"] for aoi in config.get("aois", ())]
    used = dict.fromkeys(sample.aoi for sample in found.samples if sample.aoi is not None)
    unknown = [aoi for aoi in used if aoi not in known]
    if unknown:
        raise MalformedMessage(
            f"{name} names AOIs that the study does not have: {', '.join(unknown)}. The study has {', '.join(known)}. "
            f"Name each as the study does with --aoi-map '{unknown[0]}=NAME', or make it no AOI with --aoi-map "
            f"'{unknown[0]}='{did_you_mean(unknown[0], known)}"
        )


def nothing_counted(said: Described, named: bool, before: dict[str, Any], after: dict[str, Any]) -> str:
    """Return why the gaze had no dwell on an AOI; empty if it had some, or if the session does not say."""
    if said.lost == 1.0:
        return "every sample is lost"
    if said.lost + said.off_stimulus == 1.0:
        if named:
            return "every sample is lost or on no AOI; check the names of the file's AOIs"
        return "every sample is lost or off the stimulus; check the file's units"
    if after.get("dwell_s") is None or after["dwell_s"] > before["dwell_s"]:
        return ""
    if after["samples"] == before["samples"]:
        return "the session had all of it already, under this source; give another --source to play it once more"
    if named:
        return "no AOI name of it counted; check the study's AOIs and the share that is lost"
    return "no fixation of it fell on an AOI; check the study's AOIs, the rate and the share that is lost"
