//! The way out: CSV, JSON, VTK and figures, one file per format.
//!
//! A run's outputs stand in one folder, which appears whole or not at all ([`OutputFolder`]):
//!
//! | file | what |
//! |---|---|
//! | `summary.json` | program, scene, counts, how it ended, energies, reactions, largest stress, first break, timings |
//! | `final.csv` | every particle at the end |
//! | `probes.csv` | the probed particles at every step |
//! | `residuals.csv`, `residuals` | how near the solver came, iteration by iteration, where one was used; the figure where anything acts |
//! | `load.csv`, `load` | what a load that changes does ([`load`]), where the scene has `[load_steps]` |
//! | `breaks.csv` | every broken bond, with its step and place |
//! | `steps.pvd`, `steps/*.vtu` | frames for ParaView |
//! | `report.html` | the run as a page ([`report`]) |
//! | `flockform-files.txt` | the files that flockform wrote, which alone `--force` replaces |
//! | `checkpoint` | in an unfinished or interrupted run: all it takes to go on |
//! | `configuration_*`, `pe1_*`, `von_mises_*`, `stress_*`, `probes` | figures, as SVG and as the PNG rendered from it |
//!
//! A page for people to look at is written beside them ([`report`]), and a gallery of such pages; a film ([`film`]) stands
//! where it is asked for.
//!
//! A flight (`flight`, feature `swarm`), a comparison with the truth and a study of what accuracy costs (`comparison` and
//! `trade`, feature `fem`), a study of what grows (`stability`), a parameter sweep ([`sweep`]) and benchmarks (`transport`
//! and `scale`, feature `bench`) have folders of their own.
//!
//! Frames are written while the run goes on, since a long run cannot keep them ([`VtkSeries`]); the
//! rest comes at the end, by [`write_all`]:
//!
//! ```no_run
//! use std::ops::ControlFlow;
//! use std::path::Path;
//! use flockform::continuum::{plan::Plan, record::Snapshot, run::run};
//! use flockform::export::{Drawing, OutputFolder, Records, Results, Timings, VtkSeries, write_all};
//!
//! let scene = flockform::scene::bundled("fracture").expect("bundled").load(&[])?;
//! let folder = OutputFolder::create(Path::new("out/fracture"), false)?;
//! let mut frames = VtkSeries::create(&folder)?;
//! let mut records = Records::default();
//! let outcome = run(Plan::new(&scene)?, &mut |engine, _residual| {
//!     if scene.record.figures.contains(&engine.step()) {
//!         records.snapshots.push(Snapshot::of(engine));
//!     }
//!     match frames.write(engine) {
//!         Ok(()) => ControlFlow::Continue(()),
//!         Err(_) => ControlFlow::Break(()),
//!     }
//! });
//! frames.finish()?;
//! let timings = Timings::default();
//! let results = Results { scene: &scene, outcome: &outcome, records: &records, timings };
//! write_all(&folder, &results, Drawing::default())?;
//! println!("written to {}", folder.commit()?.display());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bonds;
pub mod checkpoint;
#[cfg(feature = "fem")]
pub mod comparison;
pub mod csv;
mod error;
pub mod figures;
pub mod film;
#[cfg(feature = "swarm")]
pub mod flight;
mod folder;
pub mod load;
pub(crate) mod manifest;
pub mod memory;
mod parts;
pub mod report;
#[cfg(feature = "bench")]
pub mod scale;
pub mod shell;
pub mod stability;
mod summary;
pub mod sweep;
#[cfg(feature = "fem")]
pub mod trade;
#[cfg(all(feature = "bench", feature = "shm"))]
pub mod transport;
mod vtk;

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::continuum::mechanics::{Stresses, here};
use crate::continuum::record::{LoadStep, ProbeSeries, Snapshot};
use crate::continuum::run::Outcome;
use crate::engine::Engine;
use crate::flock::rules::Rotation;
use crate::ranks::Team;
use crate::scene::Scene;
use crate::scene::units::Units;
pub use error::ExportError;
use figures::{Formats, Subject};
pub use folder::{OutputFolder, out_of, unfinished};
pub use manifest::write_new;
pub use summary::{
    BrokenBonds, Counts, Energies, Equilibrium, FirstBreak, Measured, Signed, Summary, Timings,
};
pub use vtk::{VtkSeries, write_piece};

/// The results of a run that are written at its end.
#[derive(Clone, Copy, Debug)]
pub struct Results<'a> {
    /// The scene that was run.
    pub scene: &'a Scene,
    /// How the run ended, with the engine as it then was.
    pub outcome: &'a Outcome,
    /// What was recorded on the way.
    pub records: &'a Records,
    /// Times of the parts of the run so far.
    pub timings: Timings,
}

/// The records of a run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Records {
    /// Configurations to draw at the end.
    pub snapshots: Vec<Snapshot>,
    /// Figures that are drawn already ([`Drawn::of`]).
    pub drawn: Vec<Drawn>,
    /// Histories of the probed particles.
    pub probes: Vec<ProbeSeries>,
    /// The response to a changing load, where the scene has one.
    pub load_steps: Vec<LoadStep>,
}

/// A figure that was drawn when its step came: of a body so large that it is drawn as squares, whose configuration would take
/// far more memory, and of which each rank may have a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drawn {
    /// Steps or increments taken.
    pub step: usize,
    /// Its file without ending.
    pub name: String,
    /// The drawing; empty on ranks other than the first.
    pub svg: String,
}

impl Drawn {
    /// The figures of the engine's present configuration, drawn by all ranks together where each has a part of the body, which
    /// has to be one that is drawn as squares ([`figures::is_raster`]).
    pub fn of(scene: &Scene, engine: &Engine) -> Vec<Self> {
        let (snapshot, subject, units) = (Snapshot::of(engine), Subject::of(scene, engine), Units::of(scene));
        let figures = figures_of_snapshot(engine, &subject, &units, &snapshot);
        let is_first = engine.parted().is_none_or(Team::is_first);
        let kept = |svg| if is_first { svg } else { String::new() };
        let figures = figures.into_iter();
        figures.map(|(name, draw)| Self { step: snapshot.step, name, svg: kept(draw()) }).collect()
    }
}

/// Options for drawing figures.
#[derive(Clone, Copy)]
pub struct Drawing<'a> {
    /// The files of each figure.
    pub formats: Formats,
    /// Called with how many figures are drawn, of how many: before the first and after each, from any thread. Once it
    /// breaks off, no other figure is begun.
    pub progress: &'a (dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
}

impl Default for Drawing<'_> {
    fn default() -> Self {
        Self { formats: Formats::All, progress: &|_, _| ControlFlow::Continue(()) }
    }
}

/// Writes tables, figures and, last, the summary, which has the time that the others took. Returns the
/// paths within the folder under its temporary name, and the summary.
///
/// Where each rank has a part of the body all ranks write together, the first one into its `folder`; it alone can fail.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_all<'f>(
    folder: impl Into<Option<&'f OutputFolder>>,
    results: &Results<'_>,
    drawing: Drawing<'_>,
) -> Result<(Vec<PathBuf>, Summary), ExportError> {
    let (start, folder) = (Instant::now(), folder.into());
    let (measured, stresses) = Measured::of(results.scene, results.outcome).unzip();
    let of_particles = stresses.as_ref().map(|stresses| &stresses.particles[..]);
    let particles = csv::write_final(folder, &results.outcome.engine, of_particles);
    // Figures take memory of their own.
    drop(stresses);
    let others = || folder.map_or(Ok(Vec::new()), |folder| write_others(folder, results, drawing));
    let written = particles.and_then(|particles| Ok(particles.into_iter().chain(others()?).collect()));
    let mut timings = results.timings;
    timings.output += start.elapsed();
    // Sums over all parts: the other ranks wait for this one even if it could not write.
    let summary = Summary::new(results.scene, results.outcome, measured, timings);
    let mut written: Vec<_> = written?;
    written.extend(folder.map(|folder| summary.write(folder)).transpose()?);
    Ok((written, summary))
}

/// All tables but that of the particles, and the figures.
fn write_others(
    folder: &OutputFolder,
    results: &Results<'_>,
    drawing: Drawing<'_>,
) -> Result<Vec<PathBuf>, ExportError> {
    let Outcome { engine, solved, .. } = results.outcome;
    let (body, breaks) = (engine.body(), engine.breaks());
    let Records { probes, load_steps, .. } = results.records;
    let mut written = Vec::new();
    if !probes.is_empty() {
        written.push(csv::write_probes(folder, body, probes)?);
    }
    if !breaks.is_empty() {
        written.push(csv::write_breaks(folder, body, breaks)?);
    }
    if let Some(solved) = solved {
        written.push(csv::write_residuals(folder, &solved.residuals)?);
    }
    if !load_steps.is_empty() {
        written.push(load::write_load(folder, results.scene, load_steps)?);
    }
    if drawing.formats != Formats::None {
        written.extend(draw_all(folder, results, drawing)?);
    }
    Ok(written)
}

/// Writes a benchmark or a study: `NAME.csv` with its rows, the figure `NAME` and, last, `NAME.json` with all of it.
#[cfg(any(feature = "bench", feature = "fem"))]
fn write_study(
    folder: &OutputFolder,
    name: &str,
    rows: impl Iterator<Item = impl Serialize>,
    figure: &str,
    report: &impl Serialize,
) -> Result<Vec<PathBuf>, ExportError> {
    let mut written = vec![csv::write(folder, &format!("{name}.csv"), rows)?];
    written.extend(figures::write(figure, folder, name)?);
    written.push(summary::write_signed(folder, &format!("{name}.json"), report)?);
    Ok(written)
}

/// The histories of all probed particles, whose indices in the whole body are given, in their order; each rank has those of its
/// own part, and the first one receives them.
pub fn probes_of_parts(engine: &Engine, probes: &[usize], team: &Team) -> Vec<ProbeSeries> {
    if probes.is_empty() {
        return Vec::new();
    }
    let mut all: Vec<ProbeSeries> = Vec::new();
    team.bring([postcard::to_stdvec(engine.probes()).expect("a history can be written")], |histories| {
        all.extend(postcard::from_bytes::<Vec<ProbeSeries>>(histories).expect("as it was sent"));
    });
    let of = |&index: &usize| all.iter().find(|probe| probe.particle == index).cloned();
    probes.iter().filter_map(of).collect()
}

/// The strain of any particle's surroundings that is largest in size; `None` where no particle sees enough.
fn largest_strain(engine: &Engine) -> Option<f64> {
    let of = |i: usize| engine.strain(i).map(|strain| strain.largest());
    let own = engine.body().owned().into_par_iter().filter_map(of).reduce_with(f64::max);
    let [largest] = engine.largest_of_parts([own.unwrap_or(f64::NEG_INFINITY)]);
    Some(largest).filter(|&largest| largest > f64::NEG_INFINITY)
}

/// A figure still to be drawn, and its file without ending.
type Figure<'a> = (String, Box<dyn Fn() -> String + Send + Sync + 'a>);

fn draw_all(
    folder: &OutputFolder,
    results: &Results<'_>,
    drawing: Drawing<'_>,
) -> Result<Vec<PathBuf>, ExportError> {
    let scene = results.scene;
    let (subject, units) = (Subject::of(scene, &results.outcome.engine), Units::of(scene));
    let figures = figures_of(results, &subject, &units);
    let drawn = AtomicUsize::new(0);
    let is_broken_off = AtomicBool::new((drawing.progress)(0, figures.len()).is_break());
    let written: Result<Vec<_>, _> = figures
        .par_iter()
        .map(|(name, draw)| {
            if is_broken_off.load(Ordering::Relaxed) {
                return Ok(Vec::new());
            }
            let written = figures::write_as(&draw(), folder, name, drawing.formats);
            if (drawing.progress)(drawn.fetch_add(1, Ordering::Relaxed) + 1, figures.len()).is_break() {
                is_broken_off.store(true, Ordering::Relaxed);
            }
            written
        })
        .collect();
    Ok(written?.concat())
}

/// The figures of a configuration. Stresses are found while each of those that show them is drawn, and are there neither before
/// nor after.
fn figures_of_snapshot<'a>(
    engine: &'a Engine,
    subject: &'a Subject<'_>,
    units: &'a Units,
    snapshot: &'a Snapshot,
) -> Vec<Figure<'a>> {
    let name = |what: &str| format!("{what}_{:04}", snapshot.step);
    let mut figures: Vec<Figure<'a>> = vec![
        (name("configuration"), Box::new(move || figures::configuration(subject, snapshot))),
        (name("pe1"), Box::new(move || figures::pe1(subject, snapshot))),
    ];
    let Some(cells) = engine.cells() else { return figures };
    let parted = move || here(engine.body(), snapshot.broken.iter().copied());
    let displacement = move || snapshot.positions.since(&subject.body.reference);
    let rotation = engine.stressed_at(snapshot.step).map_or(Rotation::Small, |by| by.rotation);
    let unit = units.stress.as_str();
    let in_cells = move || Stresses::in_cells(engine, snapshot.step, &displacement(), &parted());
    let von_mises = move || {
        // Squares show no edges, along which stress is known at the particles.
        let found = match figures::is_raster(engine.body().total()) {
            false => Stresses::of(engine, snapshot.step, &displacement(), &parted()),
            true => None,
        };
        let of_cells = || Stresses { cells: in_cells(), particles: Vec::new(), recovered: Vec::new() };
        figures::stress(subject, snapshot, cells, &found.unwrap_or_else(of_cells), unit)
    };
    let components = move || figures::components(subject, snapshot, (cells, rotation), &in_cells(), unit);
    figures.push((name("von_mises"), Box::new(von_mises)));
    figures.push((name("stress"), Box::new(components)));
    figures
}

fn figures_of<'a>(results: &'a Results<'_>, subject: &'a Subject<'_>, units: &'a Units) -> Vec<Figure<'a>> {
    let Results { scene, outcome, records, .. } = *results;
    let Records { snapshots, drawn, probes, load_steps } = records;
    let already = |one: &'a Drawn| -> Figure<'a> { (one.name.clone(), Box::new(|| one.svg.clone())) };
    let to_draw =
        snapshots.iter().flat_map(|snapshot| figures_of_snapshot(&outcome.engine, subject, units, snapshot));
    let mut figures: Vec<Figure<'a>> = drawn.iter().map(already).chain(to_draw).collect();
    if !probes.is_empty() {
        figures.push(("probes".into(), Box::new(move || figures::probes(subject, probes))));
    }
    let residuals = outcome.solved.as_ref().and_then(|solved| {
        figures::chart::titled_residuals(&scene.raw.title, solved.solver.name(), &solved.residuals)
    });
    for (name, chart) in [("residuals", residuals), ("load", load::chart(scene, units, load_steps))] {
        if let Some(chart) = chart {
            figures.push((name.into(), Box::new(move || figures::chart::draw(&chart))));
        }
    }
    figures
}
