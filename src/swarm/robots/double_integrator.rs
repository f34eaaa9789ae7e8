//! Double integrator with limits on speed and acceleration, the acceleration constant over a period.

use super::Robot;

/// The limits of a double integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleIntegrator {
    /// Highest speed \[m/s\].
    pub speed: f64,
    /// Highest acceleration, and deceleration \[m/s^2\].
    pub acceleration: f64,
}

impl DoubleIntegrator {
    /// Takes the highest speed towards the target from which it can still brake in time; from rest, to a
    /// target that stays, it stands on it after finitely many periods and never goes past it. With speed
    /// sideways it shares its acceleration between the two directions and may swing around.
    pub fn step(&self, robot: &mut Robot, target: [f64; 2], dt: f64) {
        let velocity = robot.velocity;
        // The period moves it by dt (v + v') / 2, of which the half with v is settled.
        let offset = robot.offset_to(target);
        let open = [0, 1].map(|k| offset[k] - 0.5 * dt * velocity[k]);
        self.accelerate(robot, self.approach(open, dt), dt);
    }

    /// Comes to rest as soon as it can.
    pub fn brake(&self, robot: &mut Robot, dt: f64) {
        self.accelerate(robot, [0.0; 2], dt);
    }

    /// Goes on for a period with the velocity nearest to `wanted` \[m/s\] that it can reach in it.
    fn accelerate(&self, robot: &mut Robot, wanted: [f64; 2], dt: f64) {
        let velocity = robot.velocity;
        let change = [0, 1].map(|k| wanted[k] - velocity[k]);
        let (size, most) = (change[0].hypot(change[1]), self.acceleration * dt);
        let share = if size > most { most / size } else { 1.0 };
        robot.velocity = [0, 1].map(|k| velocity[k] + share * change[k]);
        robot.position = [0, 1].map(|k| robot.position[k] + 0.5 * dt * (velocity[k] + robot.velocity[k]));
    }

    /// The velocity `v'` \[m/s\] at the end of a period after which it can still come to rest at `open` \[m\],
    /// counted from `v dt / 2` ahead of it, within the speed limit.
    ///
    /// It covers `v' dt / 2` in the period and the way it takes to brake. In units of `a dt` and `a dt^2`, a speed
    /// of `n + r`, `n` whole and `0 <= r < 1`, takes `n (n + 1) / 2 + r (n + 1)`: whole periods of braking, the rest
    /// in the last.
    pub fn approach(&self, open: [f64; 2], dt: f64) -> [f64; 2] {
        let length = open[0].hypot(open[1]);
        if length == 0.0 {
            return [0.0; 2];
        }
        let unit = self.acceleration * dt;
        let way = length / (unit * dt);
        let whole = ((0.25 + 2.0 * way).sqrt() - 0.5).floor();
        let speed = unit * (whole + (way - 0.5 * whole * (whole + 1.0)) / (whole + 1.0));
        open.map(|d| speed.min(self.speed) / length * d)
    }

    /// The inverse of [`DoubleIntegrator::approach`] below the speed limit: the way beyond `v dt / 2` that a period
    /// that ends with `velocity` \[m/s\] and the braking after it cover \[m\].
    pub fn covered(&self, velocity: [f64; 2], dt: f64) -> [f64; 2] {
        let speed = velocity[0].hypot(velocity[1]);
        if speed == 0.0 {
            return [0.0; 2];
        }
        let unit = self.acceleration * dt;
        let whole = (speed / unit).floor();
        let way = 0.5 * whole * (whole + 1.0) + (speed / unit - whole) * (whole + 1.0);
        velocity.map(|v| way * unit * dt / speed * v)
    }

    /// The way from here to where it comes to rest if it brakes from `velocity` \[m/s\] now \[m\].
    pub(crate) fn braking_way(&self, velocity: [f64; 2], dt: f64) -> [f64; 2] {
        let covered = self.covered(velocity, dt);
        [0, 1].map(|k| covered[k] - 0.5 * dt * velocity[k])
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::DT;
    use super::*;
    use crate::flock::vectors::distance;

    #[test]
    fn it_keeps_its_limits_whatever_its_target_does() {
        let double = DoubleIntegrator { speed: 1.2, acceleration: 0.6 };
        let mut robot = Robot::at([0.0, 0.0], 0.0);
        for k in 0..2000 {
            let angle = 0.7 * f64::from(k / 30);
            let before = robot.velocity;
            double.step(&mut robot, [8.0 * angle.cos(), 5.0 * (1.7 * angle).sin()], DT);
            let change = distance(before, robot.velocity);
            assert!(change <= 0.6 * DT + 1e-12, "{change}");
            assert!(robot.velocity[0].hypot(robot.velocity[1]) <= 1.2 + 1e-12);
        }
    }

    #[test]
    fn from_rest_it_brakes_in_time_and_lands_within_a_period_of_the_best_there_is() {
        for length in [1e-5, 0.01, 0.3, 0.9, 1.0, 7.3] {
            let double = DoubleIntegrator { speed: 1.0, acceleration: 1.0 };
            let mut robot = Robot::at([0.0, 0.0], 0.0);
            // Bang-bang: 2 sqrt(l) below the speed limit, l + 1 above.
            let best: f64 = if length < 1.0 { 2.0 * f64::sqrt(length) } else { length + 1.0 };
            let periods = (best / DT).ceil() as usize + 2;
            for _ in 0..periods {
                double.step(&mut robot, [length, 0.0], DT);
                assert!(robot.position[0] <= length + 1e-12, "past {length} at {:?}", robot.position);
                assert!(robot.velocity[0] >= -1e-12);
            }
            let missing = (robot.position[0] - length).abs().max(robot.velocity[0].abs());
            assert!(missing <= 1e-9, "{missing} left of {length} after {periods} periods");
        }
    }

    #[test]
    fn the_way_it_needs_to_brake_is_the_way_it_takes() {
        let double = DoubleIntegrator { speed: 9.0, acceleration: 0.7 };
        for speed in [0.0, 0.01, 0.035, 0.4, 2.3] {
            let mut robot = Robot { velocity: [0.6 * speed, -0.8 * speed], ..Robot::at([0.0, 0.0], 0.0) };
            let way = double.braking_way(robot.velocity, DT);
            let again = double.approach(double.covered(robot.velocity, DT), DT);
            assert!(distance(again, robot.velocity) < 1e-12, "{again:?} of {robot:?}");
            for _ in 0..80 {
                double.brake(&mut robot, DT);
            }
            assert!(distance(robot.position, way) < 1e-12, "{robot:?}, not at {way:?}");
        }
    }

    #[test]
    fn from_any_velocity_it_comes_to_stand_on_its_target() {
        for turn in 0..12 {
            let angle = f64::from(turn) / 6.0 * std::f64::consts::PI;
            let mut robot = Robot { velocity: [angle.cos(), angle.sin()], ..Robot::at([0.0, 0.0], 0.0) };
            for _ in 0..400 {
                DoubleIntegrator { speed: 1.0, acceleration: 1.0 }.step(&mut robot, [0.4, 0.2], DT);
            }
            assert!(distance(robot.position, [0.4, 0.2]) < 1e-9, "{robot:?}");
            assert!(robot.velocity[0].hypot(robot.velocity[1]) < 1e-9, "{robot:?}");
        }
    }
}
