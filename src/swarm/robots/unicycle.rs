//! Unicycle (differential drive) with limits on speed and turn rate.

use std::f64::consts::{PI, TAU};

use super::Robot;

/// Turns on the spot until it faces the target and drives only then, so its path is the straight line to
/// the target: it stays in every convex cell that holds both, which an arc would not, and cannot circle or
/// swing about the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unicycle {
    /// Highest speed forwards \[m/s\], default 1; it does not reverse.
    pub speed: f64,
    /// Highest turn rate \[rad/s\], default 2.
    pub turn_rate: f64,
    /// Closer than this to the target it stands still rather than turn after noise \[m\], default 1e-3.
    pub tolerance: f64,
}

impl Default for Unicycle {
    fn default() -> Self {
        Self { speed: 1.0, turn_rate: 2.0, tolerance: 1e-3 }
    }
}

impl Unicycle {
    /// The controls switch once within the period: turning, then driving for what is left of it.
    pub fn step(&self, robot: &mut Robot, target: [f64; 2], dt: f64) {
        let offset = robot.offset_to(target);
        if offset[0].hypot(offset[1]) <= self.tolerance {
            robot.velocity = [0.0; 2];
            return;
        }
        let heading = offset[1].atan2(offset[0]);
        let turn = wrapped(heading - robot.yaw);
        let most = self.turn_rate * dt;
        if turn.abs() > most {
            robot.yaw = wrapped(robot.yaw + most.copysign(turn));
            robot.velocity = [0.0; 2];
            return;
        }
        robot.yaw = heading;
        let left = if turn == 0.0 { dt } else { dt - turn.abs() / self.turn_rate };
        robot.approach(target, self.speed * left, dt);
    }
}

/// The same angle in (-pi, pi\].
pub(in crate::swarm) fn wrapped(angle: f64) -> f64 {
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use super::super::tests::DT;
    use super::*;
    use crate::flock::vectors::distance;

    #[test]
    fn it_keeps_its_limits_and_to_the_straight_line() {
        let unicycle = Unicycle { speed: 0.8, turn_rate: 1.3, ..Unicycle::default() };
        for length in [3.0, 3.01, 3.02, 3.03] {
            let target = [1.0 - 0.8 * length, 0.5 - 0.6 * length];
            let mut robot = Robot::at([1.0, 0.5], 0.3);
            for _ in 0..200 {
                let before = robot;
                unicycle.step(&mut robot, target, DT);
                let turned = wrapped(robot.yaw - before.yaw).abs();
                let moved = distance(before.position, robot.position);
                assert!(turned <= 1.3 * DT + 1e-12);
                // Time spent on turning is not available for driving.
                assert!(moved <= 0.8 * (DT - turned / 1.3) + 1e-12, "{moved} after a turn by {turned}");
                let [x, y] = robot.offset_to(target);
                assert!((0.6 * x - 0.8 * y).abs() < 1e-12, "off the line at {:?}", robot.position);
            }
            assert!(distance(robot.position, target) <= unicycle.tolerance);
        }
    }

    #[test]
    fn it_turns_the_short_way_through_half_a_turn() {
        let mut robot = Robot::at([0.0, 0.0], 3.0);
        Unicycle::default().step(&mut robot, [-10.0, -1.0], 0.01);
        assert!((robot.yaw - 3.02).abs() < 1e-12, "{}", robot.yaw);
        let mut robot = Robot::at([0.0, 0.0], -3.0);
        Unicycle::default().step(&mut robot, [-10.0, 1.0], 0.05);
        assert!((robot.yaw + 3.1).abs() < 1e-12, "{}", robot.yaw);
    }

    #[test]
    fn it_stands_still_within_its_tolerance() {
        let mut robot = Robot::at([0.0, 0.0], 0.0);
        for k in 0..50 {
            let noise = 5e-4 * f64::from(k % 3 - 1);
            Unicycle::default().step(&mut robot, [noise, -noise], DT);
        }
        assert_eq!(robot, Robot::at([0.0, 0.0], 0.0));
    }
}
