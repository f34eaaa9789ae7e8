//! Places by ranges: where a member can be by what others measured, whatever it says itself.
//!
//! Every range is a ring around its observer, as wide as what may be wrong about it. Two rings cross at two places at most;
//! where the member is, the rings of all but the liars meet. A pose that was found false is replaced by that place, and a
//! member that was found lying is believed again where no other place is left.

use crate::flock::vectors::distance;

/// A range as seen from a place of its observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ring {
    /// \[m, world frame\]
    pub centre: [f64; 2],
    /// \[m\]
    pub radius: f64,
    /// Most by which both may be wrong together \[m\].
    pub slack: f64,
}

impl Ring {
    pub fn holds(&self, place: [f64; 2]) -> bool {
        (distance(place, self.centre) - self.radius).abs() <= self.slack
    }

    /// Where two rings cross, at the middle of each; at their nearest where noise keeps them apart.
    fn crossings(&self, other: &Self) -> Option<[[f64; 2]; 2]> {
        let apart = distance(self.centre, other.centre);
        if apart == 0.0 {
            return None;
        }
        let along = [0, 1].map(|k| (other.centre[k] - self.centre[k]) / apart);
        let ahead = (self.radius.powi(2) - other.radius.powi(2) + apart.powi(2)) / (2.0 * apart);
        let aside = (self.radius.powi(2) - ahead.powi(2)).max(0.0).sqrt();
        let at = |aside: f64| {
            [
                self.centre[0] + ahead * along[0] - aside * along[1],
                self.centre[1] + ahead * along[1] + aside * along[0],
            ]
        };
        Some([at(aside), at(-aside)])
    }
}

/// Rings that are looked at, which bounds what the places of one member cost.
const MOST_RINGS: usize = 16;

/// The places that rings leave.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Places {
    all: Vec<[f64; 2]>,
    /// Places this near each other are one \[m\].
    near: f64,
}

impl Places {
    /// The places that all but `max_faulty` of the nearest rings hold, if those are more than can lie, and two at least.
    pub fn of(rings: &[Ring], max_faulty: usize) -> Self {
        let mut rings = rings.to_vec();
        rings.sort_by(|a, b| a.radius.total_cmp(&b.radius));
        rings.truncate(MOST_RINGS.max(3 * max_faulty));
        let needed = rings.len().saturating_sub(max_faulty).max(max_faulty + 1).max(2);
        let pairs = rings.iter().enumerate().flat_map(|(k, a)| rings[..k].iter().map(move |b| (a, b)));
        let crossings = pairs.filter_map(|(a, b)| a.crossings(b)).flatten();
        let is_left = |place: &[f64; 2]| rings.iter().filter(|ring| ring.holds(*place)).count() >= needed;
        let slack = rings.iter().map(|ring| ring.slack).fold(0.0, f64::max);
        Self { all: crossings.filter(is_left).collect(), near: 2.0 * slack }
    }

    /// Leaves out what is farther than `reach` \[m\] from a place.
    pub fn within(mut self, reach: f64, place: [f64; 2]) -> Self {
        let reach = reach + self.near;
        self.all.retain(|one| distance(*one, place) <= reach);
        self
    }

    /// Whether there is this place and no other.
    pub fn are_only(&self, place: [f64; 2]) -> bool {
        !self.all.is_empty() && self.all.iter().all(|one| distance(*one, place) <= self.near)
    }

    /// The one place there is, if there is one.
    pub fn only(&self) -> Option<[f64; 2]> {
        let sum = self.all.iter().fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
        let mean = sum.map(|sum| sum / self.all.len() as f64);
        self.are_only(mean).then_some(mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: [f64; 2] = [2.0, 1.0];

    fn rings(centres: &[[f64; 2]]) -> Vec<Ring> {
        let ring = |&centre: &[f64; 2]| Ring { centre, radius: distance(centre, HERE), slack: 0.1 };
        centres.iter().map(ring).collect()
    }

    #[test]
    fn a_place_is_known_where_the_rings_of_all_but_liars_leave_no_other() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [1.0, 2.0]];
        let is_here = |place: Option<[f64; 2]>| place.is_some_and(|place| distance(place, HERE) < 0.1);
        assert!(is_here(Places::of(&rings(&corners[..3]), 0).only()));
        // One that lies takes three beside it that do not.
        let mut lying = rings(&corners);
        lying[1].radius += 1.0;
        assert!(is_here(Places::of(&lying, 1).only()));
        assert!(!is_here(Places::of(&lying, 0).only()));
        // Fewer than three, or a line of them, leave its mirror image as well.
        let line = [[0.0, 0.0], [1.0, 0.0], [4.0, 0.0]];
        for (few, max_faulty) in [(&corners[..1], 0), (&corners[..2], 0), (&corners[..2], 1), (&line[..], 0)]
        {
            let places = Places::of(&rings(few), max_faulty);
            assert!(places.only().is_none() && !places.are_only(HERE), "{few:?}: {places:?}");
        }
        // The image is out of reach of where the member was; on the line there is none.
        assert!(Places::of(&rings(&line), 0).within(1.0, [2.0, 0.8]).are_only(HERE));
        let row = [[0.0, 1.0], [1.0, 1.0], [5.0, 1.0]];
        assert!(is_here(Places::of(&rings(&row), 0).only()));
    }

    #[test]
    fn rings_around_one_point_leave_nothing() {
        assert!(Places::of(&rings(&[[0.0, 0.0]; 3]), 0).only().is_none());
        assert!(Places::of(&[], 0).only().is_none());
    }
}
