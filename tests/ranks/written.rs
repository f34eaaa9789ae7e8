//! What the ranks of a body in parts write together is what a run alone writes.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flockform::continuum::digest::{digest, digest_of_parts};
use flockform::continuum::equilibrium::run_to_equilibrium_shared;
use flockform::continuum::parts::laid_out_whole_for;
use flockform::continuum::plan::Plan;
use flockform::continuum::record::LoadStep;
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::engine::state::EngineState;
use flockform::export::checkpoint::{self, Checkpoint, RunRequest};
use flockform::export::figures::Formats;
use flockform::export::{
    Drawing, ExportError, OutputFolder, Records, Results, Timings, VtkSeries, write_all, write_piece,
};
use flockform::ranks::Team;
use flockform::scene::{LoadSteps, Scene};
use resvg::usvg::roxmltree::{Document, Node};

use super::on_ranks;
use super::parts::{PLATE, plate};
use super::scenes::planned;

/// Writes rows of `load.csv` and frames, as a run does, and may leave a checkpoint, with which it ends.
struct Writer<'a> {
    scene: &'a Scene,
    team: Option<&'a Team>,
    digest: u64,
    /// Of the rank that writes.
    folder: Option<&'a OutputFolder>,
    frames: Option<VtkSeries>,
    records: Records,
    leave_at: Option<usize>,
}

impl Writer<'_> {
    fn every(&self) -> usize {
        match self.scene.load_steps {
            Some(LoadSteps::Stepped { every, .. }) => every,
            Some(LoadSteps::Solved(_)) => 1,
            None => self.scene.record.vtk_every,
        }
    }

    fn measure(&mut self, engine: &Engine) {
        if self.scene.load_steps.is_some() {
            self.records.load_steps.extend(LoadStep::of(engine));
        }
    }

    fn leave(&self, engine: &Engine, residual: f64) {
        let asked = RunRequest { scene: "plate".into(), set: Vec::new(), force: false };
        let made = || {
            let state = (EngineState::of(engine), residual);
            let records = (Cow::Borrowed(&self.records), None);
            Checkpoint::new((&asked, self.scene, self.digest), state, records, Duration::default())
        };
        let folder = self.folder.map(OutputFolder::folder);
        let Some(team) = self.team else {
            return made().write(folder.expect("alone")).expect("written");
        };
        let first = engine.body().index_from(engine.body().owned().start);
        // One that the first rank cannot write is one of none, and takes no room.
        let failed =
            made().write_in_parts(folder, (first, team), Err(ExportError::MissingFrame("full".into())));
        assert!(failed.is_err(), "{failed:?}");
        if let Some(folder) = folder {
            let names = std::fs::read_dir(folder).expect("listed").flatten().map(|entry| entry.file_name());
            let left: Vec<_> =
                names.filter(|name| name.to_string_lossy().starts_with(checkpoint::FILE)).collect();
            assert!(left.is_empty(), "{left:?}");
        }
        made().write_in_parts(folder, (first, team), Ok(())).expect("written");
    }
}

impl Observer for Writer<'_> {
    fn next(&mut self, step: usize) -> usize {
        (step / self.every() + 1) * self.every()
    }

    fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()> {
        self.measure(engine);
        match (&mut self.frames, self.team) {
            (Some(frames), _) => frames.write(engine).expect("written"),
            (None, Some(team)) if self.scene.record.vtk_every > 0 => {
                write_piece(engine, team).expect("written");
            }
            _ => {}
        }
        if self.leave_at != Some(engine.step()) {
            return ControlFlow::Continue(());
        }
        self.leave(engine, residual);
        ControlFlow::Break(())
    }
}

/// Runs a scene, or goes on with it from the checkpoint in a folder, and writes what comes of it into `out`; alone, or as a rank.
fn write(scene: &Scene, team: Option<&Team>, out: &Path, from: Option<&Path>, leave_at: Option<usize>) {
    let plan = team.map_or_else(|| planned(scene), |team| Plan::of_part(scene, team).expect("fits"));
    let digest = team.map_or_else(|| digest(&plan), |team| digest_of_parts(&plan, team));
    let left = from.map(|from| {
        let mut left = Checkpoint::read(from).expect("readable").expect("there");
        left.require_of(from, scene, digest).expect("of this scene");
        left.join(from, &plan.setup).expect("of this body");
        left
    });
    let records = left.as_ref().map_or_else(Records::default, |left| left.records.clone().into_owned());
    let from = left.map(|left| (left.engine, left.residual));
    let is_writing = team.is_none_or(Team::is_first);
    let folder = is_writing.then(|| OutputFolder::create(out, true).expect("created"));
    let frames = folder.as_ref().filter(|_| scene.record.vtk_every > 0);
    let frames = frames.map(|folder| VtkSeries::create(folder).expect("created"));
    let folder_of = folder.as_ref();
    let mut writer = Writer { scene, team, digest, folder: folder_of, frames, records, leave_at };
    let outcome = run_to_equilibrium_shared(scene, plan, from, team, &mut writer).expect("can be shared");
    if writer.records.load_steps.last().is_some_and(|last| last.step != outcome.engine.step()) {
        writer.measure(&outcome.engine);
    }
    let timings = Timings::default();
    let results = Results { scene, outcome: &outcome, records: &writer.records, timings };
    let drawing = Drawing { formats: Formats::None, ..Drawing::default() };
    write_all(folder_of, &results, drawing).expect("written");
    if let Some(frames) = writer.frames {
        frames.finish().expect("written");
    }
    if let Some(folder) = folder {
        folder.commit().expect("committed");
    }
}

/// The table of the loads, if there is one, and the summary but for what depends on the clock or on how the work was shared.
fn tables(folder: &Path) -> [String; 3] {
    let read = |file: &str| std::fs::read_to_string(folder.join(file)).expect(file);
    let summary: serde_json::Value = serde_json::from_str(&read("summary.json")).expect("JSON");
    let mut summary = summary.as_object().expect("an object").clone();
    assert!(["timings", "share_swept"].iter().all(|key| summary.remove(*key).is_some()));
    if let Some(solved) = summary.get_mut("equilibrium").and_then(serde_json::Value::as_object_mut) {
        assert!(solved.remove("phases").is_some(), "times");
    }
    let loads = std::fs::read_to_string(folder.join("load.csv")).unwrap_or_default();
    [loads, read("final.csv"), format!("{summary:#?}")]
}

fn in_parts(scene: &Scene, ranks: usize, out: &Path, from: Option<&Path>, leave_at: Option<usize>) {
    on_ranks(ranks, |team| write(scene, Some(&team), out, from, leave_at));
}

/// The tables that a run alone writes, which a run in parts does as well.
pub(super) fn assert_tables_the_same(scene: &Scene) -> [String; 3] {
    assert_eq!(laid_out_whole_for(scene), None);
    let parent = tempfile::tempdir().expect("a folder");
    let of = |name: &str| parent.path().join(name);
    write(scene, None, &of("alone"), None, None);
    let expected = tables(&of("alone"));
    assert!(scene.load_steps.is_none() || expected[0].lines().count() > 5, "{}", expected[0]);
    for ranks in [2, 5] {
        in_parts(scene, ranks, &of("parts"), None, None);
        assert_eq!(tables(&of("parts")), expected, "{ranks} parts");
    }
    expected
}

fn assert_written_the_same(scene: &Scene, leave_at: usize) {
    let expected = assert_tables_the_same(scene);
    let parent = tempfile::tempdir().expect("a folder");
    let of = |name: &str| parent.path().join(name);
    in_parts(scene, 3, &of("left"), None, Some(leave_at));
    assert!(of("left").join(checkpoint::FILE).is_file());
    for ranks in [2, 4] {
        in_parts(scene, ranks, &of("resumed"), Some(&of("left")), None);
        assert_eq!(tables(&of("resumed")), expected, "3 parts, then {ranks}");
    }
    write(scene, None, &of("resumed"), Some(&of("left")), None);
    assert_eq!(tables(&of("resumed")), expected, "3 parts, then alone");
    write(scene, None, &of("left"), None, Some(leave_at));
    in_parts(scene, 2, &of("resumed"), Some(&of("left")), None);
    assert_eq!(tables(&of("resumed")), expected, "alone, then 2 parts");
}

pub(super) const SEVERAL: &str = "loads=[{kind=\"pressure\",region={kind=\"outline\",hole=1},pressure=9.0},\
     {kind=\"force\",region={kind=\"disc\",centre=[17.0,6.0],radius=2.0},force=[0.5,-1.5]},\
     {kind=\"body\",force=[0.1,-0.7]}]";

/// Its one column is the last rank's: the first has no row to know the columns' names from.
#[test]
fn a_table_has_its_header_where_the_first_rank_has_no_particle() {
    let text = "title=\"column\"\nlattice={kind=\"square\",spacing=1.0}\nbody={shape={kind=\"grid\",columns=1,rows=24}}\n\
        stop={steps=8}\nrecord={vtk_every=4}\nroles=[{region={kind=\"edge\",side=\"bottom\"},role=\"clamped\"},\
        {region={kind=\"edge\",side=\"top\"},role=\"leader\",motion={kind=\"velocity\",per_step=[0.0,0.01]}}]";
    let [_, table, _] = assert_tables_the_same(&plate(text, &[]));
    assert!(table.starts_with("id,column,row,role,X,Y,") && table.lines().count() == 25, "{table}");
}

#[test]
fn what_a_growing_load_does_to_a_body_in_parts_is_what_it_does_to_one_alone() {
    let fitted = "body.outline=\"fitted\"";
    let rotates = "rule.mean={kind=\"material\",rotation=\"corotated\"}";
    let ramp = "load_steps={ramp={steps=30},every=7}";
    let paper = ["rule.mean.kind=\"barycentre\"", "neighbours={kind=\"second\"}"];
    for sets in [
        &[SEVERAL, ramp][..],
        &[SEVERAL, ramp, fitted],
        &[SEVERAL, ramp, rotates],
        &[SEVERAL, ramp, "stop.tolerance=1e-3"],
        &["load_steps={every=11}", fitted],
        &[&paper[..], &["load_steps={every=11}"]].concat(),
    ] {
        let sets = [&["record.probes=[]"], sets].concat();
        let scene = plate(PLATE, &sets);
        let every = if sets.contains(&"load_steps={every=11}") { 11 } else { 7 };
        assert_written_the_same(&scene, 2 * every);
    }
}

#[test]
fn what_is_said_of_components_that_stay_in_parts_is_what_is_said_alone() {
    let roles = "roles=[{region={kind=\"box\",min=[0.0,0.0],max=[9.0,9.0]},role=\"clamped\"},\
        {region={kind=\"edge\",side=\"bottom\"},role=\"leader\",axis=\"y\",motion={kind=\"velocity\",per_step=[0.0,0.001]}}]";
    let text = "title=\"a plate\"\nlattice={kind=\"square\",spacing=1.0}\nbody={shape={kind=\"grid\",columns=21,rows=7}}\n\
        material={kind=\"isotropic\",young=1000.0,poisson=0.3}\nrule={mean={kind=\"material\"}}\nstop={steps=8}\nrecord={vtk_every=4}\nroles=[]";
    let [_, _, summary] = assert_tables_the_same(&plate(text, &[roles]));
    assert!(summary.contains("leads one component of 21 particles, but 10 of these stay"), "{summary}");
}

/// What stands in a file of VTK of each of its particles, by their ids, and of each of its cells, by their kind and the ids of
/// their corners: bits of each array.
#[derive(Default)]
struct Frame {
    particles: BTreeMap<i64, BTreeMap<String, Vec<u64>>>,
    cells: BTreeMap<(u64, Vec<i64>), BTreeMap<String, Vec<u64>>>,
    /// How many cells there are in all pieces.
    count: usize,
}

const GHOSTS: &str = "vtkGhostType";

impl Frame {
    fn add(&mut self, path: &Path) {
        let text = std::fs::read_to_string(path).expect("readable");
        let document = Document::parse(&text).expect("well-formed");
        let part = |name: &str| document.descendants().find(|node| node.has_tag_name(name)).expect("there");
        let arrays = |name: &str| part(name).children().filter(Node::is_element).map(array).collect();
        let [points, data, cells]: [BTreeMap<String, Vec<Vec<u64>>>; 3] =
            ["PointData", "CellData", "Cells"].map(arrays);
        let ids: Vec<i64> = points["id"].iter().map(|id| id[0] as i64).collect();
        let of = |arrays: &BTreeMap<String, Vec<Vec<u64>>>, k: usize| -> BTreeMap<String, Vec<u64>> {
            let own = |(name, values): (&String, &Vec<Vec<u64>>)| (name.clone(), values[k].clone());
            arrays.iter().filter(|(name, _)| *name != GHOSTS).map(own).collect()
        };
        for (k, &id) in ids.iter().enumerate() {
            // Points of other pieces have the same values there.
            let found = of(&points, k);
            let known = self.particles.entry(id).or_insert_with(|| found.clone());
            assert_eq!(*known, found, "particle {id}");
        }
        let mut begin = 0;
        for k in 0..cells["offsets"].len() {
            let end = cells["offsets"][k][0] as usize;
            let corners = &cells["connectivity"][begin..end];
            let mut corners: Vec<i64> = corners.iter().map(|point| ids[point[0] as usize]).collect();
            corners.sort_unstable();
            self.cells.insert((cells["types"][k][0], corners), of(&data, k));
            (begin, self.count) = (end, self.count + 1);
        }
    }
}

/// Name and values of an array, each as the bits of its components.
fn array(node: Node<'_, '_>) -> (String, Vec<Vec<u64>>) {
    let bytes = STANDARD.decode(node.text().expect("contents").trim()).expect("base64");
    let size = if node.attribute("type") == Some("UInt8") { 1 } else { 8 };
    let word = |of: &[u8]| of.iter().rev().fold(0, |word: u64, byte| word << 8 | u64::from(*byte));
    let words: Vec<u64> = bytes[8..].chunks_exact(size).map(word).collect();
    let components = node.attribute("NumberOfComponents").map_or(1, |n| n.parse().expect("a number"));
    let name = node.attribute("Name").expect("a name").to_owned();
    (name, words.chunks_exact(components).map(<[u64]>::to_vec).collect())
}

/// Names of the arrays of particles and cells.
fn names(text: &str, [particles, cells]: [&str; 2]) -> [Vec<String>; 2] {
    let document = Document::parse(text).expect("well-formed");
    [particles, cells].map(|part| {
        let part = document.descendants().find(|node| node.has_tag_name(part)).expect("there");
        part.children().filter_map(|node| node.attribute("Name").map(str::to_owned)).collect()
    })
}

#[test]
fn frames_of_a_body_in_parts_are_those_of_a_run_alone_with_their_stresses() {
    let fitted = "body.outline=\"fitted\"";
    let frames = ["record={probes=[],vtk_every=20}", "stop.steps=40"];
    let paper = ["rule.mean.kind=\"barycentre\"", "neighbours={kind=\"second\"}"];
    let torn = "fracture={stretch=1.1,ghosts=\"none\"}";
    for sets in [
        &[SEVERAL][..],
        &[SEVERAL, fitted],
        &[SEVERAL, fitted, "lattice={kind=\"hexagonal\",spacing=1.0}"],
        &["lattice={kind=\"honeycomb\",spacing=1.0}"],
        &["material.poisson=0.49", "rule.mean={kind=\"material\",rotation=\"corotated\"}"],
        &paper,
        &[&paper[..], &[torn]].concat(),
    ] {
        assert_frames_the_same(&plate(PLATE, &[&frames[..], sets].concat()), &[0, 20, 40]);
    }
}

/// The frames of these steps that a run in parts writes are those of a run alone.
pub(super) fn assert_frames_the_same(scene: &Scene, steps: &[usize]) {
    let parent = tempfile::tempdir().expect("a folder");
    let [alone, parts] = ["alone", "parts"].map(|name| parent.path().join(name));
    write(scene, None, &alone, None, None);
    for ranks in [2, 5] {
        on_ranks(ranks, |team| write(scene, Some(&team), &parts, None, None));
        for step in steps {
            let what = format!("{}, step {step} in {ranks} parts", scene.name);
            let (mut expected, mut found) = (Frame::default(), Frame::default());
            expected.add(&alone.join(format!("steps/step_{step:06}.vtu")));
            let piece = |rank: usize| parts.join(format!("steps/step_{step:06}_{rank:04}.vtu"));
            (0..ranks).for_each(|rank| found.add(&piece(rank)));
            assert!(found.particles == expected.particles, "{what}: particles");
            assert!(found.cells == expected.cells, "{what}: cells");
            assert_eq!((found.count, expected.count), (expected.count, found.cells.len()), "{what}");
            let first = expected.particles.values().next().expect("a particle");
            assert!(first.contains_key("stress") && first.contains_key("von_mises"), "{what}");
            let list = parts.join(format!("steps/step_{step:06}.pvtu"));
            let [list, piece] = [list, piece(0)].map(|path| std::fs::read_to_string(path).expect("text"));
            let listed = names(&list, ["PPointData", "PCellData"]);
            assert_eq!(listed, names(&piece, ["PointData", "CellData"]), "{what}");
        }
    }
}
