"""The graph as Cyclone DDS knows it: participants of others, and the topics of their endpoints, a line at each change.

graph.py DOMAIN _
"""

import json
import sys
import time

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState
from cyclonedds.domain import DomainParticipant


def alive(reader):
    """The instances of a builtin topic that have not left."""
    samples = (sample for sample in reader.read(4096) if sample is not None)
    return [sample for sample in samples if sample.sample_info.instance_state == InstanceState.Alive]


def main():
    participant = DomainParticipant(int(sys.argv[1]))
    own = str(participant.guid)
    kinds = (BuiltinTopicDcpsParticipant, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription)
    readers = [BuiltinDataReader(participant, kind) for kind in kinds]
    last = None
    while True:
        participants, written, read = (alive(reader) for reader in readers)
        graph = {"participants": sorted(str(one.key) for one in participants if str(one.key) != own)}
        for name, endpoints in (("writers", written), ("readers", read)):
            graph[name] = sorted(one.topic_name for one in endpoints if str(one.participant_key) != own)
        if graph != last:
            print(json.dumps(graph), flush=True)
            last = graph
        time.sleep(0.02)


main()
