//! The present place and velocity of a robot that speeds up and brakes, by its model: from the poses that arrived and
//! the targets sent since. Of a robot that takes no time to brake the same targets say where it may be.
//!
//! Two poses give only the mean velocity between them, which is already out of date. The braking distance of a robot
//! grows with its present velocity, so its model is run beside it: every target moves both, and every pose corrects
//! the model by an alpha-beta filter, whose gains are those of a steady Kalman filter for places of this noise and a
//! robot pushed about at random (P. R. Kalata, "The tracking index: a generalized parameter for alpha-beta and
//! alpha-beta-gamma target trackers", IEEE Transactions on Aerospace and Electronic Systems 20(2), 1984).

use std::collections::VecDeque;

use super::Pose;
use crate::flock::vectors::distance;
use crate::swarm::robots::{DoubleIntegrator, Model, Robot};

/// Deviation of what pushes a robot away from its model, in units of its acceleration limit \[1\].
const PUSHED: f64 = 0.5;

/// The gains by which a pose's deviation from the model corrects the state, and the noise that is left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Into the place \[1\].
    pub alpha: f64,
    /// Into the velocity, times the period \[1\].
    pub beta: f64,
    /// Standard deviation of each coordinate of the velocity \[m/s\].
    pub velocity_deviation: f64,
}

impl Gains {
    /// For a robot of this acceleration limit \[m/s^2\], a pose in every period \[s\] and the standard deviation of each
    /// of its coordinates \[m\].
    pub fn of(acceleration: f64, period: f64, deviation: f64) -> Self {
        if deviation <= 0.0 {
            // The limit is beta = 2, which would keep the error of a wrong model for ever, to and fro.
            return Self { alpha: 1.0, beta: 1.0, velocity_deviation: 0.0 };
        }
        let index = PUSHED * acceleration * period * period / deviation;
        let root = (4.0 + index - (8.0 * index + index * index).sqrt()) / 4.0;
        let alpha = 1.0 - root * root;
        let beta = (2.0 * (1.0 - root) * (1.0 - root)).min(1.0);
        let share = beta * (alpha - 0.5 * beta) / (1.0 - alpha);
        Self { alpha, beta, velocity_deviation: share.max(0.0).sqrt() * deviation / period }
    }
}

/// The state of one robot, followed.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// At `stamp`, corrected by the pose of that time.
    robot: Robot,
    /// \[s\]; absent before the first pose.
    stamp: Option<f64>,
    /// The place of the last pose \[m\].
    seen: [f64; 2],
    /// Bound on the error of the velocity where the last pose disagreed with the model: what the robot has done since the
    /// one before is then not known \[m/s\].
    doubt: f64,
    /// Whether more than one pose is known: one alone gives no velocity.
    has_moved_on: bool,
    /// Targets sent since, each with the time from which it holds \[s\].
    sent: VecDeque<(f64, Option<[f64; 2]>)>,
}

/// Targets, or velocities, that are kept: older ones are of a robot that has long been lost.
pub(in crate::swarm) const MOST_SENT: usize = 1024;

/// Distance of a pose from the model up to which they agree, in units of the way that the acceleration makes \[1\], and
/// of the deviation of poses \[1\].
const SURPRISE: f64 = 1e-6;
const NOISE: f64 = 9.0;

/// Bound on the error of a velocity behind poses that are inexact, in units of what the acceleration changes between two \[1\].
const INEXACT: f64 = 4.0;

/// Part of a period within which two times are one \[1\].
const TOGETHER: f64 = 1e-6;

/// Speed below which a robot is at rest, in units of what it takes up in a period \[1\].
const AT_REST: f64 = 1e-12;

impl Track {
    /// Takes in a pose that is believed; without it the robot goes on as its model does.
    pub fn correct(&mut self, pose: &Pose, dynamics: &DoubleIntegrator, period: f64, deviation: f64) {
        let Some(since) = self.stamp.filter(|&since| since < pose.stamp) else {
            return self.restart(pose, period);
        };
        let expected = self.run(self.robot, pose.stamp, dynamics, period, &mut |_| {});
        let surprise = [0, 1].map(|k| pose.position[k] - expected.position[k]);
        let time = (pose.stamp - since).max(period);
        let off = distance(pose.position, expected.position);
        // Farther than it can have gone: the pose gives no information on its velocity.
        if off > 2.0 * dynamics.speed * time + 12.0 * deviation {
            return self.restart(pose, period);
        }
        let is_surprise = off > SURPRISE * dynamics.acceleration * time * time + NOISE * deviation;
        let led = dynamics.acceleration * time;
        // Poses that are farther off than any robot of this model can be are inexact, which the velocity then is too.
        let most = if off > led * time + NOISE * deviation { INEXACT * led } else { led };
        // The errors before and after the pose add up to what it is off: they may cancel, and a half is left in the end.
        self.doubt = if is_surprise { most.min((2.0 * off / time).max(0.5 * self.doubt)) } else { 0.0 };
        let gains = Gains::of(dynamics.acceleration, period, deviation);
        // No robot of this model has changed its velocity by more, unless nothing was known of it.
        let change = gains.beta * off / time;
        let share = if self.has_moved_on { (2.0 * led / change).min(1.0) } else { 1.0 };
        self.has_moved_on = true;
        let size = |[x, y]: [f64; 2]| x.hypot(y);
        // One whose limit has been lowered is still faster for a while.
        let fastest = dynamics.speed.max(size(self.robot.velocity));
        self.robot = expected;
        self.robot.position = [0, 1].map(|k| expected.position[k] + gains.alpha * surprise[k]);
        self.robot.velocity = [0, 1].map(|k| expected.velocity[k] + share * gains.beta * surprise[k] / time);
        let speed = size(self.robot.velocity);
        if speed > fastest {
            self.robot.velocity = self.robot.velocity.map(|v| v * fastest / speed);
        }
        self.begin(pose, period);
    }

    /// Takes in a pose that is believed, of a robot that takes no time to brake.
    pub fn note(&mut self, pose: &Pose, period: f64) {
        match self.stamp {
            Some(since) if since < pose.stamp => self.begin(pose, period),
            _ => self.restart(pose, period),
        }
    }

    /// Forgets the targets.
    pub fn forget(&mut self) {
        self.sent.clear();
    }

    /// The places between which such a robot is if it goes straight to its targets: that of its last pose, and those to
    /// which it was sent since, by commands that take no more than a period to reach it. Empty where they are not known.
    pub fn between(&self, places: &mut Vec<[f64; 2]>) {
        if self.sent.front().zip(self.stamp).is_some_and(|((from, _), stamp)| *from <= stamp) {
            places.push(self.seen);
            places.extend(self.sent.iter().filter_map(|&(_, target)| target));
        }
    }

    /// Whether the last pose that was believed is of this place \[m\].
    pub fn is_of(&self, place: [f64; 2]) -> bool {
        self.stamp.is_some() && self.seen == place
    }

    /// Notes the target \[m\] that holds from `now` \[s\] on; `None` where the robot is to come to rest.
    pub fn send(&mut self, now: f64, target: Option<[f64; 2]>) {
        // Before the first one it may be on its way to where another loop sent it.
        if target.is_none() && self.sent.back().is_none_or(|(_, last)| last.is_none()) {
            return;
        }
        if self.sent.len() == MOST_SENT {
            self.sent.pop_front();
        }
        self.sent.push_back((now, target));
    }

    /// Bound on the error of the place at which the robot of [`Track::at`] comes to rest, by its doubt and at three
    /// deviations of its velocity \[m\].
    pub fn stray(
        &self,
        robot: &Robot,
        now: f64,
        dynamics: &DoubleIntegrator,
        gains: &Gains,
        period: f64,
    ) -> f64 {
        let speed = robot.velocity[0].hypot(robot.velocity[1]);
        let age = self.stamp.map_or(0.0, |stamp| (now - stamp).max(0.0));
        (speed / dynamics.acceleration + period + age) * (3.0 * gains.velocity_deviation + self.doubt)
    }

    /// The robot at `now` \[s\] if it follows its targets. Where it is if it stopped following them at some time since its
    /// last pose is put into `places` \[m\]: it may stand where it was by then, or come to rest from there.
    pub fn at(
        &self,
        now: f64,
        dynamics: &DoubleIntegrator,
        period: f64,
        places: &mut Vec<[f64; 2]>,
    ) -> Robot {
        places.clear();
        let mut note = |robot: &Robot| {
            let [x, y] = robot.position;
            let way = dynamics.braking_way(robot.velocity, period);
            places.extend([[x, y], [x + way[0], y + way[1]]]);
        };
        let found = self.run(self.robot, now, dynamics, period, &mut note);
        // At such velocities it would be elsewhere by now; at none it has just been let go.
        if self.doubt > 0.0 {
            let [x, y] = self.robot.velocity;
            let by = self.doubt;
            for velocity in [[0.0; 2], [x + by, y], [x - by, y], [x, y + by], [x, y - by]] {
                let other = self.run(Robot { velocity, ..self.robot }, now, dynamics, period, &mut note);
                note(&other);
            }
        }
        found
    }

    fn restart(&mut self, pose: &Pose, period: f64) {
        // The clock has been set back: times of before mean nothing.
        if self.stamp.is_some_and(|stamp| stamp > pose.stamp) {
            self.sent.clear();
        }
        (self.robot, self.doubt, self.has_moved_on) = (Robot::at(pose.position, pose.yaw), 0.0, false);
        self.begin(pose, period);
    }

    /// Takes a pose for the last one.
    fn begin(&mut self, pose: &Pose, period: f64) {
        (self.stamp, self.seen) = (Some(pose.stamp), pose.position);
        // By then the robot has the command of a period ago, or of a longer one of before, and goes to its target, no more to the one
        // before: where it has come on the way to that is the place of the pose.
        let is_over = |by: f64| by <= pose.stamp;
        let is_heard = |from: f64| is_over(from + period * (1.0 - TOGETHER));
        while self.sent.get(1).is_some_and(|&(from, _)| is_heard(from))
            && self.sent.get(2).is_none_or(|&(from, _)| is_over(from))
        {
            self.sent.pop_front();
        }
    }

    /// The model from this state at `stamp` until a time \[s\]; `leaves` sees the robot wherever it begins to go somewhere else.
    fn run(
        &self,
        mut robot: Robot,
        until: f64,
        dynamics: &DoubleIntegrator,
        period: f64,
        leaves: &mut dyn FnMut(&Robot),
    ) -> Robot {
        let Some(stamp) = self.stamp else { return robot };
        let model = Model::DoubleIntegrator(*dynamics);
        // Before it is sent anywhere from here, another program may drive it, and goes on with that: a robot that is taken to stand would be
        // taken to speed up by every pose.
        let unsent = self.sent.front().map_or(until, |&(from, _)| from.min(until)) - stamp;
        if unsent > 0.0 {
            leaves(&robot);
            robot.position = [0, 1].map(|k| robot.position[k] + unsent * robot.velocity[k]);
        }
        let mut step = |robot: &mut Robot, target: [f64; 2], time: f64| {
            if time > 0.0 {
                leaves(robot);
                robot.step(&model, target, time);
            }
        };
        let at_rest = AT_REST * dynamics.acceleration * period;
        for (k, &(from, target)) in self.sent.iter().enumerate() {
            let end = self.sent.get(k + 1).map_or(until, |&(next, _)| next.min(until));
            let mut time = from.max(stamp);
            if let Some(target) = target {
                step(&mut robot, target, end - time);
                continue;
            }
            // In every period it is sent to where it is by then.
            while time < end && robot.velocity[0].hypot(robot.velocity[1]) > at_rest {
                let here = robot.position;
                step(&mut robot, here, period.min(end - time));
                time += period;
            }
        }
        robot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 0.05;
    const DYNAMICS: DoubleIntegrator = DoubleIntegrator { speed: 1.2, acceleration: 0.8 };

    /// Poses until noise is smoothed.
    const SETTLED: usize = 20;

    /// Largest error of place and velocity, behind poses so many periods late, each heard with this noise.
    fn worst(late: usize, noise: impl Fn(usize) -> [f64; 2], deviation: f64) -> [f64; 2] {
        let (mut robot, mut track) = (Robot::at([0.0; 2], 0.0), Track::default());
        let mut poses = Vec::new();
        let (mut place, mut velocity) = (0.0_f64, 0.0_f64);
        for k in 0..400 {
            let now = k as f64 * PERIOD;
            let position = [0, 1].map(|axis| robot.position[axis] + noise(k)[axis]);
            poses.push(Pose { position, yaw: 0.0, stamp: now, frame_is_right: true });
            if k >= late {
                track.correct(&poses[k - late], &DYNAMICS, PERIOD, deviation);
            }
            // The first poses have nothing to be smoothed with.
            if k >= late + if deviation > 0.0 { SETTLED } else { 0 } {
                let found = track.at(now, &DYNAMICS, PERIOD, &mut Vec::new());
                place = place.max(distance(found.position, robot.position));
                velocity = velocity.max(distance(found.velocity, robot.velocity));
            }
            let target = [2.0 * (0.05 * k as f64).sin(), 1.5 * (0.031 * k as f64).cos()];
            track.send(now, Some(target));
            robot.step(&Model::DoubleIntegrator(DYNAMICS), target, PERIOD);
        }
        [place, velocity]
    }

    #[test]
    fn a_robot_that_does_as_its_model_is_known_exactly_however_late_its_poses_are() {
        for late in [0, 1, 4] {
            let [place, velocity] = worst(late, |_| [0.0; 2], 0.0);
            assert!(place < 1e-12 && velocity < 1e-12, "{late}: {place:e}, {velocity:e}");
        }
    }

    #[test]
    fn noise_is_smoothed_to_a_fraction_of_itself() {
        // Quasi-random, even over +-1: its deviation is 0.577.
        let even = |k: usize, step: f64| 2.0 * (k as f64 * step).fract() - 1.0;
        let noise = |k| [0.02 * even(k, 0.618_034), 0.02 * even(k, 0.414_214)];
        let deviation = 0.02 * 0.577;
        let [place, velocity] = worst(0, noise, deviation);
        let gains = Gains::of(DYNAMICS.acceleration, PERIOD, deviation);
        assert!(place < 2.0 * deviation, "{place}");
        assert!(velocity < 3.0 * gains.velocity_deviation, "{velocity}: {gains:?}");
        assert!(gains.velocity_deviation < 0.2 * deviation / PERIOD, "{gains:?}");
    }

    #[test]
    fn a_robot_that_stopped_at_any_time_since_its_last_pose_is_at_one_of_its_places() {
        for (late, dies) in [0, 3, 7].into_iter().flat_map(|late| (20..60).map(move |dies| (late, dies))) {
            let (mut robot, mut track) = (Robot::at([0.0; 2], 0.0), Track::default());
            let (mut poses, mut places) = (Vec::new(), Vec::new());
            for k in 0usize..80 {
                let now = k as f64 * PERIOD;
                if k < dies {
                    poses.push(Pose { position: robot.position, yaw: 0.0, stamp: now, frame_is_right: true });
                }
                if let Some(pose) = k.checked_sub(late).and_then(|sent| poses.get(sent)) {
                    track.correct(pose, &DYNAMICS, PERIOD, 0.0);
                }
                let found = track.at(now, &DYNAMICS, PERIOD, &mut places).position;
                let near = |place: &[f64; 2]| distance(*place, robot.position) < 1e-12;
                assert!(
                    k < late || near(&found) || places.iter().any(near),
                    "{late} late, dead at {dies}, {k}: {robot:?}"
                );
                let target = [2.0 * (0.05 * k as f64).sin(), 1.5 * (0.031 * k as f64).cos()];
                // It is lost after a while.
                let target = (k < dies + 10).then_some(target);
                track.send(now, target);
                if k < dies {
                    robot.step(&Model::DoubleIntegrator(DYNAMICS), target.unwrap_or(robot.position), PERIOD);
                }
            }
        }
    }

    #[test]
    fn a_robot_whose_speed_limit_is_lowered_is_known_while_it_slows_down() {
        let slow = DoubleIntegrator { speed: 0.3, ..DYNAMICS };
        let (mut robot, mut track) = (Robot::at([0.0; 2], 0.0), Track::default());
        for k in 0..80 {
            let now = f64::from(k) * PERIOD;
            let dynamics = if k < 50 { DYNAMICS } else { slow };
            let pose = Pose { position: robot.position, yaw: 0.0, stamp: now, frame_is_right: true };
            track.correct(&pose, &dynamics, PERIOD, 0.0);
            let found = track.at(now, &dynamics, PERIOD, &mut Vec::new());
            let off = distance(found.velocity, robot.velocity);
            assert!(off <= DYNAMICS.acceleration * PERIOD, "{k}: {found:?}, {robot:?}");
            // It is sent to where it comes to rest after it.
            let before = robot;
            robot.step(&Model::DoubleIntegrator(dynamics), [9.0, 0.0], PERIOD);
            let way = dynamics.braking_way(robot.velocity, PERIOD);
            let target = [0, 1].map(|axis| robot.position[axis] + way[axis]);
            track.send(now, Some(target));
            robot = before;
            robot.step(&Model::DoubleIntegrator(DYNAMICS), target, PERIOD);
        }
        assert!(robot.velocity[0] < 0.31, "{robot:?}");
    }

    #[test]
    fn the_velocity_behind_inexact_poses_is_off_by_no_more_than_its_doubt_allows_for() {
        let even = |k: i32, step: f64| 2.0 * (f64::from(k) * step).fract() - 1.0;
        // Up to twice as far off as the acceleration leads in a period.
        for size in [0.0002, 0.001, 0.003] {
            let (mut robot, mut track, mut late) = (Robot::at([0.0; 2], 0.0), Track::default(), 0);
            for k in 0..400 {
                let now = f64::from(k) * PERIOD;
                let off = [size * even(k, 0.618_034), size * even(k, 0.414_214)];
                let position = [0, 1].map(|axis| robot.position[axis] + off[axis]);
                let pose = Pose { position, yaw: 0.0, stamp: now, frame_is_right: true };
                track.correct(&pose, &DYNAMICS, PERIOD, 0.0);
                let found = track.at(now, &DYNAMICS, PERIOD, &mut Vec::new());
                late += i32::from(distance(found.velocity, robot.velocity) > track.doubt);
                let target = [2.0 * (0.05 * f64::from(k)).sin(), 1.5 * (0.031 * f64::from(k)).cos()];
                track.send(now, Some(target));
                robot.step(&Model::DoubleIntegrator(DYNAMICS), target, PERIOD);
            }
            assert!(late < 20, "{size} m: {late} of 400");
        }
    }

    #[test]
    fn a_robot_that_another_program_drives_and_stops_is_known_to_stand() {
        for late in [0, 3] {
            let (mut robot, mut track) = (Robot::at([0.0; 2], 0.0), Track::default());
            let mut poses = Vec::new();
            for k in 0..120 {
                let now = k as f64 * PERIOD;
                poses.push(Pose { position: robot.position, yaw: 0.0, stamp: now, frame_is_right: true });
                if k >= late {
                    track.correct(&poses[k - late], &DYNAMICS, PERIOD, 0.0);
                }
                // A loop that is not active sends it nowhere.
                track.send(now, None);
                let found = track.at(now, &DYNAMICS, PERIOD, &mut Vec::new());
                let off = distance(found.velocity, robot.velocity);
                assert!(
                    off <= (late + 1) as f64 * DYNAMICS.acceleration * PERIOD + 1e-12,
                    "{late}, {k}: {found:?}"
                );
                robot.step(
                    &Model::DoubleIntegrator(DYNAMICS),
                    if k < 50 { [9.0, 0.0] } else { robot.position },
                    PERIOD,
                );
            }
            let found = track.at(120.0 * PERIOD, &DYNAMICS, PERIOD, &mut Vec::new());
            assert!(distance(found.velocity, [0.0; 2]) < 1e-9, "{late}: {found:?}");
            assert!(distance(found.position, robot.position) < 1e-9, "{late}: {found:?}");
        }
    }

    #[test]
    fn a_robot_that_stands_against_its_model_is_seen_to_stand() {
        let mut track = Track::default();
        for k in 0..40 {
            let now = f64::from(k) * PERIOD;
            let pose = Pose { position: [1.0, 2.0], yaw: 0.0, stamp: now, frame_is_right: true };
            track.correct(&pose, &DYNAMICS, PERIOD, 0.0);
            let found = track.at(now, &DYNAMICS, PERIOD, &mut Vec::new());
            assert!(distance(found.velocity, [0.0; 2]) <= DYNAMICS.acceleration * PERIOD, "{found:?}");
            track.send(now, Some([9.0, 2.0]));
        }
    }
}
