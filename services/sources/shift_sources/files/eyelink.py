"""Text of EyeLink (ASC, made by ``edf2asc``): milliseconds, each eye's position in pixels, pupil size; ``.`` is lost.

The line ``SAMPLES`` says which eyes follow and that positions are gaze on the screen. The screen's coordinates are in a
message (``GAZE_COORDS 0.00 0.00 1919.00 1079.00``: 1920 x 1080 pixels) or given with ``--screen``. Lines ``MSG`` are
messages. Events that EyeLink found (fixations, saccades, blinks) and remarks (``**``) are not read. Pupil sizes are in
EyeLink's own unit, which the line ``PUPIL`` calls an area or a diameter.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from shift_schemas.errors import InvalidSettings

from shift_sources.files.options import Options, ScreenSize
from shift_sources.files.samples import Eyes, Gaze, Sample, sample_of_eyes, since_first
from shift_sources.files.table import Reader, check_screen, refuse_names
from shift_sources.files.text_file import TextFile

MILLISECONDS = 1e3
MESSAGE = re.compile(r"MSG\s+(\S+)\s?(.*)")
COORDINATES = re.compile(r"\b(?:GAZE|DISPLAY)_COORDS\s*=?\s*" + r"\s+".join([r"(-?\d{1,6}(?:\.\d+)?)"] * 4))
NUMBER = re.compile(r"-?\d{1,20}(\.\d{0,20})?(e[+-]?\d\d)?")
EVENTS = frozenset(
    ("START", "END", "SFIX", "EFIX", "SSACC", "ESACC", "SBLINK", "EBLINK", "INPUT", "BUTTON", "PRESCALER", "VPRESCALER")
) | {"EVENTS", "PUPIL", "FRAME"}
"""The first words of lines in a recording that are neither samples nor messages."""
LOST = frozenset({".", "-32768", "-32768.0"})
"""A lost value; the number is EyeLink's constant MISSING_DATA."""
SIDES = ("left", "right")
Event = tuple[float, Sample | str]


@dataclass
class _State:
    """What the lines so far say about the samples that follow."""

    eyes: tuple[str, ...] = ()
    """left, right or both; empty: not said yet."""
    recording: bool = False
    """Whether a block of samples has begun."""
    left: float = 0.0
    top: float = 0.0
    screen: ScreenSize | None = None


class _Line:
    """One line's words, with its place in the file for error messages."""

    def __init__(self, file: TextFile, number: int, text: str) -> None:
        self.file, self.line, self.words = file, number, text.split()

    def number(self, i: int, name: str) -> float | None:
        """Return a number of the line; None where it is lost. Raise :class:`MalformedMessage`."""
        if i >= len(self.words):
            rule = f"time, then x, y and pupil size of each eye; {name} is missing"
            raise self.file.wrong(self.line, "row", " ".join(self.words), rule)
        word = self.words[i]
        if word in LOST:
            return None
        if NUMBER.fullmatch(word) is None:
            raise self.file.wrong(self.line, name, word, "a number, or . where it was lost")
        return float(word)


def _events(file: TextFile, options: Options) -> Iterator[Event]:
    state = _State(screen=options.screen)
    before = -1.0
    for number, text in file.lines():
        if message := MESSAGE.match(text):
            time = _time(file, number, message[1])
            _take_coordinates(file, message[2], state, options)
            if message[2].strip():
                yield time, message[2].strip()
        elif text[:1].isdigit():
            line = _Line(file, number, text)
            time = _time(file, number, line.words[0])
            if time < before:
                raise file.wrong(number, "time", line.words[0], "milliseconds, rising from line to line")
            if time > before:
                before = time
                yield time, _sample(line, state)
        else:
            _take_line(file, number, text, state)


def _time(file: TextFile, number: int, word: str) -> float:
    if NUMBER.fullmatch(word) is None or word.startswith("-"):
        raise file.wrong(number, "time", word, "milliseconds")
    return float(word)


def _take_line(file: TextFile, number: int, text: str, state: _State) -> None:
    """Note what a line that is neither a sample nor a message says about the samples. Raise for an unknown one."""
    words = text.split()
    if not words or text.startswith(("*", "#", "/", ";", ">")):
        return
    if words[0] == "SAMPLES":
        if len(words) < 2 or words[1] != "GAZE":
            rule = "GAZE: convert the EDF file with gaze positions (edf2asc -sg); HREF and RAW have no pixels"
            raise file.wrong(number, "SAMPLES", " ".join(words[1:2]), rule)
        state.eyes = tuple(side for side in SIDES if side.upper() in words)
    elif words[0] in ("START", "END"):
        state.recording = words[0] == "START"
    elif state.recording and words[0] not in EVENTS:
        rule = "a sample, which begins with its time, or a line of EyeLink such as MSG, SFIX or END"
        raise file.wrong(number, "line", text.strip(), rule)


def _take_coordinates(file: TextFile, message: str, state: _State, options: Options) -> None:
    found = COORDINATES.search(message)
    if found is None:
        return
    left, top, right, bottom = (float(number) for number in found.groups())
    if right <= left or bottom <= top:
        return
    state.left, state.top = left, top
    width, height = round(right - left), round(bottom - top)
    state.screen = ScreenSize(width + 1, height + 1)
    if options.screen == ScreenSize(width, height):  # the experiment wrote 1920 where the last pixel is 1919
        state.screen = options.screen
    check_screen(file.name, state.screen, options)


def _sample(line: _Line, state: _State) -> Sample:
    if not state.eyes:
        raise line.file.wrong(
            line.line, "row", " ".join(line.words), "a sample after the line SAMPLES, which says whose eyes they are"
        )
    if state.screen is None:
        raise InvalidSettings(
            f"{line.file.name} (EyeLink) has positions in pixels and no message DISPLAY_COORDS: give the size of the "
            "screen with --screen, such as --screen 1920x1080"
        )
    points: list[tuple[float, float]] = []
    pupils: dict[str, float | None] = {}
    for i, side in enumerate(state.eyes):
        x, y, pupil = (line.number(3 * i + k, f"{side} {n}") for k, n in enumerate(("x", "y", "pupil"), start=1))
        pupils[f"pupil_{side}"] = pupil if pupil is not None and pupil > 0 else None
        if x is not None and y is not None:
            points.append(((x - state.left) / state.screen.width, (y - state.top) / state.screen.height))
    return sample_of_eyes(0.0, points, Eyes(**pupils))


def _read(file: TextFile, options: Options) -> Gaze | None:
    first = next((line for line in file.head if line.strip()), "")
    begins = re.match(r"\*\* |\*\*$|MSG\s+\d|START\s+\d|SAMPLES\s", first)
    if begins is None and not any(re.match(r"SAMPLES\s+\w+\s+(LEFT|RIGHT)", line) for line in file.head):
        return None
    refuse_names(file.name, "EyeLink", options)
    return Gaze(since_first(_events(file, options), MILLISECONDS))


FORMATS: dict[str, tuple[Reader, ...]] = {"eyelink": (_read,)}
