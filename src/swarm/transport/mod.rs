//! Transports carry poses in and targets out; the loop is the same over each of them.
//!
//! A transport has two ends. The loop holds a [`ControllerEnd`] and calls [`serve`] once a period; robots, or
//! their simulation, hold a [`RobotsEnd`] and call [`fly`]. There are two: shared memory in room `shm`, ROS 2 in
//! room `ros`. The tests hold both to one list of promises:
//!
//! * Poses of one member arrive in the order in which they were sent, or not at all: the newest matters, and a full
//!   queue drops the oldest. A sender never waits for a receiver.
//! * An end that comes late, goes away, comes back or is killed does not disturb the others.
//! * A payload that is no pose of a member is left out and counted.

pub mod complaints;
pub mod silence;

use complaints::Complaints;

use super::control::Control;
use super::control::scope::NodeScope;
use super::flight::Fleet;
use super::pace::system_time;
use super::watch::{Pose, Range, Rejection};

/// A message that reaches the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Received {
    /// A member's pose.
    Pose(usize, Pose),
    /// A distance that one member measured of another.
    Range(Range),
    /// The next place of a leader that is moved from outside \[m\].
    Leader(usize, [f64; 2]),
}

/// A member's next target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Number of the member.
    pub member: usize,
    /// \[m, world frame\]
    pub position: [f64; 2],
    /// Heading \[rad\].
    pub yaw: f64,
}

/// The loop's end.
pub trait ControllerEnd {
    /// Why a target was not sent.
    type Error: std::error::Error;

    /// Passes to `take` all that arrived since the last call, without waiting; `now` \[s\] stamps messages without one.
    fn receive(&mut self, now: f64, take: &mut dyn FnMut(Received));

    /// Sends the targets of a tick, without waiting.
    ///
    /// # Errors
    /// The first that was not sent.
    fn send(&mut self, now: f64, targets: &[Target]) -> Result<(), Self::Error>;

    /// Invalid payloads since the beginning \[1\].
    fn refused(&self) -> u64;

    /// The frame of the last pose of a member that was in another than the swarm's, where messages name frames, and the
    /// swarm's.
    fn wrong_frame(&self, _member: usize) -> Option<[&str; 2]> {
        None
    }
}

/// The robots' end.
pub trait RobotsEnd {
    /// Why a pose was not sent.
    type Error: std::error::Error;

    /// Sends poses of members, without waiting.
    ///
    /// # Errors
    /// The first that was not sent.
    fn send(&mut self, now: f64, poses: &[(usize, Pose)]) -> Result<(), Self::Error>;

    /// Sends ranges that members measured, without waiting; those of one observer stand together.
    ///
    /// # Errors
    /// The first that were not sent.
    fn send_ranges(&mut self, now: f64, ranges: &[Range]) -> Result<(), Self::Error>;

    /// Passes to `go` the targets that arrived since the last call \[m\]; of one member's the newest comes last.
    fn targets(&mut self, go: &mut dyn FnMut(usize, [f64; 2]));
}

/// The first half of a period: receives all messages that arrived, and warns of those that are dropped.
pub fn listen<E: ControllerEnd>(control: &mut Control, end: &mut E, complaints: &mut Complaints, now: f64) {
    let mut misframed = Vec::new();
    end.receive(now, &mut |heard| match heard {
        Received::Range(range) => {
            if !control.receive_range(range, now) {
                let name = &control.formation().names[range.observer];
                let text = format_args!(
                    "{name}: a range of {:?} m, {:.3} s old, is of no use: it is not finite, negative, of the robot by \
                     itself, from the future or older than `poses.age_limit`",
                    range.distance,
                    now - range.stamp
                );
                complaints.warn("range", range.observer, system_time(), &text);
            }
        }
        Received::Pose(member, pose) => {
            let Err(rejection) = control.receive(member, pose, now) else { return };
            if rejection == Rejection::WrongFrame {
                misframed.push(member);
                return;
            }
            let name = &control.formation().names[member];
            let cause = match rejection {
                // It has waited to be read for no longer than a loop at this rate lets it.
                Rejection::TooOld { age, .. } if age <= control.period() => None,
                _ => rejection.cause(),
            };
            match cause {
                Some(cause) => {
                    complaints.warn(cause, member, system_time(), &format_args!("{name}: {rejection}"))
                }
                None => tracing::debug!("{name}: {rejection}"),
            }
        }
        Received::Leader(member, place) => {
            if !control.place_leader(member, place) {
                let name = &control.formation().names[member];
                let why = if control.formation().is_on_manoeuvre(member, control.program_time()) {
                    "came while a manoeuvre moves the leaders: send places again when it has ended"
                } else {
                    "is not finite, farther from the centre than `poses.range` allows, or for a robot without an \
                     external program"
                };
                let text = format_args!("{name}: a place to lead it to {why}");
                complaints.warn("leader's place", member, system_time(), &text);
            }
        }
    });
    for member in misframed {
        let name = &control.formation().names[member];
        let text = match end.wrong_frame(member) {
            None => format!("{name}: {}", Rejection::WrongFrame),
            Some([theirs, ours]) => format!(
                "{name}: a pose is in the frame `{theirs}`, not in `{ours}`: publish it in that one, or name the other as \
                 `node.frame_id`"
            ),
        };
        complaints.warn("wrong frame", member, system_time(), &text);
    }
}

/// One period of the loop at `now` \[s\]: receives, ticks and sends the targets of the members that it serves.
///
/// # Errors
/// The first target that was not sent; the tick is done all the same.
pub fn serve<E: ControllerEnd>(
    control: &mut Control,
    part: &NodeScope,
    end: &mut E,
    complaints: &mut Complaints,
    now: f64,
) -> Result<(), E::Error> {
    listen(control, end, complaints, now);
    control.tick(now);
    end.send(now, &targets(control, part))
}

/// The targets of the last tick.
pub fn targets(control: &Control, part: &NodeScope) -> Vec<Target> {
    part.mine.iter().filter_map(|&member| target_of(control, member)).collect()
}

/// A member's target and heading after the last tick: straight ahead, or its present heading if it stays.
pub(crate) fn target_of(control: &Control, member: usize) -> Option<Target> {
    let position = control.target(member)?;
    let here = control.position(member).unwrap_or(position);
    let yaw = match [position[0] - here[0], position[1] - here[1]] {
        [0.0, 0.0] => control.yaw(member).unwrap_or(0.0),
        [x, y] => y.atan2(x),
    };
    Some(Target { member, position, yaw })
}

/// One period of simulated robots: every robot goes towards its newest goal \[m\] and sends its pose, stamped with
/// the time \[s\] that `now` returns.
///
/// # Errors
/// The first pose that was not sent; the robots have flown all the same.
pub fn fly<E: RobotsEnd>(
    fleet: &mut Fleet,
    goals: &mut [Option<[f64; 2]>],
    end: &mut E,
    now: impl FnOnce(&Fleet) -> f64,
) -> Result<(), E::Error> {
    end.targets(&mut |member, place| aim(goals, member, place));
    fleet.go(|member| goals[member]);
    let now = now(fleet);
    let (mut poses, mut ranges) = (Vec::new(), Vec::new());
    fleet.send(now, &mut |sent| match sent {
        Received::Pose(member, pose) => poses.push((member, pose)),
        Received::Range(range) => ranges.push(range),
        Received::Leader(..) => {}
    });
    let measured = if ranges.is_empty() { Ok(()) } else { end.send_ranges(now, &ranges) };
    end.send(now, &poses).and(measured)
}

/// Lets simulated robots go on for periods that the computer left out, as robots do whose time is its.
pub fn catch_up(fleet: &mut Fleet, goals: &[Option<[f64; 2]>], missed: u64) {
    /// Those that slept for longer stand by then.
    const MOST: u64 = 10_000;
    (0..missed.min(MOST)).for_each(|_| fleet.go(|member| goals[member]));
}

/// Takes a target for a robot's goal \[m\]; one that is not finite, or of no robot, changes nothing.
pub fn aim(goals: &mut [Option<[f64; 2]>], member: usize, place: [f64; 2]) {
    if place.iter().all(|value| value.is_finite())
        && let Some(goal) = goals.get_mut(member)
    {
        *goal = Some(place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_that_is_not_finite_or_of_no_robot_moves_no_robot() {
        let mut goals = [Some([1.0, 2.0]), None];
        aim(&mut goals, 0, [f64::NAN, 0.0]);
        aim(&mut goals, 1, [0.0, f64::INFINITY]);
        aim(&mut goals, 2, [0.0, 0.0]);
        assert_eq!(goals, [Some([1.0, 2.0]), None]);
        aim(&mut goals, 1, [3.0, 4.0]);
        assert_eq!(goals[1], Some([3.0, 4.0]));
    }
}
