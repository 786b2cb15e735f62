"""The recorder's shell: the worker, extended by a sink that writes segments and by the end of a session.

``session_commands``   what a start needs of the world
``segment_sink``       facts of every owner are written to segments
``ending``             the end of a session, in two halves
``convergence``        whether every service has caught up
``session_recording``  segments become a recording
``stray_messages``     publications that nobody subscribes to are counted
"""

from __future__ import annotations

from shift_runtime.service.core import Core
from shift_runtime.service.extension import Extension
from shift_runtime.service.loop import Worker
from shift_runtime.settings import ServiceSettings
from shift_schemas.registry import READS

from shift_recorder import core
from shift_recorder.core import RecorderState
from shift_recorder.service.convergence import END_WAIT_S, Convergence
from shift_recorder.service.ending import SessionEndProtocol
from shift_recorder.service.segment_sink import SegmentSink
from shift_recorder.service.session_commands import SessionCommands
from shift_recorder.service.stray_messages import StrayMessages

CORE: Core[RecorderState] = Core(
    name="recorder",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["recorder"],
)


def extend(worker: Worker[RecorderState], settings: ServiceSettings) -> Extension:
    """Return what the recorder adds to its worker; its files lie in the settings' data folder."""
    data = settings.data
    sink = SegmentSink(
        data / "segments", worker.states, worker.reader, worker.progress, worker.journal, worker.alarm, worker.clock,
        worker.metrics, worker.transactions.close_session,
    )  # fmt: skip
    convergence = Convergence(worker.reader, worker.progress)
    ends = SessionEndProtocol(
        data / "recordings", worker.states, worker.journal, worker.progress, worker.alarm, sink, convergence,
        worker.tasks, worker.enqueue,
    )  # fmt: skip

    async def start() -> None:
        StrayMessages(worker.bus, worker.metrics).declare()
        ends.resume()
        sink.start_flushing(worker.enqueue)

    async def stop() -> None:
        await worker.tasks.wait(2 * END_WAIT_S)
        await worker.reader.pull_all(worker.reader.owners)
        await worker.work_off()
        sink.flush()
        for session in sink.sessions:
            await ends.pause(session)

    return Extension(sink, ends, SessionCommands(data, settings.shard).prepare, start, stop)
