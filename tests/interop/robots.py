#!/usr/bin/env python3
"""Robots on Cyclone DDS: poses out, targets in, each exactly at its target a period later.

Usage: robots.py DOMAIN SPEC. SPEC is a JSON object:
  robots     name to place [m], in the order of the formation
  rate       poses a second [Hz]
  frame      frame_id of the poses
  pose_type  "pose-stamped" (default) or "pose-array"
  pose_topic of the array
  target_topic of the array of targets, where they come in one
  batch      this process's robots by number, [first, end); all unless given
Commands on the standard input, one JSON object a line, name to what is wrong with that robot from now on: "silent",
"nan", "infinity", "frame", "past", "future", "twice", "reversed" or null for nothing; or {"stop": true}: no more
poses, but targets are still taken.
Five times a second a line says what came: see report().
"""

from wire import *

SAID = {"nan": (math.nan, 0.0), "infinity": (math.inf, 0.0), "past": (0.0, -3600.0), "future": (0.0, 3600.0)}


class Robots:
    def __init__(self, participant, spec):
        first, end = spec.get("batch", [0, len(spec["robots"])])
        names = list(spec["robots"])[first:end]
        self.places = {name: list(spec["robots"][name]) for name in names}
        self.frame, self.wrong = spec["frame"], {}
        self.received = dict.fromkeys(names, 0)
        self.sent = self.not_finite = 0
        self.before = {}
        self.stopped = False

        def topic(name, leaf):
            return Topic(participant, f"rt/{name}/{leaf}", PoseStamped)

        self.targets, self.target_array = {}, None
        if "target_topic" in spec:
            of_all = Topic(participant, f"rt{spec['target_topic']}", PoseArray)
            self.target_array = DataReader(participant, of_all, qos=DEEP)
        else:
            self.targets = {name: DataReader(participant, topic(name, "target_pose"), qos=DEEP) for name in names}
        if spec.get("pose_type") == "pose-array":
            out = Topic(participant, f"rt{spec['pose_topic']}", PoseArray)
            self.array, self.poses = DataWriter(participant, out, qos=BEST_EFFORT), {}
        else:
            out = {name: DataWriter(participant, topic(name, "pose"), qos=BEST_EFFORT) for name in names}
            self.array, self.poses = None, out

    def hear(self):
        for name, reader in self.targets.items():
            for target in reader.take(N=100):
                if target.sample_info.valid_data:
                    self.go(name, target.pose)
        for message in self.target_array.take(N=100) if self.target_array else []:
            if message.sample_info.valid_data:
                for name, pose in zip(self.places, message.poses):
                    self.go(name, pose)

    def go(self, name, pose):
        place = [pose.position.x, pose.position.y]
        self.received[name] += 1
        if all(map(math.isfinite, place)):
            self.places[name] = place
        else:
            self.not_finite += 1

    def say(self, stamp):
        if self.stopped:
            return
        if self.array:
            poses = [Pose(Point(*place)) for place in self.places.values()]
            self.array.write(PoseArray(header(stamp, self.frame), poses))
            self.sent += 1
            return
        for name, out in self.poses.items():
            what = self.wrong.get(name)
            if what == "silent":
                continue
            shift, later = SAID.get(what, (0.0, 0.0))
            x, y = self.places[name]
            frame = "elsewhere" if what == "frame" else self.frame
            pose = PoseStamped(header(stamp + later, frame), Pose(Point(x + shift, y)))
            out.write(pose)
            self.sent += 1
            if what == "twice":
                out.write(pose)
            if what == "reversed" and name in self.before:
                out.write(self.before[name])
            self.before[name] = pose

    def report(self):
        tell(
            places=self.places,
            received=self.received,  # targets, by robot
            sent=self.sent,  # messages with poses
            not_finite=self.not_finite,  # targets that are no place
            heard=[] if self.array else sorted(name for name, out in self.poses.items() if out.get_matched_subscriptions()),
            sent_to=sorted(name for name, way in self.targets.items() if way.get_matched_publications()),
        )


# Robots take the newest target alone; here everything counts.
DEEP = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(100))


def header(stamp, frame):
    seconds = math.floor(stamp)
    return Header(Time(seconds, int((stamp - seconds) * 1e9)), frame)


def fly(participant, spec):
    robots, orders, period = Robots(participant, spec), commands(), 1.0 / spec["rate"]
    start, began, tick, told = time.time(), time.monotonic(), 0, -1.0
    while True:
        tick += 1
        rest = began + tick * period - time.monotonic()
        if rest > 0.0:
            time.sleep(rest)
        while not orders.empty():
            order = orders.get()
            robots.stopped = order.pop("stop", robots.stopped)
            robots.wrong.update(order)
        robots.hear()
        # Stamped with when it was due: a pose that is lost shows as a gap of a whole period.
        robots.say(start + tick * period)
        if tick * period - told >= 0.2:
            told = tick * period
            robots.report()


if __name__ == "__main__":
    fly(DomainParticipant(int(sys.argv[1])), json.loads(sys.argv[2]))
