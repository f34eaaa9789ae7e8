//! Checkpoints whose checksum is right and whose contents are anything.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use flockform::continuum::digest::digest;
use flockform::continuum::record::{ProbeSeries, Snapshot};
use flockform::continuum::run::run_shared;
use flockform::engine::Engine;
use flockform::engine::observer::EachStep;
use flockform::engine::state::EngineState;
use flockform::export::Records;
use flockform::export::checkpoint::{self, Checkpoint, RunRequest};
use flockform::ranks::Team;
use flockform::scene::Scene;

use super::*;
use crate::folders::temporary;
use crate::scenes::{load, planned};

fn scene() -> Scene {
    load("tension", &["stop.steps=40"])
}

fn good(folder: &Path) -> Vec<u8> {
    let scene = scene();
    let plan = planned(&scene);
    let sum = digest(&plan);
    let mut engine = Engine::new(plan.setup);
    let mut probe = ProbeSeries::new(66);
    for _ in 0..25 {
        engine.advance();
        probe.record(&engine);
    }
    let asked = RunRequest { scene: "tension".into(), set: Vec::new(), force: false };
    let records =
        Records { snapshots: vec![Snapshot::of(&engine)], probes: vec![probe], ..Records::default() };
    let kept = (Cow::Owned(records), None);
    let state = (EngineState::of(&engine), 0.5);
    Checkpoint::new((&asked, &scene, sum), state, kept, Duration::ZERO).write(folder).expect("written");
    std::fs::read(folder.join(checkpoint::FILE)).expect("there")
}

#[test]
fn a_damaged_checkpoint_is_gone_on_from_or_refused() {
    let folder = temporary();
    let whole = good(folder.path());
    let path = folder.path().join(checkpoint::FILE);
    let (scene, before) = (scene(), peak());
    fuzz(&damage(), |damage| {
        // Behind the header, which says the length and the checksum of what follows.
        let payload = damaged(&whole[24..], &damage);
        let mut bytes = whole[..12].to_vec();
        bytes.extend((payload.len() as u64).to_le_bytes());
        bytes.extend(crc32fast::hash(&payload).to_le_bytes());
        bytes.extend(payload);
        std::fs::write(&path, bytes).expect("writable");
        let Ok(Some(read)) = Checkpoint::read(folder.path()) else { return };
        let plan = planned(&scene);
        if read.require_of(folder.path(), &scene, digest(&plan)).is_err() {
            return;
        }
        let from = Some((read.engine, read.residual));
        let _ = run_shared(plan, from, None::<&Team>, &mut EachStep(&mut |_, _| ControlFlow::Continue(())));
    });
    if let (Some(before), Some(after)) = (before, peak()) {
        assert!(after < before + 600_000, "{before} kB, and {after} kB afterwards");
    }
}
