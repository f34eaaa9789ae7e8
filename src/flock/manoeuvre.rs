//! Affine manoeuvres: how a whole formation is moved, turned, stretched and sheared, leg by leg.
//!
//! A rule whose weights reproduce each follower's place (patch test) carries any affine motion of the
//! leaders over to the followers exactly, so a manoeuvre of the leaders is one of the formation.

use super::block::{Block, IDENTITY, apply};

/// `x -> about + translate + matrix (x - about)` \[length, world frame\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// The place that the matrix leaves where it is.
    pub about: [f64; 2],
    /// Shift of every place \[length\].
    pub translate: [f64; 2],
    /// Stretch, shear and turn \[1\].
    pub matrix: Block,
}

impl Affine {
    /// Leaves everything where it is.
    pub const NONE: Affine = Affine { about: [0.0; 2], translate: [0.0; 2], matrix: IDENTITY };

    /// Where a place is carried to \[length, world frame\].
    pub fn apply(&self, place: [f64; 2]) -> [f64; 2] {
        let about = self.about;
        let moved = apply(&self.matrix, [place[0] - about[0], place[1] - about[1]]);
        [0, 1].map(|k| about[k] + self.translate[k] + moved[k])
    }
}

/// Where a formation is: translation \[length\], turn \[rad\] applied after stretch and shear \[1\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture {
    /// Shift of the formation as a whole \[length\].
    pub translate: [f64; 2],
    /// Angle, counter-clockwise \[rad\].
    pub rotate: f64,
    /// Factors along x and y \[1\]; 1 changes nothing.
    pub stretch: [f64; 2],
    /// Shift of x for every unit of y, and of y for every unit of x \[1\].
    pub shear: [f64; 2],
}

impl Posture {
    /// The formation as it was laid out.
    pub const NOMINAL: Posture =
        Posture { translate: [0.0; 2], rotate: 0.0, stretch: [1.0; 2], shear: [0.0; 2] };

    /// The map that carries the nominal posture about `about` \[length\] to this one.
    pub fn affine(&self, about: [f64; 2]) -> Affine {
        let (sin, cos) = self.rotate.sin_cos();
        let ([sx, sy], [hx, hy]) = (self.stretch, self.shear);
        let matrix = [[cos * sx - sin * hy, cos * hx - sin * sy], [sin * sx + cos * hy, sin * hx + cos * sy]];
        Affine { about, translate: self.translate, matrix }
    }

    /// The posture this part of the way to another.
    fn towards(&self, other: &Posture, part: f64) -> Posture {
        let pair = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|k| a[k] + part * (b[k] - a[k]));
        Posture {
            translate: pair(self.translate, other.translate),
            rotate: self.rotate + part * (other.rotate - self.rotate),
            stretch: pair(self.stretch, other.stretch),
            shear: pair(self.shear, other.shear),
        }
    }
}

/// A part of a manoeuvre: `seconds` to get to a posture, `hold` to stay there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// Time to get there \[s\].
    pub seconds: f64,
    /// Time to stay there \[s\].
    pub hold: f64,
    /// Where the leg leads, counted from the formation as it was laid out.
    pub posture: Posture,
}

/// Legs one after another, from the nominal posture unless `from` says otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Manoeuvre {
    /// The centre of turn, stretch and shear \[length, world frame\].
    pub about: [f64; 2],
    /// Posture before the first leg.
    pub from: Posture,
    /// Legs in the order in which they are flown.
    pub legs: Vec<Leg>,
}

impl Manoeuvre {
    /// Posture `time` seconds after the start; at rest at the ends of every leg (`3s^2 - 2s^3`), and where the
    /// last leg ends after it.
    pub fn posture(&self, time: f64) -> Posture {
        let mut from = self.from;
        let mut begun = 0.0;
        for leg in &self.legs {
            if time < begun + leg.seconds {
                let part = ((time - begun) / leg.seconds).max(0.0);
                return from.towards(&leg.posture, part * part * (3.0 - 2.0 * part));
            }
            begun += leg.seconds + leg.hold;
            from = leg.posture;
            if time < begun {
                break;
            }
        }
        from
    }

    /// The map of the formation's nominal places `time` seconds after the start.
    pub fn affine(&self, time: f64) -> Affine {
        self.posture(time).affine(self.about)
    }

    /// When the last leg's posture is reached \[s\].
    pub fn duration(&self) -> f64 {
        let all: f64 = self.legs.iter().map(|leg| leg.seconds + leg.hold).sum();
        all - self.legs.last().map_or(0.0, |leg| leg.hold)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned() -> Posture {
        Posture {
            translate: [5.0, 0.0],
            rotate: std::f64::consts::FRAC_PI_2,
            stretch: [2.0, 1.0],
            shear: [0.5, 0.0],
        }
    }

    #[test]
    fn a_posture_stretches_and_shears_before_it_turns() {
        let [x, y] = turned().affine([1.0, 1.0]).apply([2.0, 3.0]);
        // (1, 2) from the centre, stretched and sheared (3, 2), turned (-2, 3).
        assert!((x - 4.0).abs() < 1e-15 && (y - 4.0).abs() < 1e-15, "{x} {y}");
    }

    #[test]
    fn a_manoeuvre_goes_from_leg_to_leg_and_rests_between() {
        let legs = vec![
            Leg { seconds: 2.0, hold: 1.0, posture: turned() },
            Leg { seconds: 4.0, hold: 1.0, posture: Posture::NOMINAL },
        ];
        let manoeuvre = Manoeuvre { about: [0.0; 2], from: Posture::NOMINAL, legs };
        assert_eq!(manoeuvre.duration(), 7.0);
        let along = |time: f64| manoeuvre.posture(time).translate[0];
        let expected = [
            (-1.0, 0.0),
            (0.0, 0.0),
            (1.0, 2.5),
            (2.0, 5.0),
            (2.9, 5.0),
            (5.0, 2.5),
            (7.0, 0.0),
            (99.0, 0.0),
        ];
        for (time, x) in expected {
            assert_eq!(along(time), x, "at {time} s");
        }
        // Smooth: nearly at rest just after it starts.
        assert!(along(0.02) < 1e-2 * 0.5);
    }
}
