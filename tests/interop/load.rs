//! Fifty robots at a hundred hertz: nothing is lost.

use std::time::Duration;

use serde_json::{Value as Json, json};

use super::support::*;

/// Fifty of them, central, at 100 Hz, each looking at its neighbours once a period.
const FIFTY: [&str; 5] = [
    "body.shape={ kind = \"grid\", columns = 10, rows = 5 }",
    "leaders[0].region.ids=[1, 5, 46, 50]",
    "control.period=0.01",
    "control.sweeps=1",
    "limits.speed=2.0",
];

const FLIGHT: Duration = Duration::from_secs(10);

/// The last of each number in the diagnostics so far.
fn numbers(watch: &Peer) -> impl Fn(&str) -> f64 + use<> {
    watch.skip();
    let status = watch.until("diagnostics", |line| line.get("diagnostics").map(|_| line.clone()));
    println!("{status}");
    move |key| state::diagnostic(&status, key).expect("a number")
}

/// Nothing lost of what goes from the robots to the node and back while the formation flies.
fn fly(pose: &[&str], messages_a_period: f64) {
    let (square, domain) = (Square::new(&[&PATIENT, &FIFTY, pose]), domain());
    let _node = square.start(domain, "node", &["--ros-args", "-p", "state_rate:=5.0"]);
    let mut watch = watch(domain);
    let mut spec = square.spec(|_, place| place);
    if !pose.is_empty() {
        spec["pose_type"] = json!("pose-array");
        spec["pose_topic"] = json!("/poses");
    }
    let mut robots = Peer::start("robots.py", domain, &spec.to_string());
    watch.until("everybody is heard", |line| state::all_fresh(state::of(line)?).then_some(()));
    robots.until("everybody is sent targets", |report| {
        received(report).values().all(|&count| count > 0).then_some(())
    });
    // From standstill to standstill, so that every target can be counted.
    change_state(&mut watch, "deactivate");
    robots.during(Duration::from_secs(1), |_| ());
    let before = report(&robots);
    let said = numbers(&watch);
    change_state(&mut watch, "activate");
    let mut ticks: Option<[u64; 2]> = None;
    watch.during(FLIGHT, |line| {
        let Some(state) = state::of(line).filter(|state| state["mode"] == json!(0)) else { return };
        let tick = state["tick"].as_u64().expect("a number");
        ticks = Some([ticks.map_or(tick, |ticks| ticks[0]), tick]);
    });
    change_state(&mut watch, "deactivate");
    robots.during(Duration::from_secs(1), |_| ());
    let says = numbers(&watch);
    robots.tell(json!({"stop": true}));
    let after = report(&robots);

    let ticks = ticks.map(|[first, last]| last - first).expect("the formation flew");
    let came: Vec<u64> =
        received(&after).into_iter().map(|(name, count)| count - received(&before)[&name]).collect();
    let sent = after["sent"].as_f64().expect("a number") - before["sent"].as_f64().expect("a number");
    println!(
        "{ticks} ticks, {:?} targets a robot, {sent} messages with poses, {} lost, {} deadlines missed",
        [came.iter().min(), came.iter().max()],
        says("poses lost") - said("poses lost"),
        says("deadlines missed") - said("deadlines missed"),
    );
    assert!(sent > 0.8 * messages_a_period * 100.0 * FLIGHT.as_secs_f64(), "the peer is too slow: {sent}");
    assert_eq!(says("poses lost") - said("poses lost"), 0.0);
    assert_eq!(says("poses rejected"), 0.0);
    assert_eq!(says("messages not sent"), 0.0);
    assert_eq!(after["not_finite"], json!(0));
    assert!(came.iter().all(|&count| count == came[0] && count >= ticks), "of {ticks} ticks: {came:?}");
}

fn report(robots: &Peer) -> Json {
    robots.skip();
    robots.until("a report", |report| Some(report.clone()))
}

fn change_state(watch: &mut Peer, label: &str) {
    watch.tell(json!({"call": "change_state", "with": label}));
    let reply = watch.until(label, |line| line.get("reply").cloned());
    assert_eq!(reply["success"], json!(true), "{label}");
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn fifty_robots_at_a_hundred_hertz_with_a_topic_each_lose_no_pose_and_no_target() {
    fly(&[], 50.0);
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn fifty_robots_at_a_hundred_hertz_in_one_array_lose_no_pose_and_no_target() {
    fly(&["node.pose_type=\"pose-array\"", "node.pose_topic=\"/poses\""], 1.0);
}

/// Both sides are `flockform`, in two processes; the peer looks on.
///
/// The robots' process is not promised every deadline of a busy computer, and what it did not send in a period, or sent
/// while the node was at work already, counts as lost where it was to be heard.
#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn fifty_simulated_robots_in_another_process_fly_at_a_hundred_hertz() {
    let (square, domain) = (Square::new(&[&PATIENT, &FIFTY]), domain());
    let _node = square.start(domain, "node", &["--ros-args", "-p", "state_rate:=5.0"]);
    let _robots = square.start(domain, "robots", &[]);
    let watch = watch(domain);
    watch.until("everybody is heard", |line| state::all_fresh(state::of(line)?).then_some(()));
    let said = numbers(&watch);
    let mut rates = Vec::new();
    watch.during(FLIGHT, |line| rates.extend(state::diagnostic(line, "rate [Hz]")));
    let says = numbers(&watch);
    let lost = says("poses lost") - said("poses lost");
    println!("{rates:?} Hz, {lost} poses lost of about 50 000");
    // That nothing is lost on the way is what the tests above count.
    assert!(
        lost < 0.1 * 50.0 * 100.0 * FLIGHT.as_secs_f64(),
        "a tenth of the robots' poses were lost: {lost}"
    );
    assert_eq!((says("messages refused"), says("messages not sent")), (0.0, 0.0));
    assert_eq!(says("poses rejected"), said("poses rejected"));
}

#[test]
#[ignore = "needs the cyclonedds package of PyPI: see the head of tests/interop/main.rs"]
fn of_a_hundred_robots_none_is_overlooked() {
    // More than two hundred endpoints on either side, opened at once.
    let gap = ["manoeuvres[0].legs=[{ seconds = 2.0, translate = [3.0, 0.0] }]", "obstacles=[]"];
    let (square, domain) = (Square::of("gap", &[&PATIENT, &gap, &["control.sweeps=1"]]), domain());
    let _node = square.start(domain, "node", &[]);
    let _robots = square.start(domain, "robots", &[]);
    let watch = watch(domain);
    let state = watch.until("everybody is heard and where it was led", |line| {
        let state = state::of(line)?;
        let moved = |one: &Json| one["displacement"]["x"].as_f64().is_some_and(|x| (x - 3.0).abs() < 1e-6);
        (state::all_fresh(state) && state::members(state).all(moved)).then(|| state.clone())
    });
    assert_eq!(state::members(&state).count(), 100);
}
