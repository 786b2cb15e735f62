"""``shift-mesh up``: the mesh on this machine, one command."""

from __future__ import annotations

import fcntl
import http.client
import os
import socket
import time
from collections import Counter
from pathlib import Path
from typing import IO

from rich.console import Console
from shift_runtime.endpoints import parse_endpoint
from shift_runtime.journal_schema import check_journals, check_no_live_sessions
from shift_runtime.settings import read_settings
from shift_schemas.errors import InvalidSettings, shorten
from shift_schemas.shards import Shard

from shift_cli.supervisor import Program, Supervisor, programs

LOCAL = {"0.0.0.0": "127.0.0.1", "::": "::1"}
console = Console(stderr=True, highlight=False)


def run_up(demo: bool, host: str, port: int, zenoh: str, data: Path, router: str | None, workers: int) -> int:
    """Run the mesh until Ctrl-C or SIGTERM; return the exit code.

    Raises
    ------
    InvalidSettings
        A flag or variable has a wrong value, a port is taken, or the data folder cannot be used or is in use.
    """
    endpoint = parse_endpoint(zenoh, "--zenoh")
    if router is not None:
        parse_endpoint(router, "--router")
    read_settings()
    lock = _lock(data)
    check_journals(data)
    check_no_live_sessions(data / "state", "recorder", Shard(0, workers))
    _check_free(host, port, "--port")
    if router is None:
        _check_free(*endpoint, "--zenoh")
    url = f"http://{LOCAL.get(host, host)}:{port}"
    os.environ |= {
        "SHIFT_DATA": str(data), "SHIFT_HOST": host, "SHIFT_PORT": str(port), "SHIFT_URL": url,
        "SHIFT_ZENOH": router or zenoh, "SHIFT_ROUTER_LISTEN": zenoh,
    }  # fmt: skip
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # a thread in the supervisor would not survive the fork
    mesh = programs(demo, router is None, workers)
    announcer = _Announcer(LOCAL.get(host, host), port, url, mesh)
    console.print(f"SHIFT mesh: data in {data}/, gateway at {url}", soft_wrap=True)
    code = Supervisor(mesh, lambda text: console.print(text, soft_wrap=True), announcer.tick).run()
    lock.close()
    return code


class _Announcer:
    """Tells the user once that everything is ready."""

    def __init__(self, host: str, port: int, url: str, mesh: list[Program]) -> None:
        self._host, self._port, self._url, self._mesh = host, port, url, mesh
        self._since = time.monotonic()
        self._done = False

    def tick(self) -> None:
        """Poll readiness; announce it once."""
        if self._done or not self._ready():
            return
        self._done = True
        took = time.monotonic() - self._since
        names = ", ".join(dict.fromkeys(p.name.partition(" ")[0] for p in self._mesh))
        workers = max(Counter(p.module for p in self._mesh).values())
        names += f"; {workers} workers of each service" if workers > 1 else ""
        console.print(f"ready in {took:.1f} s: {names}\nopen {self._url}  -  stop with Ctrl-C", soft_wrap=True)

    def _ready(self) -> bool:
        connection = http.client.HTTPConnection(self._host, self._port, timeout=1.0)
        try:
            connection.request("GET", "/readyz")
            return connection.getresponse().status == 200
        except (OSError, http.client.HTTPException):
            return False
        finally:
            connection.close()


def _lock(data: Path) -> IO[str]:
    """Lock the data folder: two meshes would write the same journals."""
    try:
        (data / "state").mkdir(parents=True, exist_ok=True)
        (data / "studies").mkdir(exist_ok=True)
        file = open(data / "state" / "lock", "w")  # noqa: SIM115 (held for as long as the mesh runs)
    except OSError as e:
        raise InvalidSettings(
            f"the data folder {data} cannot be used: {e.strerror}; give another folder with --data"
        ) from e
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as e:
        raise InvalidSettings(f"another mesh uses {data}; stop it, or give another folder with --data") from e
    return file


def _check_free(host: str, port: int, flag: str) -> None:
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
    except (OSError, UnicodeError) as e:
        where = "--host" if flag == "--port" else flag
        raise InvalidSettings(f"{where} names the host {shorten(host)!r}, which is not known: {_why(e)}") from e
    try:
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except OSError as e:
        said = f"{host}:{port} cannot be used: {e.strerror}; choose another with {flag}"
        raise InvalidSettings(f"{'port' if flag == '--port' else 'endpoint'} {said}") from e


def _why(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
