//! Within a process. There are no types and no processes to be killed.

use flockform::swarm::transport::in_process::{Controller, Robots, join};
use flockform::swarm::transport::{ControllerEnd, RobotsEnd};

use super::promises;
use super::support::*;

struct InProcess {
    count: usize,
    robots: Robots,
}

impl InProcess {
    fn new(count: usize) -> Self {
        Self { count, robots: join(count).1 }
    }
}

impl Transport for InProcess {
    type Controller = Controller;
    type Robots = Robots;

    fn count(&self) -> usize {
        self.count
    }

    fn controller(&mut self) -> Controller {
        self.robots.controller()
    }

    fn robots(&mut self) -> Robots {
        self.robots.clone()
    }
}

#[test]
fn in_process_poses_come_in_order_and_the_newest_comes() {
    promises::poses_come_in_order_and_the_newest_comes(&mut InProcess::new(3));
}

#[test]
fn in_process_ranges_come_as_they_were_measured() {
    promises::ranges_come_as_they_were_measured(&mut InProcess::new(3));
}

#[test]
fn in_process_targets_reach_their_robots_to_the_bit() {
    promises::targets_reach_their_robots_to_the_bit(&mut InProcess::new(3));
}

#[test]
fn in_process_who_comes_late_hears_what_is_said_from_then_on() {
    promises::who_comes_late_hears_what_is_said_from_then_on(&mut InProcess::new(3));
}

#[test]
fn in_process_a_peer_that_goes_away_harms_nobody_else() {
    promises::a_peer_that_goes_away_harms_nobody_else(&mut InProcess::new(3));
}

#[test]
fn in_process_who_comes_back_is_heard_again() {
    promises::who_comes_back_is_heard_again(&mut InProcess::new(3));
}

#[test]
fn in_process_a_thousand_robots_are_carried() {
    let all: Vec<usize> = (0..1000).collect();
    promises::a_thousand_robots_are_carried(&mut InProcess::new(1000), &all);
}

#[test]
fn in_process_who_does_not_listen_holds_nobody_up() {
    promises::who_does_not_listen_holds_nobody_up(&mut InProcess::new(3));
}

#[test]
fn in_process_a_pose_that_is_not_finite_moves_nobody() {
    let (mut control, part) = control_of(&row(3, &[]));
    promises::a_pose_that_is_not_finite_moves_nobody(&mut InProcess::new(3), &mut control, &part);
}

#[test]
fn in_process_a_pose_of_nobody_is_left_out_and_counted() {
    let (mut controller, mut robots) = join(3);
    robots.send(1.0, &[(3, pose(0.0, 1.0)), (2, pose(5.0, 1.0))]).expect("said");
    assert_eq!(heard(&mut controller), [(2, pose(5.0, 1.0))]);
    assert_eq!(controller.refused(), 1);
}
