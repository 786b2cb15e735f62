"""Answers one key at once, in Zenoh's own thread: what one Zenoh request costs by itself."""

import sys
import time

import zenoh
from shift_runtime.bus.zenoh_config import zenoh_config
from zenoh.handlers import Callback


def answer(query):
    query.reply(query.key_expr, b"x" * 1000)
    query.drop()


session = zenoh.open(zenoh_config("peer", connect=sys.argv[1], listen="tcp/127.0.0.1:0"))
session.declare_queryable("bench/get", Callback(answer, indirect=False))
time.sleep(3600)
