//! Two ends in one process: a loop in one thread, its robots in another.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, PoisonError};

use super::{ControllerEnd, Received, RobotsEnd, Target};
use crate::swarm::watch::{Pose, Range};

/// Most ranges of one observer that wait in a queue \[1\]: of several periods of many others.
const RANGES: usize = 4096;
/// Most poses, and most targets, of one member that wait in a queue \[1\].
const DEPTH: usize = 64;

/// A bounded queue for every member; a full one drops its oldest entry.
#[derive(Debug)]
struct Queues<T> {
    members: Mutex<Vec<VecDeque<T>>>,
}

impl<T> Queues<T> {
    fn new(count: usize) -> Self {
        Self { members: Mutex::new((0..count).map(|_| VecDeque::new()).collect()) }
    }

    /// Appends all; returns the number of those that belong to no member.
    fn push(&self, all: impl Iterator<Item = (usize, T)>, depth: usize) -> u64 {
        let mut members = self.members.lock().unwrap_or_else(PoisonError::into_inner);
        let mut strangers = 0;
        for (member, one) in all {
            let Some(queue) = members.get_mut(member) else {
                strangers += 1;
                continue;
            };
            if queue.len() == depth {
                queue.pop_front();
            }
            queue.push_back(one);
        }
        strangers
    }

    fn count(&self) -> usize {
        self.members.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    fn take(&self, mut each: impl FnMut(usize, T)) {
        let mut members = self.members.lock().unwrap_or_else(PoisonError::into_inner);
        for (member, queue) in members.iter_mut().enumerate() {
            queue.drain(..).for_each(|one| each(member, one));
        }
    }
}

#[derive(Debug)]
struct Shared {
    poses: Queues<Pose>,
    /// By observer.
    ranges: Queues<Range>,
    targets: Queues<[f64; 2]>,
    leaders: Queues<[f64; 2]>,
    refused: Mutex<u64>,
}

/// The loop's end.
#[derive(Clone, Debug)]
pub struct Controller(Arc<Shared>);

/// The robots' end; each clone may serve other robots.
#[derive(Clone, Debug)]
pub struct Robots(Arc<Shared>);

/// The two ends of a formation of so many members.
pub fn join(count: usize) -> (Controller, Robots) {
    let shared = Arc::new(Shared {
        poses: Queues::new(count),
        ranges: Queues::new(count),
        targets: Queues::new(count),
        leaders: Queues::new(count),
        refused: Mutex::new(0),
    });
    (Controller(Arc::clone(&shared)), Robots(shared))
}

impl Robots {
    /// Sends the next place of a leader that is moved from outside \[m\].
    pub fn lead(&self, member: usize, place: [f64; 2]) {
        self.0.leaders.push(std::iter::once((member, place)), DEPTH);
    }

    /// The loop's end again, for a loop that comes back.
    pub fn controller(&self) -> Controller {
        Controller(Arc::clone(&self.0))
    }
}

impl ControllerEnd for Controller {
    type Error = Infallible;

    fn receive(&mut self, _now: f64, take: &mut dyn FnMut(Received)) {
        self.0.ranges.take(|_, range| take(Received::Range(range)));
        self.0.poses.take(|member, pose| take(Received::Pose(member, pose)));
        self.0.leaders.take(|member, place| take(Received::Leader(member, place)));
    }

    fn send(&mut self, _now: f64, targets: &[Target]) -> Result<(), Infallible> {
        self.0.targets.push(targets.iter().map(|target| (target.member, target.position)), DEPTH);
        Ok(())
    }

    fn refused(&self) -> u64 {
        *self.0.refused.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl RobotsEnd for Robots {
    type Error = Infallible;

    fn send(&mut self, _now: f64, poses: &[(usize, Pose)]) -> Result<(), Infallible> {
        let strangers = self.0.poses.push(poses.iter().copied(), DEPTH);
        *self.0.refused.lock().unwrap_or_else(PoisonError::into_inner) += strangers;
        Ok(())
    }

    fn send_ranges(&mut self, _now: f64, ranges: &[Range]) -> Result<(), Infallible> {
        let count = self.0.ranges.count();
        let known = ranges.iter().filter(|range| range.of < count);
        let strangers = self.0.ranges.push(known.map(|range| (range.observer, *range)), RANGES);
        let left_out = ranges.iter().filter(|range| range.of >= count).count() as u64;
        *self.0.refused.lock().unwrap_or_else(PoisonError::into_inner) += strangers + left_out;
        Ok(())
    }

    fn targets(&mut self, go: &mut dyn FnMut(usize, [f64; 2])) {
        self.0.targets.take(go);
    }
}
