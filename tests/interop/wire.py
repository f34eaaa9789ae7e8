"""What the peers of tests/interop share: messages and services as ROS 2 has them on the wire.

The types are written down from the .msg and .srv files, with the names that ROS 2 gives them on the wire.
Needs the PyPI package cyclonedds and nothing of ROS 2.
"""

import json
import math
import os
import queue
import sys
import threading
import time
from dataclasses import dataclass, field, fields

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
class PoseArray(IdlStruct, typename="geometry_msgs::msg::dds_::PoseArray_"):
    header: Header = field(default_factory=Header)
    poses: sequence[Pose] = field(default_factory=list)


@dataclass
class MemberState(IdlStruct, typename="flockform_msgs::msg::dds_::MemberState_"):
    name: str
    role: uint8
    health: uint8
    position: Point
    target: Point
    settled: Point
    displacement: Point
    pe1: float64
    strain: array[float64, 3]
    rotation: float64
    age: float64
    clearance: float64
    to_settled: float64
    flags: uint32


@dataclass
class FormationState(IdlStruct, typename="flockform_msgs::msg::dds_::FormationState_"):
    header: Header
    formation: str
    tick: uint64
    mode: uint8
    formation_error: float64
    clearance: float64
    pe1_sum: float64
    strain_max: float64
    elapsed: float64
    members: sequence[MemberState]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


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
class Log(IdlStruct, typename="rcl_interfaces::msg::dds_::Log_"):
    stamp: Time
    level: uint8
    name: str
    msg: str
    file: str
    function: str
    line: uint32


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
class FloatingPointRange(IdlStruct, typename="rcl_interfaces::msg::dds_::FloatingPointRange_"):
    from_value: float64
    to_value: float64
    step: float64


@dataclass
class IntegerRange(IdlStruct, typename="rcl_interfaces::msg::dds_::IntegerRange_"):
    from_value: int64
    to_value: int64
    step: uint64


@dataclass
class ParameterDescriptor(IdlStruct, typename="rcl_interfaces::msg::dds_::ParameterDescriptor_"):
    name: str
    type: uint8
    description: str
    additional_constraints: str
    read_only: bool
    dynamic_typing: bool
    floating_point_range: sequence[FloatingPointRange]
    integer_range: sequence[IntegerRange]


@dataclass
class DescribeParametersRequest(IdlStruct, typename="rcl_interfaces::srv::dds_::DescribeParameters_Request_"):
    guid: uint64
    seq: int64
    names: sequence[str]


@dataclass
class DescribeParametersReply(IdlStruct, typename="rcl_interfaces::srv::dds_::DescribeParameters_Response_"):
    guid: uint64
    seq: int64
    descriptors: sequence[ParameterDescriptor]


@dataclass
class SetFormationRequest(IdlStruct, typename="flockform_msgs::srv::dds_::SetFormation_Request_"):
    guid: uint64
    seq: int64
    name: str
    translate: array[float64, 2]
    rotate: float64
    stretch: array[float64, 2]
    shear: array[float64, 2]
    duration: float64


@dataclass
class SetFormationReply(IdlStruct, typename="flockform_msgs::srv::dds_::SetFormation_Response_"):
    guid: uint64
    seq: int64
    success: bool
    message: str


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


def plain(value):
    """A message as JSON has it: numbers that are none become null."""
    if isinstance(value, IdlStruct):
        return {one.name: plain(getattr(value, one.name)) for one in fields(value)}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def tell(**finding):
    print(json.dumps(plain(finding), allow_nan=False), flush=True)


def commands():
    """A queue of the JSON objects that come line by line on the standard input."""
    heard = queue.SimpleQueue()

    def listen():
        for line in sys.stdin:
            heard.put(json.loads(line))
        os._exit(0)  # Whoever started us is gone.

    threading.Thread(target=listen, daemon=True).start()
    return heard


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
        """One request, sent once, when the server is available as rmw_cyclonedds_cpp has it: both its ends
        are known. The one reply to it."""

        def available():
            return (self.requests.get_matched_subscriptions() and self.replies.get_matched_publications()) or None

        until(f"{self.name}: a server", available)
        self.seq += 1
        self.requests.write(self.request(self.guid, self.seq, *body))

        def answered():
            reply = take(self.replies)
            return reply if reply and (reply.guid, reply.seq) == (self.guid, self.seq) else None

        return until(f"{self.name}: a reply", answered)
