//! What a swarm file may not say, and what the program answers.

use flockform::scene::SceneError;
use flockform::swarm::control::Control;
use flockform::swarm::flight::Flight;

use super::support::*;

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

#[test]
fn a_corner_without_enough_neighbours_for_its_place_is_named() {
    let text = "title = \"t\"\n[lattice]\nkind = \"square\"\nspacing = 1.0\n[body]\nshape = { kind = \"grid\", columns = 4, rows = 4 }\n\
                [rule]\nweights = { kind = \"solved\" }\n";
    let report = refusal(text);
    assert!(report.contains("rule.weights") && report.contains("particle 1 "), "{report}");
}
