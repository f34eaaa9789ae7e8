//! Velocities towards the targets, for robots that are driven so.
//!
//! A late pose is of a place that its robot has left, by the velocities that it was sent since. From there it would be sent on as if it
//! had not: past its target, and to and fro. So each velocity is that from where those before have led (the predictor of
//! O. J. M. Smith, "Closer control of loops with dead time", Chemical Engineering Progress 53(5), 1957). Velocities take time to arrive,
//! and bases to follow them, of which nothing is known here but that poses are late as well: what a robot is off is made up for at a
//! rate of `1 / (T + 2 a)` by the period `T` and the age `a` of its pose, which is stable while that takes no longer than `a + T / 2`.

use std::collections::VecDeque;

use super::control::{Control, Mode};
use super::robots::wrapped;
use super::safety::Limits;
use super::watch::{MOST_SENT, Pose};
use crate::flock::vectors::distance;
use crate::geometry::point::{dot, minus};

/// A velocity in a robot's own axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// \[m/s\]
    pub ahead: f64,
    /// To the left \[m/s\].
    pub left: f64,
    /// Counter-clockwise \[rad/s\].
    pub turn: f64,
}

/// Velocities of one member towards its targets.
#[derive(Default)]
pub struct Steering {
    /// Highest turn rate of a robot that cannot go sideways \[rad/s\]; none for one that can.
    turn_rate: Option<f64>,
    /// Velocities that it was sent since its last pose, each with the time from which it holds \[s\].
    sent: VecDeque<(f64, Velocity)>,
    /// Its last pose, with less of the noise.
    last: Option<Pose>,
    /// Its last target \[m\].
    target: Option<[f64; 2]>,
    /// Direction in which that lay \[rad\].
    bearing: Option<f64>,
}

impl Steering {
    /// Of a robot that turns no faster than `turn_rate` \[rad/s\] and cannot go sideways; `None` of one that can.
    ///
    /// # Panics
    /// A rate that is no number or negative.
    pub fn new(turn_rate: Option<f64>) -> Self {
        assert!(turn_rate.is_none_or(|rate| rate >= 0.0), "turn rate {turn_rate:?}");
        Self { turn_rate, ..Self::default() }
    }

    /// The velocity of a member towards its target \[m\] from the last tick on, zero without one.
    pub fn next(&mut self, control: &Control, member: usize, target: Option<[f64; 2]>) -> Velocity {
        let now = control.now();
        match control.watch().pose(member) {
            Some(pose) => {
                self.see(pose, control.limits());
                self.forget(pose.stamp, now);
            }
            // Where it is when it is heard again its pose alone will say.
            None => *self = Self::new(self.turn_rate),
        }
        let velocity = target.and_then(|target| self.towards(control, member, target)).unwrap_or_default();
        if self.sent.len() == MOST_SENT {
            self.sent.pop_front();
        }
        self.sent.push_back((now, velocity));
        self.target = target;
        velocity
    }

    /// Takes in a pose. That of the noise which is declared is weighed against where the velocities have led since the one before,
    /// from which a robot is taken to stray by a part of its way: a step of the Kalman filter of such a walk, once it is steady.
    fn see(&mut self, pose: Pose, limits: &Limits) {
        /// What a robot strays from where it is driven, over its way \[1\].
        const SLIP: f64 = 0.1;
        /// Deviations beyond which a pose is no noise \[1\].
        const MOST: f64 = 4.0;
        let last = match self.last {
            Some(last) if last.stamp == pose.stamp => return,
            Some(last) if last.stamp < pose.stamp => last,
            _ => {
                self.last = Some(pose);
                return;
            }
        };
        let (expected, _) = self.carried((last.position, last.yaw), last.stamp, pose.stamp);
        let off = minus(pose.position, expected);
        let ratio = SLIP * limits.speed * (pose.stamp - last.stamp) / limits.deviation;
        let gain = if ratio.is_finite() && f64::hypot(off[0], off[1]) <= MOST * limits.deviation {
            2.0 * ratio / (ratio.hypot(2.0) + ratio)
        } else {
            1.0
        };
        let position = if gain < 1.0 { [0, 1].map(|k| expected[k] + gain * off[k]) } else { pose.position };
        self.last = Some(Pose { position, ..pose });
    }

    /// Forgets velocities that were over at a pose of this time \[s\], and those of times that a clock set back has yet to come to.
    fn forget(&mut self, stamp: f64, now: f64) {
        while self.sent.back().is_some_and(|&(from, _)| from > now) {
            self.sent.pop_back();
        }
        while self.sent.get(1).is_some_and(|&(next, _)| next <= stamp) {
            self.sent.pop_front();
        }
    }

    /// That of a member that takes time to brake is to end the period on its way to where it comes to rest, far ahead.
    fn towards(&mut self, control: &Control, member: usize, target: [f64; 2]) -> Option<Velocity> {
        let bearing = self.bearing.take();
        let (period, limits) = (control.period(), control.limits());
        // What stops at once stands wherever it is by now, of which nothing else is sure.
        let stands = !limits.brakes && limits.acceleration.is_infinite();
        if control.mode() == Mode::EmergencyStopped && stands {
            return None;
        }
        let last = self.last?;
        let (here, yaw) = self.carried((last.position, last.yaw), last.stamp, control.now());
        // One that turns first would turn about for every rounding.
        let is_near = |place: [f64; 2]| distance(place, here) < ASIDE;
        if self.turn_rate.is_some() && is_near(target) && is_near(control.wanted(member)) {
            return None;
        }
        let gain = period / (period + 2.0 * (control.now() - last.stamp).max(0.0));
        let velocity = control.next_velocity(member, target).unwrap_or_else(|| {
            let way = minus(target, here);
            let share = share(way, minus(target, self.target.unwrap_or(here)), gain);
            way.map(|x| share * x / period)
        });
        self.bearing = (velocity != [0.0; 2]).then(|| velocity[1].atan2(velocity[0]));
        let swung = self.bearing.zip(bearing).map_or(0.0, |(now, before)| wrapped(now - before));
        Some(within(velocity, (yaw, swung), (period, gain), limits.speed, self.turn_rate))
    }

    /// The place \[m\] and heading \[rad\] to which the velocities sent have led from those at `stamp` until `now` \[s\].
    fn carried(&self, (mut place, mut yaw): ([f64; 2], f64), stamp: f64, now: f64) -> ([f64; 2], f64) {
        for (k, (from, Velocity { ahead, left, turn })) in self.sent.iter().enumerate() {
            let end = self.sent.get(k + 1).map_or(now, |&(next, _)| next.min(now));
            let time = end - from.max(stamp);
            if time > 0.0 {
                // On average it goes as it heads half-way.
                let (sin, cos) = (yaw + 0.5 * turn * time).sin_cos();
                place[0] += time * (cos * ahead - sin * left);
                place[1] += time * (sin * ahead + cos * left);
                yaw += turn * time;
            }
        }
        (place, yaw)
    }
}

/// How far a robot that turns while it drives may leave the straight way in a period, and stay away from where it is to come \[m\].
const ASIDE: f64 = 1e-3;

/// The part of its way to a target \[m\] that a robot is to go in a period: as far as that has moved \[m\], and of what the robot is off
/// this `gain`. It goes straight to its target, which is where it is clear of others.
fn share(way: [f64; 2], moved: [f64; 2], gain: f64) -> f64 {
    let wanted = [0, 1].map(|k| moved[k] + gain * (way[k] - moved[k]));
    let share = dot(wanted, way) / dot(way, way);
    if share.is_finite() && gain < 1.0 { share.clamp(0.0, 1.0) } else { 1.0 }
}

/// The command of a robot that is to go on with a velocity \[m/s, world frame\] for a period \[s\], in which it turns as far as that has
/// `swung` \[rad\], and makes up for this part of what it heads aside besides.
fn within(
    velocity: [f64; 2],
    (yaw, swung): (f64, f64),
    (period, gain): (f64, f64),
    speed: f64,
    turn_rate: Option<f64>,
) -> Velocity {
    let (sin, cos) = yaw.sin_cos();
    let [ahead, left] = [cos * velocity[0] + sin * velocity[1], cos * velocity[1] - sin * velocity[0]];
    let Some(turn_rate) = turn_rate else {
        let size = f64::hypot(ahead, left);
        let scale = if size > speed { speed / size } else { 1.0 };
        return Velocity { ahead: ahead * scale, left: left * scale, turn: 0.0 };
    };
    let error = if velocity == [0.0; 2] { 0.0 } else { left.atan2(ahead) };
    let turn = ((swung + gain * (error - swung)) / period).clamp(-turn_rate, turn_rate);
    // It keeps clear of others on the straight way alone: it turns first, and drives in a turn only as far as leads it
    // hardly aside: by half the turn, and by what is left of it until that is made up for.
    let left = (error - period * turn).abs();
    let aside = (error - 0.5 * period * turn).abs() + left * (1.0 / gain - 1.0);
    let ahead = if error.abs() <= turn_rate * period {
        ahead.clamp(0.0, speed).min(ASIDE / (period * aside))
    } else {
        0.0
    };
    Velocity { ahead, left: 0.0, turn }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::scene::swarm::Swarm;
    use crate::swarm::examples::parsed;

    /// Where the second of two robots starts, out of the way of the first.
    const FAR: [f64; 2] = [0.0, 9.0];
    /// Poses that may be late.
    const LATE: &str = "poses = { fresh = 1.0, age_limit = 1.0 }\n";

    /// Two robots that both lead.
    fn two(program: &str, more: &str) -> Swarm {
        let text = format!(
            "title = \"drive\"\nradius = 0.2\nlinks = {{ kind = \"nearest\", count = 1 }}\n\
             robots = [{{ name = \"a\", place = [0.0, 0.0] }}, {{ name = \"b\", place = {FAR:?} }}]\n\
             leaders = [{{ robots = [\"a\", \"b\"], program = {{ {program} }} }}]\n\
             limits = {{ speed = 1.5, clearance = 0.3 }}\n{more}"
        );
        parsed(&text, &[])
    }

    #[test]
    fn velocities_are_in_the_robot_s_own_axes_and_within_its_limits() {
        let velocity = within([0.0, 5.0], (FRAC_PI_2, 0.0), (0.1, 1.0), 2.0, None);
        assert!(
            (velocity.ahead - 2.0).abs() < 1e-12 && velocity.left.abs() < 1e-12 && velocity.turn == 0.0,
            "{velocity:?}"
        );
        let velocity = within([-0.5, 0.0], (FRAC_PI_2, 0.0), (0.1, 1.0), 2.0, None);
        assert!((velocity.left - 0.5).abs() < 1e-12 && velocity.ahead.abs() < 1e-12, "{velocity:?}");
    }

    #[test]
    fn a_robot_that_takes_time_to_brake_is_driven_to_rest_before_a_fence_and_in_an_emergency_stop() {
        let text = "title = \"drive\"\nradius = 0.2\nlinks = { kind = \"nearest\", count = 1 }\n\
                    robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [0.0, 4.0] }]\n\
                    leaders = [{ robots = [\"a\", \"b\"], program = { kind = \"path\", points = [{ at = 1.0, displacement = [6.0, 0.0] }] } }]\n\
                    limits = { speed = 1.5, acceleration = 0.8, clearance = 0.3, geofence = [[-1.0, -1.0], [6.5, -1.0], [6.5, 5.0], [-1.0, 5.0]] }\n\
                    control = { period = 0.05 }\nflight = { model = { kind = \"double-integrator\" } }\n";
        let swarm = parsed(text, &[]);
        for (stop, late) in [(None, 0), (Some(60), 0), (None, 6), (Some(60), 6)] {
            let mut control = Control::new(&swarm).expect("laid out");
            let mut steering = Steering::default();
            let (mut x, mut v, mut most, mut fastest) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
            let mut places = vec![x];
            for tick in 0..300 {
                let now = 0.05 * f64::from(tick);
                let seen = (tick as usize).checked_sub(late).map(|old| (0.05 * old as f64, places[old]));
                for ((member, y), (stamp, x)) in
                    [(0, 0.0), (1, 4.0)].into_iter().zip(seen.into_iter().cycle())
                {
                    let pose = Pose { position: [x, y], yaw: 0.0, stamp, frame_is_right: true };
                    control.receive(member, pose, now).expect("a pose");
                }
                if Some(tick) == stop {
                    control.emergency_stop();
                }
                control.tick(now);
                let velocity = steering.next(&control, 0, control.target(0));
                // Its base speeds up and brakes within its limit too.
                let next = v + (velocity.ahead - v).clamp(-0.04, 0.04);
                (x, v) = (x + 0.025 * (v + next), next);
                (most, fastest) = (most.max(x), fastest.max(v));
                places.push(x);
            }
            let end = if stop.is_some() { 4.6 } else { 6.0 };
            assert!(
                fastest > 1.4 && v.abs() < 1e-6 && most < end + 1e-6,
                "{stop:?}, {late}: {x}, {v}, {most}"
            );
            assert!(stop.is_some() || (x - 6.0).abs() < 1e-6, "{x}");
        }
    }

    /// Robots that do as they are driven, seen late: they pass through their targets, as those do that see themselves at once.
    #[test]
    fn robots_that_are_seen_late_pass_through_their_targets_and_arrive() {
        const PERIOD: f64 = 0.1;
        for (model, goal) in [("integrator\"", [3.0, 0.0]), ("unicycle\", turn_rate = 90.0", [-0.5, 2.0])] {
            let swarm = two(
                &format!("kind = \"path\", points = [{{ at = 8.0, displacement = {goal:?} }}]"),
                &format!(
                    "{LATE}control = {{ period = {PERIOD} }}\nflight = {{ model = {{ kind = \"{model} }} }}\n"
                ),
            );
            // Some slip, and go a twentieth less than they are driven, or are driven some periods later.
            for (late, slip, lag) in [
                (0, 0.0, 0),
                (1, 0.0, 0),
                (4, 0.0, 0),
                (7, 0.0, 0),
                (4, 0.05, 0),
                (1, 0.0, 1),
                (4, 0.0, 2),
                (7, 0.05, 5),
            ] {
                let mut control = Control::new(&swarm).expect("laid out");
                let turn_rate = model.starts_with("unicycle").then_some(FRAC_PI_2);
                let mut steering = Steering::new(turn_rate);
                let mut robot = Steering::new(turn_rate);
                let mut poses = vec![([0.0; 2], 0.0)];
                let mut ahead = VecDeque::from(vec![Velocity::default(); lag]);
                let (mut off, mut turned) = (0.0_f64, 0.0_f64);
                for tick in 0..400 {
                    let now = f64::from(tick) * PERIOD;
                    if let Some(old) = (tick as usize).checked_sub(late) {
                        let (position, yaw) = poses[old];
                        let pose = Pose { position, yaw, stamp: old as f64 * PERIOD, frame_is_right: true };
                        control.receive(0, pose, now).expect("a pose");
                        control.receive(1, Pose { position: FAR, ..pose }, now).expect("a pose");
                    }
                    control.tick(now);
                    let target = control.target(0);
                    ahead.push_back(steering.next(&control, 0, target));
                    let mut driven = ahead.pop_front().expect("the latest");
                    turned += PERIOD * driven.turn.abs();
                    (driven.ahead, driven.left) = ((1.0 - slip) * driven.ahead, (1.0 - slip) * driven.left);
                    robot.sent = VecDeque::from([(now, driven)]);
                    let next = robot.carried(poses[tick as usize], now, now + PERIOD);
                    if let Some(target) = target.filter(|_| turn_rate.is_none()) {
                        off = off.max((next.0[0] - target[0]).hypot(next.0[1] - target[1]));
                    }
                    poses.push(next);
                }
                let (end, yaw) = poses[400];
                let rest = (end[0] - goal[0]).hypot(end[1] - goal[1]);
                let most = if slip + lag as f64 > 0.0 { 0.5 } else { ASIDE };
                assert!(rest < ASIDE && off < most, "{model}, {late} late, {lag}: {rest} m, {off} m");
                // Driven late, it comes past its target and turns about.
                let most = if lag > 0 { 12.0 } else { 2.5 };
                assert!(turned < most, "{model}, {late} late: turned by {turned} rad to head at {yaw}");
            }
        }
    }

    /// One that followed each pose would go to and fro by 1.4 deviations in every period.
    #[test]
    fn a_robot_that_stands_follows_little_of_the_noise_of_its_poses() {
        const PERIOD: f64 = 0.1;
        const NOISE: f64 = 0.03;
        let swarm = two(
            "kind = \"external\"",
            &format!(
                "control = {{ period = {PERIOD} }}\nflight = {{ noise = {NOISE}, model = {{ kind = \"integrator\" }} }}\n"
            ),
        );
        let mut control = Control::new(&swarm).expect("laid out");
        let mut steering = Steering::default();
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let (mut place, mut squares, ticks) = ([0.0_f64; 2], [0.0_f64; 2], 2_000);
        for tick in 0..ticks {
            let now = f64::from(tick) * PERIOD;
            for (member, here) in [(0, place), (1, FAR)] {
                let position = here.map(|x| x + NOISE * random.sample::<f64, _>(StandardNormal));
                let pose = Pose { position, yaw: 0.0, stamp: now, frame_is_right: true };
                control.receive(member, pose, now).expect("a pose");
            }
            control.tick(now);
            let velocity = steering.next(&control, 0, control.target(0));
            place = [place[0] + PERIOD * velocity.ahead, place[1] + PERIOD * velocity.left];
            squares[0] += (velocity.ahead.powi(2) + velocity.left.powi(2)) / f64::from(2 * ticks);
            squares[1] += (place[0].powi(2) + place[1].powi(2)) / f64::from(2 * ticks);
        }
        for tick in ticks..2 * ticks {
            control.tick(f64::from(tick) * PERIOD);
            let driven = steering.next(&control, 0, control.target(0));
            assert!(driven == Velocity::default() || tick < ticks + 20, "one that is lost stands");
        }
        assert_eq!(steering.sent.len(), 1, "nothing is kept of one that is lost");
        let [speed, off] = squares.map(f64::sqrt);
        assert!(speed < 0.5 * NOISE / PERIOD && off < 0.6 * NOISE, "{speed} m/s, {off} m");
    }

    #[test]
    fn a_robot_that_cannot_go_sideways_turns_first() {
        // Of a quarter turn at once, and of what a period does not suffice for.
        for yaw in [0.0, 1.2] {
            let velocity = within([0.0, 2.0], (yaw, 0.0), (0.1, 1.0), 2.0, Some(1.5));
            assert_eq!((velocity.ahead, velocity.left, velocity.turn), (0.0, 0.0, 1.5));
        }
        let ahead = within([2.0, 0.0], (0.0, 0.0), (0.1, 1.0), 1.5, Some(1.5));
        assert_eq!((ahead.ahead, ahead.turn), (1.5, 0.0));
        let still = within([0.0; 2], (0.3, 0.0), (0.1, 1.0), 2.0, Some(1.5));
        assert_eq!(still, Velocity::default());
    }

    #[test]
    fn a_robot_that_turns_as_it_drives_stays_on_its_straight_way() {
        for (yaw, turn_rate) in [(0.1, 1.5), (0.3, 4.0), (-0.14, 1.5), (0.01, 1.5)] {
            let velocity = within([1.0, 0.0], (yaw, 0.0), (0.1, 1.0), 2.0, Some(turn_rate));
            let (mut y, mut heading, steps) = (0.0_f64, yaw, 1000);
            for _ in 0..steps {
                y += velocity.ahead * heading.sin() * 0.1 / f64::from(steps);
                heading += velocity.turn * 0.1 / f64::from(steps);
            }
            assert!(y.abs() < 1.01 * ASIDE && heading.abs() < 1e-9, "{yaw}: {y} m aside");
            assert!(velocity.ahead > 0.05, "it goes on: {velocity:?}");
        }
    }

    /// A unicycle on a circle, whose direction to its target turns all the time, seen late or not.
    #[test]
    fn a_robot_that_turns_follows_a_curve_behind_late_poses() {
        const PERIOD: f64 = 0.05;
        let model = "model = { kind = \"unicycle\", turn_rate = 90.0 }";
        let swarm = two(
            "kind = \"external\"",
            &format!("{LATE}control = {{ period = {PERIOD} }}\nflight = {{ {model} }}\n"),
        );
        for late in [0, 1, 4] {
            let mut control = Control::new(&swarm).expect("laid out");
            let mut steering = Steering::new(Some(FRAC_PI_2));
            let mut robot = Steering::new(Some(FRAC_PI_2));
            let mut poses = vec![([0.0; 2], FRAC_PI_2)];
            let mut off = 0.0_f64;
            for tick in 0..800_usize {
                let now = tick as f64 * PERIOD;
                // Half a metre a second around (-2, 0).
                let (sin, cos) = (0.25 * now).sin_cos();
                let place = [2.0 * cos - 2.0, 2.0 * sin];
                assert!(control.place_leader(0, place) && control.place_leader(1, FAR));
                if let Some(old) = tick.checked_sub(late) {
                    let (position, yaw) = poses[old];
                    let pose = Pose { position, yaw, stamp: old as f64 * PERIOD, frame_is_right: true };
                    control.receive(0, pose, now).expect("a pose");
                    control.receive(1, Pose { position: FAR, ..pose }, now).expect("a pose");
                }
                control.tick(now);
                robot.sent = VecDeque::from([(now, steering.next(&control, 0, control.target(0)))]);
                let next = robot.carried(poses[tick], now, now + PERIOD);
                off = if tick < 400 { off } else { off.max(distance(next.0, place)) };
                poses.push(next);
            }
            assert!(off < 0.2, "{late} late: {off} m behind");
        }
    }
}
