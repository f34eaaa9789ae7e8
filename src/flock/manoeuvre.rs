//! Affine manoeuvres: how a whole formation is moved, turned, stretched and sheared, leg by leg.
//!
//! A rule whose weights reproduce each follower's place (patch test) carries any affine motion of the
//! leaders over to the followers exactly, so a manoeuvre of the leaders is one of the formation.

use super::block::{Block, IDENTITY, apply, inverse, product};
use super::vectors::Vectors;

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

    /// The same map, counted from another point that is turned about than `from`.
    pub fn about(&self, to: [f64; 2], from: [f64; 2]) -> Self {
        let way = [to[0] - from[0], to[1] - from[1]];
        let moved = apply(&self.affine(from).matrix, way);
        Self { translate: [0, 1].map(|k| self.translate[k] + (moved[k] - way[k])), ..*self }
    }

    /// The posture about `about` \[length\] that carries places nearest to where they are, by least squares; of places on
    /// one line, one without shear.
    pub fn fitted(about: [f64; 2], carried: &[([f64; 2], [f64; 2])]) -> Self {
        let mean = |places: &dyn Fn(usize) -> [f64; 2]| {
            let sum = |k: usize| (0..carried.len()).map(|n| places(n)[k]).sum::<f64>();
            [0, 1].map(|k| sum(k) / carried.len().max(1) as f64)
        };
        let (middle, to) = (mean(&|n| carried[n].0), mean(&|n| carried[n].1));
        // Sums of the products of coordinates, before with before and after with before.
        let (mut before, mut after) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
        for (place, now) in carried {
            for (i, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                before[i][k] += (place[i] - middle[i]) * (place[k] - middle[k]);
                after[i][k] += (now[i] - to[i]) * (place[k] - middle[k]);
            }
        }
        let size = before[0][0] + before[1][1];
        let (along, across) = (after[0][0] + after[1][1], after[1][0] - after[0][1]);
        let is_flat = before[0][0] * before[1][1] - before[0][1] * before[1][0] <= 1e-9 * size * size;
        let matrix = match inverse(&before).filter(|_| !is_flat) {
            Some(inverse) => product(&after, &inverse),
            None if size > 0.0 => [[along / size, -across / size], [across / size, along / size]],
            None => IDENTITY,
        };
        let rotate = (matrix[1][0] - matrix[0][1]).atan2(matrix[0][0] + matrix[1][1]);
        let (sin, cos) = rotate.sin_cos();
        let [[sx, hx], [hy, sy]] = product(&[[cos, sin], [-sin, cos]], &matrix);
        let shift = [to[0] - middle[0], to[1] - middle[1]];
        Self { translate: shift, rotate, stretch: [sx, sy], shear: [hx, hy] }.about(about, middle)
    }

    /// Stretch and shear, before the turn.
    pub(crate) fn shape(&self) -> Block {
        [[self.stretch[0], self.shear[0]], [self.shear[1], self.stretch[1]]]
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

/// The most that a manoeuvre asks of any place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Demand {
    /// \[length/s\]
    pub speed: f64,
    /// \[length/s^2\]
    pub acceleration: f64,
}

/// Looks at each round of a leg that turns, less one; even, so that its fastest instant, the middle, is looked at.
const LOOKS: usize = 128;

/// Most rounds of a leg between the looks at which the highest speed is sought; of more the looks would take long, and some round comes
/// close to its bound.
const MOST_ROUNDS: f64 = 64.0;

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

    /// Speed and acceleration of the place that is moved most, from the derivatives of the map.
    ///
    /// The part `s(t)` of a leg's way takes a place `X`, counted from the centre, to `d(s) + R(s) M(s) X`: `d` and `M` are
    /// linear in `s`, and so is the angle of the turn `R`, by `w` in all. Its velocity is `s' (d' + R V X)` with
    /// `V = M' + w J M`, its acceleration `s'' (d' + R V X) + s'^2 R (2 w J M' - w^2 M) X`, `J` being a quarter turn. A leg
    /// of very many rounds turns far between two looks: the angle between the two summands then counts as the smallest that it
    /// has there.
    pub fn demand(&self, places: &Vectors) -> Demand {
        let mut demand = Demand::default();
        let mut from = &self.from;
        for leg in &self.legs {
            let turns = (leg.posture.rotate - from.rotate).abs();
            let rounds = (turns / std::f64::consts::TAU).ceil().max(1.0);
            let (looks, slack) = match rounds <= MOST_ROUNDS {
                true => (LOOKS * rounds as usize, 0.0),
                false => (LOOKS, turns * 0.5 / LOOKS as f64),
            };
            let of = |part: f64| self.demand_at(from, leg, part, slack, places);
            demand.speed = demand.speed.max(highest(looks, |part| of(part).speed));
            demand.acceleration = demand.acceleration.max(highest(looks, |part| of(part).acceleration));
            from = &leg.posture;
        }
        demand
    }

    /// The same in a leg once this part `u` of its time is over, where `slack` is how far it may turn until then \[rad\] of a turn that is
    /// even.
    fn demand_at(&self, from: &Posture, leg: &Leg, u: f64, slack: f64, places: &Vectors) -> Demand {
        let Leg { seconds, posture, .. } = leg;
        let moved = [0, 1].map(|k| posture.translate[k] - from.translate[k]);
        let (deforms, turns) = (difference(posture, from), posture.rotate - from.rotate);
        let pace = 6.0 * u * (1.0 - u) / seconds;
        let gain = 6.0 * (1.0 - 2.0 * u) / (seconds * seconds);
        let slack = slack * pace * seconds;
        let now = from.towards(posture, u * u * (3.0 - 2.0 * u));
        let shape = now.shape();
        let velocity = combined(1.0, &deforms, turns, &turned(&shape));
        let rate = turns * pace;
        let bend = combined(2.0 * rate * pace, &turned(&deforms), -rate * rate, &shape);
        let change = combined(gain, &velocity, 1.0, &bend);
        // As the formation sees it, which has turned.
        let (sin, cos) = now.rotate.sin_cos();
        let shift = [cos * moved[0] + sin * moved[1], cos * moved[1] - sin * moved[0]];
        let mut demand = Demand::default();
        for place in places.iter() {
            let away = [0, 1].map(|k| place[k] - self.about[k]);
            let speed = pace * longest_sum(shift, apply(&velocity, away), slack);
            let acceleration = longest_sum(shift.map(|part| gain * part), apply(&change, away), slack);
            demand.speed = demand.speed.max(speed);
            demand.acceleration = demand.acceleration.max(acceleration);
        }
        demand
    }

    /// When the last leg's posture is reached \[s\].
    pub fn duration(&self) -> f64 {
        let all: f64 = self.legs.iter().map(|leg| leg.seconds + leg.hold).sum();
        all - self.legs.last().map_or(0.0, |leg| leg.hold)
    }
}

/// The highest of the values at all parts of a way, from 0 to 1, which is looked at between so many steps, and more and more closely around
/// the highest looks.
pub(crate) fn highest(steps: usize, at: impl Fn(f64) -> f64) -> f64 {
    /// Times that the part of the way around a look is narrowed, by a third each.
    const NARROWINGS: usize = 24;
    /// What a look has of the highest one, if it is narrowed as well: of two tops either may lie farther from the looks.
    const NEARLY: f64 = 1.0 - 1e-3;
    let looks: Vec<f64> = (0..=steps).map(|n| at(n as f64 / steps as f64)).collect();
    let mut found = looks.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let beside = |n: usize| [n.saturating_sub(1), (n + 1).min(steps)];
    let least = found - (1.0 - NEARLY) * found.abs();
    // Of looks that are alike the first.
    let is_top = |&n: &usize| {
        looks[n] >= least && (n == 0 || looks[n - 1] < looks[n]) && looks[beside(n)[1]] <= looks[n]
    };
    for top in (0..=steps).filter(is_top) {
        let [mut low, mut high] = beside(top).map(|n| n as f64 / steps as f64);
        for _ in 0..NARROWINGS {
            let third = (high - low) / 3.0;
            let [first, second] = [at(low + third), at(high - third)];
            found = found.max(first).max(second);
            if first < second {
                low += third;
            } else {
                high -= third;
            }
        }
    }
    found
}

/// What stretch and shear of one posture have more than those of another.
fn difference(one: &Posture, other: &Posture) -> Block {
    combined(1.0, &one.shape(), -1.0, &other.shape())
}

fn combined(a: f64, first: &Block, b: f64, second: &Block) -> Block {
    [0, 1].map(|i| [0, 1].map(|k| a * first[i][k] + b * second[i][k]))
}

/// After a quarter turn to the left.
fn turned([x, y]: &Block) -> Block {
    [y.map(|value| -value), *x]
}

/// The length of the sum of two vectors whose angle may be smaller by `slack` \[rad\].
fn longest_sum(first: [f64; 2], second: [f64; 2], slack: f64) -> f64 {
    let [a, b] = [first, second].map(|one| f64::hypot(one[0], one[1]));
    let cross = first[0] * second[1] - first[1] * second[0];
    let angle = cross.atan2(first[0] * second[0] + first[1] * second[1]).abs();
    let (sin, cos) = (angle - slack).max(0.0).sin_cos();
    f64::hypot(a + b * cos, b * sin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::vectors::distance;

    fn posed() -> Posture {
        Posture {
            translate: [5.0, 0.0],
            rotate: std::f64::consts::FRAC_PI_2,
            stretch: [2.0, 1.0],
            shear: [0.5, 0.0],
        }
    }

    #[test]
    fn a_posture_stretches_and_shears_before_it_turns() {
        let [x, y] = posed().affine([1.0, 1.0]).apply([2.0, 3.0]);
        // (1, 2) from the centre, stretched and sheared (3, 2), turned (-2, 3).
        assert!((x - 4.0).abs() < 1e-15 && (y - 4.0).abs() < 1e-15, "{x} {y}");
    }

    #[test]
    fn a_posture_is_the_same_about_another_point_and_is_found_again_where_it_led() {
        let near = |a: [f64; 2], b: [f64; 2]| distance(a, b) < 1e-12;
        let places = [[0.0, 0.0], [2.0, 0.5], [-1.0, 3.0], [4.0, 4.0]];
        let there = posed().affine([1.0, 1.0]);
        let moved = posed().about([-3.0, 7.0], [1.0, 1.0]).affine([-3.0, 7.0]);
        let carried = places.map(|place| (place, there.apply(place)));
        let found = Posture::fitted([0.5, 2.0], &carried).affine([0.5, 2.0]);
        // Two leaders are turned and stretched alike, one is shifted.
        let [two, one] =
            [2, 1].map(|count| Posture::fitted([9.0, 9.0], &carried[..count]).affine([9.0, 9.0]));
        for (k, (place, to)) in carried.into_iter().enumerate() {
            assert!(near(moved.apply(place), to) && near(found.apply(place), to), "{place:?}");
            assert!(k >= 2 || near(two.apply(place), to), "{place:?} of two");
            assert!(k >= 1 || near(one.apply(place), to) && one.matrix == IDENTITY, "{place:?} alone");
        }
    }

    #[test]
    fn a_manoeuvre_asks_for_what_its_map_does_however_often_it_turns() {
        let places: Vectors = [[2.0, 0.5], [0.0, 3.0], [-1.0, -1.0]].into_iter().collect();
        let to = |seconds: f64, posture: Posture| Leg { seconds, hold: 1.0, posture };
        let legs = vec![to(2.0, posed()), to(4.0, Posture { rotate: -2.0, ..Posture::NOMINAL })];
        let manoeuvre = Manoeuvre { about: [1.0, 1.0], from: Posture::NOMINAL, legs };
        // By differences of the map itself.
        let (h, mut speed, mut acceleration) = (1e-4, 0.0_f64, 0.0_f64);
        for k in 1..80_000 {
            let t = f64::from(k) * h;
            // Not across the jump of acceleration at the ends of a leg.
            if [0.0, 2.0, 3.0, 7.0].iter().any(|end| (t - end).abs() < 1.5 * h) {
                continue;
            }
            for place in places.iter() {
                let [a, b, c] = [t - h, t, t + h].map(|t| manoeuvre.affine(t).apply(place));
                speed = speed.max(distance(a, c) / (2.0 * h));
                acceleration = acceleration
                    .max(f64::hypot(a[0] - 2.0 * b[0] + c[0], a[1] - 2.0 * b[1] + c[1]) / (h * h));
            }
        }
        let found = manoeuvre.demand(&places);
        let is_near = |found: f64, exact: f64| (found / exact - 1.0).abs() < 5e-4;
        assert!(is_near(found.speed, speed), "{found:?} for {speed}");
        assert!(is_near(found.acceleration, acceleration), "{found:?} for {acceleration}");

        // Where one leg turns and shifts at once, however often.
        for (rounds, seconds) in [(0.25, 10.0), (1.0, 60.0), (7.3, 300.0), (63.5, 3000.0)] {
            let posture =
                Posture { translate: [9.0, 2.0], rotate: rounds * std::f64::consts::TAU, ..Posture::NOMINAL };
            let one =
                Manoeuvre { about: [1.0, 1.0], from: Posture::NOMINAL, legs: vec![to(seconds, posture)] };
            let (parts, h) = (200_000, 1e-4);
            let at = |t: f64, n: usize| one.affine(t).apply(places.get(n));
            let speeds = (1..parts).flat_map(|k| {
                let t = seconds * f64::from(k) / f64::from(parts);
                (0..places.len()).map(move |n| (t, n))
            });
            let exact =
                speeds.map(|(t, n)| distance(at(t - h, n), at(t + h, n)) / (2.0 * h)).fold(0.0, f64::max);
            let found = one.demand(&places).speed;
            assert!((found / exact - 1.0).abs() < 1e-6, "{rounds}: {found} for {exact}");
        }

        // Round and round, a place goes at 1.5 times the mean speed in the middle.
        let radius = distance(places.get(2), [1.0, 1.0]);
        for rounds in [0.1, 1.0, 1000.0, 12_345.6] {
            let (seconds, rotate) = (1000.0, rounds * std::f64::consts::TAU);
            let moved = |translate| {
                let posture = Posture { rotate, translate, ..Posture::NOMINAL };
                let legs = vec![to(seconds, posture)];
                Manoeuvre { about: [1.0, 1.0], from: Posture::NOMINAL, legs }.demand(&places).speed
            };
            let (turn, far) = (1.5 * rotate * radius / seconds, 3000.0);
            assert!((moved([0.0; 2]) / turn - 1.0).abs() < 1e-12, "{rounds}");
            if rounds > 100.0 {
                let both = moved([far, 0.0]);
                assert!((both / (turn + 1.5 * far / seconds) - 1.0).abs() < 1e-6, "{rounds}: {both}");
            }
        }
    }

    #[test]
    fn a_manoeuvre_goes_from_leg_to_leg_and_rests_between() {
        let legs = vec![
            Leg { seconds: 2.0, hold: 1.0, posture: posed() },
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
