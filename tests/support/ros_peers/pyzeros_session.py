"""A session as pyzeros needs it, for the programs that run in its environment."""

import json

import zenoh


def open_session(router):
    config = zenoh.Config()
    entries = {
        "mode": "peer", "connect/endpoints": [router], "listen/endpoints": ["tcp/localhost:0"],
        "scouting/multicast/enabled": False, "timestamping/enabled": True,
        "connect/retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5},
    }  # fmt: skip
    for key, value in entries.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)
