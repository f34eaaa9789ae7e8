"""A peer in Python: reads the poses of a swarm and leads its robot 0 to a metre above robot 2.

Usage: peer.py DOMAIN SWARM; needs `pip install iceoryx2`. The layouts are those of src/shm/payload.rs.
"""

import ctypes
import sys
import time

import iceoryx2 as iox2


class Header(ctypes.Structure):
    _fields_ = [("sequence", ctypes.c_uint64), ("step", ctypes.c_uint64), ("stamp", ctypes.c_double)]

    @staticmethod
    def type_name() -> str:
        return "FlockformHeader_v1"


class Pose(ctypes.Structure):
    _fields_ = [
        ("member", ctypes.c_uint32),
        ("frame", ctypes.c_uint32),
        ("position", ctypes.c_double * 2),
        ("yaw", ctypes.c_double),
        ("stamp", ctypes.c_double),
    ]

    @staticmethod
    def type_name() -> str:
        return "FlockformPose_v1"


class Leader(ctypes.Structure):
    _fields_ = [("member", ctypes.c_uint32), ("reserved", ctypes.c_uint32), ("position", ctypes.c_double * 2)]

    @staticmethod
    def type_name() -> str:
        return "FlockformLeader_v1"


def service(node, name, kind):
    name = iox2.ServiceName.new(name)
    slices = node.service_builder(name).publish_subscribe(iox2.Slice[kind]).user_header(Header).open()
    return slices, node.service_builder(name).event().open()


def main(domain, swarm):
    iox2.set_log_level_from_env_or(iox2.LogLevel.Error)
    config = iox2.config.global_config()
    config.global_cfg.prefix = iox2.FileName.new(domain + "_")
    node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)
    slices, bell = service(node, f"flockform/{swarm}/poses", Pose)
    poses, rings = slices.subscriber_builder().create(), bell.listener_builder().create()
    slices, bell = service(node, f"flockform/{swarm}/leaders", Leader)
    leaders = slices.publisher_builder().initial_max_slice_len(1).create()
    ringer = bell.notifier_builder().create()
    sequence = 0
    while True:
        rings.timed_wait(iox2.Duration.from_millis(100))
        while (sample := poses.receive()) is not None:
            payload = sample.payload()
            # A slice's len() is in bytes.
            count = payload.len() // ctypes.sizeof(Pose)
            where = {payload[k].member: tuple(payload[k].position) for k in range(count)}
            del payload, sample
            x, y = where[2]
            if sequence == 0:
                print(f"{count} poses, robot 2 at {x} {y}, header {Header.type_name()}", flush=True)
            loan = leaders.loan_slice_uninit(1)
            loan.user_header()[0] = Header(sequence, 0, time.time())
            loan.payload()[0] = Leader(0, 0, (ctypes.c_double * 2)(x, y + 1.0))
            loan.assume_init().send()
            ringer.notify()
            sequence += 1


main(sys.argv[1], sys.argv[2])
