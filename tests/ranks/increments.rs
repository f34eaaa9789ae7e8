//! Equilibria on the way of a body of which each rank lays out a part are those of one that is laid out as a whole.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use flockform::continuum::equilibrium::run_to_equilibrium_shared;
use flockform::continuum::plan::Plan;
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::scene::Scene;
use flockform::solve::interrupt::Interrupt;

use super::parts::{PLATE, assert_scene_parted_the_same, plate};
use super::written::{SEVERAL, assert_frames_the_same, assert_tables_the_same};
use super::{Looks, on_ranks};

const EVEN: &str = "load_steps={increments=4}";
/// Unloaded in the end.
const BACK: &str = "load_steps={schedule=[0.5,1.0,0.25,0.0]}";
const SOFT: &str = "material={kind=\"isotropic\",young=1000.0,poisson=0.49,plane=\"strain\"}";
const FITTED: &str = "body.outline=\"fitted\"";
const GRID: &str = "body={shape={kind=\"grid\",columns=24,rows=9}}";
const PAPER: [&str; 2] = ["rule.mean.kind=\"barycentre\"", "neighbours={kind=\"second\"}"];
const LED: &str = "{region={kind=\"edge\",side=\"right\",depth=1.5},role=\"leader\",axis=\"x\",\
     motion={kind=\"keyframes\",frames=[{step=20,displacement=[0.8,0.0]},{step=40,displacement=[0.3,0.0]}]}}";

fn asked(solver: &str) -> String {
    format!("equilibrium={{solver=\"{solver}\",tolerance=1e-7}}")
}

fn pulled() -> String {
    let held = |side: &str, axis: &str| {
        format!("{{region={{kind=\"edge\",side=\"{side}\",depth=1.5}},role=\"clamped\",axis=\"{axis}\"}}")
    };
    format!("roles=[{},{},{LED}]", held("left", "x"), held("bottom", "y"))
}

/// With the histories of probed particles, and the work done on the way.
#[test]
fn equilibria_on_the_way_of_a_body_in_parts_have_the_bits_of_those_of_one_alone() {
    let lattice = |kind: &str| format!("lattice={{kind=\"{kind}\",spacing=1.0}}");
    let [hexagonal, honeycomb] = ["hexagonal", "honeycomb"].map(lattice);
    let inclusion = "body.inclusions=[{shape={kind=\"disc\",centre=[14.0,6.0],radius=3.1},\
         material={kind=\"isotropic\",young=9000.0,poisson=0.2}}]";
    let whole_cells = "body={outline=\"fitted\",shape={kind=\"rectangle\",max=[22,9]}}";
    let places = "record.places=[[16.3,5.8],[2.1,5.5],[20.9,5.0]]";
    let cornered = "equilibrium={solver=\"conjugate-gradients\",tolerance=1e-12,most_iterations=9}";
    let [multigrid, auto, direct] = ["multigrid", "auto", "direct"].map(asked);
    let pulled = pulled();
    for sets in [
        &[&multigrid[..], EVEN][..],
        &[&auto, EVEN, SEVERAL],
        &[&multigrid, BACK, SEVERAL, places],
        &[&direct, BACK, SEVERAL],
        &[&auto, EVEN, GRID],
        &[&multigrid, EVEN, &hexagonal, SEVERAL],
        &[&auto, BACK, &honeycomb],
        &[&multigrid, EVEN, inclusion, SEVERAL],
        &[&multigrid, BACK, &pulled, SEVERAL],
        &[&auto, EVEN, whole_cells],
        &[&multigrid, EVEN, FITTED],
        &[&auto, BACK, FITTED, SEVERAL, "record.places=[[16.3,5.8],[2.1,5.5]]"],
        &[&multigrid, BACK, FITTED, &hexagonal, &pulled, SEVERAL],
        &[&direct, EVEN, FITTED, SOFT, SEVERAL],
        &[&auto, EVEN, SOFT, SEVERAL],
        &[&auto, EVEN, PAPER[0], PAPER[1]],
        &[&auto, BACK, PAPER[0], PAPER[1], GRID, "frame=\"lagged\""],
        // It ends short of its tolerance in the first.
        &[cornered, EVEN, SEVERAL],
    ] {
        assert_scene_parted_the_same(&plate(PLATE, sets), &format!("{sets:?}"), 60);
    }
}

/// Large enough for several ranks to share two levels.
#[test]
fn equilibria_on_the_way_of_a_large_body_too() {
    let fine = "lattice={kind=\"square\",spacing=0.07}";
    let sets = [&asked("multigrid"), "load_steps={increments=2}", fine];
    assert_scene_parted_the_same(&plate(PLATE, &sets), "large", 60);
}

#[test]
fn what_equilibria_on_the_way_leave_is_written_in_parts_as_it_is_alone() {
    let [multigrid, auto] = ["multigrid", "auto"].map(asked);
    for sets in [
        &[&multigrid[..], SEVERAL, "load_steps={increments=5}"][..],
        &[&auto, SEVERAL, "load_steps={schedule=[0.2,0.7,1.0,0.5,0.0]}"],
        &[&auto, PAPER[0], PAPER[1], "load_steps={increments=5}"],
        &[&multigrid, FITTED, SEVERAL, "load_steps={increments=5}"],
    ] {
        assert_tables_the_same(&plate(PLATE, &[&["record.probes=[]"], sets].concat()));
    }
    let frames = "record={probes=[],vtk_every=1}";
    assert_frames_the_same(&plate(PLATE, &[&multigrid, SEVERAL, frames, BACK]), &[0, 1, 2, 3, 4]);
}

/// The last increment of each rank and how it ended there.
fn ends(scene: &Scene, observer: impl Fn(usize) -> Box<dyn Observer> + Sync) -> Vec<(usize, String)> {
    on_ranks(3, |team| {
        let plan = Plan::of_part(scene, &team).unwrap_or_else(|error| panic!("{error}"));
        let mut own = scene.clone();
        if team.rank() == 1 {
            let asked = own.equilibrium.as_mut().expect("asked for");
            asked.request.interrupt = Interrupt::new(&RAISED);
        }
        let mut observer = observer(team.rank());
        let outcome = run_to_equilibrium_shared(&own, plan, None, &team, &mut *observer);
        let outcome = outcome.unwrap_or_else(|error| panic!("{error}"));
        (outcome.engine.step(), outcome.reason.name().to_owned())
    })
}

static RAISED: AtomicBool = AtomicBool::new(false);

/// Breaks the run off at an increment, or has the next solve do so.
struct Impatient {
    at: usize,
    raises: bool,
}

impl Observer for Impatient {
    fn next(&mut self, step: usize) -> usize {
        step + 1
    }

    fn see(&mut self, engine: &Engine, _: f64) -> ControlFlow<()> {
        if engine.step() != self.at {
            return ControlFlow::Continue(());
        }
        if self.raises {
            RAISED.store(true, Ordering::Relaxed);
            return ControlFlow::Continue(());
        }
        ControlFlow::Break(())
    }
}

#[test]
fn any_rank_can_end_the_way_and_all_have_the_last_equilibrium() {
    let scene = plate(PLATE, &[&asked("jacobi"), EVEN, "record.probes=[]"]);
    let patient = || Box::new(Looks::every(1)) as Box<dyn Observer>;
    let impatient = |rank: usize, raises: bool| match rank {
        2 => Box::new(Impatient { at: 2, raises }),
        _ => patient(),
    };
    let interrupted = vec![(2, "interrupted".to_owned()); 3];
    assert_eq!(ends(&scene, |_| patient()), vec![(4, "equilibrium".to_owned()); 3]);
    assert_eq!(ends(&scene, |rank| impatient(rank, false)), interrupted);
    assert_eq!(ends(&scene, |rank| impatient(rank, true)), interrupted);
}

#[test]
fn a_way_without_equilibria_is_refused_by_all_ranks_with_the_same_words() {
    for (what, sets) in [
        ("no particle follows", &["roles=[{region={kind=\"all\"},role=\"clamped\"}]"][..]),
        ("connected to no held particle", &["roles=[]"]),
        ("not linear", &["rule.mean={kind=\"power\",exponent=2.0}", "neighbours={kind=\"second\"}"]),
    ] {
        let scene = plate(PLATE, &[&[&asked("multigrid")[..], EVEN, "record.probes=[]"], sets].concat());
        let words = |ranks: usize| {
            on_ranks(ranks, |team| {
                let plan = Plan::of_part(&scene, &team).unwrap_or_else(|error| panic!("{error}"));
                let outcome = run_to_equilibrium_shared(&scene, plan, None, &team, &mut Looks::every(1));
                outcome.expect_err("no equilibrium").to_string()
            })
        };
        let alone = words(1).remove(0);
        assert!(alone.contains(what), "{what}: {alone}");
        for ranks in [2, 3, 5] {
            assert!(words(ranks).iter().all(|one| *one == alone), "{ranks} ranks: {alone}");
        }
    }
}
