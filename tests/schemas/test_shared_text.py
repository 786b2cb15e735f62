"""Long texts are in memory once, however many messages carry them."""

from __future__ import annotations

from shift_schemas.codec import decode, encode
from shift_schemas.messages import Config
from shift_schemas.timestamps import Stamp


def test_study_of_two_sessions_is_one_string() -> None:
    sent = [Config(session=s, stamp=Stamp.of(1), version=1, study='{"study": "coffee"}' + s[:0]) for s in ("s1", "s2")]
    one, other = (decode(Config, encode(config)) for config in sent)
    assert one.study is other.study
    assert one == sent[0]
