//! The fault table of poses: what comes in, and how well its sender is heard, period by period.

use flockform::swarm::channel::{Channel, ChannelParams};
use flockform::swarm::watch::Health::{Degraded, Fresh, Held, Stopped, Waiting};
use flockform::swarm::watch::{Counts, Health, Pose, Watch, WatchLimits};

const PERIOD: f64 = 0.1;
const PERIODS: u32 = 60;
const SPEED: f64 = 0.5;

fn time(period: u32) -> f64 {
    PERIOD * f64::from(period)
}

/// The truth: along x at constant speed.
fn pose(period: u32) -> Pose {
    Pose { position: [SPEED * time(period), 2.0], yaw: 0.1, stamp: time(period), frame_is_right: true }
}

fn moved(pose: Pose, by: f64) -> Pose {
    Pose { position: [pose.position[0] + by, pose.position[1]], ..pose }
}

fn stamped(pose: Pose, later: f64) -> Pose {
    Pose { stamp: pose.stamp + later, ..pose }
}

/// Fresh for 2 periods, held for 5, stopped after 10.
fn limits() -> WatchLimits {
    WatchLimits {
        fresh: 0.25,
        age_limit: 0.55,
        stop_after: 1.05,
        range: 1000.0,
        skew: 0.05,
        jump_speed: 2.0,
        jump_slack: 0.1,
        recover: 3,
        period: Some(PERIOD),
        ..WatchLimits::default()
    }
}

struct Row {
    fault: &'static str,
    /// What arrives in each period.
    arrives: fn(u32) -> Vec<Pose>,
    /// From which period on the member is heard how well.
    heard: &'static [(u32, Health)],
    /// How often for which reason.
    counted: fn(&Counts) -> bool,
}

const BROKEN: std::ops::Range<u32> = 20..40;

/// The truth but for the periods in which the fault lasts.
fn but(period: u32, fault: impl Fn(Pose) -> Option<Pose>) -> Vec<Pose> {
    let truth = pose(period);
    let sent = if BROKEN.contains(&period) { fault(truth) } else { Some(truth) };
    sent.into_iter().collect()
}

/// What every fault that leaves nothing to use looks like: the last good pose is of period 19, held from 3
/// periods after it, degraded from 6 and stopped from 11; good ones come from 40 on, the third is believed.
const SILENCE: &[(u32, Health)] = &[(0, Fresh), (22, Held), (25, Degraded), (30, Stopped), (42, Fresh)];

const TABLE: &[Row] = &[
    Row {
        fault: "silent from the beginning",
        arrives: |_| vec![],
        heard: &[(0, Waiting)],
        counted: |c| *c == Counts::default(),
    },
    Row {
        fault: "silent for a while",
        arrives: |k| but(k, |_| None),
        heard: SILENCE,
        counted: |c| c.recovering == 2 && c.rejected() == 2 && c.lost == 22,
    },
    Row {
        fault: "killed and restarted elsewhere",
        arrives: |k| but(k, |_| None).into_iter().map(|p| if k < 40 { p } else { moved(p, 30.0) }).collect(),
        heard: SILENCE,
        counted: |c| c.recovering == 2 && c.rejected() == 2,
    },
    Row {
        fault: "restarted elsewhere within the age limit",
        arrives: |k| match k {
            20..22 => vec![],
            k if k < 20 => vec![pose(k)],
            k => vec![moved(pose(k), 30.0)],
        },
        heard: &[(0, Fresh), (22, Held), (24, Fresh)],
        counted: |c| c.jumps == 2 && c.rejected() == 2,
    },
    Row {
        fault: "one pose elsewhere",
        arrives: |k| vec![if k == 20 { moved(pose(k), 30.0) } else { pose(k) }],
        heard: &[(0, Fresh)],
        counted: |c| c.jumps == 1 && c.rejected() == 1,
    },
    Row {
        fault: "not a number",
        arrives: |k| but(k, |p| Some(Pose { position: [f64::NAN, 2.0], ..p })),
        heard: SILENCE,
        counted: |c| c.not_finite == 20,
    },
    Row {
        fault: "infinite",
        arrives: |k| but(k, |p| Some(Pose { position: [1.0, f64::NEG_INFINITY], ..p })),
        heard: SILENCE,
        counted: |c| c.not_finite == 20,
    },
    Row {
        fault: "no heading",
        arrives: |k| but(k, |p| Some(Pose { yaw: f64::NAN, ..p })),
        heard: SILENCE,
        counted: |c| c.not_finite == 20,
    },
    Row {
        fault: "far out of range",
        arrives: |k| but(k, |p| Some(moved(p, 1e12))),
        heard: SILENCE,
        counted: |c| c.out_of_range == 20,
    },
    Row {
        fault: "stamped in the past",
        arrives: |k| but(k, |p| Some(stamped(p, -10.0))),
        heard: SILENCE,
        counted: |c| c.too_old == 20,
    },
    Row {
        fault: "stamped in the future",
        arrives: |k| but(k, |p| Some(stamped(p, 10.0))),
        heard: SILENCE,
        counted: |c| c.from_the_future == 20,
    },
    Row {
        fault: "in another frame",
        arrives: |k| but(k, |p| Some(Pose { frame_is_right: false, ..p })),
        heard: SILENCE,
        counted: |c| c.wrong_frame == 20,
    },
    Row {
        fault: "every pose twice",
        arrives: |k| vec![pose(k), pose(k)],
        heard: &[(0, Fresh)],
        counted: |c| c.not_newer == 60 && c.accepted == 60 && c.lost == 0,
    },
    Row {
        fault: "every two poses the wrong way round",
        arrives: |k| if k % 2 == 1 { vec![pose(k), pose(k - 1)] } else { vec![] },
        heard: &[(0, Waiting), (1, Fresh)],
        counted: |c| c.not_newer == 30 && c.accepted == 30,
    },
    Row {
        fault: "restarted with a clock 0.3 s behind",
        // Nothing newer for three periods, then poses 0.3 s old: held, and used.
        arrives: |k| vec![if k < 20 { pose(k) } else { stamped(pose(k), -0.3) }],
        heard: &[(0, Fresh), (22, Held)],
        counted: |c| c.not_newer == 3 && c.rejected() == 3,
    },
    Row {
        fault: "restarted with a clock 3 s behind, set right later",
        arrives: |k| but(k, |p| Some(stamped(p, -3.0))),
        heard: SILENCE,
        counted: |c| c.too_old == 20,
    },
];

/// Feeds what arrives; health after each period. Whatever is used is finite.
fn heard(watch: &mut Watch, arrives: impl Fn(u32) -> Vec<Pose>, periods: u32) -> Vec<Health> {
    (0..periods)
        .map(|period| {
            for pose in arrives(period) {
                // What is rejected is counted; the table looks at the counts.
                let _ = watch.receive(0, pose, time(period));
            }
            watch.look(time(period));
            let used = watch.position(0);
            assert_eq!(used.is_some(), watch.health(0).is_usable());
            assert!(used.is_none_or(|place| place.iter().all(|p| p.is_finite())));
            watch.health(0)
        })
        .collect()
}

#[test]
fn every_fault_is_noticed_and_overcome_within_its_periods() {
    for row in TABLE {
        let mut watch = Watch::new(1, limits());
        let healths = heard(&mut watch, row.arrives, PERIODS);
        for (period, health) in healths.into_iter().enumerate() {
            let since = row.heard.iter().rev().find(|(from, _)| *from as usize <= period);
            assert_eq!(Some(health), since.map(|(_, health)| *health), "{}, period {period}", row.fault);
        }
        assert!((row.counted)(watch.counts(0)), "{}: {:?}", row.fault, watch.counts(0));
    }
}

#[test]
fn what_is_used_is_never_farther_off_than_it_can_have_moved() {
    let mut used = 0;
    for row in TABLE.iter().filter(|row| !row.fault.contains("restarted elsewhere")) {
        let mut watch = Watch::new(1, limits());
        for period in 0..PERIODS {
            for pose in (row.arrives)(period) {
                let _ = watch.receive(0, pose, time(period));
            }
            watch.look(time(period));
            // A stamp that lies by 0.3 s is believed: it is no further off than the skew of its clock.
            let most = SPEED * limits().age_limit + 1e-9;
            if let Some([x, y]) = watch.position(0) {
                let off = (x - SPEED * time(period)).hypot(y - 2.0);
                assert!(off <= most, "{}: {off} off in period {period}", row.fault);
                used += 1;
            }
        }
    }
    assert!(used > 0, "no position is ever used");
}

/// Share of the periods in which there is a position to use, and whether the member ever stopped.
fn usable(loss: f64, age_limit: f64, stop_after: f64) -> (f64, bool, Counts) {
    let mut watch = Watch::new(1, WatchLimits { age_limit, stop_after, ..limits() });
    let mut channel = Channel::new(ChannelParams { loss, ..Default::default() }, 3, 0);
    let arrivals: Vec<Vec<Pose>> = (0..2000)
        .map(|period| {
            channel.send(u64::from(period), pose(period));
            channel.deliver(u64::from(period)).collect()
        })
        .collect();
    let healths = heard(&mut watch, |period| arrivals[period as usize].clone(), 2000);
    let share = healths.iter().filter(|health| health.is_usable()).count() as f64 / 2000.0;
    (share, healths.contains(&Stopped), *watch.counts(0))
}

#[test]
fn thirty_percent_of_loss_leaves_a_member_usable_within_the_same_limits() {
    let (share, stopped, counts) = usable(0.3, 0.55, 1.05);
    assert!(share > 0.995 && !stopped, "{share}");
    assert_eq!((counts.rejected(), counts.accepted + counts.lost >= 1990), (0, true), "{counts:?}");
}

#[test]
fn eighty_percent_of_loss_needs_an_age_limit_that_bridges_it() {
    // Six in a row are lost every fourth time, twenty every hundredth.
    let (tight, ..) = usable(0.8, 0.55, 5.05);
    let (loose, stopped, _) = usable(0.8, 2.05, 5.05);
    assert!((0.6..0.85).contains(&tight), "{tight}");
    assert!(loose > 0.98 && !stopped, "{loose}");
}

#[test]
fn twenty_steps_of_delay_are_held_where_the_age_limit_allows_them_and_refused_where_not() {
    let late = |period: u32| if period < 20 { vec![] } else { vec![pose(period - 20)] };
    let mut watch = Watch::new(1, WatchLimits { age_limit: 2.5, stop_after: 5.0, ..limits() });
    let healths = heard(&mut watch, late, PERIODS);
    assert!(healths[..20].iter().all(|h| *h == Waiting) && healths[20..].iter().all(|h| *h == Held));
    assert_eq!(watch.position(0), Some(pose(PERIODS - 21).position));
    let mut watch = Watch::new(1, limits());
    assert!(heard(&mut watch, late, PERIODS).iter().all(|health| *health == Waiting));
    assert_eq!(watch.counts(0).too_old, 40);
}

#[test]
fn a_clock_set_back_costs_one_period_without_a_pose() {
    let mut watch = Watch::new(1, limits());
    for period in 1000..1010 {
        watch.receive(0, pose(period), time(period)).expect("good");
    }
    let healths = heard(&mut watch, |period| if period == 0 { vec![] } else { vec![pose(period)] }, 5);
    assert_eq!(healths, [Waiting, Fresh, Fresh, Fresh, Fresh]);
}
