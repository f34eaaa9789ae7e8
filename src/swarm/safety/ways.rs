//! The ways on which members that take time to brake come to rest, and the borders that part them.
//!
//! A member that follows its targets goes along one straight way. Between its last pose and now it may have stopped
//! following them: it then stands on its past way, or came to rest beside it. The convex hull of all these places is
//! what others keep clear of.

use super::cell::{HalfPlane, foot, length, nearest};
use super::step::TOUCHING;
use crate::geometry::point::{cross, dot, minus};
use crate::geometry::shape::segments_cross;

/// All places that a member may take until it is at rest.
#[derive(Clone, Debug, Default)]
pub struct Ways {
    /// The place at which it is seen, and that at which it comes to rest if it brakes now \[m\].
    pub way: [[f64; 2]; 2],
    /// Whether it takes no others.
    is_straight: bool,
    /// Corners of the convex hull, in order \[m\].
    pub corners: Vec<[f64; 2]>,
    sorted: Vec<[f64; 2]>,
    /// Largest distance of a corner from the member \[m\].
    pub extent: f64,
}

impl Ways {
    /// Takes the hull of the way from `here` to `rest` and of other places \[m\].
    pub fn take(&mut self, here: [f64; 2], rest: [f64; 2], places: &[[f64; 2]]) {
        self.way = [here, rest];
        self.corners.clear();
        self.corners.extend(self.way);
        self.is_straight = places.is_empty() || !here.iter().chain(&rest).all(|x| x.is_finite());
        if !self.is_straight {
            self.sorted.clear();
            self.sorted.extend(places.iter().chain(&self.way));
            hull(&mut self.sorted, &mut self.corners);
        }
        let far = self.corners.iter().map(|&corner| length(minus(corner, here))).fold(0.0, f64::max);
        self.extent = if far.is_finite() { far } else { 0.0 };
    }

    /// Whether the member stands, as far as is known.
    pub fn is_point(&self) -> bool {
        self.extent == 0.0
    }

    /// Distance from a place to the hull's rim \[m\].
    pub fn distance(&self, place: [f64; 2]) -> f64 {
        edges(&self.corners).map(|edge| length(minus(foot(edge, place), place))).fold(f64::INFINITY, f64::min)
    }

    /// The largest offset of one of its places from the member along `normal` \[m\].
    fn support(&self, normal: [f64; 2]) -> f64 {
        let offset = |corner: &[f64; 2]| dot(normal, minus(*corner, self.way[0]));
        self.corners.iter().map(offset).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The pairs of neighbouring corners of a hull.
pub fn edges(corners: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> {
    let count = corners.len();
    // A segment has one edge.
    (0..if count > 2 { count } else { 1 }).map(move |k| [corners[k], corners[(k + 1) % count]])
}

/// Corners of the convex hull of these places, counter-clockwise: the lower and the upper chain (A. M. Andrew, "Another
/// efficient algorithm for convex hulls in two dimensions", Information Processing Letters 9(5), 1979).
fn hull(places: &mut Vec<[f64; 2]>, corners: &mut Vec<[f64; 2]>) {
    corners.clear();
    places.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    places.dedup();
    let mut chain = |places: &mut dyn Iterator<Item = [f64; 2]>| {
        let begin = corners.len();
        for place in places {
            while let [.., a, b] = corners[begin..]
                && cross(minus(b, a), minus(place, a)) <= 0.0
            {
                corners.pop();
            }
            corners.push(place);
        }
        // It is where the other chain begins.
        corners.pop();
    };
    chain(&mut places.iter().copied());
    chain(&mut places.iter().rev().copied());
    if corners.is_empty() {
        corners.extend(places.first());
    }
}

/// The nearest points of two hulls; `None` if they have a point in common.
fn nearest_of(first: &Ways, second: &Ways) -> Option<[[f64; 2]; 2]> {
    let from = first
        .corners
        .iter()
        .flat_map(|&corner| edges(&second.corners).map(move |edge| [corner, foot(edge, corner)]));
    let to = second
        .corners
        .iter()
        .flat_map(|&corner| edges(&first.corners).map(move |edge| [foot(edge, corner), corner]));
    let square = |[a, b]: &[[f64; 2]; 2]| dot(minus(*b, *a), minus(*b, *a));
    let [near, far] = from.chain(to).min_by(|a, b| square(a).total_cmp(&square(b)))?;
    let way = minus(far, near);
    // The line across the way parts convex hulls that have no point in common. The direction of a short way is known no better
    // than its ends are.
    let far_out = near.iter().chain(&far).fold(0.0, |most: f64, x| most.max(x.abs()));
    let size = first.extent + second.extent + length(way);
    let most = TOUCHING * square(&[near, far]) + 16.0 * f64::EPSILON * (far_out + size) * size;
    let is_before = first.corners.iter().all(|&corner| dot(way, minus(corner, near)) <= most);
    let is_behind = second.corners.iter().all(|&corner| dot(way, minus(far, corner)) <= most);
    (way != [0.0; 2] && is_before && is_behind).then_some([near, far])
}

/// The border of a member's cell to another, for members whose ways until they are at rest are known.
pub struct Border<'a> {
    /// The member's and the other's.
    pub ways: [&'a Ways; 2],
    /// Places where the other may be, or come to rest, if it has not done what it was sent to \[m\].
    pub places: &'a [[f64; 2]],
    /// Distance of the two members' places to be kept \[m\].
    pub keep: f64,
    /// Largest distance of both from their ways together \[m\].
    pub stray: f64,
    /// Radius around the member within which the border matters \[m\].
    pub reach: f64,
}

impl Border<'_> {
    /// Appends the half-planes that keep the member on its own side.
    pub fn add(&self, planes: &mut Vec<HalfPlane>) {
        let [own, other] = self.ways;
        let ([here, _], [there, _]) = (own.way, other.way);
        // No plane would be in reach.
        let least = length(minus(there, here)) - own.extent - other.extent;
        if self.stray == 0.0 && least - self.keep >= 2.0 * self.reach {
            return;
        }
        let are_straight = own.is_straight && other.is_straight;
        let parted = if are_straight { self.parted_segments() } else { nearest_of(own, other) };
        // Away from where the other is, if the ways have no distance.
        let [near, far] = parted.unwrap_or([here, there]);
        let way = minus(far, near);
        let distance = length(way);
        let normal = if distance > 0.0 { [way[0] / distance, way[1] / distance] } else { [1.0, 0.0] };
        let ahead = dot(normal, minus(near, here));
        let fresh = (distance - self.keep) / 2.0 + ahead;
        if self.stray > 0.0 {
            return self.add_strayed(planes, normal, distance, [ahead, fresh]);
        }
        self.push(planes, normal, fresh);
        if parted.is_none() || distance < self.keep * (1.0 - TOUCHING) {
            self.add_single(planes);
        }
    }

    /// Appends the half-plane between members each of which is somewhere on its hull, `is_first` the one of the lower number;
    /// false, and nothing, where the hulls have a point in common, or are nearer than allowed and than what their ages say. Both members
    /// find the same. Hulls that are nearer than allowed, as noise may bring them, part: a member that stood where its late pose
    /// says instead would go after the noise of its poses, from each to the next.
    pub fn add_between(&self, is_first: bool, planes: &mut Vec<HalfPlane>) -> bool {
        let [own, other] = self.ways;
        // In one order, so that rounding does not make of it two.
        let found =
            if is_first { nearest_of(own, other) } else { nearest_of(other, own).map(|[a, b]| [b, a]) };
        let Some([near, far]) = found else { return false };
        let way = minus(far, near);
        let distance = length(way);
        let seen = length(minus(other.way[0], own.way[0]));
        let by_age = (seen * seen - self.stray * self.stray).max(0.0).sqrt() - self.stray;
        // While hulls are as far apart as they have to be they part the members, or the next ones would not be.
        if distance < by_age && distance < self.keep * (1.0 - TOUCHING) {
            return false;
        }
        let normal = way.map(|x| x / distance);
        self.push(planes, normal, (distance - self.keep) / 2.0 + dot(normal, minus(near, own.way[0])));
        true
    }

    /// The nearest points of two straight ways; `None` if they cross.
    fn parted_segments(&self) -> Option<[[f64; 2]; 2]> {
        let [[a, b], [c, d]] = self.ways.map(|ways| ways.way);
        let [near, far] = nearest([a, b], [c, d]);
        (length(minus(far, near)) >= self.keep || !segments_cross(a, b, c, d)).then_some([near, far])
    }

    /// Half-planes that keep the member away from each of the places in which the other may be. The hulls are nearer
    /// than allowed where a pose contradicts what the other was taken to do: the place in which it truly is is one of
    /// these, of which the member has kept clear so far.
    fn add_single(&self, planes: &mut Vec<HalfPlane>) {
        let [own, other] = self.ways.map(|ways| ways.way);
        for &place in self.places.iter().chain(&other) {
            let near = foot(own, place);
            let way = minus(place, near);
            let distance = length(way);
            if distance > 0.0 {
                let normal = [way[0] / distance, way[1] / distance];
                let ahead = dot(normal, minus(near, own[0]));
                self.push(planes, normal, (distance - self.keep) / 2.0 + ahead);
            }
        }
    }

    /// The half-planes where the other's true way is only near that which is known.
    fn add_strayed(
        &self,
        planes: &mut Vec<HalfPlane>,
        normal: [f64; 2],
        distance: f64,
        [ahead, fresh]: [f64; 2],
    ) {
        let sine = (self.stray / distance).min(1.0);
        let cosine = (1.0 - sine * sine).sqrt();
        let offset = fresh - self.stray - (2.0 - 2.0 * cosine).sqrt() * self.reach;
        if offset >= ahead {
            return self.push(planes, normal, offset);
        }
        // Perhaps too near already: away from every place where the other may be, or on along the member's way.
        planes.push(HalfPlane { normal, offset: fresh.min(ahead) });
        let turned =
            |sine: f64| [cosine * normal[0] - sine * normal[1], sine * normal[0] + cosine * normal[1]];
        let back = (sine >= 1.0).then_some([-normal[0], -normal[1]]);
        for normal in [turned(sine), turned(-sine)].into_iter().chain(back) {
            planes.push(HalfPlane { normal, offset: self.ways[0].support(normal) });
        }
    }

    fn push(&self, planes: &mut Vec<HalfPlane>, normal: [f64; 2], offset: f64) {
        if offset < self.reach {
            planes.push(HalfPlane { normal, offset });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ways(places: &[[f64; 2]]) -> Ways {
        let mut ways = Ways::default();
        ways.take(places[0], places[1], &places[2..]);
        ways
    }

    fn some_places() -> impl Strategy<Value = Vec<[f64; 2]>> {
        prop::collection::vec(prop::array::uniform2(-1.0..1.0), 2..12)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn the_hull_holds_every_place_and_its_corners_turn_left(places in some_places()) {
            let ways = ways(&places);
            prop_assert!(ways.corners.iter().all(|corner| places.contains(corner)));
            if ways.corners.len() > 2 {
                for [a, b] in edges(&ways.corners) {
                    let least = places.iter().map(|&p| cross(minus(b, a), minus(p, a))).fold(f64::INFINITY, f64::min);
                    prop_assert!(least >= -1e-12, "{places:?} beside {a:?} to {b:?} by {least}");
                }
            }
        }

        #[test]
        fn nearest_points_are_found_of_hulls_that_are_apart_and_of_no_others(
            (first, second) in (some_places(), some_places()),
            by in prop::array::uniform2(-3.0..3.0),
        ) {
            let second: Vec<[f64; 2]> = second.iter().map(|&[x, y]| [x + by[0], y + by[1]]).collect();
            let pair = [ways(&first), ways(&second)];
            // The largest gap between the two along a direction is their distance, if there is any. It lies across a side of
            // one, or along the line from a corner of one to a corner of the other.
            let sides = [&first, &second].into_iter().flat_map(|places| {
                let pairs = places.iter().flat_map(move |&a| places.iter().map(move |&b| minus(b, a)));
                pairs.map(|[x, y]| [-y, x])
            });
            let corners = first.iter().flat_map(|&a| second.iter().map(move |&b| minus(b, a)));
            let gap = |across: [f64; 2]| {
                let along = |places: &[[f64; 2]]| {
                    places.iter().map(|&p| dot(across, p) / length(across)).collect::<Vec<_>>()
                };
                let [first, second] = [along(&first), along(&second)];
                let end = first.into_iter().fold(f64::NEG_INFINITY, f64::max);
                second.into_iter().fold(f64::INFINITY, f64::min) - end
            };
            let largest = sides.chain(corners).filter(|&across| across != [0.0; 2]).map(gap).fold(f64::NEG_INFINITY, f64::max);
            match nearest_of(&pair[0], &pair[1]) {
                Some([near, far]) => {
                    let distance = length(minus(far, near));
                    prop_assert!((distance - largest).abs() < 1e-9, "{distance}, {largest}");
                }
                None => prop_assert!(largest < 1e-9, "{largest} apart"),
            }
        }
    }

    #[test]
    fn places_on_one_line_and_in_one_place_have_hulls_too() {
        let line = ways(&[[0.0, 0.0], [2.0, 2.0], [1.0, 1.0], [3.0, 3.0]]);
        assert_eq!((line.corners.as_slice(), line.extent), (&[[0.0; 2], [3.0; 2]][..], 18.0_f64.sqrt()));
        let point = ways(&[[1.0, 2.0]; 4]);
        assert_eq!((point.corners.as_slice(), point.is_point()), (&[[1.0, 2.0]][..], true));
        assert_eq!(nearest_of(&point, &line), Some([[1.0, 2.0], [1.5, 1.5]]));
        assert_eq!(nearest_of(&line, &ways(&[[0.0, 2.0], [2.0, 0.0]])), None);
    }

    #[test]
    fn hulls_that_hardly_have_a_distance_are_apart_all_the_same() {
        let corners = [[0.1, 0.2], [0.9, 0.73], [0.3, 1.0]];
        let normal = [0.53, -0.8].map(|x: f64| x / 0.53_f64.hypot(0.8));
        for (share, gap) in
            (1..40).flat_map(|k| [1e-3, 1e-5, 1e-7, 1e-9].map(|gap| (0.025 * f64::from(k), gap)))
        {
            let beside = |far: f64| [0, 1].map(|k| corners[0][k] + share * [0.8, 0.53][k] + far * normal[k]);
            let found = nearest_of(&ways(&corners), &ways(&[beside(gap), beside(1.0)]));
            let distance = found.map(|[near, far]| length(minus(far, near)));
            assert!(
                distance.is_some_and(|distance| (distance / gap - 1.0).abs() < 1e-6),
                "{gap}: {distance:?}"
            );
            assert_eq!(nearest_of(&ways(&corners), &ways(&[beside(-gap), beside(1.0)])), None, "{gap}");
        }
    }
}
