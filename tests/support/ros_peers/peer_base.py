"""A ROS peer as a process that a test drives: a JSON list a line, ``[method, *arguments]``, and a JSON answer.

Runs in the peer's own environment, so it imports nothing of the project.
"""

from __future__ import annotations

import json
import sys
import threading
import time


class PeerBase:
    """What every peer can do. A subclass gives ``_publisher``, ``_subscribe``, ``_client`` and ``_call``."""

    def __init__(self):
        self.said = {}
        self.publishers = {}
        self.clients = {}
        self.play_left = 0

    def advertise(self, topic):
        self.publishers.setdefault(topic, None) or self.publishers.update({topic: self._publisher(topic)})

    def publish(self, topic, text):
        self.advertise(topic)
        self.publishers[topic](text)

    def hear(self, topic):
        self.said[topic] = []
        self._subscribe(topic, self.said[topic].append)

    def heard(self, topic, since=0):
        return self.said[topic][since:]

    def wait_heard(self, topic, count, wait_s):
        """Wait for so many messages, and return them."""
        until = time.monotonic() + wait_s
        while len(self.said[topic]) < count and time.monotonic() < until:
            time.sleep(0.002)
        return len(self.said[topic])

    def service(self, name):
        self.clients[name] = self._client(name)

    def call(self, name, wait_s=10.0):
        """Return [success, message], or null without an answer."""
        return self._call(self.clients[name], wait_s)

    def timed_call(self, name):
        started = time.perf_counter()
        answer = self._call(self.clients[name], 10.0)
        took = time.perf_counter() - started
        assert answer, answer
        assert answer[0], answer
        return took

    def play(self, topic, file, rate_hz):
        """Publish the lines of a file at a rate, in the background."""
        self.advertise(topic)
        with open(file) as lines:
            texts = lines.read().splitlines()
        self.play_left = len(texts)

        def run():
            begun = time.monotonic()
            for i, text in enumerate(texts):
                time.sleep(max(0.0, begun + i / rate_hz - time.monotonic()))
                self.publishers[topic](text)
                self.play_left -= 1

        threading.Thread(target=run, daemon=True).start()
        return len(texts)

    def playing(self):
        return self.play_left


def drive(peer):
    """Answer commands until the input ends."""
    out = sys.stdout
    sys.stdout = sys.stderr
    out.write('"ready"\n')
    out.flush()
    for line in sys.stdin:
        method, *arguments = json.loads(line)
        try:
            answer = {"ok": getattr(peer, method)(*arguments)}
        except Exception as e:
            answer = {"error": f"{type(e).__name__}: {e}"}
        out.write(json.dumps(answer) + "\n")
        out.flush()
