"""``python -m shift_runtime.healthcheck SERVICE``: exit with 0 if the service answers and is ready.

Containers run it every few seconds, so it imports little besides Zenoh. It asks a service over Zenoh,
through the loop that does the service's work; it asks the gateway for ``/readyz``, and connects to the router. The
simulated person is healthy if the gateway (``SHIFT_URL``) answers.
"""

from __future__ import annotations

import http.client
import json
import os
import socket
import sys
from urllib.parse import urlsplit

TIMEOUT_S = 2.0
CHECKED = ("router", "gateway", "recorder", "monitor", "decider", "learner", "simulator", "ros2_bridge")


def main(arguments: list[str]) -> int:
    """Check the one service in ``arguments``. Return the exit code: 0 healthy, 1 not healthy, 2 wrong use."""
    if len(arguments) != 1 or arguments[0] not in CHECKED:
        sys.stderr.write(f"give one service: {', '.join(CHECKED)}\n")
        return 2
    checks = {"router": _router, "gateway": _gateway, "simulator": _simulator}
    try:
        healthy = checks[arguments[0]]() if arguments[0] in checks else _service(arguments[0])
    except (OSError, http.client.HTTPException) as e:
        sys.stderr.write(f"the {arguments[0]} does not answer: {e or type(e).__name__}\n")
        return 1
    except ValueError as e:
        sys.stderr.write(f"a port, address or shard in the environment (SHIFT_...) is wrong: {e}\n")
        return 2
    return 0 if healthy else 1


def _router() -> bool:
    listen = os.environ.get("SHIFT_ROUTER_LISTEN", "tcp/127.0.0.1:7447")
    host, _, port = listen.partition("/")[2].rpartition(":")
    with socket.create_connection(("127.0.0.1" if host == "0.0.0.0" else host.strip("[]"), int(port)), TIMEOUT_S):
        return True


def _gateway() -> bool:
    return _answers("127.0.0.1", int(os.environ.get("SHIFT_PORT", "8080")), "/readyz")


def _simulator() -> bool:
    url = urlsplit(os.environ.get("SHIFT_URL", "http://127.0.0.1:8080"))
    return _answers(url.hostname or "127.0.0.1", url.port or 80, "/healthz")


def _answers(host: str, port: int, path: str) -> bool:
    connection = http.client.HTTPConnection(host, port, timeout=TIMEOUT_S)
    connection.request("GET", path)
    return connection.getresponse().status == 200


def _service(name: str) -> bool:
    import zenoh
    from shift_schemas.shards import parse_shard

    from shift_runtime.bus.zenoh_config import zenoh_config

    shard = parse_shard(os.environ.get("SHIFT_SHARD", f"0/{os.environ.get('SHIFT_SHARDS', '1')}"))
    config = zenoh_config(
        "client", connect=os.environ.get("SHIFT_ZENOH", "tcp/127.0.0.1:7447"), timeout_ms=2000, namespace=shard.name
    )
    try:
        session = zenoh.open(config)
    except zenoh.ZError as e:
        sys.stderr.write(f"{name}: {e}\n")
        return False
    try:
        for reply in session.get(f"shift/v1/@service/{name}/health", timeout=TIMEOUT_S):
            if reply.ok is not None:
                return bool(json.loads(reply.ok.payload.to_bytes()).get("ready"))
    finally:
        session.close()  # type: ignore[no-untyped-call]
    return False


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
