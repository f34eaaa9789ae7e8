//! The promises, against the two ends of any transport.

use std::time::{Duration, Instant};

use flockform::swarm::transport::complaints::Complaints;
use flockform::swarm::transport::{ControllerEnd, Received, RobotsEnd, serve};
use flockform::swarm::watch::{Health, Range};

use super::support::*;

/// The promises as tests of a transport: of three robots, of three that measure each other, and of a thousand with those
/// that get targets.
macro_rules! kept {
    (@$small:expr => $($promise:ident)+) => {$(
        #[test]
        fn $promise() {
            crate::promises::$promise(&mut $small);
        }
    )+};
    ($small:expr, $measuring:expr, $thousand:expr) => {
        crate::promises::kept!(@$small =>
            poses_come_in_order_and_the_newest_comes
            targets_reach_their_robots_to_the_bit
            who_comes_late_hears_what_is_said_from_then_on
            a_peer_that_goes_away_harms_nobody_else
            who_comes_back_is_heard_again
            who_does_not_listen_holds_nobody_up
            a_pose_that_is_not_finite_moves_nobody
        );
        crate::promises::kept!(@$measuring => ranges_come_as_they_were_measured);

        #[test]
        fn a_thousand_robots_are_carried() {
            let (mut transport, served): (_, Vec<usize>) = $thousand;
            crate::promises::a_thousand_robots_are_carried(&mut transport, &served);
        }
    };
}
pub(crate) use kept;

/// A moment for what travels through a network.
fn a_moment() {
    std::thread::sleep(Duration::from_millis(2));
}

pub fn poses_come_in_order_and_the_newest_comes(transport: &mut impl Transport) {
    let (mut controller, mut robots) = (transport.controller(), transport.robots());
    meet(&mut controller, &mut robots, 0);
    let mut stamps = Vec::new();
    for k in 1..=200 {
        let stamp = 10.0 + f64::from(k);
        robots.send(stamp, &[(0, pose(stamp, stamp)), (1, pose(-stamp, stamp))]).expect("said");
        // At times several wait together.
        if k % 3 == 0 {
            a_moment();
            stamps.extend(heard(&mut controller));
        }
    }
    until("the newest poses", || {
        stamps.extend(heard(&mut controller));
        let newest = |m: usize| stamps.iter().rev().find(|(member, _)| *member == m).map(|(_, p)| p.stamp);
        [0, 1].iter().all(|&m| newest(m) == Some(210.0)).then_some(())
    });
    for m in [0, 1] {
        let of: Vec<f64> = stamps.iter().filter(|(member, _)| *member == m).map(|(_, p)| p.stamp).collect();
        assert!(of.windows(2).all(|pair| pair[0] < pair[1]), "member {m}: {of:?}");
    }
    let right = |(m, pose): &(usize, _)| {
        let pose: &flockform::swarm::watch::Pose = pose;
        pose.position == [if *m == 0 { pose.stamp } else { -pose.stamp }, 2.0] && pose.yaw == 0.5
    };
    assert!(stamps.iter().all(right), "what is said is what is heard");
}

/// Of a swarm of three that measure each other.
pub fn ranges_come_as_they_were_measured(transport: &mut impl Transport) {
    let (mut controller, mut robots) = (transport.controller(), transport.robots());
    meet(&mut controller, &mut robots, 0);
    let range = |observer, of, distance| Range { observer, of, distance, stamp: 2.5 };
    let sent = [range(0, 1, 0.1 + 0.2), range(0, 2, 1.0 / 3.0), range(2, 0, f64::NAN), range(2, 1, 1e-300)];
    let bits = |range: &Range| (range.observer, range.of, range.distance.to_bits(), range.stamp.to_bits());
    let mut found = Vec::new();
    until("the ranges", || {
        robots.send_ranges(2.5, &sent).expect("sent");
        a_moment();
        controller.receive(2.5, &mut |received| {
            if let Received::Range(range) = received {
                found.push(bits(&range));
            }
        });
        sent.iter().all(|range| found.contains(&bits(range))).then_some(())
    });
    let all = sent.map(|range| bits(&range));
    assert!(found.iter().all(|one| all.contains(one)), "{found:?}");
    assert_eq!(controller.refused(), 0);
}

pub fn targets_reach_their_robots_to_the_bit(transport: &mut impl Transport) {
    let (mut controller, mut robots) = (transport.controller(), transport.robots());
    meet(&mut controller, &mut robots, 0);
    let position = [0.1 + 0.2, -1.0 / 3.0];
    until("the target", || {
        let mut found = None;
        let aim = flockform::swarm::transport::Target { member: 1, position, yaw: 0.0 };
        controller.send(2.0, &[aim]).expect("sent");
        robots.targets(&mut |member, place| {
            if member == 1 {
                assert_eq!(place.map(f64::to_bits), position.map(f64::to_bits));
                found = Some(());
            }
        });
        found
    });
}

pub fn who_comes_late_hears_what_is_said_from_then_on(transport: &mut impl Transport) {
    let mut robots = transport.robots();
    for k in 0..100 {
        robots
            .send(1.0, &[(0, pose(f64::from(k), 1.0 + f64::from(k)))])
            .expect("nobody listens, and nobody waits");
    }
    let mut late = transport.controller();
    let begun = Instant::now();
    let (_, first) = until("a late loop hears", || {
        let stamp = 200.0 + begun.elapsed().as_secs_f64();
        robots.send(stamp, &[(0, pose(7.0, stamp))]).expect("said");
        heard(&mut late).into_iter().find(|(_, pose)| pose.stamp >= 200.0)
    });
    assert_eq!(first.position, [7.0, 2.0]);
    let mut later = transport.robots();
    until("late robots are heard", || {
        later.send(300.0, &[(1, pose(8.0, 300.0))]).expect("said");
        heard(&mut late).iter().any(|(m, pose)| *m == 1 && pose.stamp == 300.0).then_some(())
    });
}

pub fn a_peer_that_goes_away_harms_nobody_else(transport: &mut impl Transport) {
    let (mut controller, mut stays) = (transport.controller(), transport.robots());
    let mut goes = transport.robots();
    meet(&mut controller, &mut stays, 0);
    meet(&mut controller, &mut goes, 1);
    drop(goes);
    let mut stamp = 10.0;
    until("who stayed is heard", || {
        stamp += 1.0;
        stays.send(stamp, &[(0, pose(1.0, stamp))]).expect("said");
        heard(&mut controller).iter().any(|(m, pose)| *m == 0 && pose.stamp > 12.0).then_some(())
    });
    drop(controller);
    for _ in 0..100 {
        stays.send(99.0, &[(0, pose(1.0, 99.0))]).expect("robots go on without a loop");
    }
}

pub fn who_comes_back_is_heard_again(transport: &mut impl Transport) {
    let (mut controller, mut robots) = (transport.controller(), transport.robots());
    meet(&mut controller, &mut robots, 0);
    drop(robots);
    let mut robots = transport.robots();
    meet(&mut controller, &mut robots, 0);
    drop(controller);
    let mut controller = transport.controller();
    meet(&mut controller, &mut robots, 0);
}

/// Of the members in `served`, which get targets too.
pub fn a_thousand_robots_are_carried(transport: &mut impl Transport, served: &[usize]) {
    let count = transport.count();
    let (mut controller, mut robots) = (transport.controller(), transport.robots());
    meet(&mut controller, &mut robots, served[0]);
    let mut stamp = 10.0;
    until("everybody is heard at once", || {
        stamp += 1.0;
        let all: Vec<_> = (0..count).map(|m| (m, pose(m as f64, stamp))).collect();
        robots.send(stamp, &all).expect("said");
        std::thread::sleep(Duration::from_millis(20));
        let heard = heard(&mut controller);
        let mut whole = vec![false; count];
        for (m, pose) in heard.iter().filter(|(_, pose)| pose.stamp == stamp) {
            assert_eq!(pose.position[0], *m as f64);
            whole[*m] = true;
        }
        whole.iter().all(|&whole| whole).then_some(())
    });
    let mut reached = vec![false; count];
    until("everybody gets a target", || {
        let targets: Vec<_> = served.iter().map(|&m| target(m, m as f64)).collect();
        controller.send(stamp, &targets).expect("sent");
        a_moment();
        robots.targets(&mut |m, place| reached[m] = place == [m as f64, 3.0]);
        served.iter().all(|&m| reached[m]).then_some(())
    });
}

pub fn who_does_not_listen_holds_nobody_up(transport: &mut impl Transport) {
    let (mut controller, mut robots) = (transport.controller(), transport.robots());
    meet(&mut controller, &mut robots, 0);
    let said = 5000;
    for k in 1..=said {
        let stamp = 10.0 + f64::from(k);
        robots.send(stamp, &[(0, pose(1.0, stamp))]).expect("a queue that is full refuses nothing");
    }
    let mut waited = heard(&mut controller);
    if transport.newest_waits() {
        let newest = waited.last().expect("something waited").1.stamp;
        assert_eq!(newest, 10.0 + f64::from(said), "the newest is what waited");
    }
    until("the newest of the flood", || {
        waited.extend(heard(&mut controller));
        // A network may lose the very last.
        robots.send(1e5, &[(0, pose(1.0, 1e5))]).expect("said");
        waited.iter().any(|(_, pose)| pose.stamp >= 10.0 + f64::from(said)).then_some(())
    });
    let of_the_flood = waited.iter().filter(|(_, pose)| pose.stamp < 1e5).count();
    assert!(of_the_flood < said as usize / 4, "{of_the_flood} of {said} waited: the old ones give way");
}

pub fn a_pose_that_is_not_finite_moves_nobody(transport: &mut impl Transport) {
    let (mut control, part) = control_of(&row(3, &[]));
    let (mut controller, mut robots) = (transport.controller(), transport.robots());
    meet(&mut controller, &mut robots, 1);
    let mut complaints = Complaints::default();
    let now = flockform::swarm::pace::system_time();
    let mut k = 0.0;
    until("everybody is heard", || {
        k += 1e-3;
        let all: Vec<_> = (0..3)
            .map(|m| (m, flockform::swarm::watch::Pose { position: [m as f64, 0.0], ..pose(0.0, now + k) }))
            .collect();
        robots.send(now, &all).expect("said");
        a_moment();
        serve(&mut control, &part, &mut controller, &mut complaints, now + k).expect("sent");
        (0..3).all(|m| control.health(m) == Health::Fresh).then_some(())
    });
    let before = control.watch().counts(1).rejected();
    until("bad poses are turned away", || {
        k += 1e-3;
        let bad = flockform::swarm::watch::Pose { position: [f64::NAN, f64::INFINITY], ..pose(0.0, now + k) };
        robots.send(now, &[(1, bad)]).expect("said");
        a_moment();
        serve(&mut control, &part, &mut controller, &mut complaints, now + k).expect("sent");
        (control.watch().counts(1).rejected() > before + 2).then_some(())
    });
    assert_eq!(control.position(1), Some([1.0, 0.0]), "the last good one stands");
    assert!((0..3).all(|m| control.target(m).is_some_and(|[x, y]| x.is_finite() && y.is_finite())));
    let mut told = 0;
    robots.targets(&mut |_, place| {
        assert!(place.iter().all(|value| value.is_finite()));
        told += 1;
    });
    assert!(told > 0);
}
