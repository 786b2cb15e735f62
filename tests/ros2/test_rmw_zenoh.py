"""The wire of rmw_zenoh, byte by byte: golden values measured with the real one."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_ros2 import cdr
from shift_ros2.rmw_zenoh import NO_HASH, STRING, TRIGGER, Attachment, Node, data_key, gid_of, hash_of, qos_text
from shift_ros2.ros4hri import ENGAGEMENT_LEVEL
from shift_schemas.errors import MalformedMessage

TEXT = st.text(st.characters(blacklist_characters="\0", blacklist_categories=["Cs"]))


def test_keys_are_those_of_the_real_rmw_zenoh() -> None:
    assert data_key(0, "/shift/gaze", STRING, STRING.hash) == (
        "0/shift/gaze/std_msgs::msg::dds_::String_/"
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    )
    assert data_key(0, "/shift/next_strategy", TRIGGER, TRIGGER.hash) == (
        "0/shift/next_strategy/std_srvs::srv::dds_::Trigger_/"
        "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"
    )
    assert hash_of(data_key(7, "/a/b/", STRING, "*")) == "*"


def test_humble_has_no_hash_and_the_others_have_ros_own() -> None:
    assert STRING.hash_in("humble") == NO_HASH == "TypeHashNotSupported"
    for distribution in ("iron", "jazzy", "kilted", "rolling"):
        assert STRING.hash_in(distribution) == STRING.hash
    assert TRIGGER.fits(NO_HASH)
    assert TRIGGER.fits(TRIGGER.hash)
    assert not TRIGGER.fits(STRING.hash)
    assert ENGAGEMENT_LEVEL.fits(STRING.hash), "a type whose hash we do not know fits all"


def test_tokens_are_those_of_the_real_rmw_zenoh() -> None:
    node = Node(0, "c0ffee", 0, "/", "shift")
    assert node.token() == "@ros2_lv/0/c0ffee/0/0/NN/%/%/shift"
    assert node.entity_token(3, "SS", "/shift/next_strategy", TRIGGER, TRIGGER.hash, qos_text(True, 10)) == (
        f"@ros2_lv/0/c0ffee/0/3/SS/%/%/shift/%shift%next_strategy/std_srvs::srv::dds_::Trigger_/{TRIGGER.hash}"
        "/::,10:,:,:,,"
    )
    lab = Node(7, "c0ffee", 0, "/lab/one", "robot")
    assert lab.token() == "@ros2_lv/7/c0ffee/0/0/NN/%/%lab%one/robot"


def test_quality_of_service_is_empty_where_it_is_the_default() -> None:
    assert qos_text(True, 10) == "::,10:,:,:,,"
    assert qos_text(False, 1000) == "2::,1000:,:,:,,"
    assert qos_text(True, 42) == "::,:,:,:,,"


def test_attachment_is_33_bytes() -> None:
    gid = bytes(range(16))
    data = Attachment(1, 0x0102030405060708, gid).encode()
    assert data == b"\x01\0\0\0\0\0\0\0" + b"\x08\x07\x06\x05\x04\x03\x02\x01" + b"\x10" + gid
    assert Attachment.decode(data) == Attachment(1, 0x0102030405060708, gid)


@pytest.mark.parametrize("data", [b"", b"\0" * 32, b"\0" * 34, b"\0" * 33])
def test_another_attachment_is_refused(data: bytes) -> None:
    with pytest.raises(MalformedMessage, match="attachment"):
        Attachment.decode(data)


@given(st.integers(-(2**63), 2**63 - 1), st.integers(-(2**63), 2**63 - 1), st.binary(min_size=16, max_size=16))
def test_attachments_come_back(sequence: int, stamp_ns: int, gid: bytes) -> None:
    assert Attachment.decode(Attachment(sequence, stamp_ns, gid).encode()) == Attachment(sequence, stamp_ns, gid)


def test_the_same_request_has_the_same_id_and_another_has_another() -> None:
    gid = gid_of("token")
    assert Attachment(1, 5, gid).name() == Attachment(1, 5, gid).name()
    assert len({Attachment(n, t, gid).name() for n in range(3) for t in range(3)}) == 9


def test_string_is_length_with_nul_bytes_nul() -> None:
    assert cdr.encode_string("hi") == bytes.fromhex("0001000003000000686900")
    assert cdr.decode_string(bytes.fromhex("0001000003000000686900") + b"\0\xff\0") == "hi", "padding is seen"
    assert cdr.decode_string(bytes.fromhex("0000000000000003686900")) == "hi", "big-endian"
    assert cdr.decode_string(bytes.fromhex("0001000000000000")) == "", "some write an empty string without NUL"


def test_trigger_is_five_bytes_and_its_response_is_padded_to_four() -> None:
    assert bytes.fromhex("0001000000") == cdr.TRIGGER_REQUEST
    assert cdr.encode_trigger_response(True, "ok") == bytes.fromhex("0001000001000000030000006f6b00")
    for data in (b"\0\1\0\0", b"\0\1\0\0\0", b"\0\1\0\0\0\0\0\0"):
        cdr.check_trigger_request(data)
    for data in (b"", b"\0\1\0", b"\0\1\0\0" + b"\0" * 5, b"\xff\1\0\0\0"):
        with pytest.raises(MalformedMessage, match="cdr"):
            cdr.check_trigger_request(data)


@given(TEXT, st.booleans(), st.binary(max_size=9))
def test_texts_and_responses_come_back_whatever_follows_them(text: str, success: bool, padding: bytes) -> None:
    assert cdr.decode_string(cdr.encode_string(text) + padding) == text
    assert cdr.decode_trigger_response(cdr.encode_trigger_response(success, text) + padding) == (success, text)


@given(st.binary(max_size=64))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    for read in (cdr.decode_string, cdr.decode_trigger_response, cdr.check_trigger_request, Attachment.decode):
        for candidate in (data, b"\0\1\0\0" + data):
            with suppress(MalformedMessage):
                read(candidate)


def test_text_with_nul_is_not_written() -> None:
    with pytest.raises(MalformedMessage, match="NUL"):
        cdr.encode_string("a\0b")
