//! The way out: CSV, JSON, VTK and figures, one file per format.
//!
//! A run's outputs stand in one folder, which appears whole or not at all ([`OutputFolder`]):
//!
//! | file | what |
//! |---|---|
//! | `summary.json` | program, scene, counts, how it ended, energies, first break, timings |
//! | `final.csv` | every particle at the end |
//! | `probes.csv` | the probed particles at every step |
//! | `residuals.csv`, `residuals` | how near the solver came, iteration by iteration, where one was used |
//! | `breaks.csv` | every broken bond, with its step and place |
//! | `steps.pvd`, `steps/*.vtu` | frames for ParaView |
//! | `report.html` | the run as a page ([`report`]) |
//! | `checkpoint` | in an unfinished or interrupted run: all it takes to go on |
//! | `configuration_*`, `pe1_*`, `probes` | figures, as SVG and as the PNG rendered from it |
//!
//! A page for people to look at is written beside them ([`report`]), and a gallery of such pages.
//!
//! A flight (`flight`, feature `swarm`), a comparison with the truth (`comparison`, feature `fem`) have folders of their own, and so has a study of
//! what grows (`stability`).
//!
//! Frames are written while the run goes on, since a long run cannot keep them ([`VtkSeries`]); the
//! rest comes at the end, by [`write_all`]:
//!
//! ```no_run
//! use std::ops::ControlFlow;
//! use std::path::Path;
//! use flockform::continuum::{plan::Plan, record::Snapshot, run::run};
//! use flockform::export::{OutputFolder, Results, Timings, VtkSeries, write_all};
//!
//! let scene = flockform::scene::bundled("fracture").expect("bundled").load(&[])?;
//! let folder = OutputFolder::create(Path::new("out/fracture"), false)?;
//! let mut frames = VtkSeries::create(&folder)?;
//! let mut snapshots = Vec::new();
//! let outcome = run(Plan::new(&scene)?, &mut |engine, _residual| {
//!     if scene.record.figures.contains(&engine.step()) {
//!         snapshots.push(Snapshot::of(engine));
//!     }
//!     match frames.write(engine) {
//!         Ok(()) => ControlFlow::Continue(()),
//!         Err(_) => ControlFlow::Break(()),
//!     }
//! });
//! frames.finish()?;
//! let timings = Timings::default();
//! let results = Results { scene: &scene, outcome: &outcome, snapshots: &snapshots, probes: &[], timings };
//! write_all(&folder, &results)?;
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
#[cfg(feature = "swarm")]
pub mod flight;
mod folder;
pub mod report;
pub mod stability;
mod summary;
#[cfg(feature = "fem")]
pub mod trade;
#[cfg(all(feature = "bench", feature = "shm"))]
pub mod transport;
mod vtk;

use std::path::PathBuf;
use std::time::Instant;

use rayon::prelude::*;

use crate::continuum::record::{ProbeSeries, Snapshot};
use crate::continuum::run::Outcome;
use crate::flock::strain::Strain;
use crate::scene::Scene;
pub use error::ExportError;
use figures::Subject;
pub use folder::{OutputFolder, unfinished};
pub use summary::{BrokenBonds, Counts, Energies, Equilibrium, FirstBreak, Seconds, Summary, Timings};
pub use vtk::VtkSeries;

/// What a run leaves to be written at its end.
#[derive(Clone, Copy, Debug)]
pub struct Results<'a> {
    pub scene: &'a Scene,
    pub outcome: &'a Outcome,
    /// The configurations to draw.
    pub snapshots: &'a [Snapshot],
    pub probes: &'a [ProbeSeries],
    pub timings: Timings,
}

/// Writes tables, figures and, last, the summary, which tells how long the others took. Returns the
/// paths within the folder under its temporary name, and the summary.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_all(
    folder: &OutputFolder,
    results: &Results<'_>,
) -> Result<(Vec<PathBuf>, Summary), ExportError> {
    let start = Instant::now();
    let engine = &results.outcome.engine;
    let last = Snapshot::of(engine);
    let strains: Vec<_> = (0..engine.body().count()).into_par_iter().map(|i| engine.strain(i)).collect();
    let largest_strain = strains.iter().flatten().map(Strain::largest).reduce(f64::max);
    let mut written = vec![csv::write_final(folder, engine.body(), &last, &strains)?];
    if !results.probes.is_empty() {
        written.push(csv::write_probes(folder, engine.body(), results.probes)?);
    }
    if !engine.breaks().is_empty() {
        written.push(csv::write_breaks(folder, engine.body(), engine.breaks())?);
    }
    if let Some(solved) = &results.outcome.solved {
        written.push(csv::write_residuals(folder, &solved.residuals)?);
        let title = &results.scene.raw.title;
        let chart = figures::chart::residuals(title, solved.solver.name(), &solved.residuals);
        written.extend(figures::write(&chart, &folder.path("residuals"))?);
    }
    written.extend(write_figures(folder, results)?);
    let mut timings = results.timings;
    timings.output += start.elapsed();
    let summary = Summary::new(results.scene, results.outcome, &last, largest_strain, timings);
    written.push(summary.write(folder)?);
    Ok((written, summary))
}

fn write_figures(folder: &OutputFolder, results: &Results<'_>) -> Result<Vec<PathBuf>, ExportError> {
    let scene = results.scene;
    let subject = Subject::of(scene, &results.outcome.engine);
    let of_snapshots: Result<Vec<_>, _> = results
        .snapshots
        .par_iter()
        .map(|snapshot| {
            let path = |what: &str| folder.path(format!("{what}_{:04}", snapshot.step));
            let configuration = figures::configuration(&subject, snapshot);
            let pe1 = figures::pe1(&subject, snapshot);
            let written = [
                figures::write(&configuration, &path("configuration"))?,
                figures::write(&pe1, &path("pe1"))?,
            ];
            Ok(written.concat())
        })
        .collect();
    let mut written = of_snapshots?.concat();
    if !results.probes.is_empty() {
        written.extend(figures::write(&figures::probes(&subject, results.probes), &folder.path("probes"))?);
    }
    Ok(written)
}
