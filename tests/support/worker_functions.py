"""Functions that tests run in a worker process."""

from __future__ import annotations

import os
import signal
import time

from shift_gateway.web.worker_process import Progress, Send
from shift_schemas.errors import UnknownThing


def send_words(send: Send, *words: str) -> None:
    """Send each word, and how far it is."""
    for i, word in enumerate(words, start=1):
        print("not a part")
        send(word)
        send(Progress(i / len(words)))


def refuse(send: Send) -> None:
    """Raise one of the project's errors."""
    raise UnknownThing("there is no coffee")


def fail(send: Send) -> None:
    """Raise an error that nobody expects."""
    raise KeyError("coffee")


def die(send: Send) -> None:
    """End as a process does that the kernel kills."""
    os.kill(os.getpid(), signal.SIGKILL)


def send_forever(send: Send) -> None:
    """Send the process's id, again and again."""
    while True:
        send(os.getpid())
        time.sleep(0.01)
