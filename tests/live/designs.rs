//! A formation designed by hand, and the file that it becomes.

use flockform::live::command::Command;
use flockform::live::session::Session;
use flockform::live::swarm::Swarm as Live;
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;
use flockform::swarm::design::Edit;
use flockform::swarm::flight::Flight;
use flockform::swarm::formation::Formation;
use proptest::prelude::*;

use super::swarms::{begun, saved};

fn try_edit(live: &mut Live, edit: Edit) -> Result<(), String> {
    live.perform(0, &Command::Design { edit }).map_err(|refused| refused.0)
}

fn edit(live: &mut Live, edit: Edit) {
    let words = format!("{edit:?}");
    try_edit(live, edit).unwrap_or_else(|refused| panic!("{words}: {refused}"));
}

fn formation(live: &Live) -> &Formation {
    live.flight().control().formation()
}

fn number(live: &Live, name: &str) -> usize {
    formation(live).number(name).unwrap_or_else(|| panic!("no {name}"))
}

fn neighbours(live: &Live, name: &str) -> Vec<String> {
    let formation = formation(live);
    formation.neighbours(number(live, name)).map(|k| formation.names[k].clone()).collect()
}

fn flown(swarm: &Swarm) -> Vec<[f64; 2]> {
    let mut flight = Flight::new(swarm).unwrap_or_else(|error| panic!("{error}"));
    (0..flight.periods()).for_each(|_| flight.step());
    flight.fleet().places().iter().collect()
}

#[test]
fn robots_given_one_by_one_fly_as_the_lattice_does_that_they_come_from() {
    for (name, set) in [
        ("square", &["flight.duration=12.0"][..]),
        ("square", &["flight.duration=6.0", "rule={}", "limits.clearance=0.1"]),
        ("square", &["flight.duration=6.0", "rule={mean={kind=\"distance\"}}", "control.sweeps=3"]),
        ("faulty-robot", &["flight.duration=3.0"]),
    ] {
        let mut live = begun(name, set);
        let lattice = flown(live.swarm());
        edit(&mut live, Edit::Move { robot: 0, by: [0.0, 0.0] });
        let one_by_one = saved(&live);
        assert_eq!(one_by_one.raw.robots.len(), lattice.len());
        assert!(one_by_one.raw.lattice.is_none() && one_by_one.raw.body.is_none());
        for (m, (there, here)) in lattice.iter().zip(flown(&one_by_one)).enumerate() {
            let apart = f64::hypot(there[0] - here[0], there[1] - here[1]);
            assert!(apart < 1e-9, "{name}: robot {m} is {apart} m from where it was");
        }
    }
}

#[test]
fn what_a_designer_does_is_in_the_file_and_is_undone() {
    let mut live = begun("square", &["rule={}", "limits.clearance=0.1"]);
    (0..30).for_each(|_| live.advance().expect("flies"));
    edit(&mut live, Edit::Place { at: [8.0, 3.0], leads: false });
    assert_eq!((formation(&live).count(), live.flight().fleet().period()), (26, 0), "it begins anew");
    // The column at x = 6 is the nearest.
    assert_eq!(neighbours(&live, "robot_26"), ["robot_18", "robot_22", "robot_23", "robot_24"]);
    assert!(neighbours(&live, "robot_23").contains(&"robot_26".to_owned()), "links are mutual");

    let robot = number(&live, "robot_26");
    edit(&mut live, Edit::Rename { robot, name: "scout".into() });
    assert!(neighbours(&live, "robot_23").contains(&"scout".to_owned()));
    let [below, beside] = ["robot_18", "robot_17"].map(|name| number(&live, name));
    edit(&mut live, Edit::Link { robots: [robot, below] });
    assert!(!neighbours(&live, "scout").contains(&"robot_18".to_owned()));
    assert!(!neighbours(&live, "robot_18").contains(&"scout".to_owned()));
    edit(&mut live, Edit::Link { robots: [beside, robot] });
    assert!(neighbours(&live, "robot_17").contains(&"scout".to_owned()));
    edit(&mut live, Edit::Move { robot, by: [0.5, 1.0] });
    edit(&mut live, Edit::Lead { robot, leads: true });
    assert!(formation(&live).leads(robot));
    let first = number(&live, "robot_1");
    edit(&mut live, Edit::Remove { robot: first });
    assert!(formation(&live).number("robot_1").is_none());

    let file = saved(&live);
    let scout = file.raw.robots.iter().find(|robot| robot.name == "scout").expect("written");
    assert_eq!(scout.place, [8.5, 4.0]);
    assert_eq!(file.raw.leaders[0].robots, ["robot_5", "robot_21", "robot_25", "scout"]);
    let bundled = bundled_swarm("square").expect("bundled").load_swarm(&[]).expect("loads");
    let durations = [&file, &bundled].map(|swarm| swarm.raw.flight.duration);
    assert_eq!(durations[0], durations[1], "what has not flown flies as long as its file says");
    assert!(file.raw.robots.iter().all(|robot| !robot.neighbours.contains(&"robot_1".to_owned())));

    for _ in 0..7 {
        live.perform(0, &Command::Undo {}).expect("undone");
    }
    assert_eq!((formation(&live).count(), live.flight().fleet().period()), (25, 30));
    assert!(saved(&live).raw.lattice.is_some(), "the file of before");
    // A key that is set later is one of the design.
    edit(&mut live, Edit::Place { at: [8.0, 3.0], leads: true });
    let set = Command::Set { key: "limits.speed".into(), value: "0.5".into() };
    live.perform(0, &set).expect("set");
    let file = saved(&live);
    assert_eq!((file.raw.robots.len(), file.raw.limits.speed), (26, Some(0.5)));
}

#[test]
fn designs_that_cannot_fly_are_refused_and_change_nothing() {
    let mut live = begun("square", &[]);
    let before = live.saved(None);
    let refused = |live: &mut Live, edit: Edit| {
        let words = try_edit(live, edit).expect_err("refused");
        assert_eq!((live.saved(None), live.undoable()), (before.clone(), 0), "{words}");
        words
    };
    // Of three neighbours that move with it a corner that follows makes a formation that does not settle.
    let outside = refused(&mut live, Edit::Lead { robot: 0, leads: false });
    assert!(outside.contains("robot_1"), "{outside}");
    let near = refused(&mut live, Edit::Place { at: [0.1, 0.0], leads: true });
    assert!(near.contains("robot_1` and `robot_26") && near.contains("clearance"), "{near}");
    assert!(refused(&mut live, Edit::Rename { robot: 3, name: "robot_1".into() }).contains("robot_1"));
    assert!(refused(&mut live, Edit::Rename { robot: 3, name: "a b".into() }).contains("no ROS name"));
    assert!(refused(&mut live, Edit::Move { robot: 99, by: [1.0, 0.0] }).contains("no such robot"));
    assert!(refused(&mut live, Edit::Link { robots: [3, 3] }).contains("itself"));
    // Whatever is linked to it.
    for robot in [0, 9] {
        let words = try_edit(&mut live, Edit::Rename { robot, name: "robot_2".into() }).expect_err("taken");
        assert!(words.contains("two robots are called `robot_2`"), "{words}");
    }
    let placed = try_edit(&mut live, Edit::Place { at: [20.0, 20.0], leads: true });
    assert_eq!(placed, Ok(()));

    let mut bridge = begun("bridge", &[]);
    let words = try_edit(&mut bridge, Edit::Remove { robot: 0 }).expect_err("of a scene");
    assert!(words.contains("scene"), "{words}");
    let edge = "leaders[0].region={ kind = \"edge\", side = \"left\" }";
    let mut framed = begun("square", &["frame=\"lagged\"", "rule={}", edge]);
    let words = try_edit(&mut framed, Edit::Remove { robot: 7 }).expect_err("a frame");
    assert!(words.contains("a frame needs a lattice"), "{words}");
}

#[test]
fn a_designer_is_told_which_manoeuvres_are_exact() {
    let mut live = begun("square", &[]);
    let told = |live: &Live| live.exactness().expect("designed").join("; ");
    assert!(told(&live).contains("shift, turn, stretch, shear"), "{}", told(&live));
    assert!(told(&live).contains("`turn`: every follower in its place"), "{}", told(&live));
    live.perform(0, &Command::Set { key: "rule".into(), value: "{}".into() }).expect("equal weights");
    assert!(told(&live).contains("exactly in every shift of the leaders"), "{}", told(&live));
    assert!(told(&live).contains("`turn`: followers up to"), "{}", told(&live));
    assert_eq!(begun("bridge", &[]).exactness(), None);
    assert_eq!(begun("antipodal", &[]).exactness(), Some(Vec::new()), "all lead");
}

fn edits() -> impl Strategy<Value = Edit> {
    let robot = || 0_usize..30;
    let place = || prop::array::uniform2(prop_oneof![-3.0..9.0, Just(f64::MAX), Just(-0.0)]);
    prop_oneof![
        (place(), any::<bool>()).prop_map(|(at, leads)| Edit::Place { at, leads }),
        (robot(), place()).prop_map(|(robot, by)| Edit::Move { robot, by }),
        [robot(), robot()].prop_map(|robots| Edit::Link { robots }),
        (robot(), "[a-z_]{0,3}").prop_map(|(robot, name)| Edit::Rename { robot, name }),
        (robot(), any::<bool>()).prop_map(|(robot, leads)| Edit::Lead { robot, leads }),
        robot().prop_map(|robot| Edit::Remove { robot }),
    ]
}

#[test]
fn a_leader_that_is_made_to_lead_keeps_its_program() {
    let still = "program = { kind = \"external\" }";
    let two =
        format!("leaders=[{{ robots = [\"robot_1\"], {still} }}, {{ robots = [\"robot_25\"], {still} }}]");
    let mut live = begun("square", &[&two, "rule={}", "flight.bounds={}"]);
    let robot = number(&live, "robot_25");
    edit(&mut live, Edit::Lead { robot, leads: true });
    let leaders = saved(&live).raw.leaders;
    let led: Vec<&[String]> = leaders.iter().map(|entry| &entry.robots[..]).collect();
    assert_eq!(led, [["robot_1"], ["robot_25"]]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is done, what is there can be flown and saved, and the file is the design.
    #[test]
    fn any_edits_leave_a_swarm_that_flies(edits in prop::collection::vec(edits(), 1..12)) {
        let mut live = begun("square", &["rule={}", "flight.bounds={}", "limits={ speed = 1.0 }"]);
        for edit in edits {
            let _ = try_edit(&mut live, edit);
        }
        let file = saved(&live);
        let again = Formation::lay_out(&file).unwrap_or_else(|error| panic!("{error}"));
        prop_assert_eq!(&again.names, &formation(&live).names);
        prop_assert_eq!(&again.places, &formation(&live).places);
        live.advance().expect("flies");
    }
}
