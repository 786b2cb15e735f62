"""The configuration of Zenoh: explicit endpoints and gossip, no multicast, quick reconnection."""

from __future__ import annotations

import json
from typing import Any

import zenoh


def zenoh_config(
    mode: str, *, connect: str = "", listen: str = "", timeout_ms: int = -1, namespace: str = ""
) -> zenoh.Config:
    """Return a configuration without multicast; ``mode`` is peer, client or router.

    ``timeout_ms`` is how long Zenoh tries to connect at the start. With -1 it tries without end; a peer does so in the
    background. Every key is under ``namespace``, if one is given.
    """
    config = zenoh.Config()
    entries: dict[str, Any] = {
        "mode": mode,
        "connect/endpoints": [connect] if connect else [],
        "connect/timeout_ms": timeout_ms,
        "connect/exit_on_failure": False,
        "connect/retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5},
        "listen/endpoints": [listen] if listen else [],
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "open/return_conditions/connect_scouted": False,
        "open/return_conditions/declares": False,
    }
    if namespace:
        entries["namespace"] = namespace
    for key, value in entries.items():
        config.insert_json5(key, json.dumps(value))
    return config
