"""The simulator: people who are not there, experiments with them, and the exact best that is possible.

Where Gymnasium was imported before, importing this package makes ``shift/Partner-v0`` known to it; importing
``shift_simulator.env`` does so in any case. Gymnasium is an optional extra, and is not imported for its own sake.
"""

import sys

ENV_ID = "shift/Partner-v0"

if "gymnasium" in sys.modules:
    _gymnasium = sys.modules["gymnasium"]
    if ENV_ID not in _gymnasium.registry:
        _gymnasium.register(id=ENV_ID, entry_point="shift_simulator.env:PartnerEnv")
