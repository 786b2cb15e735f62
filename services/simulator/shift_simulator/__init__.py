"""The simulator: simulated persons, experiments with them, and the exact optimum.

If Gymnasium is already imported, importing this package registers ``shift/Partner-v0``. Importing
``shift_simulator.env`` always registers it. Gymnasium is an optional extra, so this module does not import it.
"""

import sys

ENV_ID = "shift/Partner-v0"

if "gymnasium" in sys.modules:
    _gymnasium = sys.modules["gymnasium"]
    if ENV_ID not in _gymnasium.registry:
        _gymnasium.register(id=ENV_ID, entry_point="shift_simulator.env:PartnerEnv")
