//! Ghosts, broken pairs and pieces: what is left of a body.

use std::ops::ControlFlow;

use flockform::continuum::run::run;
use flockform::engine::Engine;
use flockform::flock::role::Role;
use flockform::flock::vectors::distance;
use flockform::scene::Scene;

use crate::support::*;

#[test]
fn a_ghost_among_neighbours_that_are_found_anew_is_seen_by_none() {
    let outcome =
        outcome("drop", &["roles=[{region={kind='ids',ids=[9]},role='ghost',from=3}]", "stop.steps=6"]);
    let engine = &outcome.engine;
    let ghost = engine.roles().iter().position(|role| *role == Role::Ghost).expect("a ghost");
    assert!(!engine.flock().neighbours.index.contains(&(ghost as u32)));
    assert_eq!(engine.step(), 6);
}

#[test]
fn the_energy_of_a_body_that_is_all_gone_is_zero_without_a_sign() {
    let gone = "[fracture]; [[roles]]; region = { kind = 'all' }; role = 'ghost'; [stop]; steps = 1";
    let energies = run_out(&pulled([3, 3], 0.1, gone)).engine.energies();
    assert_eq!(energies.map(f64::to_bits), [0; 2]);
}

#[test]
fn a_ghost_leaves_the_body_and_the_rest_stays_in_place() {
    let ghosts = r#"roles=[{from=3,region={kind="box",min=[5,5],max=[7,7]},role="ghost"}]"#;
    for kind in ["lattice", "mirrored"] {
        let fracture = format!("fracture={{ghosts=\"{kind}\"}}");
        let outcome = outcome("shear", &[ghosts, &fracture, "stop={steps=30}", "record={}"]);
        assert_eq!(outcome.engine.roles().iter().filter(|&&role| role == Role::Ghost).count(), 9);
        // 9 particles have 12 bonds among them and 12 to the others.
        assert_eq!(outcome.engine.breaks().len(), 24);
        assert!(outcome.engine.breaks().iter().all(|b| b.step == 3));
        assert_eq!(
            outcome.engine.present(),
            &*outcome.engine.body().reference,
            "{kind} ghosts keep the balance"
        );
    }
    let fracture = "fracture={ghosts=\"none\"}";
    let outcome = outcome(
        "shear",
        &[ghosts, fracture, "rule.rest=literal", "frame=immediate", "stop={steps=30}", "record={}"],
    );
    assert_ne!(
        outcome.engine.present(),
        &*outcome.engine.body().reference,
        "without ghosts the flanks draw together"
    );
}

#[test]
fn a_broken_pair_never_influences_each_other_again() {
    // A row of six: torn between a held and a led half, then brought back together.
    let row = r#"body={shape={kind="grid",columns=6,rows=1}}"#;
    let roles = r#"roles=[{region={kind="edge",side="left"},role="clamped"},{region={kind="edge",side="right"},role="leader",motion={kind="keyframes",interpolation="hold",frames=[{step=1,displacement=[9,0]},{step=60,displacement=[0.0,0.0]}]}}]"#;
    let mut broken_at_50 = 0;
    let outcome =
        watched("lattice-square", &[row, roles, "fracture={stretch=3.0}", "stop={steps=400}"], |engine| {
            if engine.step() == 50 {
                broken_at_50 = engine.breaks().len();
            }
        });
    let engine = &outcome.engine;
    assert_eq!(broken_at_50, 1);
    assert_eq!(engine.breaks().len(), 1, "a bond broke twice or another did: {:?}", engine.breaks());
    assert_eq!(engine.breaks()[0].pair, [4, 5]);
    // The leader came back to its place beside its old neighbour, which does not mind.
    assert_eq!(displacement(engine, 6), [0.0, 0.0]);
    assert!(displacement(engine, 5)[0].abs() < 1e-6);
}

#[test]
fn the_liquid_drop_stays_in_one_piece_and_rounds_itself() {
    let oblong = |engine: &Engine| {
        let (low, high) = engine.present().bounds(0..engine.present().len()).expect("has particles");
        (high[0] - low[0]) / (high[1] - low[1])
    };
    let mut start = 0.0;
    let outcome = watched("drop", &[], |engine| {
        if engine.step() == 0 {
            start = oblong(engine);
        }
    });
    let engine = &outcome.engine;
    // Each has another near, and none on top of it.
    for (i, here) in engine.present().iter().enumerate() {
        let nearest = engine
            .present()
            .iter()
            .enumerate()
            .filter(|&(k, _)| k != i)
            .map(|(_, there)| distance(here, there));
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        assert!((0.3..1.2).contains(&nearest), "particle {}: {nearest}", i + 1);
    }
    let end = oblong(engine);
    assert!(start > 1.8 && end < 1.4, "{start} became {end}");
}

/// A strip without ghosts, clamped on its left, under these further lines.
fn without_ghosts(name: &str, more: &str) -> Scene {
    let text = format!(
        "title = \"A strip without ghosts\"\nlattice = {{ kind = \"hexagonal\", spacing = 1.0, orientation = 17 }}\n\
         body = {{ shape = {{ kind = \"rectangle\", max = [12.0, 8.0] }} }}\nneighbours = {{ kind = \"first\" }}\n\
         fracture = {{ stretch = 1.3, ghosts = \"none\" }}\n{more}"
    );
    Scene::parse(name, "strip.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"))
}

const CLAMPED: &str =
    "[[roles]]\nregion = { kind = \"edge\", side = \"left\", depth = 1.2 }\nrole = \"clamped\"\n";

#[test]
fn a_cut_body_at_rest_stays_where_it_is_without_ghosts() {
    let cuts = [
        // Into the body, and through it: nothing leads the loose half.
        "cuts = [{ from = [4.0, 4.1], to = [20.0, 4.1] }]",
        "cuts = [{ from = [6.2, -1.0], to = [6.2, 9.0] }]",
        // By a scattered mean, one by one in order, and by weights: other ways to the same targets.
        "cuts = [{ from = [4.0, 4.1], to = [20.0, 4.1] }]\nrule = { mean = { kind = \"distance\", power = -1.0 } }",
        "cuts = [{ from = [4.0, 4.1], to = [20.0, 4.1] }]\nupdate = { order = \"sequential\" }",
        "cuts = [{ from = [4.0, 4.1], to = [20.0, 4.1] }]\nrule = { poisson = { k = 0.03, axis = \"x\" } }",
    ];
    for cut in cuts {
        let scene = without_ghosts("cut", &format!("{cut}\nstop = {{ steps = 300 }}\n{CLAMPED}"));
        let outcome = run(planned(&scene), &mut |_, _| ControlFlow::Continue(()));
        let engine = &outcome.engine;
        assert!(engine.breaks().len() > 10, "{cut}: {} are cut", engine.breaks().len());
        let moved = (1..=engine.body().count()).flat_map(|id| displacement(engine, id));
        let farthest = moved.fold(0.0, |most: f64, d| most.max(d.abs()));
        assert!(farthest < 1e-12, "{cut}: {farthest}");
    }
}

#[test]
fn a_strip_torn_in_two_without_ghosts_comes_to_rest_in_two_unstrained_pieces_whenever_it_is_resumed() {
    use flockform::continuum::run::run_shared;
    use flockform::engine::observer::EachStep;
    use flockform::engine::state::EngineState;
    use flockform::ranks::Team;
    let led = "[[roles]]\nregion = { kind = \"edge\", side = \"right\", depth = 1.2 }\nrole = \"leader\"\n\
               motion = { kind = \"keyframes\", frames = [{ step = 200, displacement = [4.0, 1.0] }] }\n";
    let scene = without_ghosts("torn", &format!("stop = {{ steps = 4000 }}\n{CLAMPED}{led}"));
    let mut kept = None;
    let outcome = run(planned(&scene), &mut |engine, residual| {
        if engine.step() == 150 {
            kept = Some((engine.clone(), residual));
        }
        ControlFlow::Continue(())
    });
    let engine = &outcome.engine;
    assert!(!engine.breaks().is_empty());
    // Each goes with what holds it, as a rigid body; what broke off altogether stays undeformed too.
    let pieces = (1..=engine.body().count()).filter(|&id| {
        let [x, y] = displacement(engine, id);
        x.hypot(y) < 1e-6 || (x - 4.0).hypot(y - 1.0) < 1e-6
    });
    let count = pieces.count();
    assert!(count + 4 > engine.body().count(), "{count} of {}", engine.body().count());
    let (then, residual) = kept.expect("came that far");
    let mut see = |_: &Engine, _: f64| ControlFlow::Continue(());
    let from = Some((EngineState::of(&then), residual));
    let resumed =
        run_shared(planned(&scene), from, None::<&Team>, &mut EachStep(&mut see)).expect("the same body");
    let bits =
        |engine: &Engine| -> Vec<[u64; 2]> { engine.present().iter().map(|p| p.map(f64::to_bits)).collect() };
    assert!(bits(&resumed.engine) == bits(engine));
}
