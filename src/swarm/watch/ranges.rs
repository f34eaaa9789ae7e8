//! Ranges: distances that members measure of each other, against which poses are held.
//!
//! A range that disagrees with the poses of the two shows that one of three is wrong, and not which. A pose that more
//! observers contradict than may lie is wrong whatever else is: at least one of them is honest and has measured. A lie
//! passes only for observers from which the false place is as far as the true one, and these lie on one line, the
//! perpendicular bisector of the two places. So every lie beyond the tolerance is found where more honest observers
//! than may lie stand beside any such line.
//!
//! A member whose pose was contradicted is doubted until ranges leave no place but the one it says: that nobody measures it
//! any more confirms nothing. Until then it stays where it was last known to be, by its pose or by ranges ([`Places`]).
//!
//! Ranges of the last while are kept, each with the place of its observer at the time: a pose is held against those of its
//! own time, whatever time it claims, and gains nothing by a stamp of the past.

use super::placing::{Places, Ring};
use super::{Pose, Rejection, Watch, WatchLimits};
use crate::flock::rounding::at_most;

/// A distance that one member measured of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Number of the member that measured.
    pub observer: usize,
    /// Number of the member that was measured.
    pub of: usize,
    /// \[m\]
    pub distance: f64,
    /// Time of the measurement \[s\].
    pub stamp: f64,
}

/// The conditions that poses have to meet where members measure each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeLimits {
    /// Difference between a range and the distance of two poses of its time that is no contradiction \[m\].
    pub tolerance: f64,
    /// Most members that lie, about places or ranges \[1\]: a pose that more contradict is rejected.
    pub max_faulty: usize,
}

/// What one member has measured of another lately.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Measured {
    observer: usize,
    /// By ascending stamp, each with the observer's pose as it was known then.
    kept: Vec<(Range, Option<Pose>)>,
}

/// Ranges of a pair that are kept, evenly spread over the time in which poses may be late.
const MOST_KEPT: usize = 16;

impl Measured {
    /// Adds a range that is newer than all of them; those older than `age_limit` \[s\] go.
    fn add(&mut self, range: Range, from: Option<Pose>, age_limit: f64) {
        self.kept.retain(|(known, _)| at_most(range.stamp - known.stamp, age_limit));
        // The newest is always kept, those before it as far apart as there is room for.
        if let [.., (before, _), (last, _)] = &self.kept[..]
            && last.stamp - before.stamp < age_limit / MOST_KEPT as f64
        {
            self.kept.pop();
        }
        self.kept.push((range, from));
    }

    /// The one nearest in time to a stamp \[s\].
    fn at(&self, stamp: f64) -> &(Range, Option<Pose>) {
        let after = self.kept.partition_point(|(range, _)| range.stamp < stamp);
        let near = self.kept[after.saturating_sub(1)..].iter().take(2);
        let away = |(range, _): &(Range, Option<Pose>)| (range.stamp - stamp).abs();
        near.min_by(|a, b| away(a).total_cmp(&away(b))).expect("one at least is kept")
    }
}

impl Watch {
    /// Takes in a range that arrives at `now` \[s\]; of one pair's the newest counts. False for one that is of no use:
    /// not finite, negative, of a member by itself, from the future, or too old to be compared.
    ///
    /// # Panics
    /// If there is no such member.
    pub fn receive_range(&mut self, range: Range, now: f64) -> bool {
        self.follow_clock(now);
        let Range { observer, of, distance, stamp } = range;
        assert!(observer < self.members.len(), "no member {observer}");
        let age = now - stamp;
        let is_in_time = at_most(-age, self.limits.skew) && at_most(age, self.limits.age_limit);
        if observer == of || !is_in_time || !distance.is_finite() || distance < 0.0 {
            return false;
        }
        let (from, age_limit) = (self.pose(observer), self.limits.age_limit);
        let ranges = &mut self.ranges[of];
        match ranges.binary_search_by_key(&observer, |known| known.observer) {
            Ok(place) if ranges[place].kept.last().is_none_or(|(last, _)| last.stamp < stamp) => {
                ranges[place].add(range, from, age_limit);
            }
            Ok(_) => {}
            Err(place) => ranges.insert(place, Measured { observer, kept: vec![(range, from)] }),
        }
        true
    }

    /// Refuses a pose that too many contradict, and from then on all that ranges do not confirm: where nobody measures a
    /// liar it is a liar still. A pose that was believed before anyone had measured is dropped if it is contradicted too:
    /// the member then waits as if it had never been heard, but for its place.
    pub(super) fn weigh_by_ranges(&mut self, member: usize, pose: &Pose) -> Result<(), Rejection> {
        let Some(RangeLimits { max_faulty, .. }) = self.limits.ranges else { return Ok(()) };
        let rings = self.rings(member, pose.stamp, self.limits.age_limit);
        if let Err(contradicted) = weigh(&rings, pose, max_faulty) {
            let accepted = self.members[member].accepted;
            let is_false = |last: Pose| {
                weigh(&self.rings(member, last.stamp, self.limits.age_limit), &last, max_faulty).is_err()
            };
            let was_false = accepted.is_some_and(is_false);
            let watched = &mut self.members[member];
            watched.is_doubted = true;
            if was_false {
                watched.forget();
            }
            return Err(contradicted);
        }
        if !self.members[member].is_doubted {
            return Ok(());
        }
        // What was measured before may be of where it lied from: only what is measured now confirms.
        let rings = self.rings(member, pose.stamp, self.limits.fresh);
        let mut places = Places::of(&rings, max_faulty);
        if let Some(last) = self.members[member].accepted {
            // One that is not used gets no target, and stands by then.
            let time = (pose.stamp - last.stamp).clamp(0.0, self.limits.age_limit);
            places = places.within(self.limits.way(time), last.position);
        }
        let measured = rings.len();
        if places.are_only(pose.position) { Ok(()) } else { Err(Rejection::Unconfirmed { measured }) }
    }

    /// Moves members that are doubted, and have no pose to use, to where ranges leave no other place.
    pub(super) fn place_doubted(&mut self, now: f64) {
        let Some(RangeLimits { max_faulty, .. }) = self.limits.ranges else { return };
        for member in 0..self.members.len() {
            let watched = &self.members[member];
            if watched.is_doubted
                && !watched.health.is_usable()
                && let Some(place) =
                    Places::of(&self.rings(member, now, self.limits.age_limit), max_faulty).only()
            {
                self.members[member].place = Some(place);
            }
        }
    }

    /// What was measured of a member no more than `within` \[s\] from a time \[s\], by those that have a pose.
    fn rings(&self, member: usize, stamp: f64, within: f64) -> Vec<Ring> {
        let Some(RangeLimits { tolerance, .. }) = self.limits.ranges else { return Vec::new() };
        let ring = |one: &Measured| {
            let present = self.pose(one.observer)?;
            let (range, then) = one.at(stamp);
            if !at_most((stamp - range.stamp).abs(), within) {
                return None;
            }
            // The pose known at the time, or the present one: the nearer in time.
            let away = |observer: &Pose| (observer.stamp - range.stamp).abs();
            let observer = then.filter(|then| away(then) <= away(&present)).unwrap_or(present);
            let slack = tolerance
                + self.limits.way(stamp - range.stamp)
                + self.limits.way(observer.stamp - range.stamp);
            Some(Ring { centre: observer.position, radius: range.distance, slack })
        };
        self.ranges[member].iter().filter_map(ring).collect()
    }
}

/// Refuses a pose that the rings of too many do not hold.
fn weigh(rings: &[Ring], pose: &Pose, max_faulty: usize) -> Result<(), Rejection> {
    let against = rings.iter().filter(|ring| !ring.holds(pose.position)).count();
    if against > max_faulty {
        return Err(Rejection::Contradicted { against, measured: rings.len(), max_faulty });
    }
    Ok(())
}

impl WatchLimits {
    /// The longest way of a member in a time \[m\].
    fn way(&self, time: f64) -> f64 {
        // An infinite speed times no time is not a number.
        if time == 0.0 { 0.0 } else { self.jump_speed * time.abs() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Health;
    use super::*;
    use crate::flock::vectors::distance;

    /// Four in the corners of a square of 4 m and one in its middle.
    const PLACES: [[f64; 2]; 5] = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [2.0, 2.0]];

    fn watch() -> Watch {
        let ranges = Some(RangeLimits { tolerance: 0.2, max_faulty: 1 });
        Watch::new(5, WatchLimits { ranges, jump_speed: 1.0, recover: 1, ..WatchLimits::default() })
    }

    fn pose(position: [f64; 2], stamp: f64) -> Pose {
        Pose { position, yaw: 0.0, stamp, frame_is_right: true }
    }

    /// Every member measures every other, `observed` at its place and all others at theirs; then all send their poses,
    /// `claims` of member 4.
    fn period(
        watch: &mut Watch,
        now: f64,
        claims: [f64; 2],
        measure: impl Fn(usize, usize) -> f64,
    ) -> Vec<Result<(), Rejection>> {
        for observer in 0..5 {
            for of in (0..5).filter(|&of| of != observer) {
                let range = Range { observer, of, distance: measure(observer, of), stamp: now };
                assert!(watch.receive_range(range, now));
            }
        }
        watch.look(now);
        (0..5).map(|m| watch.receive(m, pose(if m == 4 { claims } else { PLACES[m] }, now), now)).collect()
    }

    fn true_distance(observer: usize, of: usize) -> f64 {
        distance(PLACES[observer], PLACES[of])
    }

    /// Those in the corners send their poses, after some of them have measured member 4 where it truly is.
    fn corners(watch: &mut Watch, now: f64, observers: &[usize]) {
        for &observer in observers {
            let range = Range { observer, of: 4, distance: true_distance(observer, 4), stamp: now };
            assert!(watch.receive_range(range, now));
        }
        watch.look(now);
        for (m, &place) in PLACES[..4].iter().enumerate() {
            watch.receive(m, pose(place, now), now).expect("no one measures it");
        }
    }

    #[test]
    fn a_lie_is_rejected_and_honest_poses_never_are() {
        let mut watch = watch();
        for step in 0..40 {
            // It drifts away at a quarter of the allowed speed.
            let now = 0.1 * f64::from(step);
            let drift = 0.25 * now;
            let verdicts = period(&mut watch, now, [2.0 + drift, 2.0], true_distance);
            assert!(verdicts[..4].iter().all(Result::is_ok), "{now}: {verdicts:?}");
            // Seen from the corners, 45 degrees off, the drift shows by 0.7 of it.
            match drift {
                ..0.25 => assert_eq!(verdicts[4], Ok(()), "{now}"),
                0.35.. => assert!(
                    matches!(
                        verdicts[4],
                        Err(Rejection::Contradicted { against: 4, measured: 4, max_faulty: 1 })
                    ),
                    "{now}: {:?}",
                    verdicts[4]
                ),
                _ => {}
            }
        }
        assert!(!watch.health(4).is_usable());
        assert!(watch.place(4).is_some_and(|[x, _]| x < 2.35), "the last believed stays");
    }

    #[test]
    fn a_place_as_far_from_all_observers_on_a_line_is_not_found_and_one_beside_it_is_enough() {
        let mut watch = watch();
        // Mirrored at the line through members 0 and 2, on which the middle lies too.
        let mirrored = |watch: &mut Watch, now: f64, also: &[usize]| {
            let observers = [&[0, 2, 4][..], also].concat();
            for &observer in &observers {
                let range = Range { observer, of: 1, distance: true_distance(observer, 1), stamp: now };
                assert!(watch.receive_range(range, now));
            }
            for m in [0, 2, 3, 4] {
                watch.receive(m, pose(PLACES[m], now), now).expect("no one measures it");
            }
            watch.receive(1, pose([0.1, 3.9], now), now)
        };
        assert_eq!(mirrored(&mut watch, 0.0, &[]), Ok(()));
        watch.limits.ranges = Some(RangeLimits { tolerance: 0.2, max_faulty: 0 });
        assert!(matches!(
            mirrored(&mut watch, 0.1, &[3]),
            Err(Rejection::Contradicted { against: 1, measured: 4, .. })
        ));
    }

    #[test]
    fn one_liar_accuses_nobody_and_two_are_beyond_what_is_promised() {
        let mut watch = watch();
        let lying = |liars: usize| {
            move |observer: usize, of: usize| {
                true_distance(observer, of) + if observer < liars { 3.0 } else { 0.0 }
            }
        };
        for step in 0..20 {
            let verdicts = period(&mut watch, 0.1 * f64::from(step), PLACES[4], lying(1));
            assert!(verdicts.iter().all(Result::is_ok), "{verdicts:?}");
        }
        let verdicts = period(&mut watch, 2.0, PLACES[4], lying(2));
        assert!(verdicts[4].is_err());
    }

    #[test]
    fn a_place_believed_before_anyone_had_measured_gives_way_to_the_measured_one() {
        let mut watch = watch();
        corners(&mut watch, 0.0, &[]);
        watch.receive(4, pose([9.0, 9.0], 0.0), 0.0).expect("nothing was measured yet");
        assert_eq!(watch.position(4), Some([9.0, 9.0]));
        let verdicts = period(&mut watch, 0.1, [9.0, 9.0], true_distance);
        assert!(verdicts[4].is_err() && verdicts[..4].iter().all(Result::is_ok));
        assert_eq!((watch.health(4), watch.position(4)), (Health::Waiting, None));
        assert_eq!(watch.place(4), Some([9.0, 9.0]), "it is somewhere");
        watch.look(0.15);
        let place = watch.place(4).expect("known");
        assert!(distance(place, PLACES[4]) < 0.2, "{place:?}");
        assert_eq!(period(&mut watch, 0.2, PLACES[4], true_distance)[4], Ok(()), "the truth is believed");
    }

    #[test]
    fn one_found_lying_is_not_believed_where_nobody_measures_it_and_stays_where_it_was() {
        let mut watch = watch();
        let send = |watch: &mut Watch, now: f64, claims: [f64; 2], observers: &[usize]| {
            corners(watch, now, observers);
            watch.receive(4, pose(claims, now), now)
        };
        // Farther off than it can go while ranges are remembered.
        let lie = [2.0, 5.0];
        assert_eq!(send(&mut watch, 0.0, PLACES[4], &[0, 1, 2, 3]), Ok(()));
        assert!(matches!(
            send(&mut watch, 0.1, lie, &[0, 1, 2, 3]),
            Err(Rejection::Contradicted { against: 4, .. })
        ));
        // What it says now may be true by what was measured before, and is not confirmed by it.
        let ahead = send(&mut watch, 0.5, [2.2, 2.0], &[]);
        assert!(matches!(ahead, Err(Rejection::Unconfirmed { measured: 0 })), "{ahead:?}");
        let known =
            |watch: &Watch| (watch.health(4), watch.place(4).map(|at| at.map(|x| (1e9 * x).round() / 1e9)));
        let mut now = 0.5;
        let mut for_a_while = |watch: &mut Watch, claims, observers: &[usize]| {
            for k in 0..50 {
                now += 0.1;
                let verdict = send(watch, now, claims, observers);
                // At first the ranges of before are remembered.
                let is_remembered = k < 10 && matches!(verdict, Err(Rejection::Contradicted { .. }));
                let is_unconfirmed = matches!(verdict, Err(Rejection::Unconfirmed { .. }));
                assert!(is_unconfirmed || is_remembered, "{now}: {verdict:?}");
            }
            assert_eq!(known(watch), (Health::Stopped, Some(PLACES[4])));
        };
        for_a_while(&mut watch, lie, &[]);
        // One range confirms no place, a true one no more than a false one.
        for_a_while(&mut watch, PLACES[4], &[0]);
        watch.look(-1.0);
        assert_eq!(known(&watch), (Health::Waiting, Some(PLACES[4])), "the clock is set back");
        assert!(matches!(send(&mut watch, -1.0, lie, &[]), Err(Rejection::Unconfirmed { measured: 0 })));
        assert_eq!(send(&mut watch, -0.9, PLACES[4], &[0, 1, 2, 3]), Ok(()), "there is no other place");
        assert_eq!(send(&mut watch, -0.8, PLACES[4], &[]), Ok(()), "and it is one like others again");
    }

    #[test]
    fn a_false_place_of_the_past_gains_nothing_by_its_stamp() {
        let mut watch = watch();
        let mut verdicts = Vec::new();
        for step in 0..40 {
            let now = 0.05 * f64::from(step);
            corners(&mut watch, now, &[0, 1, 2, 3]);
            // At the speed of 1 m/s that poses are allowed it may have come 0.9 m in the 0.9 s since.
            verdicts.push(watch.receive(4, pose([2.7, 2.0], now - 0.9), now));
        }
        let late = verdicts[20..].iter();
        assert!(
            late.clone().all(|verdict| matches!(verdict, Err(Rejection::Contradicted { .. }))),
            "{verdicts:?}"
        );
        assert!(watch.ranges[4].iter().all(|one| one.kept.len() <= MOST_KEPT + 2), "few are kept");
    }

    #[test]
    fn ranges_that_say_nothing_are_left_out() {
        let mut watch = watch();
        let range = Range { observer: 0, of: 1, distance: 4.0, stamp: 10.0 };
        assert!(watch.receive_range(range, 10.0));
        for wrong in [
            Range { distance: f64::NAN, ..range },
            Range { distance: -1.0, ..range },
            Range { of: 0, ..range },
            Range { stamp: f64::NAN, ..range },
            Range { stamp: 11.0, ..range },
            Range { stamp: 5.0, ..range },
        ] {
            assert!(!watch.receive_range(wrong, 10.0), "{wrong:?}");
        }
        assert!(
            watch.receive_range(Range { distance: 99.0, stamp: 9.9, ..range }, 10.0),
            "late, and no harm"
        );
        assert_eq!(watch.ranges[1].len(), 1);
        assert_eq!(watch.ranges[1][0].kept, [(range, None)], "the newest counts");
        // A clock that is set back makes them worthless.
        watch.look(1.0);
        assert!(watch.ranges[1].is_empty());
    }
}
