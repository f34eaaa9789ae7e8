//! What goes wrong between robots and node, over the wire. Each row says what the node makes of it.

use flockform::messages::flockform_msgs::MemberState;
use serde_json::{Value as Json, json};

use super::support::*;

/// Short enough to wait for, long enough for a busy computer.
const QUICK: [&str; 3] = ["poses.fresh=0.8", "poses.age_limit=1.6", "poses.stop_after=2.5"];

const STATE_EVERY_TICK: [&str; 3] = ["--ros-args", "-p", "state_rate:=20.0"];

fn is_lost(member: &Json) -> bool {
    [MemberState::DEGRADED, MemberState::STOPPED].contains(&state::health(member))
}

fn is_sent_nowhere(member: &Json) -> bool {
    member["target"]["x"].is_null()
}

fn needs_somebody_lost(member: &Json) -> bool {
    state::has(member, MemberState::NEIGHBOUR_LOST)
}

/// Names of followers that look at one of these, and are none of these.
fn dependents(square: &Square, lost: &[&str]) -> Vec<String> {
    let control = square.control();
    let formation = control.formation();
    let is_lost = |m: usize| lost.contains(&formation.names[m].as_str());
    let depends =
        |&m: &usize| !is_lost(m) && !formation.leads(m) && formation.depends_on(m).into_iter().any(is_lost);
    (0..formation.count()).filter(depends).map(|m| formation.names[m].clone()).collect()
}

/// Waits for diagnostics of a level that say something.
fn until_diagnosed(watch: &Peer, level: u64, says: &str) {
    watch.until(&format!("diagnostics of level {level}: {says}"), |line| {
        let status = line.get("diagnostics")?;
        (status["level"] == json!(level) && status["message"].as_str()?.contains(says)).then_some(())
    });
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn silent_robots_are_held_then_lost_and_only_who_depends_on_them_is_told() {
    let (square, domain) = (Square::new(&[&QUICK, &SHORT]), domain());
    let _node = square.start(domain, "node", &STATE_EVERY_TICK);
    let (watch, mut robots) = (watch(domain), square.robots(domain));
    watch.until("everybody is heard", |line| state::all_fresh(state::of(line)?).then_some(()));
    let lost = ["robot_7", "robot_19"];
    robots.send(json!({"robot_7": "silent", "robot_19": "silent"}));
    let mut seen = Vec::new();
    let state = watch.until("both are stopped", |line| {
        let state = state::of(line)?;
        let health = state::health(&state["members"][6]);
        if seen.last() != Some(&health) {
            seen.push(health);
        }
        let stopped = state::who(state, |one| state::health(one) == MemberState::STOPPED);
        (stopped == lost).then(|| state.clone())
    });
    let course = [MemberState::FRESH, MemberState::HELD, MemberState::DEGRADED, MemberState::STOPPED];
    assert_eq!(seen, course);
    assert_eq!(state::who(&state, is_lost), lost);
    assert_eq!(state::who(&state, is_sent_nowhere), lost);
    assert_eq!(state::who(&state, needs_somebody_lost), dependents(&square, &lost));
    until_diagnosed(&watch, 1, "2 of 25 robots lost");
    robots.skip();
    let before = robots.until("a report", |report| Some(received(report)));
    robots.until("the others are still sent targets, these are not", |report| {
        let now = received(report);
        for name in lost {
            assert_eq!(now[name], before[name], "{name} was sent a target");
        }
        now.iter()
            .all(|(name, count)| lost.contains(&name.as_str()) || *count > before[name] + 20)
            .then_some(())
    });
    robots.send(json!({"robot_7": null, "robot_19": null}));
    watch.until("everybody is heard again", |line| {
        let state = state::of(line)?;
        (state::all_fresh(state) && state::who(state, needs_somebody_lost).is_empty()).then_some(())
    });
    // Four good poses in a row are counted and not yet used; the fifth is believed.
    watch.skip();
    let rejected = watch.until("diagnostics", |line| state::diagnostic(line, "poses rejected"));
    let rejected = watch.until("diagnostics", |line| state::diagnostic(line, "poses rejected")).max(rejected);
    assert_eq!(rejected, 8.0);
    until_diagnosed(&watch, 0, "flying");
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn bad_poses_are_rejected_and_counted_and_never_make_a_target() {
    let (square, domain) = (Square::new(&[&PATIENT, &SHORT]), domain());
    let _node = square.start(domain, "node", &STATE_EVERY_TICK);
    let (watch, mut robots) = (watch(domain), square.robots(domain));
    watch.until("everybody is heard", |line| state::all_fresh(state::of(line)?).then_some(()));
    let is_rejected = |member: &Json| state::has(member, MemberState::POSE_REJECTED);
    for what in ["nan", "infinity", "frame", "past", "future", "twice", "reversed"] {
        robots.send(json!({"robot_7": what}));
        let mut rejections = 0;
        watch.until(&format!("{what}: ten poses of robot_7 are rejected"), |line| {
            let state = state::of(line)?;
            let of = state::who(state, is_rejected);
            assert!(of.is_empty() || of == ["robot_7"], "{what}: {of:?} are rejected");
            // Until it is too old, the last good pose stands in.
            assert!(state::who(state, is_lost).is_empty(), "{what}");
            assert!(state::who(state, is_sent_nowhere).is_empty(), "{what}");
            rejections += of.len();
            (rejections >= 10).then_some(())
        });
        robots.send(json!({"robot_7": null}));
        let mut clean = 0;
        watch.until(&format!("{what}: it is believed again"), |line| {
            let state = state::of(line)?;
            clean = if state::who(state, is_rejected).is_empty() { clean + 1 } else { 0 };
            (clean >= 5 && state::all_fresh(state)).then_some(())
        });
    }
    watch.skip();
    let counted = watch.until("diagnostics", |line| state::diagnostic(line, "poses rejected"));
    assert!(counted >= 70.0, "{counted}");
    robots.skip();
    assert_eq!(robots.until("a report", |report| Some(report["not_finite"].clone())), json!(0));
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn robots_may_come_late_be_killed_and_come_back() {
    let (square, domain) = (Square::new(&[&QUICK, &SHORT]), domain());
    let _node = square.start(domain, "node", &STATE_EVERY_TICK);
    let watch = watch(domain);
    let is_waiting = |member: &Json| state::health(member) == MemberState::WAITING;
    let state = watch.until("a state", |line| state::of(line).cloned());
    assert_eq!(state::who(&state, is_waiting).len(), 25);
    assert_eq!(state::who(&state, is_sent_nowhere).len(), 25, "nobody is sent anywhere from nothing");
    until_diagnosed(&watch, 2, "no robot is heard");

    let names = &square.control().formation().names.clone();
    let part = |first: usize, end: usize| {
        let mut spec = square.spec(|_, place| place);
        spec["batch"] = json!([first, end]);
        Peer::start("robots.py", domain, &spec.to_string())
    };
    let first = part(0, 13);
    watch.until("half of them are heard", |line| {
        let state = state::of(line)?;
        let fresh = state::who(state, |one| state::health(one) == MemberState::FRESH);
        (fresh == names[..13]).then_some(())
    });
    until_diagnosed(&watch, 1, "12 of 25 robots lost");
    let second = part(13, 25);
    watch.until("all are heard", |line| state::all_fresh(state::of(line)?).then_some(()));

    drop(second);
    let gone: Vec<&str> = names[13..].iter().map(String::as_str).collect();
    let state = watch.until("half of them are stopped", |line| {
        let state = state::of(line)?;
        let stopped = state::who(state, |one| state::health(one) == MemberState::STOPPED);
        (stopped == gone).then(|| state.clone())
    });
    assert_eq!(state::who(&state, needs_somebody_lost), dependents(&square, &gone));
    assert_eq!(state::who(&state, is_sent_nowhere), gone);
    until_diagnosed(&watch, 1, "12 of 25 robots lost");
    drop(first);
    until_diagnosed(&watch, 2, "no robot is heard");
    let state = watch.until("a state", |line| state::of(line).cloned());
    assert_eq!(state::who(&state, is_sent_nowhere).len(), 25);

    let control = square.control();
    let formation = control.formation();
    let map = formation.affine(formation.programs_end()).expect("a manoeuvre");
    // The new ones begin at their places of long ago, and fly to where the formation is now.
    let robots = square.robots(domain);
    robots.until("everybody is where the others were led", |report| {
        (apart(report, names, |m| map.apply(formation.places.get(m))) < 1e-9).then_some(())
    });
    watch.until("all are heard", |line| state::all_fresh(state::of(line)?).then_some(()));
    until_diagnosed(&watch, 0, "flying");
}
