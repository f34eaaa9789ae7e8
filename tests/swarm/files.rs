//! What a swarm file may not say, and what the program answers.

use flockform::scene::SceneError;
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::Control;
use flockform::swarm::flight::Flight;
use flockform::swarm::plan::cautions;

use super::support::*;
use crate::folders::temporary;
use crate::swarms::load_swarm;

const PAIR: &str = "title = \"t\"\n[[robots]]\nname = \"a\"\nplace = [0.0, 0.0]\n[[robots]]\nname = \"b\"\nplace = [1.0, 0.0]\n\
                    [[robots]]\nname = \"c\"\nplace = [0.0, 1.0]\n[[leaders]]\nrobots = [\"a\", \"b\"]\nprogram = { kind = \"external\" }\n";

/// The report about a swarm that cannot fly.
fn refusal(text: &str) -> String {
    let laid_out = |swarm| Flight::new(&swarm).map(|_| ());
    let refused: Result<(), SceneError> = parse(text).and_then(laid_out);
    refused.expect_err(text).to_string()
}

#[test]
fn a_bad_swarm_file_is_refused_with_place_and_remedy() {
    let with = |more: &str| format!("{PAIR}{more}");
    let cases = [
        ("title = \"t\"\n".into(), "robots: no robot is given"),
        (with("[limits]\nspeed = -1.0\n"), "limits.speed = -1.0: must be greater than 0 [m/s]"),
        (with("[limits]\nspede = 1.0\n"), "did you mean `speed`"),
        (with("[[robots]]\nname = \"a\"\nplace = [5.0, 5.0]\n"), "two robots are called `a`"),
        (with("[[robots]]\nname = \"d\"\nplace = [1.0, 0.0]\n"), "`b` and `d` have the same place"),
        (with("[[robots]]\nname = \"7up\"\nplace = [5.0, 5.0]\n"), "is no ROS name"),
        (with("[[leaders]]\nrobots = [\"x\"]\nprogram = { kind = \"external\" }\n"), "there is no robot `x`"),
        (
            with("[[leaders]]\nrobots = [\"c\"]\nprogram = { kind = \"manoeuvre\", name = \"m\" }\n"),
            "there is no manoeuvre `m`",
        ),
        (
            with("[scene]\nname = \"tension\"\n[rule]\nmean = { kind = \"barycentre\" }\n"),
            "which says this itself",
        ),
        (
            "title = \"t\"\n[scene]\nname = \"tension\"\n[rule]\npoisson = { k = -0.5 }\n".into(),
            "which says this itself",
        ),
        (
            with("[flight]\nmodel = { kind = \"integrator\" }\n"),
            "limits.speed: this model of a robot needs a limit",
        ),
        (with("[limits]\nclearance = 2.0\n"), "the places of `a` and `b` are 1 m apart"),
        (with("[links]\nkind = \"listed\"\n"), "`c` follows and has no neighbours"),
        (with("[rule]\nweights = { kind = \"solved\" }\n"), "`c` cannot be placed by its 2 neighbours"),
        (with("[rule]\nmean = { kind = \"material\" }\n"), "needs a lattice"),
        (with("[poses]\nage_limit = 0.01\n"), "poses would be too old before the next period"),
        (
            with("[[obstacles]]\nkind = \"polygon\"\nvertices = [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]\n"),
            "obstacles[0].vertices",
        ),
        (
            with("[[flight.faults]]\nrobot = \"z\"\nat = 1.0\nwhat = { kind = \"silent\" }\n"),
            "flight.faults[0].robot = \"z\": there is no robot `z`",
        ),
        (
            with("[flight.bounds]\naffine_error = 0.1\n"),
            "flight.bounds.affine_error = 0.1: can never be measured",
        ),
        (
            with("[flight.bounds]\ncontinuum_error = 0.1\n"),
            "flight.bounds.continuum_error = 0.1: can never be measured",
        ),
        (with("[limits]\nclearance = 0.2\n[flight]\ndelay = 1\n"), "by flight.delay poses come late"),
        (with("[limits]\nclearance = 0.2\n[flight]\njitter = 2\n"), "by flight.jitter poses come late"),
        (with("[limits]\nclearance = 0.2\n[flight]\nloss = 0.1\n"), "give limits.speed, above what"),
        (
            with(
                "[limits]\nclearance = 0.2\n[[flight.commands]]\nafter = 3\nwhat = { kind = \"channel\", noise = 0.0, delay = 2, loss = 0.0 }\n",
            ),
            "by flight.commands[0] poses come late",
        ),
        (with("[poses]\nrange = 0.5\n"), "and poses farther than poses.range (0.5 m) are rejected"),
        (with("[flight]\nduration = 1e15\n"), "periods; a flight has 1e7 at most"),
        (with("[limits]\nspeed = 1.0\n[ranges]\nmax_faulty = 2\n"), "there are 2 that could measure it"),
        (
            with("[[obstacles]]\nkind = \"disc\"\ncentre = [1.0, 0.1]\nradius = 0.3\n"),
            "robots[1].place = [1.0, 0.0]: `b` starts at [1.0, 0.0]",
        ),
        (
            with("[flight]\nstart = [{ robot = \"c\", place = [1.0, 0.1] }]\n[limits]\nclearance = 0.1\n"),
            "`c` starts 0.100 m from `b`",
        ),
        (
            with(
                "[flight]\nstart = [{ robot = \"c\", place = [3.0, 0.1] }, { robot = \"c\", place = [4.0, 0.0] }]\n",
            ),
            "flight.start[1].robot = \"c\": `c` has a place to start at already",
        ),
        (
            with("[[leaders]]\nrobots = [\"a\"]\nprogram = { kind = \"external\" }\n"),
            "leaders[1].robots[0] = \"a\": `a` leads by leaders[0] already",
        ),
        (
            with("[[robots]]\nname = \"d\"\nplace = [5.0, 5.0]\nneighbours = [\"a\", \"a\"]\n"),
            "robots[3].neighbours[1] = \"a\": `d` has this neighbour already",
        ),
        (with("[resilience]\nmax_faulty_neighbours = 1\n"), "`c` has 2 neighbours"),
    ];
    for (text, expected) in cases {
        let report = refusal(&text);
        assert!(report.contains(expected), "{expected:?} is not in:\n{report}");
        assert!(report.contains("help:") || report.contains("must be"), "{report}");
    }
}

#[test]
fn four_neighbours_tolerate_no_liar_and_eight_one() {
    let lattice = |neighbours: &str| {
        format!(
            "title = \"t\"\n[lattice]\nkind = \"square\"\nspacing = 1.0\n[body]\nshape = {{ kind = \"grid\", columns = 6, rows = 6 }}\n\
             [neighbours]\n{neighbours}\n[[leaders]]\nregion = {{ kind = \"edge\", side = \"left\" }}\nprogram = {{ kind = \"external\" }}\n\
             [[leaders]]\nregion = {{ kind = \"edge\", side = \"right\" }}\nprogram = {{ kind = \"external\" }}\n\
             [[leaders]]\nregion = {{ kind = \"edge\", side = \"top\" }}\nprogram = {{ kind = \"external\" }}\n\
             [[leaders]]\nregion = {{ kind = \"edge\", side = \"bottom\" }}\nprogram = {{ kind = \"external\" }}\n\
             [resilience]\nmax_faulty_neighbours = 1\n"
        )
    };
    let report = refusal(&lattice("kind = \"first\""));
    assert!(report.contains("tolerate F = 1"), "{report}");
    let swarm = parse(&lattice("kind = \"chebyshev\"\nradius = 1")).expect("valid");
    assert!(Control::new(&swarm).is_ok());
    // Targets beyond the neighbours leave the hull of the honest ones without any liar.
    for beyond in ["feedback = { factor = 0.9, reference = \"previous\" }", "poisson = { k = 0.3 }"] {
        let text = lattice("kind = \"chebyshev\"\nradius = 1")
            .replace("[resilience]", &format!("[rule]\n{beyond}\n[resilience]"));
        let report = refusal(&text);
        assert!(report.contains("lead beyond them") && report.contains("help:"), "{report}");
    }
}

#[test]
fn corners_that_follow_by_negative_weights_are_refused_and_named() {
    let text = "title = \"t\"\n[lattice]\nkind = \"square\"\nspacing = 1.0\n[body]\nshape = { kind = \"grid\", columns = 10, rows = 10 }\n\
                [neighbours]\nkind = \"chebyshev\"\nradius = 1\n[rule]\nweights = { kind = \"solved\" }\n\
                [[leaders]]\nregion = { kind = \"ids\", ids = [45, 56, 46] }\nprogram = { kind = \"external\" }\n";
    let report = refusal(text);
    assert!(report.contains("does not come to rest"), "{report}");
    assert!(report.contains("robot_1, robot_10, robot_91, robot_100"), "{report}");
}

/// A swarm file has no `update`: the formation is damped so as not to grow.
#[test]
fn a_lattice_with_a_second_gradient_keeps_its_formation() {
    let text = "title = \"t\"\n[lattice]\nkind = \"square\"\nspacing = 1.0\n[body]\nshape = { kind = \"grid\", columns = 5, rows = 4 }\n\
                [neighbours]\nkind = \"collinear\"\n[rule]\nweights = { kind = \"gradient\", length = 0.8 }\n\
                [[leaders]]\nregion = { kind = \"ids\", ids = [1, 4, 17, 20] }\n\
                program = { kind = \"path\", points = [{ at = 1.0, displacement = [0.3, 0.1] }] }\n[flight]\nduration = 60.0\n";
    let (_, report) = flown(&parse(text).expect("valid"));
    assert!(report.pe1[1] < 1e-9 && report.per_robot[9].x > 1.0, "{report:?}");
}

#[test]
fn a_corner_without_enough_neighbours_for_its_place_is_named() {
    let text = "title = \"t\"\n[lattice]\nkind = \"square\"\nspacing = 1.0\n[body]\nshape = { kind = \"grid\", columns = 4, rows = 4 }\n\
                [rule]\nweights = { kind = \"solved\" }\n";
    let report = refusal(text);
    assert!(report.contains("rule.weights") && report.contains("particle 1 "), "{report}");
}

#[test]
fn robots_fly_without_bounds_that_only_a_simulation_measures() {
    let swarm = parse(&format!("{PAIR}[flight.bounds]\naffine_error = 0.1\n")).expect("valid");
    assert!(Control::new(&swarm).is_ok());
    assert!(Flight::new(&swarm).is_err());
}

#[test]
fn polygons_far_from_the_origin_of_the_coordinates_have_their_area() {
    let square = "[[1e8, 1e8], [100000001.0, 1e8], [100000001.0, 100000001.0], [1e8, 100000001.0]]";
    for table in [
        format!("[limits]\ngeofence = {square}\n"),
        format!("[[obstacles]]\nkind = \"polygon\"\nvertices = {square}\n"),
    ] {
        assert!(parse(&format!("{PAIR}{table}")).is_ok(), "{table}");
        let flat = table.replace("100000001.0]", "1e8]");
        let report = refusal(&format!("{PAIR}{flat}"));
        assert!(report.contains("area"), "{report}");
    }
}

/// What may be meant, and is likely not.
#[test]
fn what_is_doubtful_is_a_caution_before_the_flight() {
    let square = |more: &[&str]| plan_of(&load_swarm("square", more));
    let quiet = square(&[]);
    assert!(quiet.is_empty(), "{quiet:?}");
    let hurried = "manoeuvres=[{ name = \"turn\", legs = [{ seconds = 10.0, translate = [6.0, 2.0], rotate = 90.0 }] }]";
    let path = "leaders=[{ robots = [\"robot_1\", \"robot_5\", \"robot_21\", \"robot_25\"], program = { kind = \"path\", \
                points = [{ at = 2.0, displacement = [9.0, 0.0] }] } }]";
    let squeezed = "manoeuvres=[{ name = \"turn\", legs = [{ seconds = 60.0, stretch = [0.2, 1.0] }] }]";
    let fence = "limits.geofence=[[-1.0, -1.0], [7.0, -1.0], [7.0, 7.0], [-1.0, 7.0]]";
    let cases: [(&[&str], &str); 7] = [
        (&["flight.loss=1.0"], "every pose is lost"),
        (&[hurried], "manoeuvre `turn` moves a robot's place at up to"),
        (&[path], "the program of leaders[0] moves a robot at up to 4.500 m/s, above limits.speed"),
        (&[squeezed], "manoeuvre `turn` leaves -0.100 m between"),
        (&[fence], "programs lead these robots out of limits.geofence: `robot_1`"),
        (
            &["flight.start=[{ robot = \"robot_7\", place = [-9.0, 0.0] }]", fence],
            "these robots start outside",
        ),
        (&["ranges={ reach = 1.0, max_faulty = 1 }"], "no more than ranges.max_faulty robots are within"),
    ];
    for (more, expected) in cases {
        let cautions = square(more);
        assert!(cautions.iter().any(|caution| caution.contains(expected)), "{more:?}: {cautions:?}");
    }
    let near =
        "[limits]\nspeed = 1.0\nclearance = 0.4\n[flight]\nstart = [{ robot = \"b\", place = [0.3, 0.0] }]\n";
    let cautions = plan_of(&parse(&format!("{PAIR}{near}")).expect("valid"));
    assert!(
        cautions.iter().any(|one| one.contains("start nearer to another than limits.clearance: `a`, `b`")),
        "{cautions:?}"
    );
    let silent = "[limits]\nclearance = 0.2\n[flight]\nfaults = [{ robot = \"b\", at = 1.0, what = { kind = \"silent\" } }]\n";
    let cautions = plan_of(&parse(&format!("{PAIR}{silent}")).expect("valid"));
    assert!(cautions.iter().any(|one| one.contains("how far `b` goes once it is not heard")), "{cautions:?}");
    let apart = "title = \"t\"\nlinks = { kind = \"listed\" }\n\
                 robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [1.0, 0.0], neighbours = [\"a\"] },\n\
                 { name = \"c\", place = [2.0, 0.0], neighbours = [\"d\"] }, { name = \"d\", place = [3.0, 0.0], neighbours = [\"c\"] }]\n\
                 leaders = [{ robots = [\"a\"], program = { kind = \"external\" } }]\n";
    let cautions = plan_of(&parse(apart).expect("valid"));
    assert!(cautions[0].starts_with("no leader reaches `c`, `d`:"), "{cautions:?}");
    let (unled, _) = PAIR.split_once("[[leaders]]").expect("leaders last");
    let cautions = plan_of(&parse(unled).expect("valid"));
    assert!(cautions[0].starts_with("no robot leads"), "{cautions:?}");
    let bounded = refusal(&format!("{apart}[flight.bounds]\nfinal_error = 0.1\n"));
    assert!(bounded.contains("no leader reaches `c`, `d`"), "{bounded}");
}

/// In binary 3 x 0.1 is above 0.3, and 1.5 x 6 / 15 above 0.6.
#[test]
fn what_is_exactly_at_a_limit_is_no_reason_for_caution_or_refusal() {
    let cautions = |more: &[&str]| plan_of(&load_swarm("square", more));
    let late = ["control.period=0.1", "poses={ age_limit = 0.3 }", "flight.delay=3"];
    let led = "manoeuvres=[{ name = \"turn\", legs = [{ seconds = 15.0, translate = [6.0, 0.0] }] }]";
    let fault = "flight.faults=[{ robot = \"robot_1\", at = 0.9, until = 1.2, what = { kind = \"stuck\" } }]";
    for more in [&late[..], &[led, "limits.speed=0.6"], &["control.period=0.3", fault]] {
        assert_eq!(cautions(more), [""; 0], "{more:?}");
    }
    // 1.4 - 0.7 is less than 0.2 + 0.2 + 0.3.
    let dense = "title = \"t\"\nradius = 0.2\nlattice = { kind = \"square\", spacing = 0.7 }\n\
                 body = { shape = { kind = \"grid\", columns = 10, rows = 3 } }\nlimits = { clearance = 0.3 }\n\
                 leaders = [{ region = { kind = \"ids\", ids = [1, 10, 21, 30] }, program = { kind = \"external\" } }]\n\
                 neighbours = { kind = \"second\" }\n";
    assert!(Flight::new(&parse(dense).expect("valid")).is_ok());
    assert!(refusal(&dense.replace("0.3", "0.301")).contains("need 0.701 m"));
}

/// One file may have the ways of all robots: those of an entry's own count.
#[test]
fn rows_for_robots_of_other_entries_are_no_reason_for_caution() {
    let folder = temporary();
    let rows = "t,name,dx,dy\n0,a,0,0\n0,b,0,0\n10,a,1,0\n10,b,50,0\n";
    std::fs::write(folder.path().join("ways.csv"), rows).expect("written");
    let cautions = |robot: &str| {
        let (robots, _) = PAIR.split_once("[[leaders]]").expect("leaders last");
        let program = "program = { kind = \"file\", path = \"ways.csv\" }\n[limits]\nspeed = 1.0\n";
        let other = if robot == "a" { "b" } else { "a" };
        let external = format!("[[leaders]]\nrobots = [\"{other}\"]\nprogram = {{ kind = \"external\" }}\n");
        let text = format!("{robots}{external}[[leaders]]\nrobots = [\"{robot}\"]\n{program}");
        plan_of(&Swarm::parse("t", "t.toml", &text, &[], Some(folder.path())).expect("valid"))
    };
    assert!(cautions("b").iter().any(|one| one.contains("up to 5.000 m/s")), "{:?}", cautions("b"));
    assert!(!cautions("a").iter().any(|one| one.contains("fall behind")), "{:?}", cautions("a"));
}

#[test]
fn rows_for_robots_that_no_entry_leads_are_refused_by_their_line() {
    let folder = temporary();
    std::fs::write(folder.path().join("ways.csv"), "t,name,dx,dy\n0,a,0,0\n\n0,b,0,0\n").expect("written");
    let (robots, _) = PAIR.split_once("[[leaders]]").expect("leaders last");
    let text = format!(
        "{robots}[[leaders]]\nrobots = [\"a\"]\nprogram = {{ kind = \"file\", path = \"ways.csv\" }}\n"
    );
    let refusal = |text: &str| {
        let swarm = Swarm::parse("t", "t.toml", text, &[], Some(folder.path())).expect("valid");
        Flight::new(&swarm).err().expect("refused").to_string()
    };
    let said = refusal(&text);
    assert!(said.contains("\"ways.csv\": line 4: the file has rows for `b`, which no entry"), "{said}");
    assert!(said.contains("help: let it lead"), "{said}");
    let unknown = refusal(&text.replace("\"b\"", "\"d\""));
    assert!(unknown.contains("line 4: the file has rows for `b`, and there is no such robot"), "{unknown}");
}

fn plan_of(swarm: &Swarm) -> Vec<String> {
    let flight = Flight::new(swarm).unwrap_or_else(|error| panic!("{error}"));
    cautions::of(swarm, &flight)
}
