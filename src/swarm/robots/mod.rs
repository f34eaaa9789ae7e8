//! Simulated robots: the motion towards a target within one period. One file per model.
//!
//! Every model goes from its position towards the target and, where it stands on a straight line to it,
//! never past it. A robot whose target is not finite comes to rest where it is.

mod double_integrator;
mod integrator;
mod unicycle;

pub use double_integrator::DoubleIntegrator;
pub use integrator::Integrator;
pub use unicycle::Unicycle;
pub(super) use unicycle::wrapped;

use serde::{Deserialize, Serialize};

/// The state of a robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Robot {
    /// \[m, world frame\]
    pub position: [f64; 2],
    /// Heading from the x axis \[rad\], in (-pi, pi\] once a unicycle has turned; the other models slide in
    /// any direction and keep it.
    pub yaw: f64,
    /// \[m/s, world frame\]. Of a double integrator at the end of the period, of the others, whose speed
    /// jumps, its mean over the period.
    pub velocity: [f64; 2],
}

/// The model of a robot's motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Model {
    /// At its target after every period.
    #[default]
    Ideal,
    /// Straight to the target, no faster than a limit.
    Integrator(Integrator),
    /// Turns on the spot towards the target, then drives.
    Unicycle(Unicycle),
    /// Speeds up and brakes within limits.
    DoubleIntegrator(DoubleIntegrator),
}

impl Model {
    /// The name in swarm files.
    pub fn name(&self) -> &'static str {
        match self {
            Model::Ideal => "ideal",
            Model::Integrator(_) => "integrator",
            Model::Unicycle(_) => "unicycle",
            Model::DoubleIntegrator(_) => "double-integrator",
        }
    }
}

impl Robot {
    /// At rest.
    pub fn at(position: [f64; 2], yaw: f64) -> Self {
        Self { position, yaw, velocity: [0.0; 2] }
    }

    /// Moves for `dt` \[s\] towards `target` \[m, world frame\]. A period that is not positive moves nothing;
    /// a target that is not finite is none: the robot comes to rest.
    pub fn step(&mut self, model: &Model, target: [f64; 2], dt: f64) {
        if dt.is_nan() || dt <= 0.0 {
            return;
        }
        if !target.iter().all(|t| t.is_finite()) {
            match model {
                Model::DoubleIntegrator(double) => double.brake(self, dt),
                _ => self.velocity = [0.0; 2],
            }
            return;
        }
        match model {
            Model::Ideal => self.move_to(target, dt),
            Model::Integrator(integrator) => integrator.step(self, target, dt),
            Model::Unicycle(unicycle) => unicycle.step(self, target, dt),
            Model::DoubleIntegrator(double) => double.step(self, target, dt),
        }
    }

    fn offset_to(&self, target: [f64; 2]) -> [f64; 2] {
        [target[0] - self.position[0], target[1] - self.position[1]]
    }

    /// Moves straight towards the target, no farther than `reach` \[m\] and never past it.
    fn approach(&mut self, target: [f64; 2], reach: f64, dt: f64) {
        let offset = self.offset_to(target);
        let length = offset[0].hypot(offset[1]);
        let on_the_way = || [0, 1].map(|k| self.position[k] + offset[k] * (reach / length));
        let place = if length <= reach { target } else { on_the_way() };
        self.move_to(place, dt);
    }

    /// Puts the robot at `place`; its velocity is the mean over the period.
    fn move_to(&mut self, place: [f64; 2], dt: f64) {
        self.velocity = self.offset_to(place).map(|d| d / dt);
        self.position = place;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::vectors::distance;

    pub(super) const DT: f64 = 0.05;

    fn every_model() -> [Model; 4] {
        [
            Model::Ideal,
            Model::Integrator(Integrator { speed: 1.0 }),
            Model::Unicycle(Unicycle::default()),
            Model::DoubleIntegrator(DoubleIntegrator { speed: 1.0, acceleration: 1.0 }),
        ]
    }

    #[test]
    fn an_ideal_robot_is_at_its_target_to_the_bit() {
        let mut robot = Robot::at([1e9, 0.3], 0.0);
        robot.step(&Model::Ideal, [0.1, 0.7], 0.1);
        assert_eq!(robot.position, [0.1, 0.7]);
    }

    #[test]
    fn every_model_reaches_its_target_and_stays() {
        for model in every_model() {
            for target in [[3.0, 4.0], [-2.0, 0.1], [0.0, -7.0], [1e-4, 0.0]] {
                let mut robot = Robot::at([0.0, 0.0], 0.4);
                for _ in 0..600 {
                    robot.step(&model, target, DT);
                }
                let tolerance = if let Model::Unicycle(u) = model { u.tolerance } else { 1e-12 };
                let missing = distance(robot.position, target);
                assert!(missing <= tolerance, "{}: {missing} from {target:?}", model.name());
                let here = robot.position;
                for _ in 0..20 {
                    robot.step(&model, target, DT);
                    assert!(distance(robot.position, here) <= 1e-12, "{} wanders", model.name());
                }
            }
        }
    }

    #[test]
    fn no_model_starting_from_rest_ever_gets_farther_from_its_target() {
        for model in every_model() {
            let target = [2.7, -1.3];
            let mut robot = Robot::at([0.0, 0.0], 2.0);
            let mut left = distance(robot.position, target);
            for _ in 0..400 {
                robot.step(&model, target, DT);
                let now = distance(robot.position, target);
                assert!(now <= left + 1e-12, "{}: {now} after {left}", model.name());
                left = now;
            }
        }
    }

    #[test]
    fn a_target_that_is_not_finite_brings_every_model_to_rest() {
        for model in every_model() {
            let mut robot = Robot::at([0.0, 0.0], 0.0);
            for _ in 0..40 {
                robot.step(&model, [20.0, 0.0], DT);
            }
            for bad in [[f64::NAN, 0.0], [0.0, f64::INFINITY]] {
                for _ in 0..60 {
                    robot.step(&model, bad, DT);
                }
                assert_eq!(robot.velocity, [0.0; 2], "{}", model.name());
                assert!(robot.position.iter().all(|p| p.is_finite()), "{}", model.name());
            }
        }
    }

    #[test]
    fn a_period_that_is_not_positive_moves_nothing() {
        for model in every_model() {
            let mut robot = Robot::at([1.0, 2.0], 0.5);
            for dt in [0.0, -1.0, f64::NAN] {
                robot.step(&model, [5.0, 5.0], dt);
            }
            assert_eq!(robot, Robot::at([1.0, 2.0], 0.5), "{}", model.name());
        }
    }
}
