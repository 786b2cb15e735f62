"""Control of a running replay over the mesh: pause, rate, seek, step and stop; its status is published."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from shift_runtime.bus.protocol import Bus, Handle, Request
from shift_schemas.codec import decode, encode, encoding_of
from shift_schemas.errors import Conflict, MalformedMessage, Problem, ShiftError
from shift_schemas.keys import ReplayKey, build_key
from shift_schemas.messages import ReplayControl, ReplayStatus

from shift_recording.replay import Pacer

EVERY_S = 0.25
"""How often the status is published; chosen, as often as a person reads a number."""


@dataclass
class ControlledReplay:
    """A replay that is controlled over the mesh as it is from the terminal.

    Parameters
    ----------
    session, recording
        The session under which it is replayed, and the name of the file.
    length_s
        The length of the recording on its time line, s.
    pacer
        The clock of the replay.
    stop
        Ends the replay.
    published
        Returns how many messages were replayed.
    inputs
        Whether inputs are replayed into a mesh; these cannot be skipped, so there is no seek.
    """

    session: str
    recording: str
    length_s: float
    pacer: Pacer
    stop: Callable[[], object]
    published: Callable[[], int]
    inputs: bool = False

    @property
    def status(self) -> ReplayStatus:
        """How far the replay is."""
        return ReplayStatus(
            session=self.session, recording=self.recording, inputs=self.inputs,
            position_s=min(self.pacer.position_s, self.length_s), length_s=self.length_s, rate=self.pacer.rate,
            paused=self.pacer.paused, published=self.published(),
        )  # fmt: skip

    def apply(self, control: ReplayControl) -> None:
        """Carry out a control. Raises :class:`Conflict` for a seek within inputs, ``MalformedMessage`` for none."""
        if control == ReplayControl():
            raise MalformedMessage("give paused, rate, position_s, step or stop")
        if control.position_s is not None:
            if self.inputs:
                raise Conflict("inputs are replayed into a session, which needs all of them; it cannot seek")
            if control.position_s > self.length_s:
                raise MalformedMessage(
                    f"position_s is {control.position_s:g} and the recording has {self.length_s:.1f} s"
                )
            self.pacer.jump(control.position_s)
        if control.rate is not None:
            self.pacer.change_rate(control.rate)
        if control.paused is not None:
            self.pacer.pause(control.paused)
        if control.step:
            self.pacer.step()
        if control.stop:
            self.stop()

    def serve(self, bus: Bus) -> Handle:
        """Answer requests under the replay's key: without a payload with the status, otherwise after the control."""
        return bus.serve(build_key(ReplayKey(self.session)), self._on_request)

    def _on_request(self, request: Request) -> None:
        try:
            if request.payload:
                self.apply(decode(ReplayControl, request.payload))
        except ShiftError as e:
            request.refuse(encode(Problem.of(e)))
            return
        request.reply(encode(self.status))

    async def publish_once(self, bus: Bus) -> None:
        """Publish the status, and wait until it is time for the next one."""
        bus.put(build_key(ReplayKey(self.session)), encode(self.status), encoding=encoding_of(ReplayStatus))
        await asyncio.sleep(EVERY_S)
