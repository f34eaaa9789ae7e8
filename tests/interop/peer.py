#!/usr/bin/env python3
"""A peer on Cyclone DDS, for tests/interop/main.rs.

Usage: peer.py SCENARIO DOMAIN. Prints one JSON object per finding; ends with status 0 when the scenario is
through. Needs the PyPI package cyclonedds and nothing of ROS 2: the types below are written down from the
.msg and .srv files, with the names that ROS 2 gives them on the wire.
"""

import json
import sys
import time
from dataclasses import dataclass, field

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

PATIENCE = 20.0

RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
BEST_EFFORT = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(1))
LATCHED = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal, Policy.History.KeepLast(10)
)


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point = field(default_factory=Point)
    orientation: Quaternion = field(default_factory=Quaternion)


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header = field(default_factory=Header)
    pose: Pose = field(default_factory=Pose)


@dataclass
class Gid(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
    data: array[uint8, 16]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
    node_namespace: str
    node_name: str
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


@dataclass
class ParameterValue(IdlStruct, typename="rcl_interfaces::msg::dds_::ParameterValue_"):
    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[uint8] = field(default_factory=list)
    bool_array_value: sequence[bool] = field(default_factory=list)
    integer_array_value: sequence[int64] = field(default_factory=list)
    double_array_value: sequence[float64] = field(default_factory=list)
    string_array_value: sequence[str] = field(default_factory=list)


@dataclass
class Parameter(IdlStruct, typename="rcl_interfaces::msg::dds_::Parameter_"):
    name: str
    value: ParameterValue


@dataclass
class SetParametersResult(IdlStruct, typename="rcl_interfaces::msg::dds_::SetParametersResult_"):
    successful: bool
    reason: str


@dataclass
class State(IdlStruct, typename="lifecycle_msgs::msg::dds_::State_"):
    id: uint8
    label: str


@dataclass
class Transition(IdlStruct, typename="lifecycle_msgs::msg::dds_::Transition_"):
    id: uint8 = 0
    label: str = ""


# Requests and replies begin with what rmw_cyclonedds_cpp puts before them: who asks, and the number.
# That package's cdds_request_header_t is {uint64_t guid; int64_t seq;}.


@dataclass
class EmptyRequest(IdlStruct):
    guid: uint64
    seq: int64
    structure_needs_at_least_one_member: uint8 = 0


@dataclass
class TriggerRequest(EmptyRequest, typename="std_srvs::srv::dds_::Trigger_Request_"):
    pass


@dataclass
class TriggerReply(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Response_"):
    guid: uint64
    seq: int64
    success: bool
    message: str


@dataclass
class GetParametersRequest(IdlStruct, typename="rcl_interfaces::srv::dds_::GetParameters_Request_"):
    guid: uint64
    seq: int64
    names: sequence[str]


@dataclass
class GetParametersReply(IdlStruct, typename="rcl_interfaces::srv::dds_::GetParameters_Response_"):
    guid: uint64
    seq: int64
    values: sequence[ParameterValue]


@dataclass
class SetParametersRequest(IdlStruct, typename="rcl_interfaces::srv::dds_::SetParameters_Request_"):
    guid: uint64
    seq: int64
    parameters: sequence[Parameter]


@dataclass
class SetParametersReply(IdlStruct, typename="rcl_interfaces::srv::dds_::SetParameters_Response_"):
    guid: uint64
    seq: int64
    results: sequence[SetParametersResult]


@dataclass
class ListParametersRequest(IdlStruct, typename="rcl_interfaces::srv::dds_::ListParameters_Request_"):
    guid: uint64
    seq: int64
    prefixes: sequence[str]
    depth: uint64


@dataclass
class ListParametersReply(IdlStruct, typename="rcl_interfaces::srv::dds_::ListParameters_Response_"):
    guid: uint64
    seq: int64
    names: sequence[str]
    prefixes: sequence[str]


@dataclass
class GetStateRequest(EmptyRequest, typename="lifecycle_msgs::srv::dds_::GetState_Request_"):
    pass


@dataclass
class GetStateReply(IdlStruct, typename="lifecycle_msgs::srv::dds_::GetState_Response_"):
    guid: uint64
    seq: int64
    current_state: State


@dataclass
class ChangeStateRequest(IdlStruct, typename="lifecycle_msgs::srv::dds_::ChangeState_Request_"):
    guid: uint64
    seq: int64
    transition: Transition


@dataclass
class ChangeStateReply(IdlStruct, typename="lifecycle_msgs::srv::dds_::ChangeState_Response_"):
    guid: uint64
    seq: int64
    success: bool


def tell(**finding):
    print(json.dumps(finding), flush=True)


def until(what, look):
    """What `look` finds that is not None, within the patience."""
    since = time.monotonic()
    while time.monotonic() - since < PATIENCE:
        found = look()
        if found is not None:
            return found
        time.sleep(0.01)
    sys.exit(f"{what}: not within {PATIENCE} s")


def take(reader):
    """The next valid sample, or None."""
    for sample in reader.take(N=1):
        if sample.sample_info.valid_data:
            return sample
    return None


class Client:
    """A service client as rmw_cyclonedds_cpp writes it."""

    def __init__(self, participant, name, request, reply, guid=0x1122334455667788):
        self.request, self.guid, self.seq = request, guid, 0
        requests = Topic(participant, f"rq{name}Request", request, qos=RELIABLE)
        replies = Topic(participant, f"rr{name}Reply", reply, qos=RELIABLE)
        self.replies = DataReader(participant, replies, qos=RELIABLE)
        self.requests = DataWriter(participant, requests, qos=RELIABLE)
        self.name = name

    def call(self, *body):
        """One request, sent once; the one reply to it."""
        until(f"{self.name}: a server", lambda: self.requests.get_matched_subscriptions() or None)
        self.seq += 1
        self.requests.write(self.request(self.guid, self.seq, *body))

        def answered():
            reply = take(self.replies)
            return reply if reply and (reply.guid, reply.seq) == (self.guid, self.seq) else None

        return until(f"{self.name}: a reply", answered)


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
