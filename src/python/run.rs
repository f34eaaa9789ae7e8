//! `flockform.run`: a scene run to its end, with the frames that were asked for.

use std::ops::ControlFlow;

use numpy::PyArrayDyn;
use pyo3::exceptions::{PyMemoryError, PyValueError};
use pyo3::prelude::*;

use super::arrays::moved;
use super::beside::{Progress, beside};
use super::body::Body;
use super::source::Source;
use crate::continuum::equilibrium::run_to_equilibrium_watched;
use crate::continuum::looks::Looks;
use crate::continuum::run::{Outcome, StopReason};
use crate::engine::Engine;
use crate::engine::observer::Observer;
use crate::scene::{Scene, SceneError};
use crate::solve::interrupt::Interrupt;
use crate::study::compare::run::plan;

/// Runs a scene to its end, as `flockform run` does, and returns what came of it.
///
/// scene: name of a bundled scene, path of a scene file, or a scene as a dict.
/// set: keys to change, a dict such as {"stop.steps": 50} or texts KEY.PATH=VALUE.
/// every: steps from one frame to the next; without it the end alone is kept.
/// progress: called as progress(step, residual) several times a second; the residual is infinite before the first
/// report. A scene that is solved reports its end alone.
///
/// Raises SceneError for a scene that cannot be, and MemoryError for more frames than fit where
/// the address space is limited (ulimit -v).
#[pyfunction]
#[pyo3(signature = (scene, *, set=None, every=None, progress=None))]
pub(super) fn run(
    py: Python<'_>,
    scene: &Bound<'_, PyAny>,
    set: Option<&Bound<'_, PyAny>>,
    every: Option<i64>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Run> {
    let source = Source::scene(scene, set)?;
    let every = every.map(|every| positive("every", every)).transpose()?;
    let (scene, outcome, frames) =
        beside(py, progress, move |progress| run_source(&source, every, progress))??;
    Run::new(py, scene, outcome, frames)
}

/// A count that is at least 1.
pub(super) fn positive(name: &str, count: i64) -> PyResult<usize> {
    let found = usize::try_from(count).ok().filter(|&count| count > 0);
    found.ok_or_else(|| PyValueError::new_err(format!("{name} = {count}: give a number of steps, 1 or more")))
}

fn run_source(
    source: &Source,
    every: Option<usize>,
    progress: &Progress,
) -> Result<(Scene, Outcome, Frames), SceneError> {
    let scene = source.chosen(progress)?;
    let plan = plan(&scene)?;
    let looks = Looks::new(&plan, false);
    let mut watcher = Watcher { frames: Frames::default(), every, looks, progress };
    let outcome = run_to_equilibrium_watched(&scene, plan, &mut watcher)?;
    let mut frames = watcher.frames;
    frames.keep(&outcome.engine);
    Ok((scene, outcome, frames))
}

/// Ends the scene's solver when the wait for it ends.
pub(super) fn interrupt_by(scene: &mut Scene, progress: &Progress) {
    if let Some(equilibrium) = &mut scene.equilibrium {
        equilibrium.request.interrupt = Interrupt::new(progress.flag);
    }
}

/// Configurations on the way.
#[derive(Default)]
struct Frames {
    steps: Vec<i64>,
    /// Present places \[length\], shape \[frames, count, 2\].
    places: Vec<f64>,
    is_full: bool,
}

impl Frames {
    /// Keeps the present configuration, unless it is the last one kept.
    fn keep(&mut self, engine: &Engine) {
        let (step, present) = (engine.step() as i64, engine.present());
        if self.is_full || self.steps.last() == Some(&step) {
            return;
        }
        self.is_full = self.places.try_reserve(2 * present.len()).is_err();
        if !self.is_full {
            self.steps.push(step);
            self.places.extend(present.iter().flatten());
        }
    }
}

/// Keeps frames, reports progress and ends the run when the wait for it ends.
struct Watcher<'a> {
    frames: Frames,
    every: Option<usize>,
    looks: Looks,
    progress: &'a Progress,
}

impl Observer for Watcher<'_> {
    fn next(&mut self, step: usize) -> usize {
        let frame = self.every.map_or(usize::MAX, |every| (step / every + 1).saturating_mul(every));
        self.looks.next(step).min(frame)
    }

    fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()> {
        if self.every.is_some_and(|every| engine.step().is_multiple_of(every)) {
            self.frames.keep(engine);
        }
        let flow = self.progress.see(engine, residual);
        if self.frames.is_full { ControlFlow::Break(()) } else { flow }
    }
}

/// Why a run ended, in words.
pub(super) fn words(reason: &StopReason) -> String {
    reason.fault().unwrap_or_else(|| reason.name().to_owned())
}

/// A scene that was run to its end.
#[pyclass(frozen, module = "flockform")]
pub(super) struct Run {
    /// Short name of the scene.
    #[pyo3(get)]
    name: String,
    /// The unit of length.
    #[pyo3(get)]
    unit: String,
    /// Why the run ended: "equilibrium", "unsettled", "stuck", "steps" or "diverged".
    #[pyo3(get)]
    reason: &'static str,
    /// The same as a sentence, where there is more to say.
    #[pyo3(get)]
    words: String,
    /// Largest one-step motion over the spacing, at the last step [1].
    #[pyo3(get)]
    residual: f64,
    /// The solver that found the equilibrium; None for a run that was stepped.
    #[pyo3(get)]
    solver: Option<&'static str>,
    /// Iterations of the solver.
    #[pyo3(get)]
    iterations: Option<usize>,
    /// Steps of the frames, int64, shape (frames,); the last is the end.
    #[pyo3(get)]
    steps: Py<PyArrayDyn<i64>>,
    /// Places in the frames [length], float64, shape (frames, count, 2).
    #[pyo3(get)]
    positions: Py<PyArrayDyn<f64>>,
    /// The body at the end.
    #[pyo3(get)]
    body: Py<Body>,
}

impl Run {
    fn new(py: Python<'_>, scene: Scene, outcome: Outcome, frames: Frames) -> PyResult<Self> {
        let Frames { mut steps, mut places, is_full } = frames;
        let particles = outcome.engine.present().len();
        if is_full {
            return Err(PyMemoryError::new_err(format!(
                "{} frames of {particles} particles are kept and no more fit into memory: raise `every`",
                steps.len()
            )));
        }
        // Room that was reserved for frames that did not come.
        steps.shrink_to_fit();
        places.shrink_to_fit();
        let shape = [steps.len(), particles, 2];
        Ok(Self {
            name: scene.name.clone(),
            unit: scene.unit().to_owned(),
            reason: outcome.reason.name(),
            words: words(&outcome.reason),
            residual: outcome.residual,
            solver: outcome.solved.as_ref().map(|solved| solved.solver.name()),
            iterations: outcome.solved.as_ref().map(|solved| solved.iterations),
            steps: moved(py, steps, &shape[..1])?.unbind(),
            positions: moved(py, places, &shape)?.unbind(),
            body: Py::new(
                py,
                Body::at(scene, outcome.engine, outcome.solved.as_ref().map(|_| outcome.residual)),
            )?,
        })
    }
}

#[pymethods]
impl Run {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        // Another thread may be stepping it.
        let count = self.body.try_borrow(py)?.count();
        let words = if self.words == self.reason { "" } else { &self.words };
        let gap = if words.is_empty() { "" } else { ": " };
        Ok(format!("<flockform.Run of {}, {count} particles, {}{gap}{words}>", self.name, self.reason))
    }
}
