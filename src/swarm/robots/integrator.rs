//! Single integrator with a speed limit: a quadrotor under a position controller, seen from far.

use super::Robot;

/// The limit of a single integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integrator {
    /// Highest speed \[m/s\].
    pub speed: f64,
}

impl Integrator {
    /// Straight towards the target, so it stays in every convex cell that holds both; never past it.
    pub fn step(&self, robot: &mut Robot, target: [f64; 2], dt: f64) {
        robot.approach(target, self.speed * dt, dt);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::vectors::distance;

    #[test]
    fn it_keeps_its_speed_limit_and_lands_on_the_target() {
        let integrator = Integrator { speed: 0.7 };
        let (mut robot, target, dt) = (Robot::at([0.0, 0.0], 0.0), [2.102, 0.0], 0.03);
        let periods = (distance(robot.position, target) / (0.7 * dt)).ceil() as usize;
        for period in 1..=periods {
            let before = robot.position;
            integrator.step(&mut robot, target, dt);
            assert!(distance(before, robot.position) <= 0.7 * dt + 1e-12);
            assert!(robot.velocity[0].hypot(robot.velocity[1]) <= 0.7 + 1e-12);
            assert_eq!(robot.position == target, period == periods, "in period {period}");
        }
    }
}
