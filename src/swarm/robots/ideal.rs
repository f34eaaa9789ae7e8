//! The robot of the paper, and a particle: it is at its target after a period.

use super::Robot;

/// Bit for bit at the target.
pub fn step(robot: &mut Robot, target: [f64; 2], dt: f64) {
    robot.move_to(target, dt);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_at_its_target_to_the_bit() {
        let mut robot = Robot::at([1e9, 0.3], 0.0);
        step(&mut robot, [0.1, 0.7], 0.1);
        assert_eq!(robot.position, [0.1, 0.7]);
    }
}
