"""Reads a recording with the packages `mcap` and `rosbags`, and holds every message against the values expected.

    read_mcap.py RECORDING.mcap EXPECTED.jsonl

A line of EXPECTED is {"topic": ..., "type": ..., "message": {...}}, in the order of the file; null stands for a
number that is not finite.
"""

import json
import math
import struct
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2.metadata import parse_qos
from ruamel.yaml import YAML


def single(value):
    """The nearest number of 32 bits."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


def same(expected, found, where):
    if isinstance(expected, dict):
        for name, value in expected.items():
            same(value, getattr(found, name), f"{where}.{name}")
    elif isinstance(expected, list):
        assert len(expected) == len(found), f"{where}: {len(found)} entries, expected {len(expected)}"
        for number, (one, other) in enumerate(zip(expected, found)):
            same(one, other, f"{where}[{number}]")
    elif expected is None:
        assert not math.isfinite(found), f"{where}: {found}, expected no finite number"
    elif isinstance(expected, float):
        assert expected == found or single(expected) == found, f"{where}: {found}, expected {expected}"
    else:
        assert expected == found, f"{where}: {found}, expected {expected}"


def hold_against_rosbag2(bag, summary, recording):
    """What `ros2 bag info` and `ros2 bag play` take from the file, in the form of metadata version 9."""
    statistics, channels = summary.statistics, summary.channels.values()
    found = YAML(typ="safe").load(bag["serialized_metadata"])
    assert (found["version"], found["storage_identifier"], found["ros_distro"]) == (9, "mcap", "jazzy"), found
    assert found["message_count"] == statistics.message_count, found
    assert found["starting_time"]["nanoseconds_since_epoch"] == statistics.message_start_time, found
    assert found["duration"]["nanoseconds"] == statistics.message_end_time - statistics.message_start_time, found
    assert found["relative_file_paths"] == [Path(recording).name] == [one["path"] for one in found["files"]], found
    topics = {one["topic_metadata"]["name"]: one for one in found["topics_with_message_count"]}
    assert len(topics) == len(channels), topics
    for channel in channels:
        one = topics[channel.topic]
        assert one["topic_metadata"]["type"] == summary.schemas[channel.schema_id].name, one
        assert one["message_count"] == statistics.channel_message_counts[channel.id], one
        # As one text in the channel, and as a list in the record.
        for profiles in (channel.metadata["offered_qos_profiles"], one["topic_metadata"]["offered_qos_profiles"]):
            (profile,) = parse_qos(profiles)
            is_pose = channel.topic.endswith("/pose")
            expected = QosReliability.BEST_EFFORT if is_pose else QosReliability.RELIABLE
            assert profile.reliability == expected, (channel.topic, profile)
            assert profile.durability == QosDurability.VOLATILE, profile
            assert profile.liveliness == QosLiveliness.AUTOMATIC, profile
            assert profile.history == QosHistory.UNKNOWN and profile.depth == 0, profile
            assert profile.deadline == profile.lifespan == QosTime(9223372036, 854775807), profile


def main(recording, expected_path):
    expected = [json.loads(line) for line in Path(expected_path).read_text().splitlines()]
    with open(recording, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header, summary = reader.get_header(), reader.get_summary()
        assert header.profile == "ros2", header.profile
        assert summary.statistics.message_count == len(expected), summary.statistics
        read = 0
        for number, (schema, channel, _, message) in enumerate(reader.iter_decoded_messages(log_time_order=False)):
            one = expected[number]
            assert (channel.topic, schema.name) == (one["topic"], one["type"]), (number, channel.topic, schema.name)
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            same(one["message"], message, f"mcap, {one['topic']} {number}")
            read += 1
        assert read == len(expected), read
        attachments = {one.name: one.data.decode() for one in reader.iter_attachments()}
        metadata = {one.name: one.metadata for one in reader.iter_metadata()}
    hold_against_rosbag2(metadata["rosbag2"], summary, recording)
    assert metadata["flockform"]["source"] in ("swarm", "node", "run"), metadata
    if metadata["flockform"]["source"] != "run":
        assert "title" in attachments["swarm.toml"], attachments

    topics = {}
    for one in expected:
        topics.setdefault(one["topic"], []).append(one)
    with AnyReader([Path(recording)]) as reader:
        read = 0
        for connection, _, payload in reader.messages():
            one = topics[connection.topic].pop(0)
            assert connection.msgtype == one["type"], connection
            message = reader.deserialize(payload, connection.msgtype)
            same(one["message"], message, f"rosbags, {connection.topic} {read}")
            read += 1
        assert read == len(expected), read
    print(f"{read} messages")


main(*sys.argv[1:])
