//! A swarm led by hand and hurt, and the file that flies it again.

use flockform::live::command::Command;
use flockform::live::swarm::Swarm as Live;
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;
use flockform::swarm::flight::Flight;

fn begun(name: &'static str) -> Live {
    begun_with(name, &[])
}

fn begun_with(name: &'static str, set: &[String]) -> Live {
    let set = set.to_vec();
    let load =
        move |more: &[String]| bundled_swarm(name).expect("bundled").load_swarm(&[&set[..], more].concat());
    Live::new(Box::new(load)).unwrap_or_else(|error| panic!("{error}"))
}

fn ask(swarm: &mut Live, text: &str) {
    let command = Command::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
    swarm.perform(0, &command).unwrap_or_else(|refused| panic!("{text}: {}", refused.0));
}

fn fly(swarm: &mut Live, periods: usize) {
    (0..periods).for_each(|_| swarm.advance());
}

fn leader(swarm: &Live) -> usize {
    let formation = swarm.flight().control().formation();
    (0..formation.count()).find(|&m| formation.leads(m)).expect("led")
}

fn bits(flight: &Flight) -> Vec<[u64; 2]> {
    flight.fleet().places().iter().map(|[x, y]| [x.to_bits(), y.to_bits()]).collect()
}

fn assert_replays(swarm: &Live) {
    let text = swarm.saved().expect("can be written");
    let file = Swarm::parse("saved", "saved.toml", &text, &[], None)
        .unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut again = Flight::new(&file).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(again.periods(), swarm.flight().fleet().period());
    (0..again.periods()).for_each(|_| again.step());
    assert!(bits(swarm.flight()) == bits(&again), "the same places to the last bit");
}

#[test]
fn leaders_led_by_hand_broken_robots_and_lost_poses_are_flown_again_to_the_bit() {
    let mut swarm = begun("square");
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
    assert_eq!(swarm.sets(), ["flight.noise=0.01", "flight.delay=0", "flight.loss=0.2"]);
    ask(&mut swarm, r#"{"do":"fault","robot":12,"what":null}"#);
    fly(&mut swarm, 13);
    assert_eq!(swarm.faults(), []);
    assert_replays(&swarm);
}

#[test]
fn at_one_period_the_commands_of_the_file_come_after_those_of_the_hand() {
    let square = begun("square");
    let leader = leader(&square);
    let formation = square.flight().control().formation();
    let (name, [x, y]) = (&formation.names[leader], formation.places.get(leader));
    let own = format!(
        "flight.commands=[{{ after = 5, what = {{ kind = \"lead\", robot = \"{name}\", to = [{x}, {y}] }} }}]"
    );
    let mut swarm = begun_with("square", &[own]);
    fly(&mut swarm, 5);
    ask(&mut swarm, &format!(r#"{{"do":"grab","particle":{leader},"alone":true}}"#));
    ask(&mut swarm, r#"{"do":"drag","by":[0.5,-0.5]}"#);
    fly(&mut swarm, 10);
    assert_replays(&swarm);
}

#[test]
fn a_follower_is_not_led_and_a_lead_out_of_range_is_refused() {
    let mut swarm = begun("square");
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
    let mut swarm = begun("square");
    ask(&mut swarm, r#"{"do":"set","key":"flight.bounds.clearance","value":"5.0"}"#);
    fly(&mut swarm, 2);
    let (words, robots) = swarm.alarms();
    assert!(words[0].contains("clearance: declared 5 m, now") && words[0].contains("robot_"), "{words:?}");
    assert!(robots.len() >= 2, "{robots:?}");
}
