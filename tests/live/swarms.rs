//! A swarm led by hand and hurt, and the file that flies it again.

use flockform::live::command::Command;
use flockform::live::session::Session;
use flockform::live::swarm::Swarm as Live;
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;
use flockform::swarm::flight::Flight;

pub fn begun(name: &str, set: &[&str]) -> Live {
    let set: Vec<String> = set.iter().map(|&one| one.to_owned()).collect();
    let swarm = bundled_swarm(name).expect("bundled").load_swarm(&set);
    Live::new(swarm.unwrap_or_else(|error| panic!("{error}")), None).unwrap_or_else(|error| panic!("{error}"))
}

pub fn saved(live: &Live) -> Swarm {
    let text = live.saved(None).expect("can be written");
    Swarm::parse("saved", "saved.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn ask(swarm: &mut Live, text: &str) {
    let command = Command::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
    swarm.perform(0, &command).unwrap_or_else(|refused| panic!("{text}: {}", refused.0));
}

fn fly(swarm: &mut Live, periods: usize) {
    (0..periods).for_each(|_| swarm.advance().expect("flies"));
}

fn leader(swarm: &Live) -> usize {
    let formation = swarm.flight().control().formation();
    (0..formation.count()).find(|&m| formation.leads(m)).expect("led")
}

fn bits(flight: &Flight) -> Vec<[u64; 2]> {
    flight.fleet().places().iter().map(|[x, y]| [x.to_bits(), y.to_bits()]).collect()
}

fn assert_replays(swarm: &Live) {
    let mut again = Flight::new(&saved(swarm)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(again.periods(), swarm.flight().fleet().period());
    (0..again.periods()).for_each(|_| again.step());
    assert!(bits(swarm.flight()) == bits(&again), "the same places to the last bit");
}

#[test]
fn leaders_led_by_hand_broken_robots_and_lost_poses_are_flown_again_to_the_bit() {
    let mut swarm = begun("square", &[]);
    fly(&mut swarm, 20);
    let leader = leader(&swarm);
    ask(&mut swarm, &format!(r#"{{"do":"grab","particle":{leader}}}"#));
    for k in 1..=10 {
        ask(
            &mut swarm,
            &format!(r#"{{"do":"drag","by":[{},{}]}}"#, 0.07 * f64::from(k), -0.1 * f64::from(k)),
        );
        fly(&mut swarm, 1);
    }
    ask(&mut swarm, r#"{"do":"release"}"#);
    ask(&mut swarm, r#"{"do":"fault","robot":12,"what":"dead"}"#);
    fly(&mut swarm, 7);
    ask(&mut swarm, r#"{"do":"set","key":"flight.noise","value":"0.01"}"#);
    ask(&mut swarm, r#"{"do":"set","key":"flight.loss","value":"0.2"}"#);
    fly(&mut swarm, 11);
    assert_eq!(swarm.faults(), [(12, "dead")]);
    assert_eq!(swarm.sets(), ["flight.noise=0.01", "flight.loss=0.2"]);
    ask(&mut swarm, r#"{"do":"fault","robot":12,"what":null}"#);
    fly(&mut swarm, 13);
    assert_eq!(swarm.faults(), []);
    assert_replays(&swarm);
    // One that begins anew keeps them.
    ask(&mut swarm, r#"{"do":"set","key":"limits.speed","value":"0.8"}"#);
    assert_eq!(swarm.sets(), ["flight.noise=0.01", "flight.loss=0.2", "limits.speed=0.8"]);
    fly(&mut swarm, 5);
    assert_replays(&swarm);
}

#[test]
fn at_one_period_the_commands_of_the_file_come_after_those_of_the_hand() {
    let square = begun("square", &[]);
    let leader = leader(&square);
    let formation = square.flight().control().formation();
    let (name, [x, y]) = (&formation.names[leader], formation.places.get(leader));
    let own = format!(
        "flight.commands=[{{ after = 5, what = {{ kind = \"lead\", robot = \"{name}\", to = [{x}, {y}] }} }}]"
    );
    let mut swarm = begun("square", &[&own]);
    fly(&mut swarm, 5);
    ask(&mut swarm, &format!(r#"{{"do":"grab","particle":{leader},"alone":true}}"#));
    ask(&mut swarm, r#"{"do":"drag","by":[0.5,-0.5]}"#);
    fly(&mut swarm, 10);
    assert_replays(&swarm);
}

#[test]
fn what_the_file_makes_of_the_channel_stays_where_one_part_of_it_is_changed() {
    let own =
        "flight.commands=[{ after = 5, what = { kind = \"channel\", noise = 0.0, delay = 4, loss = 0.25 } }]";
    let mut swarm = begun("square", &[own]);
    fly(&mut swarm, 12);
    assert_eq!(swarm.sets(), ["flight.delay=4", "flight.loss=0.25"]);
    ask(&mut swarm, r#"{"do":"set","key":"limits.speed","value":"0.8"}"#);
    assert_eq!(swarm.sets(), ["limits.speed=0.8"]);
    ask(&mut swarm, r#"{"do":"undo"}"#);
    ask(&mut swarm, r#"{"do":"set","key":"flight.noise","value":"0.01"}"#);
    assert_eq!(swarm.sets(), ["flight.noise=0.01", "flight.delay=4", "flight.loss=0.25"]);
    fly(&mut swarm, 12);
    assert_replays(&swarm);
}

#[test]
fn a_follower_is_not_led_and_a_lead_out_of_range_is_refused() {
    let mut swarm = begun("square", &[]);
    let formation = swarm.flight().control().formation();
    let follower = (0..formation.count()).find(|&m| !formation.leads(m)).expect("follows");
    let refused = |swarm: &mut Live, command: Command| swarm.perform(0, &command).expect_err("refused").0;
    assert!(refused(&mut swarm, Command::Grab { particle: follower, alone: true }).contains("does not lead"));
    let leader = leader(&swarm);
    ask(&mut swarm, &format!(r#"{{"do":"grab","particle":{leader},"alone":true}}"#));
    assert!(refused(&mut swarm, Command::Drag { by: [1e9, 0.0] }).contains("range"));
    assert!(
        refused(&mut swarm, Command::Set { key: "flight.loss".into(), value: "2".into() }).contains("loss")
    );
    assert!(refused(&mut swarm, Command::Fault { robot: 99, what: None }).contains("no such robot"));
}

#[test]
fn a_broken_bound_is_named_with_its_robots() {
    let mut swarm = begun("square", &[]);
    ask(&mut swarm, r#"{"do":"set","key":"flight.bounds.clearance","value":"5.0"}"#);
    fly(&mut swarm, 2);
    let (words, robots) = swarm.alarms();
    assert!(words[0].contains("clearance: declared 5 m, now") && words[0].contains("robot_"), "{words:?}");
    assert!(robots.len() > 3, "{robots:?}");
    assert!(words[0].ends_with(&format!(" and {} more", robots.len() - 3)), "{words:?}");
    assert_eq!(words[0].matches("robot_").count(), 3, "{words:?}");
}

/// A quantity of a robot as the page shows it.
fn shown(swarm: &Live, name: &str, robot: usize) -> f64 {
    let channel = swarm.channels().iter().position(|known| *known == name).expect("a channel");
    swarm.frame(&[]).channels[channel].as_ref().expect("sent")[robot]
}

#[test]
fn a_leader_dragged_while_robots_stand_still_has_its_target_at_once() {
    let mut swarm = begun("square", &[]);
    let leader = leader(&swarm);
    let place = swarm.flight().fleet().places().get(leader);
    let from = swarm.flight().control().formation().places.get(leader);
    ask(&mut swarm, &format!(r#"{{"do":"grab","particle":{leader}}}"#));
    ask(&mut swarm, r#"{"do":"drag","by":[0.5,-0.25]}"#);
    for (name, expected) in
        [("target_dx", place[0] + 0.5 - from[0]), ("target_dy", place[1] - 0.25 - from[1])]
    {
        assert!((shown(&swarm, name, leader) - expected).abs() < 1e-6, "{name}");
    }
    fly(&mut swarm, 3);
    assert_replays(&swarm);
}

#[test]
fn a_hand_that_moves_nothing_is_nothing_to_undo() {
    let mut swarm = begun("square", &[]);
    let leader = leader(&swarm);
    ask(&mut swarm, &format!(r#"{{"do":"grab","particle":{leader}}}"#));
    ask(&mut swarm, r#"{"do":"drag","by":[0.0,0.0]}"#);
    assert!(swarm.perform(0, &Command::Drag { by: [1e9, 0.0] }).is_err());
    ask(&mut swarm, r#"{"do":"release"}"#);
    assert_eq!(swarm.undoable(), 0);
    ask(&mut swarm, &format!(r#"{{"do":"grab","particle":{leader}}}"#));
    ask(&mut swarm, r#"{"do":"drag","by":[0.5,0.0]}"#);
    ask(&mut swarm, r#"{"do":"drag","by":[0.6,0.0]}"#);
    assert_eq!(swarm.undoable(), 1);
}

#[test]
fn speed_and_acceleration_are_those_of_the_robots() {
    let mut swarm = begun("square", &[]);
    let robot = leader(&swarm);
    fly(&mut swarm, 1);
    let [x, y] = swarm.flight().fleet().robots()[robot].velocity;
    fly(&mut swarm, 1);
    let [u, v] = swarm.flight().fleet().robots()[robot].velocity;
    let period = swarm.flight().control().period();
    assert!(u.hypot(v) > 0.0);
    assert_eq!(shown(&swarm, "speed", robot), u.hypot(v));
    assert_eq!(shown(&swarm, "acceleration", robot), (u - x).hypot(v - y) / period);
}

#[cfg(feature = "cli")]
#[test]
fn a_drag_of_what_was_not_to_be_taken_is_refused_once() {
    use super::pages::Viewer;
    let folder = super::folders::temporary();
    let served = super::served::Served::swarm("square", &[], folder.path());
    let (host, token) = served.parts();
    let mut viewer = Viewer::enter(&host, &token).expect("let in");
    let follower = {
        let swarm = begun("square", &[]);
        let formation = swarm.flight().control().formation();
        (0..formation.count()).find(|&m| !formation.leads(m)).expect("follows")
    };
    viewer.ask(&serde_json::json!({ "do": "grab", "particle": follower }));
    for _ in 0..3 {
        viewer.ask(&serde_json::json!({ "do": "drag", "by": [0.1, 0.0] }));
    }
    viewer.ask(&serde_json::json!({ "do": "release" }));
    let (_, first) = viewer.done(serde_json::json!({ "do": "fault", "robot": 99, "what": null }));
    assert!(first.contains("does not lead"), "{first}");
    let (_, second) = viewer.done(serde_json::json!({ "do": "drag", "by": [0.1, 0.0] }));
    assert!(second.contains("no such robot"), "{second}");
    let (_, third) = viewer.done(serde_json::json!({ "do": "fault", "robot": 99, "what": null }));
    assert!(third.contains("nothing is held"), "{third}");
}

#[test]
fn a_lead_of_a_file_to_where_no_pose_is_believed_is_refused_with_its_key() {
    let name = begun("square", &[]).flight().control().formation().names[0].clone();
    let led = |x: f64| {
        let lead = format!("{{ kind = \"lead\", robot = \"{name}\", to = [{x}, 0.0] }}");
        let set =
            [format!("flight.commands=[{{ after = 1, what = {lead} }}]"), "poses.range=20.0".to_owned()];
        Flight::new(&bundled_swarm("square").expect("bundled").load_swarm(&set).expect("readable")).map(drop)
    };
    led(5.0).unwrap_or_else(|error| panic!("{error}"));
    let words = led(1e3).expect_err("refused").to_string();
    assert!(words.contains("flight.commands[0].what.to") && words.contains("poses.range = 20"), "{words}");
}

#[test]
fn moved_obstacles_are_avoided_and_flown_again_to_the_bit() {
    let obstacles = "obstacles=[{ kind = \"disc\", centre = [40.0, 0.0], radius = 0.5 }, \
                     { kind = \"polygon\", vertices = [[-30.0, 0.0], [-29.0, 0.0], [-29.0, 1.0]] }]";
    let mut swarm = begun("square", &[obstacles]);
    fly(&mut swarm, 5);
    let centre = swarm.flight().fleet().places().get(12);
    ask(&mut swarm, r#"{"do":"grab-obstacle","obstacle":0}"#);
    // Onto a robot, in steps; it gives way.
    for k in 1..=20 {
        let [x, y] = [centre[0] - 40.0, centre[1]].map(|way| way * f64::from(k) / 20.0);
        ask(&mut swarm, &format!(r#"{{"do":"drag","by":[{x},{y}]}}"#));
        fly(&mut swarm, 1);
    }
    ask(&mut swarm, r#"{"do":"release"}"#);
    fly(&mut swarm, 20);
    let [x, y] = swarm.flight().fleet().places().get(12);
    // Its radius is 0.2, that of the obstacle 0.5.
    assert!(f64::hypot(x - centre[0], y - centre[1]) > 0.7, "it gives way: {x}, {y}");
    ask(&mut swarm, r#"{"do":"grab-obstacle","obstacle":1}"#);
    ask(&mut swarm, r#"{"do":"drag","by":[27.5,1.0]}"#);
    fly(&mut swarm, 15);
    assert_eq!(swarm.obstacles()[1], [27.5, 1.0]);
    assert_replays(&swarm);
    ask(&mut swarm, r#"{"do":"undo"}"#);
    assert_eq!(swarm.obstacles()[1], [0.0, 0.0]);
    assert_replays(&swarm);
}

#[test]
fn obstacles_that_are_none_or_go_too_far_are_refused_by_hand_and_in_a_file() {
    let obstacle = "obstacles=[{ kind = \"polygon\", vertices = [[30.0, 0.0], [31.0, 0.0], [31.0, 1.0]] }]";
    let mut swarm = begun("square", &[obstacle]);
    let refused = |swarm: &mut Live, text: &str| {
        swarm.perform(0, &Command::parse(text).expect("a request")).expect_err("refused").0
    };
    assert!(refused(&mut swarm, r#"{"do":"grab-obstacle","obstacle":1}"#).contains("no such obstacle"));
    ask(&mut swarm, r#"{"do":"grab-obstacle","obstacle":0}"#);
    // So far away its corners are one place.
    assert!(refused(&mut swarm, r#"{"do":"drag","by":[1e60,0]}"#).contains("far away"));
    assert_eq!(swarm.obstacles(), [[0.0, 0.0]]);
    for (what, key) in
        [("obstacle = 1, by = [1.0, 0.0]", "what.obstacle"), ("obstacle = 0, by = [1e60, 0.0]", "what.by")]
    {
        let command =
            format!("flight.commands=[{{ after = 1, what = {{ kind = \"move-obstacle\", {what} }} }}]");
        let file = bundled_swarm("square").expect("bundled").load_swarm(&[obstacle.to_owned(), command]);
        let error = Flight::new(&file.expect("readable")).map(drop).expect_err("refused").to_string();
        assert!(error.contains(&format!("flight.commands[0].{key}")), "{error}");
    }
}

#[test]
fn a_squeezed_formation_is_as_wide_as_its_leaders_and_flown_again_to_the_bit() {
    let mut swarm = begun("square", &[]);
    let wide = |swarm: &Live| {
        let places = swarm.flight().fleet().places();
        let largest = places.x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        largest - places.x.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let before = wide(&swarm);
    let leader = leader(&swarm);
    let refused = swarm.perform(0, &Command::Squeeze { by: [0.8; 2] }).expect_err("nothing is held").0;
    assert!(refused.contains("no leaders are held"), "{refused}");
    ask(&mut swarm, &format!(r#"{{"do":"grab","particle":{leader}}}"#));
    for by in [0.9, 0.8, 0.7] {
        ask(&mut swarm, &format!(r#"{{"do":"squeeze","by":[{by},{by}]}}"#));
        fly(&mut swarm, 10);
    }
    ask(&mut swarm, r#"{"do":"release"}"#);
    fly(&mut swarm, 60);
    assert!((wide(&swarm) / before - 0.7).abs() < 0.01, "{} of {before}", wide(&swarm));
    assert_replays(&swarm);
}
