"""The supervisor of ``shift-mesh up``: it runs every service as a process and restarts a process that ends.

The supervisor imports everything once and then forks, so that seven Python processes start in the time of one and
restart at once after a crash. Therefore it must never open a Zenoh session or start a thread. At a stop, the gateway
ends first and then the recorder, which finishes its files while the other services still answer.
"""

from __future__ import annotations

import ctypes
import gc
import importlib
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import setproctitle

_PR_SET_PDEATHSIG = 1
_STOPS = {signal.SIGINT, signal.SIGTERM}
_SIGNALS = {*_STOPS, signal.SIGCHLD}
POLL_S = 0.1
GRACE_S = 12.0
"""How long a service may take to stop, seconds; the recorder finishes its files in this time."""
STEADY_S = 3.0
"""A process that ran this many seconds has its back-off reset."""
LONGEST_PAUSE_S = 2.0
"""The longest pause before a restart, seconds; with the start itself below 5 s (docs/reliability.md)."""
SETTINGS_WRONG = 2
OWNED_ELSEWHERE = 3
"""The exit code of ``shift_runtime.process``, which is not imported: this process must not open a Zenoh session."""


@dataclass
class Program:
    """A process of the mesh: its package, and its place in the order of stopping (lower stops first)."""

    name: str
    module: str
    stops: int
    environment: dict[str, str] = field(default_factory=dict)
    """Variables of this process alone."""
    pid: int | None = None
    started: float = 0.0
    deaths: int = 0
    due: float = 0.0
    """When it is started again, on the monotonic clock, seconds."""
    ran: bool = False
    """Whether it ran for a while: then its settings are valid, and a later end is restarted, as after a full disk."""


def programs(demo: bool, router: bool, workers: int = 1) -> list[Program]:
    """Return the processes of the mesh in the order of their start, with so many workers of each service."""
    mesh = [Program("router", "shift_runtime.router", 5)] if router else []
    for index in range(workers):
        mesh += [
            _worker("recorder", 3, index, workers),
            _worker("monitor", 4, index, workers),
            _worker("decider", 4, index, workers),
            _worker("learner", 4, index, workers),
        ]
    mesh.append(Program("gateway", "shift_gateway", 2, {"SHIFT_SHARDS": str(workers)}))
    return [*mesh, Program("simulator", "shift_simulator", 1)] if demo else mesh


def _worker(service: str, stops: int, index: int, workers: int) -> Program:
    shard = f"{index}/{workers}"
    name = f"{service} {shard}" if workers > 1 else service
    return Program(name, f"shift_{service}", stops, {"SHIFT_SHARD": shard})


@dataclass
class Supervisor:
    """Runs ``programs`` until a signal. ``tell`` gets each event as a sentence; ``tick`` runs ten times a second."""

    programs: Sequence[Program]
    tell: Callable[[str], None]
    tick: Callable[[], None] = lambda: None
    _entries: dict[str, Callable[[], None]] = field(default_factory=dict)

    def run(self) -> int:
        """Start every program, keep it running, and stop it on SIGINT or SIGTERM. Return the exit code."""
        for program in self.programs:
            self._entries[program.name] = _entry(program.module)
        gc.collect()
        gc.freeze()
        signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        code = 0
        try:
            for program in self.programs:
                self._start(program)
            code = self._watch()
        finally:
            self._stop()
        return code

    def _watch(self) -> int:
        while True:
            received = signal.sigtimedwait(_SIGNALS, POLL_S)
            # After Ctrl-Z and fg, CPython's loop around EINTR returns a number that is not a signal.
            if received is not None and received.si_signo in _STOPS:
                self.tell(f"{signal.Signals(received.si_signo).name}: stopping")
                return 0
            for program, status in self._collect_ended():
                program.ran = program.ran or time.monotonic() - program.started > STEADY_S
                if os.waitstatus_to_exitcode(status) == OWNED_ELSEWHERE:
                    self.tell(f"the {program.name} found another mesh on its router; stopping")
                    return SETTINGS_WRONG
                if os.waitstatus_to_exitcode(status) == SETTINGS_WRONG and not program.ran:
                    self.tell(f"the {program.name} cannot run with these settings; stopping")
                    return SETTINGS_WRONG
                self._schedule_restart(program, status)
            now = time.monotonic()
            for program in self.programs:
                if program.pid is None and now >= program.due:
                    self._start(program)
            self.tick()

    def _collect_ended(self) -> list[tuple[Program, int]]:
        found = []
        for program in self.programs:
            if program.pid is not None:
                pid, status = os.waitpid(program.pid, os.WNOHANG)
                if pid:
                    program.pid = None
                    found.append((program, status))
        return found

    def _schedule_restart(self, program: Program, status: int) -> None:
        now = time.monotonic()
        program.deaths = 0 if now - program.started > STEADY_S else program.deaths + 1
        pause = min(LONGEST_PAUSE_S, 0.1 * 2**program.deaths) if program.deaths else 0.0
        program.due = now + pause
        code = os.waitstatus_to_exitcode(status)
        why = f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
        self.tell(f"the {program.name} {why}; it starts again" + (f" in {pause:.1f} s" if pause else ""))

    def _start(self, program: Program) -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        pid = os.fork()
        if pid == 0:
            self._run_child(program)
        program.pid = pid
        program.started = time.monotonic()

    def _run_child(self, program: Program) -> None:
        """Run the service in the child process. This never returns."""
        code = 1
        try:
            os.setpgid(0, 0)  # Ctrl-C reaches the supervisor alone, which stops the services in their order
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
            setproctitle.setproctitle(f"python -m {program.module}")
            os.environ |= program.environment
            self._entries[program.name]()
            code = 0
        except SystemExit as e:
            code = e.code if isinstance(e.code, int) else int(e.code is not None)
            if isinstance(e.code, str):
                sys.stderr.write(e.code + "\n")
        except BaseException:
            sys.excepthook(*sys.exc_info())
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)

    def _stop(self) -> None:
        for rank in sorted({p.stops for p in self.programs}):
            wave = [p for p in self.programs if p.stops == rank and p.pid is not None]
            for program in wave:
                _signal(program, signal.SIGTERM)
            self._reap(wave, time.monotonic() + GRACE_S)
        self.tell("stopped")

    def _reap(self, wave: list[Program], deadline: float) -> None:
        while any(p.pid is not None for p in wave):
            self._collect_ended()
            if time.monotonic() > deadline:
                for program in wave:
                    self.tell(f"the {program.name} does not stop; it is killed")
                    _signal(program, signal.SIGKILL)
                deadline = time.monotonic() + GRACE_S
            time.sleep(0.01)


def _signal(program: Program, number: signal.Signals) -> None:
    if program.pid is not None:
        try:
            os.kill(program.pid, number)
        except ProcessLookupError:
            return


def _entry(module: str) -> Callable[[], None]:
    """Return the module's ``main``. It is imported now, so that every fork has it."""
    name = module if module == "shift_runtime.router" else f"{module}.__main__"
    entry: Callable[[], None] = importlib.import_module(name).main
    return entry
