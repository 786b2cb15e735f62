"""``shift-mesh`` whose services die at the worst moment: after a commit, before its reply.

A file ``{data}/die-{service}`` makes the service kill itself, once, when it has committed an answer and
would reply with it next. Called by test_lost_replies.py in the place of ``python -m shift_cli.main``.
"""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

from shift_cli.main import main
from shift_runtime.service.loop import Worker
from shift_runtime.service.transaction import Transaction

reply = Worker.reply


def die_first(self: Worker[Any], done: Transaction) -> None:
    wish = Path(os.environ["SHIFT_DATA"]) / f"die-{self.core.name}"
    if done.replies and wish.exists():
        wish.unlink()
        os.kill(os.getpid(), signal.SIGKILL)
    reply(self, done)


Worker.reply = die_first  # type: ignore[method-assign]

if __name__ == "__main__":
    main()
