//! How leaders move: displacement from where they stood when they became leaders, as a function of
//! the steps since.

/// A leader's program; vectors in \[length, world frame\], times in steps since it became a leader.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Constant velocity \[length per step\].
    Velocity {
        /// Displacement that each step adds.
        per_step: [f64; 2],
    },
    /// Displacements at given steps, ascending; before the first it runs from zero at step 0, after
    /// the last it holds.
    Keyframes {
        /// Keyframes by ascending step.
        frames: Vec<Keyframe>,
        /// How displacements between two keyframes are found.
        interpolation: Interpolation,
    },
    /// Rotation by `angle` \[rad\], stretch and shear about `about`, reached in even parts over `steps`.
    Affine {
        /// Centre of turn, stretch and shear.
        about: [f64; 2],
        /// Angle at the end, counter-clockwise.
        angle: f64,
        /// Factors along x and y at the end \[1\]; 1 changes nothing.
        stretch: [f64; 2],
        /// Shift of x for every unit of y, and of y for every unit of x, at the end \[1\]; before the turn.
        shear: [f64; 2],
        /// Steps after which the end is reached.
        steps: f64,
    },
    /// `amplitude * sin(2 pi (step / period + phase))`, less its value at step 0.
    Sinusoid {
        /// Greatest deflection along x and y.
        amplitude: [f64; 2],
        /// Steps of one oscillation.
        period: f64,
        /// Share of an oscillation by which the start is shifted \[1\].
        phase: f64,
    },
    /// A displacement for each leader, reached in even parts over `steps`; shape \[leaders\], in the
    /// order of the particles' indices.
    Table {
        /// Displacement of each leader at the end.
        displacements: Vec<[f64; 2]>,
        /// Steps after which the end is reached.
        steps: f64,
    },
}

/// A displacement at a given step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// Steps since the particle became a leader; parts of a step are allowed.
    pub step: f64,
    /// From where the leader stood when it became one \[length\].
    pub displacement: [f64; 2],
}

/// How a motion goes from one keyframe to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// At constant velocity.
    Linear,
    /// Starts and ends each part at rest (the cubic `3s^2 - 2s^3`).
    Smooth,
    /// Jumps at each keyframe.
    Hold,
}

impl Motion {
    /// Whether it leads a particle along this axis, 0 or 1, at some time; of a table its rows say so.
    pub fn goes_along(&self, axis: usize) -> bool {
        match self {
            Self::Velocity { per_step } => per_step[axis] != 0.0,
            Self::Keyframes { frames, .. } => frames.iter().any(|frame| frame.displacement[axis] != 0.0),
            Self::Sinusoid { amplitude, .. } => amplitude[axis] != 0.0,
            Self::Affine { angle, stretch, shear, .. } => {
                *angle != 0.0 || stretch[axis] != 1.0 || shear[axis] != 0.0
            }
            Self::Table { .. } => false,
        }
    }

    /// Displacement after `step` steps of the leader number `which`, which started from `base` \[length\].
    pub fn displacement(&self, step: f64, which: usize, base: [f64; 2]) -> [f64; 2] {
        match self {
            Motion::Velocity { per_step } => per_step.map(|v| v * step),
            Motion::Keyframes { frames, interpolation } => keyframed(frames, *interpolation, step),
            Motion::Affine { about, angle, stretch, shear, steps } => {
                let part = (step / steps).clamp(0.0, 1.0);
                let s = [0, 1].map(|k| 1.0 + part * (stretch[k] - 1.0));
                let h = shear.map(|gamma| part * gamma);
                let r = [base[0] - about[0], base[1] - about[1]];
                let deformed = [s[0] * r[0] + h[0] * r[1], h[1] * r[0] + s[1] * r[1]];
                let (sin, cos) = (part * angle).sin_cos();
                let turned = [cos * deformed[0] - sin * deformed[1], sin * deformed[0] + cos * deformed[1]];
                [turned[0] - r[0], turned[1] - r[1]]
            }
            Motion::Sinusoid { amplitude, period, phase } => {
                let wave = |step: f64| (std::f64::consts::TAU * (step / period + phase)).sin();
                amplitude.map(|a| a * (wave(step) - wave(0.0)))
            }
            Motion::Table { displacements, steps } => {
                displacements[which].map(|d| d * (step / steps).clamp(0.0, 1.0))
            }
        }
    }

    /// Steps after which the leader rests; `None` where it never does.
    pub fn duration(&self) -> Option<usize> {
        match self {
            Motion::Velocity { per_step } => (*per_step == [0.0; 2]).then_some(0),
            Motion::Sinusoid { amplitude, .. } => (*amplitude == [0.0; 2]).then_some(0),
            Motion::Keyframes { frames, .. } => {
                Some(frames.last().map_or(0, |frame| frame.step.ceil() as usize))
            }
            Motion::Affine { steps, .. } | Motion::Table { steps, .. } => Some(steps.ceil() as usize),
        }
    }
}

fn keyframed(frames: &[Keyframe], interpolation: Interpolation, step: f64) -> [f64; 2] {
    let start = Keyframe { step: 0.0, displacement: [0.0; 2] };
    let after = frames.partition_point(|frame| frame.step <= step);
    let from = if after == 0 { start } else { frames[after - 1] };
    let Some(to) = frames.get(after) else { return from.displacement };
    let part = (step - from.step) / (to.step - from.step);
    let part = match interpolation {
        Interpolation::Linear => part,
        Interpolation::Smooth => part * part * (3.0 - 2.0 * part),
        Interpolation::Hold => 0.0,
    };
    [0, 1].map(|k| from.displacement[k] + part * (to.displacement[k] - from.displacement[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: [f64; 2], b: [f64; 2]) -> bool {
        (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12
    }

    #[test]
    fn keyframes_interpolate_and_then_hold() {
        let frames = vec![
            Keyframe { step: 10.0, displacement: [2.0, 0.0] },
            Keyframe { step: 20.0, displacement: [2.0, 4.0] },
        ];
        let at = |interpolation, step| {
            Motion::Keyframes { frames: frames.clone(), interpolation }.displacement(step, 0, [0.0; 2])
        };
        assert!(near(at(Interpolation::Linear, 5.0), [1.0, 0.0]));
        assert!(near(at(Interpolation::Linear, 15.0), [2.0, 2.0]));
        assert!(near(at(Interpolation::Smooth, 2.5), [0.3125, 0.0]));
        assert!(near(at(Interpolation::Hold, 19.0), [2.0, 0.0]));
        assert!(near(at(Interpolation::Linear, 500.0), [2.0, 4.0]));
    }

    #[test]
    fn an_affine_quarter_turn_ends_where_it_should() {
        let motion = Motion::Affine {
            about: [1.0, 0.0],
            angle: std::f64::consts::FRAC_PI_2,
            stretch: [2.0, 1.0],
            shear: [0.0, 0.0],
            steps: 10.0,
        };
        // (2, 0) lies 1 from the centre, 2 when stretched, then above it.
        assert!(near(motion.displacement(10.0, 0, [2.0, 0.0]), [-1.0, 2.0]));
        assert!(near(motion.displacement(99.0, 0, [2.0, 0.0]), [-1.0, 2.0]));
        assert!(near(motion.displacement(0.0, 0, [2.0, 0.0]), [0.0, 0.0]));
    }

    #[test]
    fn a_sinusoid_starts_from_rest_and_repeats() {
        let motion = Motion::Sinusoid { amplitude: [1.0, 0.0], period: 8.0, phase: 0.25 };
        assert!(near(motion.displacement(0.0, 0, [0.0; 2]), [0.0, 0.0]));
        assert!(near(motion.displacement(4.0, 0, [0.0; 2]), [-2.0, 0.0]));
        assert!(near(motion.displacement(8.0, 0, [0.0; 2]), [0.0, 0.0]));
    }
}
