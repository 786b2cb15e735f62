"""Topics that may carry gaze are found in the graph of a router."""

from __future__ import annotations

from shift_ros2.gaze_topics import GazeTopic, find_gaze_topics, gaze_topics


def token(kind: str, topic: str, of: str) -> str:
    return f"@ros2_lv/0/zid/0/10/{kind}/%/%/tracker/{topic}/{of}/RIHS01_1/::,10:,:,:,,"


GAZE = token("MP", "%humans%faces%gaze", "hri_msgs::msg::dds_::Gaze_")
TEXT = token("MP", "%shift%gaze", "std_msgs::msg::dds_::String_")


def test_published_topics_are_recognised_by_name_or_type() -> None:
    text, tf = "std_msgs::msg::dds_::String_", "tf2_msgs::msg::dds_::TFMessage_"
    others = [token("MS", "%gaze", text), token("MP", "%tf", tf)]
    assert gaze_topics([GAZE, GAZE, TEXT, *others, "@ros2_lv/0/zid/0/0/NN/%/%/tracker"]) == [
        GazeTopic("/humans/faces/gaze", "hri_msgs/msg/Gaze"), GazeTopic("/shift/gaze", "std_msgs/msg/String"),
    ]  # fmt: skip


def test_without_a_router_there_are_none() -> None:
    assert find_gaze_topics("tcp/127.0.0.1:1") == []
