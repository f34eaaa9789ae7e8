//! Figures and recordings of a body in parts are, to the byte, those of one laid out as a whole.

use std::ops::ControlFlow;
use std::sync::mpsc;

use flockform::continuum::equilibrium::run_to_equilibrium_shared;
use flockform::continuum::parts::laid_out_whole_for;
use flockform::continuum::plan::Plan;
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::export::Drawn;
use flockform::export::figures::is_raster;
use flockform::messages::recorder::{RecordSink, RecordedMessage};
use flockform::ranks::Team;
use flockform::record::body::BodyMessages;
use flockform::scene::Scene;

use super::on_ranks;
use super::parts::plate;
use super::scenes::planned;

/// More particles than are drawn one by one.
const LARGE: &str = r#"
title = "A large plate"
lattice = { kind = "square", spacing = 1.0 }
rule = { mean = { kind = "material" } }
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
stop = { steps = 5 }

[body]
shape = { kind = "rectangle", min = [0.0, 0.0], max = [300.0, 220.0] }
holes = [{ kind = "disc", centre = [80.3, 100.2], radius = 21.1 }]

[[roles]]
region = { kind = "edge", side = "left" }
role = "clamped"

[[roles]]
region = { kind = "edge", side = "right" }
role = "leader"
motion = { kind = "keyframes", frames = [{ step = 5, displacement = [1.5, -20.4] }] }

[record]
probes = []
figures = [2]
"#;

struct Drawer<'a>(&'a Scene, Vec<Drawn>);

impl Observer for Drawer<'_> {
    fn next(&mut self, step: usize) -> usize {
        self.0.record.figures.iter().copied().find(|&figure| figure > step).unwrap_or(usize::MAX)
    }

    fn see(&mut self, engine: &Engine, _: f64) -> ControlFlow<()> {
        if self.0.record.figures.contains(&engine.step()) {
            self.1.extend(Drawn::of(self.0, engine));
        }
        ControlFlow::Continue(())
    }
}

/// The figures of the steps that the scene names, and of the last one.
fn drawn(scene: &Scene, team: Option<&Team>) -> Vec<Drawn> {
    let plan = team.map_or_else(|| planned(scene), |team| Plan::of_part(scene, team).expect("fits"));
    let mut drawer = Drawer(scene, Vec::new());
    let outcome = run_to_equilibrium_shared(scene, plan, None, team, &mut drawer).expect("can be shared");
    drawer.1.extend(Drawn::of(scene, &outcome.engine));
    drawer.1
}

/// Topics and payloads of the messages that a run is recorded in.
fn recorded(scene: &Scene, team: Option<&Team>) -> Vec<(String, Vec<u8>)> {
    struct Watch(BodyMessages);
    impl Observer for Watch {
        fn next(&mut self, step: usize) -> usize {
            self.0.next(step)
        }

        fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()> {
            self.0.step(engine, residual);
            ControlFlow::Continue(())
        }
    }
    let (sent, taken) = mpsc::channel();
    let sink = move |message: &RecordedMessage<'_>| {
        sent.send((message.topic.to_owned(), message.payload.to_vec())).expect("taken");
    };
    let sink = team.is_none_or(Team::is_first).then(|| Box::new(sink) as RecordSink);
    let plan = team.map_or_else(|| planned(scene), |team| Plan::of_part(scene, team).expect("fits"));
    let mut watch = Watch(BodyMessages::new(scene, sink).expect("its names are valid"));
    let outcome = run_to_equilibrium_shared(scene, plan, None, team, &mut watch).expect("can be shared");
    watch.0.finish(&outcome.engine, outcome.residual);
    taken.iter().collect()
}

#[test]
fn a_body_in_parts_is_recorded_by_the_first_rank_as_one_alone() {
    let every = "record.vtk_every=2";
    let fitted = [every, "body.outline=\"fitted\""];
    let torn =
        [every, "rule.mean={kind=\"barycentre\"}", "neighbours={kind=\"second\"}", "fracture={stretch=1.1}"];
    for sets in [&fitted[..], &torn] {
        let scene = plate(LARGE, sets);
        let expected = recorded(&scene, None);
        // At rest, after steps 2 and 4 and in the end, on four topics.
        assert_eq!(expected.len(), 16, "{sets:?}");
        for ranks in [2, 5] {
            let found = on_ranks(ranks, |team| recorded(&scene, Some(&team)));
            assert!(found[0] == expected, "{sets:?} on {ranks} ranks");
            assert!(found[1..].iter().all(Vec::is_empty));
        }
    }
}

#[test]
fn figures_of_a_large_body_in_parts_are_those_of_one_alone() {
    let fitted = ["body.outline=\"fitted\""];
    let turned = ["rule.mean={kind=\"material\",rotation=\"corotated\"}", "lattice.kind=\"hexagonal\""];
    let torn = [
        "rule.mean={kind=\"barycentre\"}",
        "neighbours={kind=\"second\"}",
        "fracture={stretch=1.1,ghosts=\"none\"}",
        "cuts=[{from=[200.5,80.0],to=[200.5,260.0]}]",
    ];
    for sets in [&[][..], &fitted, &turned, &torn] {
        let scene = plate(LARGE, sets);
        assert!(laid_out_whole_for(&scene).is_none() && is_raster(planned(&scene).count()), "{sets:?}");
        let expected = drawn(&scene, None);
        assert_eq!(expected.len(), 8, "{sets:?}");
        assert_eq!(expected[0].svg.contains("broken bonds"), sets == torn, "{sets:?}");
        for ranks in [2, 5] {
            let found = on_ranks(ranks, |team| drawn(&scene, Some(&team)));
            assert!(found[0] == expected, "{sets:?} on {ranks} ranks");
            assert!(found[1..].iter().flatten().all(|one| one.svg.is_empty()));
        }
    }
}
