use super::*;

fn pose(x: f64, stamp: f64) -> Pose {
    Pose { position: [x, 0.0], yaw: 0.0, stamp, frame_is_right: true }
}

fn limits() -> WatchLimits {
    WatchLimits {
        fresh: 0.25,
        age_limit: 0.5,
        stop_after: 1.0,
        range: 100.0,
        skew: 0.05,
        jump_speed: 2.0,
        jump_slack: 0.1,
        recover: 3,
        period: Some(0.1),
        ..WatchLimits::default()
    }
}

fn watch() -> Watch {
    Watch::new(2, limits())
}

#[test]
fn a_pose_ages_from_fresh_to_stopped() {
    let mut watch = watch();
    watch.look(10.0);
    assert_eq!((watch.health(0), watch.position(0)), (Health::Waiting, None));
    watch.receive(0, pose(1.0, 10.0), 10.0).expect("good");
    let stages = [
        (10.0, Health::Fresh),
        (10.25, Health::Fresh),
        (10.26, Health::Held),
        (10.5, Health::Held),
        (10.51, Health::Degraded),
        (11.0, Health::Degraded),
        (11.01, Health::Stopped),
    ];
    for (now, health) in stages {
        watch.look(now);
        assert_eq!(watch.health(0), health, "at {now}");
        assert_eq!(watch.position(0), health.is_usable().then_some([1.0, 0.0]), "at {now}");
        assert_eq!(watch.health(1), Health::Waiting, "the other member is another");
    }
    assert_eq!(watch.place(0), Some([1.0, 0.0]));
    assert!((watch.age(0, 11.01).expect("heard") - 1.01).abs() < 1e-12);
}

#[test]
fn a_pose_exactly_as_old_as_a_limit_is_within_it_whatever_rounding_makes_of_its_age() {
    let limits = WatchLimits { fresh: 0.2, age_limit: 0.3, ..limits() };
    for period in 0..100 {
        let time = |period: i32| 0.1 * f64::from(period);
        let mut watch = Watch::new(1, limits);
        assert_eq!(watch.receive(0, pose(1.0, time(period)), time(period + 3)), Ok(()), "in {period}");
        let mut watch = Watch::new(1, limits);
        assert_eq!(watch.receive(0, pose(1.0, time(period)), time(period)), Ok(()));
        for (later, health) in [(2, Health::Fresh), (3, Health::Held), (4, Health::Degraded)] {
            watch.look(time(period + later));
            assert_eq!(watch.health(0), health, "{later} after {period}");
        }
    }
}

#[test]
fn each_kind_of_bad_pose_is_turned_away_for_its_reason() {
    let good = pose(1.0, 10.0);
    let at = |position| Pose { position, ..good };
    let stamped = |stamp| Pose { stamp, ..good };
    type IsReason = fn(&Rejection) -> bool;
    let rows: [(Pose, IsReason); 9] = [
        (at([f64::NAN, 0.0]), |r| *r == Rejection::NotFinite { what: "position" }),
        (at([0.0, f64::NEG_INFINITY]), |r| *r == Rejection::NotFinite { what: "position" }),
        (Pose { yaw: f64::NAN, ..good }, |r| *r == Rejection::NotFinite { what: "heading" }),
        (stamped(f64::INFINITY), |r| *r == Rejection::NotFinite { what: "stamp" }),
        (Pose { frame_is_right: false, ..good }, |r| *r == Rejection::WrongFrame),
        (at([1e300, 1e300]), |r| matches!(r, Rejection::OutOfRange { .. })),
        (stamped(10.06), |r| matches!(r, Rejection::FromTheFuture { .. })),
        (stamped(9.49), |r| matches!(r, Rejection::TooOld { .. })),
        (stamped(0.0), |r| matches!(r, Rejection::TooOld { .. })),
    ];
    let mut watch = watch();
    for (bad, is_reason) in &rows {
        let rejection = watch.receive(0, *bad, 10.0).expect_err("bad");
        assert!(is_reason(&rejection), "{rejection}");
        assert_eq!((watch.health(0), watch.place(0)), (Health::Waiting, None), "{rejection}");
    }
    let counts = *watch.counts(0);
    let reasons =
        [counts.not_finite, counts.wrong_frame, counts.out_of_range, counts.from_the_future, counts.too_old];
    assert_eq!((reasons, counts.rejected(), counts.accepted), ([4, 1, 1, 1, 2], 9, 0));
    watch.receive(0, good, 10.0).expect("good");
}

#[test]
fn the_newest_wins_whatever_the_order() {
    let mut watch = watch();
    for (stamp, x, taken) in [(1.0, 0.0, true), (1.2, 0.2, true), (1.1, 0.1, false), (1.2, 0.2, false)] {
        assert_eq!(watch.receive(0, pose(x, stamp), 1.2).is_ok(), taken, "{stamp}");
        assert_eq!(watch.position(0), Some([if stamp == 1.0 { 0.0 } else { 0.2 }, 0.0]));
    }
    let counts = watch.counts(0);
    assert_eq!((counts.accepted, counts.not_newer), (2, 2));
}

/// A second sender that is `ahead` \[s\] of the first, and leads the member away from it at `speed` \[m/s\]: the causes of the
/// rejections, in order.
fn causes_of_two(ahead: f64, speed: f64, polls: u32) -> Vec<Option<&'static str>> {
    let mut watch = watch();
    let mut causes = Vec::new();
    for k in 0..polls {
        let now = 1.0 + 0.03 * f64::from(k);
        let first = watch.receive(0, pose(0.0, now), now);
        causes.extend(first.err().map(|rejection| rejection.cause()));
        let second = pose(speed * (now - 1.0), now + ahead);
        watch.receive(0, second, now).expect("the newest, and not far off");
    }
    causes
}

#[test]
fn two_that_publish_the_poses_of_one_robot_are_noticed_by_its_places() {
    let causes = causes_of_two(0.04, 1.0, 40);
    let begun = causes.iter().position(|cause| *cause == Some("two at once")).expect("noticed");
    // Beyond 0.12 m at 1 m/s: 0.1 m of slack, and 0.01 s at 2 m/s.
    assert!((3..8).contains(&begun) && causes[begun..].iter().all(Option::is_some), "{causes:?}");
}

#[test]
fn poses_that_come_late_again_and_again_are_worth_a_warning_and_a_few_are_not() {
    let causes = causes_of_two(0.04, 0.0, 200);
    let begun = causes.iter().position(|cause| *cause == Some("often late")).expect("noticed");
    assert!((5..60).contains(&begun), "{begun}");
    assert!(causes[begun..].iter().all(|cause| *cause == Some("often late")), "{causes:?}");
    // A network that reorders one in ten, and one that brings all twice.
    let mut watch = watch();
    for k in 0..1000 {
        let now = 1.0 + 0.05 * f64::from(k);
        let one = pose(0.0, now);
        watch.receive(0, one, now).expect("the newest");
        let again = if k % 10 == 9 { pose(0.0, now - 0.05) } else { one };
        let rejection = watch.receive(0, again, now).expect_err("late");
        assert_eq!(rejection.cause(), None, "{k}: {rejection}");
    }
}

#[test]
fn poses_of_a_member_that_is_slower_than_the_loop_are_not_lost() {
    // The loop's period is 0.1 s; each row has gaps in periods and what of them is a loss.
    let rows: [(&[u32], u64); 4] =
        [(&[1, 1, 1, 3, 1], 2), (&[4, 4, 4, 4], 0), (&[2, 2, 4, 2, 4], 2), (&[2, 1, 2, 1], 1)];
    for (gaps, lost) in rows {
        let (mut watch, mut stamp) = (watch(), 1.0);
        watch.receive(0, pose(0.0, stamp), stamp).expect("good");
        for &gap in gaps {
            stamp += 0.1 * f64::from(gap);
            watch.receive(0, pose(0.0, stamp), stamp).expect("good");
        }
        assert_eq!(watch.counts(0).lost, lost, "{gaps:?}");
    }
}

#[test]
fn a_jump_is_believed_once_enough_poses_agree_on_it() {
    let mut watch = watch();
    watch.receive(0, pose(0.0, 1.0), 1.0).expect("good");
    // 0.1 s at 2 m/s and 0.1 m of slack: 0.3 m.
    let rejection = watch.receive(0, pose(0.31, 1.1), 1.1).expect_err("a jump");
    assert!(matches!(rejection, Rejection::Jump { seen: 1, recover: 3, .. }), "{rejection}");
    watch.receive(0, pose(0.3, 1.1), 1.1).expect("fast, but possible");
    for (k, x) in [(2, 50.0), (3, 50.1), (4, 50.2)] {
        let stamp = 1.0 + 0.1 * f64::from(k);
        assert_eq!(watch.receive(0, pose(x, stamp), stamp).is_ok(), k == 4, "{x}");
    }
    assert_eq!(watch.position(0), Some([50.2, 0.0]));
}

#[test]
fn jumps_that_do_not_agree_are_never_believed() {
    let mut watch = watch();
    watch.receive(0, pose(0.0, 1.0), 1.0).expect("good");
    for k in 1..40 {
        let stamp = 1.0 + 0.1 * f64::from(k);
        let x = if k % 2 == 0 { 50.0 } else { -50.0 };
        watch.receive(0, pose(x, stamp), stamp).expect_err("a jump");
        watch.look(stamp);
    }
    assert_eq!(watch.health(0), Health::Stopped);
}

#[test]
fn a_true_pose_between_jumps_ends_their_run() {
    let mut watch = watch();
    watch.receive(0, pose(0.0, 1.0), 1.0).expect("good");
    for (k, x) in [50.0, 50.0, 0.0, 50.0, 50.0, 0.0].into_iter().enumerate() {
        let stamp = 1.1 + 0.1 * k as f64;
        assert_eq!(watch.receive(0, pose(x, stamp), stamp).is_ok(), x == 0.0, "{stamp}");
    }
}

#[test]
fn a_stopped_member_goes_on_after_enough_good_poses_in_a_row() {
    let mut watch = watch();
    watch.receive(0, pose(0.0, 1.0), 1.0).expect("good");
    watch.look(3.0);
    assert_eq!(watch.health(0), Health::Stopped);
    // One that comes too long after the last does not count as in a row.
    for (stamp, seen) in [(3.0, 1), (3.1, 2), (3.8, 1), (3.9, 2)] {
        let rejection = watch.receive(0, pose(0.0, stamp), stamp).expect_err("not yet");
        assert_eq!(rejection, Rejection::Recovering { seen, recover: 3 });
        watch.look(stamp);
        assert_eq!(watch.position(0), None);
    }
    // The same pose again is no further one.
    let again = watch.receive(0, pose(0.0, 3.9), 3.9).expect_err("again");
    assert_eq!(again, Rejection::NotNewer { behind: 0.0 });
    watch.receive(0, pose(0.0, 4.0), 4.0).expect("the third in a row");
    assert_eq!((watch.health(0), watch.position(0)), (Health::Fresh, Some([0.0, 0.0])));
}

#[test]
fn after_a_clock_is_set_back_every_member_waits_for_new_poses() {
    let mut watch = watch();
    watch.receive(0, pose(0.0, 100.0), 100.0).expect("good");
    watch.look(99.96);
    assert_eq!(watch.health(0), Health::Fresh, "within the skew");
    watch.look(0.0);
    assert_eq!((watch.health(0), watch.position(0), watch.age(0, 0.0)), (Health::Waiting, None, None));
    assert_eq!(watch.place(0), Some([0.0, 0.0]), "it is still somewhere");
    watch.receive(0, pose(50.0, 0.1), 0.1).expect("nothing to jump from");
    assert_eq!(watch.counts(0).accepted, 2);
}

#[test]
fn a_clock_creeping_back_is_noticed_too() {
    let mut watch = watch();
    watch.receive(0, pose(0.0, 100.0), 100.0).expect("good");
    for k in 1..10 {
        watch.look(100.0 - 0.01 * f64::from(k));
    }
    assert_eq!(watch.health(0), Health::Waiting);
}

#[test]
fn without_a_finite_clock_nothing_is_believed() {
    let mut watch = watch();
    watch.receive(0, pose(0.0, 1.0), 1.0).expect("good");
    watch.look(f64::NAN);
    assert_eq!((watch.health(0), watch.position(0)), (Health::Waiting, None));
    let rejection = watch.receive(0, pose(0.0, 1.1), f64::NAN).expect_err("no clock");
    assert_eq!(rejection, Rejection::NotFinite { what: "time of arrival" });
    watch.receive(0, pose(0.0, 1.1), 1.1).expect("the clock is back");
}
