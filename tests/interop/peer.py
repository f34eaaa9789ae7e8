#!/usr/bin/env python3
"""A peer on Cyclone DDS that goes through one scenario, for tests/interop/edge.rs.

Usage: peer.py SCENARIO DOMAIN. Prints one JSON object per finding; ends with status 0 when the scenario is
through.
"""

import sys

from wire import *


def scenario_graph(participant):
    topic = Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo, qos=LATCHED)
    reader = DataReader(participant, topic, qos=LATCHED)

    def complete():
        sample = take(reader)
        if sample is None or len(sample.node_entities_info_seq) < 2:
            return None
        return sample

    for node in until("nodes", complete).node_entities_info_seq:
        tell(
            node=f"{node.node_namespace} {node.node_name}",
            readers=len(node.reader_gid_seq),
            writers=len(node.writer_gid_seq),
        )


def scenario_poses(participant):
    out = DataWriter(participant, Topic(participant, "rt/robot_1/pose", PoseStamped), qos=BEST_EFFORT)
    come = DataReader(participant, Topic(participant, "rt/robot_1/target_pose", PoseStamped), qos=RELIABLE)
    pose = PoseStamped(Header(Time(7, 8), "map"), Pose(Point(1.5, 2.5, 3.5), Quaternion(0.0, 0.0, 0.6, 0.8)))

    def exchange():
        out.write(pose)
        return take(come)

    target = until("a target", exchange)
    p, q = target.pose.position, target.pose.orientation
    tell(
        frame=target.header.frame_id,
        stamp=[target.header.stamp.sec, target.header.stamp.nanosec],
        position=[p.x, p.y, p.z],
        orientation=[q.x, q.y, q.z, q.w],
    )


def scenario_late(participant):
    reader = DataReader(participant, Topic(participant, "rt/kept", PoseStamped), qos=LATCHED)
    tell(x=until("what was kept", lambda: take(reader)).pose.position.x)


def scenario_trigger(participant):
    # Two clients at once: each hears both replies and must know its own.
    clients = [Client(participant, "/swarm/stop", TriggerRequest, TriggerReply, guid) for guid in (3, 4)]
    for _ in range(3):
        for client in clients:
            reply = client.call()
            tell(guid=reply.guid, seq=reply.seq, success=reply.success, message=reply.message)


def scenario_parameters(participant):
    get = Client(participant, "/swarm/get_parameters", GetParametersRequest, GetParametersReply)
    set_ = Client(participant, "/swarm/set_parameters", SetParametersRequest, SetParametersReply)
    list_ = Client(participant, "/swarm/list_parameters", ListParametersRequest, ListParametersReply)
    tell(names=list_.call([], 0).names)
    tell(rate=get.call(["rate"]).values[0].double_value)
    for value in (ParameterValue(type=3, double_value=120.0), ParameterValue(type=3, double_value=0.0)):
        result = set_.call([Parameter("rate", value)]).results[0]
        tell(successful=result.successful, reason=result.reason)
    tell(rate=get.call(["rate"]).values[0].double_value)


def scenario_lifecycle(participant):
    state = Client(participant, "/swarm/get_state", GetStateRequest, GetStateReply)
    change = Client(participant, "/swarm/change_state", ChangeStateRequest, ChangeStateReply)
    tell(state=state.call().current_state.label)
    for label in ("activate", "configure", "activate"):
        tell(success=change.call(Transition(0, label)).success, state=state.call().current_state.label)


if __name__ == "__main__":
    scenario, domain = sys.argv[1], int(sys.argv[2])
    globals()[f"scenario_{scenario}"](DomainParticipant(domain))
